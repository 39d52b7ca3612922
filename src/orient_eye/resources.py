"""Where the files that travel with the code are: the MJCF, its meshes, the shipped models.

They stand at the top of a checkout (`eye_mjcf/`, `models/`) and inside the package in a wheel
(`orient_eye/_data/`). Everything that opens one of them asks here.
"""

from pathlib import Path

_PACKAGE = Path(__file__).resolve().parent


def data_folder(name: str) -> Path:
    """The folder `eye_mjcf` or `models`, of this checkout or of the installed wheel.

    Raises:
        FileNotFoundError: the installation is damaged.
    """
    for folder in (_PACKAGE / "_data" / name, _PACKAGE.parents[1] / name):
        if folder.is_dir():
            return folder
    raise FileNotFoundError(f"orient-eye is installed without its folder {name!r}; install it again")
