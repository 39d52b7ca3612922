"""Make the meshes of eye_mjcf/meshes, and weigh the printed eyeball.

    python scripts/make_meshes.py

The meshes are for the eyes only: all physics stands in eye_mjcf/eye3.xml and eye6.xml, from which
this script takes the places of all that a cable touches, so that shell, arms, eyelets and posts follow
the numbers there. The same numbers give the same files. Meshes of the six-motor eye are called eye6_NAME.

The eyeball of the three-motor prototype is a printed half sphere, so its mass, centre of mass and inertia
follow from its wall. They are printed beside those of the presets.
"""

import sys
from collections.abc import Iterable
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import mujoco
import numpy as np
import trimesh
import tyro
from numpy.typing import NDArray

from orient_eye.eyes import EYES
from orient_eye.eyes.model import load_spec
from orient_eye.files import write_atomically
from orient_eye.resources import data_folder

Array = NDArray[np.float64]
Mesh = trimesh.Trimesh

SECTIONS = 64  # of a surface of revolution about the line of sight
RIM_X = -0.014  # m, where the shell ends: behind the insertions of every preset (eve_v3: -0.007)
IRIS_DEG, LIMBUS_DEG, PUPIL_DEG = 27.0, 29.0, 11.0  # half angles seen from the centre, as in man
PLATE_Z = -0.16  # m, top of the base plate: lower than the arms reach
OPENING_DEG = 50.0  # half angle of the six-motor eye's opening behind, for its post and for the cable LR
LEVEL_Z = -0.13  # m, top of the six-motor eye's base plate
Z_TO_X = np.array([[0, 0, 1, 0], [1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 0, 1]], dtype=float)
Y_TO_Z = np.array([[-1, 0, 0, 0], [0, 0, 1, 0], [0, 1, 0, 0], [0, 0, 0, 1]], dtype=float)


@dataclass(frozen=True)
class Options:
    """Make the visual meshes and compare the printed shell with the published eye."""

    wall: float = 0.003
    """Thickness of the printed wall [m]; no publication gives it."""
    density: float = 1240.0
    """Density of the plastic [kg/m^3]; 1240 is solid PLA."""
    out: Path | None = None
    """Folder of the meshes; that of eye_mjcf if not given."""


# --- Shapes -------------------------------------------------------------------------------------


def revolve(profile: Array, sections: int = SECTIONS) -> Mesh:
    """A closed surface: the profile (points, [x, distance from the x axis]) [m] turned about x."""
    mesh: Mesh = trimesh.creation.revolve(profile[::-1, ::-1], sections=sections)
    mesh.apply_transform(Z_TO_X)
    return mesh


def arc(radius: float, start_deg: float, end_deg: float, points: int) -> Array:
    """Points (points, [x, distance from the x axis]) of a circle; 0 deg is the front pole."""
    angle = np.deg2rad(np.linspace(start_deg, end_deg, points))
    return radius * np.column_stack([np.cos(angle), np.where(np.sin(angle) < 1e-9, 0, np.sin(angle))])


def hull_of_circles(centres: Array, radii: Array, points: int) -> Array:
    """Corners (points, 2), counterclockwise, of the convex outline around circles."""
    angle = 2 * np.pi * (np.arange(points) + 0.5) / points
    outward = np.column_stack([np.cos(angle), np.sin(angle)])
    farthest = (outward @ centres.T + radii).argmax(axis=1)
    return np.asarray(centres[farthest] + radii[farthest, None] * outward)


def plate(outline: Array, thickness: float) -> Mesh:
    """A flat plate in the x-y plane around z = 0, from its convex outline (points, 2)."""
    fan = np.array([[0, i, i + 1] for i in range(1, len(outline) - 1)])
    mesh: Mesh = trimesh.creation.extrude_triangulation(outline, fan, thickness)
    mesh.apply_translation([0, 0, -thickness / 2])
    return mesh


def box(low: Iterable[float], high: Iterable[float]) -> Mesh:
    """A box from its lowest to its highest corner."""
    mesh: Mesh = trimesh.creation.box(bounds=np.sort([list(low), list(high)], axis=0))
    return mesh


