"""A run leaves a directory that explains itself.

    run = RunDirectory.create(Path("runs/my-run"), "train", config, seed=0)
    run.path / "anything"                            # files of the run
    run.write_json("result.json", result)

`run.json` holds the command, the resolved configuration, the seed and the versions of everything
that computes.
"""

import json
import platform
import shlex
import sys
from dataclasses import asdict, dataclass, is_dataclass
from datetime import datetime
from importlib import metadata
from pathlib import Path
from typing import Any

from orient_eye.errors import InputError
from orient_eye.files import explained, finite, read_json, write_json

_PACKAGES = (
    "orient-eye", "mujoco", "numpy", "scipy", "gymnasium", "stable-baselines3", "torch", "safetensors", "rerun-sdk",
)  # fmt: skip


@dataclass(frozen=True)
class RunDirectory:
    """The directory of one run."""

    path: Path

    @classmethod
    def create(cls, path: Path | None, command: str, config: Any, *, seed: int | None = None) -> "RunDirectory":
        """Make the directory and write `run.json`.

        Args:
            path: where; None for runs/COMMAND-DATE-TIME.
            command: name of the command.
            config: resolved configuration, a dataclass or a dictionary of plain values.
            seed: of all random generators, None where nothing is random.

        Raises:
            InputError: the directory holds something already, belongs to another run, or cannot be made.
        """
        path = path or unnamed(command)
        settings = asdict(config) if is_dataclass(config) and not isinstance(config, type) else config
        told = {
            "command": command,
            "command_line": shlex.join(sys.argv),
            "started": datetime.now().astimezone().isoformat(timespec="seconds"),
            "seed": seed,
            "config": settings,
            "versions": versions(),
        }
        taken = InputError(f"{path} exists and is not an empty folder; name another with --out, or move it away")
        with explained(path):
            if path.exists() and (not path.is_dir() or any(path.iterdir())):
                raise taken
            path.mkdir(parents=True, exist_ok=True)
            about = path / "run.json"
            try:
                with about.open("x", encoding="utf-8") as file:  # of runs that begin at once one has the directory
                    file.write(json.dumps(finite(told), indent=2, default=str) + "\n")
            except FileExistsError:
                raise taken from None
            except BaseException:  # a signal too
                about.unlink()
                raise
        return cls(path)

    def write_json(self, name: str, content: Any) -> Path:
        """Write a JSON file of the run."""
        return write_json(self.path / name, content)

    def read_json(self, name: str) -> Any:
        """Read a JSON file of the run.

        Raises:
            InputError: it is missing or is not JSON.
        """
        return read_json(self.path / name, hint="this is no run directory, name one")


def unnamed(command: str) -> Path:
    """Where a run goes that was given no place: runs/COMMAND-DATE-TIME, with a number behind where that is taken."""
    usual = Path("runs") / f"{command}-{datetime.now():%Y%m%d-%H%M%S}"
    names = (usual, *(usual.with_name(f"{usual.name}-{number}") for number in range(2, 100)))
    return next((path for path in names if not path.exists()), usual)


def versions() -> dict[str, str]:
    """Versions of Python, the platform and the packages that compute."""
    found = {"python": platform.python_version(), "platform": platform.platform()}
    for package in _PACKAGES:
        try:
            found[package] = metadata.version(package)
        except metadata.PackageNotFoundError:
            found[package] = "not installed"
    return found


def plain(value: Any) -> Any:
    """numpy and path values for JSON."""
    return value.tolist() if hasattr(value, "tolist") else str(value)
