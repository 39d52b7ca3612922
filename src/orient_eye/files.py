"""Outputs appear whole or not at all, inputs are read within bounds, and what keeps them from it is an InputError."""

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
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Any

from orient_eye.errors import InputError
from orient_eye.resources import printable

if TYPE_CHECKING:
    from numpy.typing import NDArray

_MARK = ".tmp-orient-eye"
_LEFTOVER = re.compile(rf"\..*-[0-9a-f]{{16}}{re.escape(_MARK)}(\.[^.]*)?")
_STEM, _SUFFIX = 40, 16  # characters; with them a temporary name stays within the 255 bytes of a file name

_LARGEST_JSON = 16 * 2**20  # bytes
_NESTING = 100
_PATIENCE_S = 3.0

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
    errno.ENXIO: "it is a pipe that nobody reads, or a socket; name another file",
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
        if error.errno == errno.EEXIST:  # which is also said of a link that leads to itself
            try:
                os.stat(path)
            except OSError as cause:
                error = cause if cause.errno == errno.ELOOP else error
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
        owned = not isinstance(goal, int)
        descriptor = goal if isinstance(goal, int) else _awaited(goal)
        with open(descriptor, "wb", closefd=owned) as target, temporary.open("rb") as source:
            shutil.copyfileobj(source, target)


def _awaited(path: Path) -> int:
    """Descriptor of a device or pipe that is open for writing; for a pipe's reader one waits seconds."""
    patient = time.monotonic() + _PATIENCE_S
    while True:
        try:
            descriptor = os.open(path, os.O_WRONLY | os.O_NONBLOCK | os.O_NOCTTY)
        except OSError as error:
            if error.errno != errno.ENXIO or time.monotonic() > patient:
                raise
            time.sleep(_PATIENCE_S / 100)
        else:
            os.set_blocking(descriptor, True)
            return descriptor


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


def write_json(path: str | Path, content: Any) -> Path:
    """Write plain values, NumPy's and paths as a JSON file, atomically; numbers that JSON does not have become null.

    Raises:
        InputError: it cannot be written.
    """
    return write_text(path, json.dumps(finite(content), indent=2, default=str, allow_nan=False) + "\n")


def finite(value: Any) -> Any:
    """The same plain value with None for numbers that JSON does not have."""
    if hasattr(value, "tolist"):
        value = value.tolist()
    if isinstance(value, Mapping):
        return {key: finite(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [finite(item) for item in value]
    return None if isinstance(value, float) and not isfinite(value) else value


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


def read_bytes(path: str | Path, *, most: int, hint: str) -> bytes:
    """The content of a file, or of a pipe or device up to its end. Links are followed.

    For a pipe's writer it waits as long as one has it open, as every Unix tool does, but only seconds for one to come.

    Args:
        path: of the file.
        most: bytes that it may hold.
        hint: what to give instead, the end of messages.

    Raises:
        InputError: it cannot be read, is larger, or a pipe that nobody writes to.
    """
    try:
        if "\0" in os.fspath(path):
            raise ValueError("a file name holds no NUL")
        with open(os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_NOCTTY), "rb", buffering=0) as file:
            beginning = _beginning(file)
            with io.BufferedReader(file) as reader:
                content = beginning + reader.read(most)
        if len(content) > most:
            raise ValueError(f"it is larger than {most / 2**20:.3g} MB")
    except (OSError, ValueError) as error:
        raise unreadable(path, error, hint) from error
    return content


def _beginning(file: io.FileIO) -> bytes:
    """At most one byte, waited for where the file is a pipe; what follows may be waited for too."""
    pipe, patient = stat.S_ISFIFO(os.fstat(file.fileno()).st_mode), time.monotonic() + _PATIENCE_S
    while (found := file.read(1)) == b"" and pipe:  # None: somebody has it open, and has not written yet
        if time.monotonic() > patient:
            raise ValueError("it is a pipe, and nobody writes to it")
        time.sleep(_PATIENCE_S / 100)
    os.set_blocking(file.fileno(), True)
    return found or b""


def unreadable(path: str | Path, error: Exception, hint: str) -> InputError:
    """Why a file cannot be read, and what to give instead."""
    why = error.strerror if isinstance(error, OSError) else None
    return InputError(f"cannot read {printable(path)}: {why or error}; {hint}")


def parse_json(text: str | bytes) -> Any:
    """Plain values of a JSON text.

    Raises:
        ValueError: it is none, nested more than 100 deep, or has a number that no finite float holds.
    """
    try:
        content = json.loads(text, parse_constant=_number, parse_float=_number, parse_int=_number)
    except RecursionError as error:
        raise ValueError("it is nested too deeply") from error
    level = [content]
    for _ in range(_NESTING):
        level = [
            child for each in level if isinstance(each, dict | list)
            for child in (each.values() if isinstance(each, dict) else each)
        ]  # fmt: skip
    if level:
        raise ValueError("it is nested too deeply")
    json.dumps(content, ensure_ascii=False).encode()  # ValueError: halves of characters, which nobody could write
    return content


def _number(text: str) -> float | int:
    number = float(text)
    if not isfinite(number):
        raise ValueError(f"{text[:20]} is no finite number")
    return int(text) if text.lstrip("-").isdigit() else number


def read_json(path: str | Path, *, hint: str) -> Any:
    """The plain values of a JSON file.

    Args:
        path: of the file.
        hint: what to give instead, the end of messages.

    Raises:
        InputError: it cannot be read, is larger than any of ours, or `parse_json` does not take it.
    """
    content = read_bytes(path, most=_LARGEST_JSON, hint=hint)
    try:
        return parse_json(content)
    except ValueError as error:
        raise unreadable(path, error, hint) from error


def read_arrays(path: str | Path, *, most: int, hint: str) -> "tuple[dict[str, NDArray[Any]], dict[str, str]]":
    """Arrays of a safetensors file by name, and its metadata.

    Args:
        path: of the file.
        most: bytes that it may hold.
        hint: what to give instead, the end of messages.

    Raises:
        InputError: it cannot be read, is larger, is damaged, or none.
    """
    import safetensors.numpy  # and NumPy with it, which --help does not wait for

    content = read_bytes(path, most=most, hint=hint)
    try:
        arrays = safetensors.numpy.load(content)
        header = parse_json(content[8 : 8 + int.from_bytes(content[:8], "little")])
    except (safetensors.SafetensorError, KeyError, ValueError) as error:  # KeyError: a dtype that NumPy has not
        raise unreadable(path, error, hint) from error
    return arrays, header.get("__metadata__", {})


def digest(arrays: "Mapping[str, NDArray[Any]]", told: Mapping[str, Any]) -> str:
    """SHA-256 of arrays and plain values: it shows damage, and proves nothing about who wrote them."""
    found = hashlib.sha256(json.dumps(told, sort_keys=True).encode())
    for name in sorted(arrays):
        found.update(f"{name} {arrays[name].dtype} {arrays[name].shape}".encode())
        found.update(arrays[name].tobytes())
    return found.hexdigest()
