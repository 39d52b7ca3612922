"""A movement as pictures and as a film, by MuJoCo's renderer.

    pictures = frames(trajectory, plant.drawn())     # a batch of one; (height, width, 3) each
    write_film(pictures, "saccade.gif")

Needs a machine that draws: a screen, or on Linux without one EGL (MUJOCO_GL in the environment chooses another
way, as everywhere in MuJoCo).
"""

import os
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray
from PIL import Image

from orient_eye.errors import InputError
from orient_eye.files import write_atomically
from orient_eye.movement.trajectory import Trajectory

Array = NDArray[np.float64]
Picture = NDArray[np.uint8]
SIZE = (480, 360)
"""Width and height of a picture [pixels]."""
FPS = 30
SLOWER = 10.0
"""A film shows a saccade this many times slower than it is."""
_FORMATS = (".gif", ".webp", ".png")


def frames(
    trajectory: Trajectory,
    model: mujoco.MjModel,
    *,
    fps: float = FPS,
    slower: float = SLOWER,
    size: tuple[int, int] = SIZE,
    camera: str | None = None,
) -> list[Picture]:
    """Pictures (height, width, 3) of a movement, evenly in time.

    Args:
        trajectory: a batch of one.
        model: the eye to draw, with its shapes.
        fps: pictures a second of film.
        slower: seconds of film a second of movement.
        size: width and height [pixels].
        camera: of the model; None for the first it has, or a free one.

    Raises:
        InputError: more than one movement, one that failed, or a machine that cannot draw.
    """
    if len(trajectory) != 1:
        raise InputError(f"a film shows one movement, got {len(trajectory)}; pick one: trajectory[0]")
    if trajectory.failed[0]:
        raise InputError("this movement failed: there is nothing to draw")
    times = np.arange(0, trajectory.time[-1] * slower + 0.5 / fps, 1 / fps) / slower
    rows = np.searchsorted(trajectory.time, times - 1e-9).clip(0, len(trajectory.time) - 1)
    with _renderer(model, size) as draw:
        return [
            draw(
                trajectory.orientation[0, row],
                dict(zip(trajectory.motor_names, trajectory.motor[0, row], strict=True)),
                camera,
            )
            for row in rows
        ]


def still(
    model: mujoco.MjModel,
    orientation: Array,
    motors: Mapping[str, float],
    *,
    size: tuple[int, int] = SIZE,
    camera: str | None = None,
) -> Picture:
    """One picture of an eye in an orientation (4,), its motors at these positions [deg].

    Raises:
        InputError: a machine that cannot draw.
    """
    with _renderer(model, size) as draw:
        return draw(orientation, motors, camera)


def write_film(pictures: Sequence[Picture], path: str | Path, *, fps: float = FPS) -> Path:
    """Write a film: NAME.gif, NAME.webp or NAME.png (animated).

    Raises:
        InputError: another format, or no picture.
    """
    path = Path(path)
    if path.suffix not in _FORMATS:
        raise InputError(f"a film is a file {', '.join(f'NAME{f}' for f in _FORMATS)}, got {path.name!r}")
    if not pictures:
        raise InputError("a film needs at least one picture")
    first, *others = (Image.fromarray(picture) for picture in pictures)
    return write_atomically(
        path,
        lambda temporary: first.save(
            temporary, save_all=True, append_images=others, duration=round(1000 / fps), loop=0
        ),
    )


@contextmanager
def _renderer(model: mujoco.MjModel, size: tuple[int, int]) -> "Iterator[_Draw]":
    try:
        context = _context_class()(*size)
        context.make_current()
        drawing = mujoco.MjrContext(model, mujoco.mjtFontScale.mjFONTSCALE_100)
        mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN, drawing)
    except Exception as error:  # each of MuJoCo's ways raises its own
        raise InputError(
            f"MuJoCo cannot draw on this machine ({error}); on Linux without a screen it needs EGL (Debian and "
            "Ubuntu: libegl1), or see a recording in Rerun instead"
        ) from error
    try:
        yield _Draw(model, drawing, size)
    finally:
        drawing.free()
        context.free()


def _context_class() -> Any:
    """MuJoCo's own choice; EGL where a Linux machine has no screen and nothing was chosen."""
    chosen = any(name in os.environ for name in ("MUJOCO_GL", "DISPLAY", "WAYLAND_DISPLAY"))
    if sys.platform == "linux" and not chosen:
        from mujoco.egl import GLContext

        return GLContext
    return mujoco.GLContext


class _Draw:
    """Draws one picture."""

    def __init__(self, model: mujoco.MjModel, drawing: mujoco.MjrContext, size: tuple[int, int]) -> None:
        self.model, self.data, self.drawing, self.size = model, mujoco.MjData(model), drawing, size
        self.scene, self.option = mujoco.MjvScene(model, maxgeom=1000), mujoco.MjvOption()

    def __call__(self, orientation: Array, motors: Mapping[str, float], camera: str | None) -> Picture:
        model, data = self.model, self.data
        eye = int(model.joint("eye").qposadr[0])
        data.qpos[eye : eye + 4] = orientation
        known = {model.actuator(i).name: i for i in range(model.nu)}
        for name, position in motors.items():
            if name in known:
                actuator = known[name]
                joint = model.joint(model.actuator_trnid[actuator, 0])
                data.qpos[joint.qposadr[0]] = np.deg2rad(position) / model.actuator_gear[actuator, 0]
        mujoco.mj_forward(model, data)
        view = mujoco.MjrRect(0, 0, *self.size)
        shown = mujoco.mjtCatBit.mjCAT_ALL
        mujoco.mjv_updateScene(model, data, self.option, None, self._camera(camera), shown, self.scene)
        mujoco.mjr_render(view, self.scene, self.drawing)
        picture = np.empty((self.size[1], self.size[0], 3), np.uint8)
        mujoco.mjr_readPixels(picture, None, view, self.drawing)
        return np.flipud(picture).copy()

    def _camera(self, name: str | None) -> mujoco.MjvCamera:
        camera = mujoco.MjvCamera()
        if name is None and not self.model.ncam:
            mujoco.mjv_defaultFreeCamera(self.model, camera)
            return camera
        camera.type = mujoco.mjtCamera.mjCAMERA_FIXED
        camera.fixedcamid = 0 if name is None else self.model.camera(name).id
        return camera
