"""`orient-eye check`: hold a saccade that was executed on a rig against its prediction."""

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import tyro

from orient_eye.checks import DEG, likely_milliseconds, real
from orient_eye.errors import InputError

if TYPE_CHECKING:
    from orient_eye.commands.motor_file import Wiring, WrittenCommand
    from orient_eye.plants import Plant
    from orient_eye.rig import Rig
    from orient_eye.surrogate import Surrogate
    from orient_eye.sysid.executed import Held, Saccade
    from orient_eye.tables import Table

_OPTIONAL = tyro.conf.arg(help_behavior_hint="(optional)")
_SAMPLED = 3  # rows of a recording that say how far apart they are
_EXPLAINED = 0.8  # share of the eye's movement that the prediction explains: a rig's faults leave 0.95
_FACTOR = 1.6  # up or down: as far as the gain of a rig may be off beside that of its unit
_LARGE = 1e5  # deg: nothing turns so far
_CLOCK_S = 1.0  # a recording that begins later than this has a clock of its own


@dataclass(frozen=True)
class Check:
    """Hold an executed saccade against its prediction: what is off, and what to do about it.

    MODEL is what predicts: a surrogate.json or the run directory of `orient-eye sysid`, a policy, or the run directory
    of `orient-eye train`. The command is the file that was sent to the rig, the recording what the rig did: t_s, the
    eye's angle, and, if at hand, where the motors were, with the columns that `orient-eye sysid` reads.

    $ orient-eye check runs/sysid-1/surrogate.json --command saccade.csv --executed executed.csv

    $ orient-eye check runs/train-1 --rig rig.toml --command saccade.csv --executed executed.csv
    """

    model: Annotated[str, tyro.conf.Positional, tyro.conf.arg(metavar="MODEL")]
    """Surrogate, policy, or run directory of either."""
    command: Path
    """CSV file that was sent to the rig, as `orient-eye predict` wrote it."""
    executed: Path
    """CSV file of what the rig did, from rest on until the eye stands."""
    rig: Annotated[str | None, tyro.conf.arg(help_behavior_hint="(default: the surrogate's own)")] = None
    """Description of the rig (TOML, docs/rigs.md): the files are then in its driver's units."""
    axis: Annotated[
        Literal["yaw", "pitch", "roll"] | None, tyro.conf.arg(help_behavior_hint="(default: the surrogate's)")
    ] = None
    """Angle of the eye that is compared."""
    sent_at: Annotated[float | None, tyro.conf.arg(help_behavior_hint="(default: 0, or its first row)")] = None
    """Time in the recording at which the first row of the command was sent, s."""
    band: Annotated[float | None, tyro.conf.arg(help_behavior_hint="(default: the policy's own, else 0.02)")] = None
    """Settling band: the share of the movement around its end into which it comes to stay when it is over."""
    out: Annotated[Path | None, _OPTIONAL] = None
    """CSV file to write: the table."""

    def run(self) -> dict[str, Any]:
        """Compare, print the table and what to do."""
        import numpy as np

        from orient_eye.cli.places import check_outputs
        from orient_eye.cli.tables import column, say, table
        from orient_eye.constants import ANGLES as AXES
        from orient_eye.files import write_table
        from orient_eye.plants.limits import wiring
        from orient_eye.state import State
        from orient_eye.sysid.executed import Saccade, hold_against
        from orient_eye.sysid.step_response import axis_angle
        from orient_eye.tables import read_table

        check_outputs({"--out": self.out}, {"--command": self.command, "--executed": self.executed})
        plant, surrogate, rig, band = self._model()
        wired = None if rig is None else wiring(plant, rig)
        command = self._command(plant, wired)
        recorded = read_table(self.executed, "t_s,motor_deg,eye_deg")
        time = self._clock(recorded)
        horizon = max(command.duration_s, float(time[-1])) + plant.step_s
        start = State(plant.rest(command.rest), command.rest)
        trajectory = plant.move(command, start, horizon).trajectory()
        angles = {axis: axis_angle(trajectory.orientation, axis)[0] for axis in AXES}
        axis: str = self.axis or max(AXES, key=lambda each: float(np.ptp(angles[each])))
        told = trajectory.motor[0, :, 0] if len(plant.motors) == 1 else None
        predicted = Saccade(trajectory.time, angles[axis], told)
        executed = self._executed(recorded, time, axis, plant, rig)
        held = hold_against(predicted, executed, _answer(surrogate, executed, predicted), band)
        rows = [asdict(row) for row in held.rows]
        columns = {
            "": lambda row: f"{row['name']} [{row['unit']}]",
            "predicted": column("predicted", ".4g"),
            "executed": column("executed", ".4g"),
            "difference": _difference,
        }
        say(table(f"Executed against predicted, {axis}.", columns, rows, left=("",)))
        _say_rest(held, band)
        if executed.motor_deg is None and told is not None:
            say("note: the recording has no motor positions, so motor and eye cannot be told apart", "yellow")
        advice = _doubts(held, executed) or held.advice
        for words in advice:
            say(words, "bold")
        if self.out:
            say(f"in {write_table(self.out, rows)}")
        result = {**asdict(held), "advice": list(advice)}
        del result["rows"]
        return {"model": self.model, "axis": axis, "quantities": rows, "band": band, **result}

    def _model(self) -> "tuple[Plant, Surrogate | None, Rig | None, float]":
        """The plant that predicts, its surrogate where it is one, the rig, and the settling band."""
        from orient_eye.cli.tables import say
        from orient_eye.learning.policy import NAME, Policy, shipped_policies
        from orient_eye.plants import make_plant, restore_plant
        from orient_eye.rig import Rig
        from orient_eye.surrogate import Surrogate
        from orient_eye.sysid.executed import BAND

        rig = None if self.rig is None else Rig.load(self.rig)
        place = Path(self.model)
        policy = self.model in shipped_policies() or place.name == NAME or (place / NAME).is_file()
        if policy:
            learned = Policy.load(self.model)
            task = learned.manifest["task"]
            identity, band = task["plant"], float(task["band"])
            plant = restore_plant(identity) if rig is None else restore_plant(identity, rig=rig)
            others = learned.require(learned.task(plant), force=True)
            if others:
                say(f"note: this is another rig than the policy's, which was trained for {'; '.join(others)}", "red")
            surrogate: Surrogate | None = getattr(plant, "surrogate", None)
        else:
            band = BAND
            surrogate = Surrogate.load(place / "surrogate.json" if place.is_dir() else self.model)
            plant = make_plant("lpf", surrogate=surrogate, rig=rig)
        if rig is None and surrogate is not None and surrogate.rig is not None:
            rig = Rig.from_plain(surrogate.rig, f"the rig inside {self.model}")
        return plant, surrogate, rig, band if self.band is None else self.band

    def _command(self, plant: "Plant", wired: "Wiring | None") -> "WrittenCommand":
        """The command that was sent.

        Raises:
            InputError: it is none of this plant or rig.
        """
        from orient_eye.commands.motor_file import read_command

        try:
            return read_command(self.command, plant.motors, wired)
        except InputError as error:
            if wired is not None:
                raise
            raise InputError(
                f"{error}. A command for a rig's driver is read with its rig: name its file by --rig"
            ) from error

    def _clock(self, recorded: "Table") -> Any:
        """Times of the recording on the command's clock [s], (rows,).

        Raises:
            InputError: no column t_s, time that does not rise, or a start that is not in it.
        """
        from orient_eye.sysid.recordings import times_of

        time = times_of(recorded)
        if asked := likely_milliseconds(len(time), float(time[-1] - time[0]), many=_SAMPLED):
            raise InputError(f"{self.executed}: {asked}")
        begins = 0.0 if time[0] <= _CLOCK_S else float(time[0])
        if self.sent_at is not None:
            begins = real("--sent-at", self.sent_at, unit="s")
        if not begins < time[-1]:
            raise InputError(f"{self.executed} ends at {time[-1]:g} s, before the command is sent at {begins:g} s")
        return time - begins

    def _executed(self, recorded: "Table", time: Any, axis: str, plant: "Plant", rig: "Rig | None") -> "Saccade":
        from orient_eye.motor import Motor
        from orient_eye.sysid.executed import Saccade
        from orient_eye.sysid.motor_columns import driven_by_rig
        from orient_eye.sysid.recordings import eye_of

        _, eye, _ = eye_of(recorded, axis)
        motor = None
        if rig is not None and axis in rig.axes:
            wanted = [{rig.motor(n).column, f"{n}_deg", Motor(n).column} for n in rig.axes[axis]]
            if all(names & set(recorded.columns) for names in wanted) or rig.drive(axis).column in recorded:
                motor = driven_by_rig(recorded, rig, axis).position
        elif len(plant.motors) == 1:
            column = next((c for c in (plant.motors[0].column, "motor_deg") if c in recorded), None)
            motor = None if column is None else recorded[column]
        for what, values in (("the eye", eye), ("the motor", motor)):
            if values is not None and not abs(values).max() <= _LARGE:
                raise InputError(f"{self.executed}: {what} turns by {abs(values).max():.3g} deg; angles are in deg")
        return Saccade(time, eye, motor)


