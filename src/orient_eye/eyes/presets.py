"""What the presets of the eye change in their MJCF file."""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import mujoco


def eve_v3(spec: "mujoco.MjSpec") -> None:
    """The group's second published parameter set (a Simulink model by another author).

    Insertions behind the centre, an inertia ten times larger with products of inertia, and motor 3
    counting the other way.
    """
    eye = spec.body("eye")
    for site in eye.sites:
        if site.name.startswith("eye_"):
            site.pos = [-0.007, *site.pos[1:]]
    eye.inertia = [0, 0, 0]
    eye.fullinertia = [4.759e-4, 4.316e-4, 3.956e-4, -1e-7, 1.11e-5, 0]
    spec.joint("motor3").axis = [0, -1, 0]