def rod(start: Iterable[float], end: Iterable[float], radius: float, sections: int = 20) -> Mesh:
    """A cylinder between two points."""
    mesh: Mesh = trimesh.creation.cylinder(radius, segment=[list(start), list(end)], sections=sections)
    return mesh


def ring(centre: Array, radius: float, thickness: float) -> Mesh:
    """A ring about the x direction."""
    mesh: Mesh = trimesh.creation.torus(radius, thickness, major_sections=20, minor_sections=6)
    mesh.apply_transform(Z_TO_X)
    mesh.apply_translation(centre)
    return mesh


def join(parts: list[Mesh]) -> Mesh:
    """All parts as one mesh."""
    mesh = trimesh.util.concatenate(parts)
    assert isinstance(mesh, Mesh)
    return mesh


# --- The parts ----------------------------------------------------------------------------------


def shell(radius: float, wall: float, rings: int = 15, sections: int = SECTIONS, rim_x: float = RIM_X) -> Mesh:
    """The printed eyeball: a hollow sphere of this outer radius, open behind x = `rim_x`."""
    inside = radius - wall
    outer = arc(radius, 0, np.rad2deg(np.arccos(rim_x / radius)), rings)
    inner = arc(inside, np.rad2deg(np.arccos(rim_x / inside)), 0, max(rings // 2, 2))
    return revolve(np.vstack([outer, inner]), sections)


def cap(radius: float, half_angle_deg: float, rings: int = 5) -> Mesh:
    """A skin on the front of the eyeball that follows its surface, 1.5 mm thick and so sunk into the wall."""
    top, bottom = arc(radius, 0, half_angle_deg, rings), arc(radius - 0.0015, half_angle_deg, 0, 3)
    return revolve(np.vstack([top, bottom]), 48)


def band(radius: float, inner_deg: float, outer_deg: float) -> Mesh:
    """Such a skin between two half angles."""
    top, bottom = arc(radius, inner_deg, outer_deg, 2), arc(radius - 0.0015, outer_deg, inner_deg, 2)
    return revolve(np.vstack([top, bottom, top[:1]]), 48)


def front(radius: float) -> dict[str, Mesh]:
    """What lies on the front of an eyeball of this radius."""
    return {
        "limbus": band(radius + 0.0005, IRIS_DEG - 0.5, LIMBUS_DEG),
        "iris": cap(radius + 0.0006, IRIS_DEG),
        "pupil": cap(radius + 0.0009, PUPIL_DEG, rings=3),
    }


def arm(half_length: float) -> Mesh:
    """An arm in the x-y plane, long in y, pivoting about z: plate, hub, and a pin at either end."""
    tips = np.array([-half_length, half_length])
    outline = hull_of_circles(np.array([[0, tips[0]], [0, 0], [0, tips[1]]]), np.array([0.006, 0.013, 0.006]), 40)
    parts = [plate(outline, 0.004), rod([0, 0, -0.008], [0, 0, 0.008], 0.009, 24)]
    parts += [rod([0, tip, -0.004], [0, tip, 0.004], 0.003, 10) for tip in tips]
    return join(parts)


def support(vias: Array) -> Mesh:
    """Two rings at the via points (2, 3), on a post; from its middle a rod carries the eye's ball joint."""
    upper, lower = vias
    half = np.array([0, 0, 0.0065])
    middle = (upper + lower) / 2
    return join(
        [
            ring(upper, 0.0065, 0.0016),
            ring(lower, 0.0065, 0.0016),
            rod(upper - half, lower + half, 0.0035),
            rod(lower - half, [lower[0], lower[1], PLATE_Z], 0.0035),
            rod(middle, [0, 0, 0], 0.0045),
            trimesh.creation.icosphere(subdivisions=2, radius=0.011),
        ]
    )


def motor_blocks(centres: Array) -> tuple[Mesh, Mesh]:
    """Motor housings at the centres (motors, 3), and the plate with a post under each.

    A motor on the middle plane turns about z and hangs below its arm; the others turn about y and
    stand on the outer side of theirs.
    """
    blocks, posts = [], []
    for x, y, z in centres:
        if y == 0:
            blocks.append(box([x - 0.026, -0.017, z - 0.046], [x + 0.014, 0.017, z - 0.008]))
            posts.append(box([x - 0.016, -0.009, PLATE_Z], [x + 0.004, 0.009, z - 0.046]))
        else:
            side = np.sign(y)
            blocks.append(box([x - 0.018, y + side * 0.008, z - 0.03], [x + 0.018, y + side * 0.046, z + 0.014]))
            posts.append(box([x - 0.012, y + side * 0.017, PLATE_Z], [x + 0.012, y + side * 0.037, z - 0.03]))
    return join(blocks), join(posts)


def base_plate(centres: Array, via_x: float) -> Mesh:
    """The plate under motors and posts, rounded at the corners; it ends behind the eye."""
    back, front, side = centres[:, 0].min() - 0.035, via_x + 0.025, abs(centres[:, 1]).max() + 0.045
    corners = np.array([[x, y] for x in (back + 0.02, front - 0.02) for y in (-side, side)])
    mesh = plate(hull_of_circles(corners, np.full(4, 0.02), 32), 0.008)
    mesh.apply_translation([0, 0, PLATE_Z - 0.004])
    return mesh


def make_meshes(spec: mujoco.MjSpec, wall: float) -> dict[str, Mesh]:
    """File name (without .stl) to mesh, for the eye of this specification."""
    radius = float(spec.site("gaze").pos[0])
    vias = np.array([spec.site(name).pos for name in ("via_upper", "via_lower")])
    centres = np.array([spec.joint(motor.target).parent.pos for motor in spec.actuators])
    blocks, posts = motor_blocks(centres)
    return {
        "sclera": shell(radius, wall),
        **front(radius),
        "stem": rod([0.008, 0, 0], [radius - wall / 2, 0, 0], 0.007, 24),
        "arm_vertical": arm(float(spec.site("arm_motor1_upper").pos[2])).apply_transform(Y_TO_Z),
        "arm_horizontal": arm(float(spec.site("arm_motor2_left").pos[1])),
        "support": support(vias),
        "motors": blocks,
        "base": join([base_plate(centres, vias[0, 0]), posts]),
    }


# --- The parts of the six-motor eye -------------------------------------------------------------


def spindle(radius: float) -> Mesh:
    """A drum about z of this radius, between two dished flanges, on its shaft."""
    face = [[0.0095, 0], [0.0095, 0.005], [0.004, 0.007], [0.003, radius - 0.006], [0.0065, radius - 0.002]]
    half = np.array([*face, [0.0065, radius + 0.0025], [0.005, radius + 0.0025], [0.005, radius]])
    return revolve(np.vstack([half, half[::-1] * [-1, 1]]), 36).apply_transform(Z_TO_X.T)


def bent_rod(points: Array, radius: float) -> Mesh:
    """A rod through these points (points, 3), with a ball at each; straight parts share no corner, so all is closed."""
    parts = [trimesh.creation.icosphere(subdivisions=1, radius=1.05 * radius).apply_translation(p) for p in points]
    for start, end in pairwise(points):
        gap = 0.2 * radius * (end - start) / np.linalg.norm(end - start)
        parts.append(rod(start + gap, end - gap, radius, 16))
    return join(parts)


def six_motor_blocks(eyelets: Array, spindles: Array) -> Mesh:
    """Motor housings on the axes of the spindles, (motors, 3) both: behind the eye in a whirl, else on the left."""
    blocks = []
    for eyelet, centre in zip(eyelets, spindles, strict=True):
        across = np.cross((centre - eyelet) * [0, 1, 1], [1, 0, 0])
        axis, deep = np.rint(across / np.linalg.norm(across)), [2, 1, 1]
        if eyelet[0] > 0:
            axis, deep = abs(axis), [1, 1, 1]
        half = 0.015 * (1 - abs(axis))
        blocks.append(box(centre + 0.009 * axis + half, centre + 0.039 * axis - half * deep))
    return join(blocks)


def standing_plate(low: Iterable[float], high: Iterable[float], top: float) -> Mesh:
    """A plate on the six-motor eye's base, rounded above, between its lowest and highest (x, y), facing forward."""
    (back, right), (front, left) = low, high
    corners = np.array([[y, z] for y in (right + 0.008, left - 0.008) for z in (LEVEL_Z + 0.003, top - 0.008)])
    mesh = plate(hull_of_circles(corners, np.full(4, 0.008), 32), front - back).apply_transform(Z_TO_X)
    return mesh.apply_translation([(back + front) / 2, 0, 0])


def frame(eyelets: Array, spindles: Array) -> Mesh:
    """What carries eyelets and spindles, (motors, 3) both, and the eye.

    The plate with the eyelets of the recti stands on the base. From it two beams, on the left of the spindles, reach
    forward above and below the eye, to the eyelets of the obliques. A bent post holds the ball joint.
    """
    oblique = eyelets[:, 0] > 0
    x, y, _ = eyelets[~oblique].mean(axis=0)
    beam_y, top = spindles[oblique, 1].max() + 0.0125, spindles[:, 2].max()
    parts = [standing_plate([x - 0.006, y - 0.024], [x - 0.001, y + 0.024], top + 0.008)]
    for (tip_x, tip_y, tip_z), (_, _, z) in zip(eyelets[oblique], spindles[oblique], strict=True):
        parts.append(box([x - 0.003, beam_y - 0.003, z - 0.006], [tip_x + 0.006, beam_y + 0.003, z + 0.006]))
        ring_z = tip_z + np.sign(z) * 0.0035
        parts.append(bent_rod(np.array([[tip_x, beam_y, z], [tip_x, tip_y, z], [tip_x, tip_y, ring_z]]), 0.003))
    knee = 0.072 * np.array([-1, 0, -np.tan(np.deg2rad(20))])
    parts.append(bent_rod(np.array([[0, 0, 0], knee, [knee[0], 0, LEVEL_Z]]), 0.0035))
    parts.append(trimesh.creation.icosphere(subdivisions=2, radius=0.007))
    return join(parts)


def six_motor_base(spindles: Array) -> Mesh:
    """The plate under all, and the one behind the spindles (motors, 3) that carries the motors of the recti."""
    behind = spindles[spindles[:, 0] < spindles[:, 0].mean()]
    (x, right, _), (_, left, top) = behind.min(axis=0) - 0.015, behind.max(axis=0) + 0.015
    corners = np.array([[x, y] for x in (x - 0.015, -0.02) for y in (right, left)])
    floor = plate(hull_of_circles(corners, np.full(4, 0.015), 32), 0.006).apply_translation([0, 0, LEVEL_Z - 0.003])
    return join([floor, standing_plate([x - 0.021, right], [x - 0.015, left], top)])


def make_six_motor_meshes(spec: mujoco.MjSpec) -> dict[str, Mesh]:
    """File name (without .stl) to mesh, for the six-motor eye: tendon NAME runs from head_NAME to eye_NAME."""
    names = [motor.name for motor in spec.actuators]
    eyelets, spindles = (
        np.array([part.pos for part in parts])
        for parts in ([spec.site(f"head_{n}") for n in names], [spec.geom(f"spindle_{n}") for n in names])
    )
    radius = float(np.mean([np.linalg.norm(spec.site(f"eye_{n}").pos) for n in names]))
    thickness, motor = radius / 20, spec.actuators[0]
    touches = np.column_stack([spindles[:, 0], eyelets[:, 1:]])
    parts = {
        "sclera": shell(radius, thickness, sections=48, rim_x=-radius * np.cos(np.deg2rad(OPENING_DEG))),
        **front(radius),
        "stem": rod([0.005, 0, 0], [radius - thickness / 2, 0, 0], 0.004),
        "spindle": spindle(motor.gainprm[0] / motor.biasprm[1]),
        "eyelets": join([ring(eyelet, 0.003, 0.0012) for eyelet in eyelets]),
        "leads": join([rod(a, b, 0.0006, 8) for a, b in zip(eyelets, touches, strict=True)]),
        "motors": six_motor_blocks(eyelets, spindles),
        "frame": frame(eyelets, spindles),
        "base": six_motor_base(spindles),
    }
    return {f"eye6_{name}": mesh for name, mesh in parts.items()}


# --- The scales ---------------------------------------------------------------------------------


@dataclass(frozen=True)
class Weighing:
    """Mass [kg], centre of mass [m] (3,), inertia about the centre of rotation [kg m^2] (3,): x, y, z."""

    mass: float
    centre_of_mass: Array
    inertia: Array


def weigh_shell(radius: float, wall: float, density: float) -> Weighing:
    """What the shell weighs at this density [kg/m^3]: the cut ball less the cut ball inside it."""
    mass, moment, about_x, about_y = density * (_cut_ball(radius) - _cut_ball(radius - wall))
    return Weighing(mass, np.array([moment / mass, 0, 0]), np.array([about_x, about_y, about_y]))


def _cut_ball(radius: float) -> Array:
    """Volume, its first moment in x, and its second moments about x and about y, of a ball before `RIM_X`.

    Integrals over discs of radius^2 = `square`; the quadrature is exact for these polynomials.
    """
    x, weight = np.polynomial.legendre.leggauss(4)
    x, weight = RIM_X + (radius - RIM_X) * (x + 1) / 2, weight * (radius - RIM_X) / 2
    square = radius**2 - x**2
    disc = np.pi * square
    return np.array([weight @ f for f in (disc, disc * x, disc * square / 2, disc * (square / 4 + x**2))])


def published(spec: mujoco.MjSpec) -> Weighing:
    """The numbers of a preset."""
    eye = spec.body("eye")
    inertia = eye.inertia if np.isnan(eye.fullinertia[0]) else eye.fullinertia[:3]
    return Weighing(float(eye.mass), spec.site("centre_of_mass").pos.copy(), inertia.copy())


def report(printed: Weighing, presets: dict[str, Weighing], wall: float, density: float) -> str:
    """The comparison as text."""
    thesis = next(iter(presets.values()))
    share = thesis.mass / printed.mass
    rows = {
        f"printed, {1e3 * wall:g} mm wall": printed,
        "same shape, published mass": Weighing(thesis.mass, printed.centre_of_mass, share * printed.inertia),
        **{f"preset {name}": numbers for name, numbers in presets.items()},
    }
    head = f"{'':28}{'mass [kg]':>10}{'centre x [m]':>14}   inertia about the centre of rotation [kg m^2]: x, y, z"
    lines = [f"Eyeball printed at {density:g} kg/m^3:", head]
    for name, r in rows.items():
        lines.append(
            f"{name:28}{r.mass:10.3f}{r.centre_of_mass[0]:14.4f}   " + "  ".join(f"{value:.3e}" for value in r.inertia)
        )
    lines.append("")
    least = thesis.mass * float(thesis.centre_of_mass @ thesis.centre_of_mass)
    for name, numbers in presets.items():
        ratio = float(np.mean(rows["same shape, published mass"].inertia / numbers.inertia))
        verdict = "no rigid body has these numbers" if numbers.inertia[1] < least else "possible for a rigid body"
        lines.append(f"{name}: a shell of the published mass has {ratio:.1f} times this inertia; {verdict}.")
    lines.append(
        f"({thesis.mass:g} kg centred {np.linalg.norm(thesis.centre_of_mass):g} m from the centre of rotation have at "
        f"least {least:.2e} kg m^2 about y and z, however they are spread.)"
    )
    return "\n".join(lines)


def main(options: Options) -> None:
    """Write the meshes and print the comparison."""
    spec = load_spec("thesis")
    radius = float(spec.site("gaze").pos[0])
    if not 0.0005 <= options.wall <= radius / 2 or not options.density > 0:
        sys.exit(f"the wall must be between 0.0005 and {radius / 2:.4f} m and the density positive")
    folder = options.out or data_folder("eye_mjcf") / "meshes"
    meshes = make_meshes(spec, options.wall)
    meshes |= make_six_motor_meshes(load_spec(str(data_folder("eye_mjcf") / "eye6.xml")))
    for name, mesh in meshes.items():
        write_atomically(folder / f"{name}.stl", mesh.export)
    size = sum(path.stat().st_size for path in folder.glob("*.stl"))
    print(f"{len(meshes)} meshes in {folder}, {size / 1e3:.0f} kB\n")

    printed = weigh_shell(radius, options.wall, options.density)
    presets = [name for name in EYES if EYES[name].file == EYES["thesis"].file]
    print(report(printed, {name: published(load_spec(name)) for name in presets}, options.wall, options.density))


if __name__ == "__main__":
    main(tyro.cli(Options, description=__doc__))