def _doubts(held: "Held", executed: "Saccade") -> list[str]:
    """What the recording probably is instead; where nothing says so, nothing.

    An eye in radians would pass for one of a tiny gain, and another command's saccade for a shape that differs.
    """
    import numpy as np

    told = {row.name: row for row in held.rows}
    found = []
    for what, row in (("eye's angle", told["movement"]), ("motor's position", told.get("motor end"))):
        if row is None or row.predicted is None or row.executed is None or abs(row.predicted) < 1:
            continue
        share = DEG * row.executed / row.predicted
        if 1 / _FACTOR < share < _FACTOR:
            found.append(
                f"the {what} comes to {row.executed:.3g} where {row.predicted:.3g} deg were predicted: is it in "
                f'radians? It is read in deg; multiply by {DEG:.7g} (for the motor a rig can say it: unit = "rad")'
            )
    moved = float(np.std(executed.eye_deg))
    if not found and held.left_rms_deg**2 > (1 - _EXPLAINED) * moved**2:
        found.append(
            f"the prediction explains {max(100 * (1 - (held.left_rms_deg / max(moved, 1e-9)) ** 2), 0):.0f} % of how "
            "the eye moved: is this the recording of another command, or of an eye that does not follow its motor? "
            "Nothing else can be told from it"
        )
    return found


