"""orient-eye convert."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import tyro

from orient_eye.cli.saccades import Saccades

if TYPE_CHECKING:
    from orient_eye.movement.trajectory import Trajectory
    from orient_eye.plants import Plant

_OPTIONAL = tyro.conf.arg(help_behavior_hint="(optional)")
_NAME = "trajectory.npz"


@dataclass(frozen=True)
class Convert:
    """Write saccades in formats that other people's tools read: eye tracking by BIDS, and Parquet.

    SOURCE is a trajectory.npz, a run directory that has one (`orient-eye simulate`), or a policy (run directory, policy
    folder, or name of a shipped one) whose saccades are made: those of --start and --target or --pairs, else of the
    sizes in its table, around straight ahead.

    BIDS is a folder with one recording, in which the saccades stand one after the other; Parquet has one row a sample,
    with motors and tensions.

    $ orient-eye convert runs/my-simulation --bids dataset

    $ orient-eye convert lpf-human --rate 500 --bids dataset --parquet saccades.parquet
    """

    source: Annotated[str, tyro.conf.Positional, tyro.conf.arg(metavar="SOURCE")]
    """Trajectory, run directory or policy."""
    bids: Annotated[Path | None, tyro.conf.arg(metavar="FOLDER", help_behavior_hint="(optional)")] = None
    """Folder of the data set to write, new or empty."""
    parquet: Annotated[Path | None, _OPTIONAL] = None
    """Parquet file to write, at the trajectory's own times."""
    subject: str = "robot"
    """Label of the participant in the data set, letters and digits."""
    rate: Annotated[float | None, tyro.conf.arg(help_behavior_hint="(default: the trajectory's own)")] = None
    """Samples in a second of the data set, Hz."""
    saccades: Saccades = field(default_factory=Saccades)

    def run(self) -> dict[str, Any]:
        """Read or make the saccades, and write the files that were asked for."""
        from orient_eye.cli.places import check_outputs
        from orient_eye.cli.tables import say
        from orient_eye.errors import InputError
        from orient_eye.exchange.bids import check_folder, write_bids
        from orient_eye.exchange.parquet import write_parquet

        if not self.bids and not self.parquet:
            raise InputError("say what to write: --bids FOLDER, --parquet FILE.parquet, or both")
        if self.rate is not None and not self.bids:
            raise InputError("--rate is that of the data set; Parquet has the trajectory's own times, leave it out")
        file = self._file()
        check_outputs({"--parquet": self.parquet}, {"SOURCE": file, "--pairs": self.saccades.pairs})
        if self.bids:
            check_folder(self.bids)
        trajectory, source, plant = self._read(file)
        written = []
        if self.bids:
            of = {"subject": self.subject, "source": source, "eye": _side(plant, file)}
            written += write_bids(self.bids, trajectory, rate_hz=self.rate, **of)
        if self.parquet:
            written.append(write_parquet(self.parquet, trajectory))
        failed = int(trajectory.failed.sum())
        if failed:
            say(f"{failed} simulated saccades failed: their samples are empty", "red")
        say(f"{len(trajectory)} saccades in {', '.join(str(path) for path in (self.bids, self.parquet) if path)}")
        return {
            "source": self.source,
            "saccades": len(trajectory),
            "failed_saccades": failed,
            "files": [str(path) for path in written],
        }

    def _file(self) -> Path | None:
        """The trajectory that SOURCE names; None where it is a policy."""
        import os

        path = Path(self.source)
        if os.path.exists(path / _NAME):
            return path / _NAME
        return path if path.suffix == ".npz" else None

    def _read(self, file: Path | None) -> "tuple[Trajectory, str, Plant | None]":
        """The saccades, in words what they are, and the plant that made them; None where that is not known."""
        from orient_eye.errors import InputError
        from orient_eye.movement.trajectory import Trajectory

        chosen = (self.saccades.start, self.saccades.target, self.saccades.pairs)
        if file is None:
            return self._made()
        if any(option is not None for option in chosen):
            raise InputError(f"--start, --target and --pairs are a policy's; {file} has its saccades, leave them out")
        return Trajectory.load_npz(file), f"simulation {file.parent.name}", _plant_of(file.parent)

    def _made(self) -> "tuple[Trajectory, str, Plant]":
        """Saccades of a policy."""
        import os

        import numpy as np

        from orient_eye.errors import InputError
        from orient_eye.files import read_json
        from orient_eye.learning.evaluation import TABLE_AMPLITUDES_DEG
        from orient_eye.learning.policy import Policy
        from orient_eye.task.targets import saccades
        from orient_eye.words import plant_in_words

        about = Path(self.source) / "run.json"
        if os.path.exists(about):
            told = read_json(about, hint="this is no run directory, name one")
            command = told.get("command") if isinstance(told, dict) else None
            if command != "train":
                raise InputError(
                    f"{self.source} is a run of orient-eye {command}, which keeps no {_NAME}; name a run of simulate, "
                    "or a policy, whose saccades are made"
                )
        policy = Policy.load(self.source)
        task = policy.task()
        if self.saccades.target is None and self.saccades.pairs is None and self.saccades.start is None:
            ends = task.targets.symmetric(np.array(TABLE_AMPLITUDES_DEG, float))
        else:
            ends = self.saccades.angles(task.targets, drawn=True)
        start, target = saccades(task.targets, *ends)
        made = task.trajectory(start, policy.act(start.orientation, target), target)
        return made, f"policy {Path(self.source).name} on plant {plant_in_words(task.plant.identity())}", task.plant


def _plant_of(folder: Path) -> "Plant | None":
    """The plant of a simulation, as its result tells; None where there is none, or it cannot be had."""
    from orient_eye.errors import InputError
    from orient_eye.files import read_json
    from orient_eye.plants import restore_plant

    try:
        return restore_plant(read_json(folder / "result.json", hint="")["plant"])
    except (InputError, LookupError, TypeError, AttributeError):
        return None


def _side(plant: "Plant | None", file: Path | None) -> str:
    """Which eye was recorded."""
    from orient_eye.cli.tables import say
    from orient_eye.eyes.model import side

    if plant is not None:
        return side(plant.drawn())
    say(f"note: no result beside {file} says which eye that was; the data set has it as a left one", "yellow")
    return "left"
