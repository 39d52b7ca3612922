"""What every recording has in common: how it is written, whole or not at all."""

import errno
import zlib
from collections.abc import Callable, Sized
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from orient_eye.errors import InputError
from orient_eye.files import write_atomically

if TYPE_CHECKING:
    import rerun as rr

_BEGINNING, _END = b"RRF2", b"RRF2FOOT"
_FOOTER = slice(-12, -4)  # behind it stands how many there are


def check(path: Path, saccades: int, target: NDArray[np.float64] | None, **others: Sized | None) -> None:
    """Whether a recording can be written there, and what is told of each saccade fits their number.

    Args:
        path: of the recording.
        saccades: how many there are.
        target: their targets, or None.
        others: what else is told of each, or None, by name.

    Raises:
        InputError: it cannot, or does not.
    """
    if path.suffix != ".rrd":
        raise InputError(f"a recording is a file NAME.rrd, got {path.name!r}: write {path.stem}.rrd")
    if not saccades:
        raise InputError("a recording needs at least one saccade, the trajectory has none")
    if target is not None and target.shape != (saccades, 4):
        raise InputError(
            f"{saccades} saccades need targets of shape ({saccades}, 4), quaternions, got "
            f"{target.shape}; rotations.from_yaw(yaw_deg) makes them"
        )
    for what, given in others.items():
        if given is not None and len(given) != saccades:
            raise InputError(f"{what}: one for each of the {saccades} saccades, got {len(given)}")


def write(path: Path, layout: object, draw: "Callable[[rr.RecordingStream], None]") -> Path:
    """Write a recording; an older file is replaced only by a whole one.

    Args:
        path: the file, NAME.rrd.
        layout: what makes its layout this one, with a `repr` that says so.
        draw: sends layout and data.
    """
    # The viewer keeps what a person changed in the layout of an application: one application for each layout.
    application = f"orient-eye-{zlib.crc32(repr(layout).encode()):08x}"
    return write_atomically(path, lambda file: _fill(file, _recorded(application, path.stem, draw)))


def _fill(file: Path, recording: bytes) -> None:
    """Write a file, and raise OSError unless it holds all of it, from a recording's first bytes to its footer."""
    file.write_bytes(recording)
    there = file.read_bytes()
    if there != recording or not there.startswith(_BEGINNING) or there[_FOOTER] != _END:
        raise OSError(errno.EIO, "the recording came out damaged")


def draw_info(rec: "rr.RecordingStream", text: str) -> None:
    """The text of the panel "info", Markdown."""
    import rerun as rr

    rec.log("/info", rr.TextDocument(text, media_type="text/markdown"), static=True)


def _recorded(application: str, name: str, draw: "Callable[[rr.RecordingStream], None]") -> bytes:
    import rerun as rr

    strict = rr.strict_mode()
    rr.set_strict_mode(True)
    try:
        with rr.RecordingStream(application) as rec:
            stream = rr.binary_stream(rec)  # to memory: of a file on a full disk the SDK says nothing, or waits
            rec.send_recording_name(name)
            draw(rec)
            rec.disconnect()  # writes the end, without which the recording is not whole
            recording = stream.read()
            if recording is None:
                raise RuntimeError("the Rerun SDK returned no recording")
            return recording
    finally:
        rr.set_strict_mode(strict)