def _answer(surrogate: "Surrogate | None", executed: "Saccade", predicted: "Saccade") -> Any:
    """What the surrogate answers to the motor as it was measured, from rest [deg], (samples,); None without.

    Before the first row the motor did what it was told.
    """
    import numpy as np

    from orient_eye.sysid import StepResponse
    from orient_eye.sysid.identification import response_of

    if surrogate is None or executed.motor_deg is None or predicted.motor_deg is None:
        return None
    before, lost = executed.time <= 0, predicted.time < executed.time[0]
    rest = executed.motor_deg[before].mean() if before.any() else predicted.motor_deg[0]
    motor = np.append(predicted.motor_deg[lost], executed.motor_deg) - rest
    time = np.append(predicted.time[lost], executed.time)
    return response_of(surrogate, StepResponse("executed", time, motor, np.zeros_like(time)))[lost.sum() :]


def _difference(row: Any) -> str:
    both = row["predicted"], row["executed"]
    return "-" if None in both else f"{both[1] - both[0]:+.3g}"


def _say_rest(held: "Held", band: float) -> None:
    from orient_eye.cli.tables import say

    share = f"{100 * band:g} % of the movement"
    if held.band_is_noise:
        share = f"four times its sensor's noise, in which {share} cannot be seen"
    say(f"duration: until the eye stays within {held.band_deg:.3g} deg of its end, {share}")
    told = [
        f"residual rms {held.residual_rms_deg:.3f} deg (sensor's noise {held.noise_deg:.3f})",
        f"eye {_when(held.shift_s)} than predicted",
    ]
    if held.motor_shift_s is not None:
        told.append(f"motor {_when(held.motor_shift_s)} than told")
    told.append(f"at that shift {held.gain:.3f} times the movement, rms {held.left_rms_deg:.3f} deg left")
    if held.model_rms_deg is not None:
        told.append(f"model driven by the measured motor: rms {held.model_rms_deg:.3f} deg")
    say("; ".join(told))


def _when(shift_s: float) -> str:
    return f"{1e3 * abs(shift_s):.1f} ms {'earlier' if shift_s < 0 else 'later'}"
