"""Output files appear whole or not at all, and what keeps them from it is an InputError."""

import csv
import errno
import hashlib
import io
import json
import os
import re
import secrets
import shutil
import stat
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

from orient_eye.errors import InputError

if TYPE_CHECKING:
    from numpy.typing import NDArray

_MARK = ".tmp-orient-eye"
_LEFTOVER = re.compile(rf"\..*-[0-9a-f]{{16}}{re.escape(_MARK)}(\.[^.]*)?")
_STEM, _SUFFIX = 40, 16  # characters; with them a temporary name stays within the 255 bytes of a file name

_ELSEWHERE = "a file stands where a folder is needed, name another place"
_FORBIDDEN = "name a place that you may write to"
_FULL = "make room there or name another place"
_ADVICE = {
    errno.EACCES: _FORBIDDEN,
    errno.EPERM: _FORBIDDEN,
    errno.EROFS: _FORBIDDEN,
    errno.ENOSPC: _FULL,
    errno.EDQUOT: _FULL,
    errno.EFBIG: _FULL,
    errno.EEXIST: _ELSEWHERE,
    errno.ENOTDIR: _ELSEWHERE,
    errno.EISDIR: "name a file in it",
    errno.ENAMETOOLONG: "shorten it",
}


@contextmanager
def explained(path: str | Path) -> Iterator[None]:
    """Make an OSError in this block, met while path is written, an InputError that says what to do.

    Raises:
        InputError: the block raised OSError, or path holds a NUL.
    """
    if "\0" in os.fspath(path):
        raise InputError(f"cannot write {str(path)!r}: a file name holds no NUL; name another file")
    try:
        yield
    except OSError as error:
        advice = _ADVICE.get(error.errno or 0, "name another file")
        raise InputError(f"cannot write {path}: {error.strerror or error}; {advice}") from error


def write_atomically(path: str | Path, write: Callable[[Path], object]) -> Path:
    """Let `write` fill a temporary file beside path, then give it the name.

    Missing folders are made. An older file stays as it was unless all went well, and hands its permissions on.
    Of a symbolic link the file it points to is replaced. What cannot be replaced, a device, a pipe or the file
    that standard output goes to, is written to, when `write` has returned.

    Args:
        path: the file.
        write: writes all of the file that it is given, which has the suffix of path.

    Raises:
        InputError: it cannot be written (no such folder can be made, no permission, the disk is full, ...);
            any OSError of `write` counts as that.
    """
    path = Path(path)
    with explained(path):
        status = _status(path)
        if status is not None and stat.S_ISDIR(status.st_mode):
            raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR))
        stream = _standard_stream(status)
        if stream is not None or not (status is None or stat.S_ISREG(status.st_mode)):
            _pour(path if stream is None else stream, path.suffix, write)
        else:
            _replace(Path(os.path.realpath(path)) if path.is_symlink() else path, status, write)
    return path


def _status(path: Path) -> os.stat_result | None:
    """Of the file that path leads to, None where there is none."""
    try:
        return path.stat()
    except FileNotFoundError:
        return None


def _standard_stream(status: os.stat_result | None) -> int | None:
    """Descriptor of standard output or error, if that is the file: replaced, it would be lost to its reader."""
    for stream in (1, 2):
        with suppress(OSError):  # closed
            if status is not None and os.path.samestat(status, os.fstat(stream)):
                return stream
    return None


def _pour(goal: Path | int, suffix: str, write: Callable[[Path], object]) -> None:
    with tempfile.TemporaryDirectory(prefix="orient-eye-") as folder:
        temporary = Path(folder) / f"output{suffix}"
        write(temporary)
        with open(goal, "wb", closefd=not isinstance(goal, int)) as target, temporary.open("rb") as source:
            shutil.copyfileobj(source, target)


def _replace(path: Path, old: os.stat_result | None, write: Callable[[Path], object]) -> None:
    if old is not None and not os.access(path, os.W_OK):
        raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))
    path.parent.mkdir(parents=True, exist_ok=True)
    suffix = path.suffix if len(path.suffix) <= _SUFFIX else ""
    temporary = path.parent / f".{path.stem[:_STEM]}-{secrets.token_hex(8)}{_MARK}{suffix}"
    try:
        os.close(os.open(temporary, os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o666))  # less the umask
        write(temporary)
        with temporary.open("rb+") as written:
            os.fsync(written.fileno())  # else a crash of the machine can leave the new name with an empty file
        if old is not None:
            temporary.chmod(old.st_mode & 0o777)
        os.replace(temporary, path)
    finally:
        temporary.unlink(missing_ok=True)


def remove_leftovers(folder: Path) -> list[Path]:
    """Remove the temporary files that killed processes of this project left in a folder and those below it.

    Nothing else may be writing there meanwhile: its temporary files look the same.

    Returns:
        What was removed.

    Raises:
        InputError: one cannot be removed.
    """
    found = [Path(root) / name for root, _, names in os.walk(folder) for name in names if _LEFTOVER.fullmatch(name)]
    for path in found:
        with explained(path):
            path.unlink(missing_ok=True)
    return found


def write_text(path: str | Path, text: str) -> Path:
    """Write a text file in UTF-8, atomically.

    Raises:
        InputError: it cannot be written.
    """
    return write_atomically(path, lambda temporary: temporary.write_text(text, encoding="utf-8"))


def write_table(path: str | Path, rows: Sequence[Mapping[str, Any]]) -> Path:
    """Write rows of plain values as a CSV file with a header, atomically.

    Raises:
        InputError: there is no row, whose keys are the columns, or it cannot be written.
    """
    if not rows:
        raise InputError(f"cannot write {path}: a table needs at least one row, there is none")
    text = io.StringIO()
    writer = csv.DictWriter(text, fieldnames=list(rows[0]), lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    return write_text(path, text.getvalue())


def read_arrays(path: Path) -> "tuple[dict[str, NDArray[Any]], dict[str, str]]":
    """Arrays of a safetensors file by name, and its metadata.

    Raises:
        OSError: it cannot be read.
        safetensors.SafetensorError: it is damaged, or none.
    """
    import safetensors  # and NumPy with it, which --help does not wait for

    with safetensors.safe_open(path, "numpy") as opened:
        return {name: opened.get_tensor(name) for name in opened.keys()}, opened.metadata() or {}  # noqa: SIM118  no iterator


def digest(arrays: "Mapping[str, NDArray[Any]]", told: Mapping[str, Any]) -> str:
    """SHA-256 of arrays and plain values: it shows damage, and proves nothing about who wrote them."""
    found = hashlib.sha256(json.dumps(told, sort_keys=True).encode())
    for name in sorted(arrays):
        found.update(f"{name} {arrays[name].dtype} {arrays[name].shape}".encode())
        found.update(arrays[name].tobytes())
    return found.hexdigest()
