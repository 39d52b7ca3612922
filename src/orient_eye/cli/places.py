"""Where files are written: never over an input, never twice to the same place."""

import os
from collections.abc import Mapping
from pathlib import Path

from orient_eye.errors import InputError
from orient_eye.files import explained


def check_outputs(outputs: Mapping[str, Path | None], inputs: Mapping[str, Path | None]) -> None:
    """Refuse an output that is a folder, an input, or another output.

    Args:
        outputs: option to the file that it names.
        inputs: option to the file that it names.

    Raises:
        InputError: names both options; or a name that no file can have.
    """
    taken: dict[str, str] = {}
    for option, named in inputs.items():
        if named is not None and "\0" not in str(named):
            taken[os.path.realpath(named)] = option
    for option, path in outputs.items():
        if path is None:
            continue
        with explained(path):
            if path.is_dir():
                raise InputError(f"{option} {path} is a folder; name a file in it")
            if path.exists() and not path.is_file():
                continue  # a device or a pipe keeps nothing, so nothing is lost
        other = taken.setdefault(os.path.realpath(path), option)
        if other != option:
            raise InputError(f"{option} and {other} name the same file, {path}, which would be lost; name another")


def policy_file(policy: str) -> Path:
    """The file of a policy named as `orient_eye.learning.policy.Policy.load` takes it."""
    from orient_eye.learning.policy import NAME, shipped_policies

    place = shipped_policies().get(policy, Path(policy))
    return place if place.name == NAME else place / NAME
