"""Where the files that travel with the code are: the MJCF, its meshes, the shipped models.

They stand at the top of a checkout (`eye_mjcf/`, `models/`) and inside the package in a wheel
(`orient_eye/_data/`). Everything that opens one of them asks here, and
everything that uses all cores how many it has.
"""

import os
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

from orient_eye.errors import InputError

_PACKAGE = Path(__file__).resolve().parent
_SHARE: list[int] = []


def data_folder(name: str) -> Path:
    """The folder `eye_mjcf` or `models`, of this checkout or of the installed wheel.

    Raises:
        FileNotFoundError: the installation is damaged.
    """
    for folder in (_PACKAGE / "_data" / name, _PACKAGE.parents[1] / name):
        if folder.is_dir():
            return folder
    raise FileNotFoundError(f"orient-eye is installed without its folder {name!r}; install it again")


def shipped_or_given(name: str | Path, shipped: Mapping[str, Path], kind: str, hint: str) -> Path:
    """The file that a user means: a shipped one by its name, else a file of his own.

    Args:
        name: what he gave.
        shipped: files by name.
        kind: of file, for messages.
        hint: what to give instead, the end of messages.

    Raises:
        InputError: it is neither.
    """
    file = shipped.get(str(name), Path(name))
    if not os.path.exists(file):  # of a name that no file can have, too
        raise InputError(f"{printable(name)} is no {kind}: there is no such file; {hint}")
    return file


def cores() -> int:
    """How many threads "one a core" are: the machine's cores, or what `share_cores` left this process of them."""
    return _SHARE[-1] if _SHARE else os.cpu_count() or 1


def share_cores(count: int) -> None:
    """Leave this process so many cores, because others work beside it; plants made before keep theirs."""
    _SHARE[:] = [count]


def user_cache(name: str) -> Path:
    """A folder of the user's cache (XDG_CACHE_HOME moves it); of a user without a home, one that ends with Python."""
    import platformdirs  # which --help does not wait for

    try:
        return platformdirs.user_cache_path("orient-eye") / name
    except RuntimeError:
        return Path(_homeless().name) / name


@cache
def _homeless() -> "TemporaryDirectory[str]":
    return TemporaryDirectory(prefix="orient-eye-")


def printable(path: str | Path) -> str:
    """A path for messages: as it is, or quoted where it holds what no terminal should be sent."""
    text = str(path)
    return text if text.isprintable() else repr(text)
