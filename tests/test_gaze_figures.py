"""Pictures of saccades in all directions: what they show of saccades whose numbers are known."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from orient_eye import figures
from orient_eye.figures import gaze as pictures
from orient_eye.figures.trajectory import draw_trajectory
from orient_eye.listing import directions, ficks_torsion, with_torsion
from orient_eye.motor import Motor
from orient_eye.movement.antagonists import antagonist_correlation
from orient_eye.movement.main_sequence import fit_peak_velocity
from orient_eye.movement.measures import Measures, measure
from orient_eye.movement.trajectory import Trajectory

Array = NDArray[np.float64]
TIME = 0.001 * np.arange(301)
TENDONS = tuple(f"elastic{k}" for k in range(6))
TOWARD = np.array([[20.0, 0], [0, 20], [15, 10], [-10, -12], [12, -9]])  # left, up [deg]
EASE = (TIME / 0.1).clip(0, 1) ** 3 * (10 - 15 * (TIME / 0.1).clip(0, 1) + 6 * (TIME / 0.1).clip(0, 1) ** 2)


def looking(shift: Array) -> Array:
    """Directions (..., 3) so far to the left and up of straight ahead [deg], written out."""
    away = np.deg2rad(np.linalg.norm(shift, axis=-1))[..., None]
    return np.concatenate([np.cos(away), np.sinc(away / np.pi) * np.deg2rad(shift)], axis=-1)


def saccades(toward: Array = TOWARD, torsion_deg: float = 0.0) -> Trajectory:
    """Straight ones from straight ahead; with a blip of torsion."""
    blip = torsion_deg * np.sin(np.pi * (TIME / 0.06).clip(0, 1)) ** 2
    orientation = with_torsion(looking(EASE[:, None] * toward[:, None]), blip)
    rate = np.gradient(EASE, TIME)
    axis = np.stack([np.zeros(len(toward)), -toward[:, 1], toward[:, 0]], axis=-1)
    motor = EASE[:, None] * np.linspace(-5, 5, 3 * len(toward)).reshape(-1, 1, 3)
    tension = 1 + 0.1 * EASE[:, None] * np.arange(6.0) * np.ones((len(toward), 1, 1))
    return Trajectory(
        TIME, orientation, rate[:, None] * axis[:, None], motor, motor, tension, np.zeros(len(toward), bool),
        tuple(Motor(f"motor{k}") for k in (1, 2, 3)), TENDONS,
    )  # fmt: skip


def made(toward: Array = TOWARD, torsion_deg: float = 0.0) -> tuple[Trajectory, Measures]:
    trajectory = saccades(toward, torsion_deg)
    return trajectory, measure(trajectory, of="gaze")


def curves(axes: Axes) -> dict[str, Array]:
    return {str(line.get_label()): line.get_xydata() for line in axes.lines}


def words(figure: Figure) -> str:
    """All that is written in a figure."""
    texts = [figure.get_suptitle(), *(axes.get_title() for axes in figure.axes)]
    legends = [legend for holder in (figure, *figure.axes) for legend in _legends(holder)]
    return "\n".join(texts + [text.get_text() for legend in legends for text in legend.get_texts()])


def _legends(holder: Figure | Axes) -> list:
    return list(holder.legends) if isinstance(holder, Figure) else [x for x in [holder.get_legend()] if x]


def test_paths_are_drawn_as_the_eye_sees_them() -> None:
    trajectory, measures = made()
    figure = pictures.gaze_paths(trajectory, measures, with_torsion(looking(TOWARD), 0.0))
    (axes,) = figure.axes
    left, right = axes.get_xlim()
    assert left > right  # left on the left
    assert axes.get_aspect() == 1
    np.testing.assert_array_equal(np.diff(axes.get_xticks()), np.diff(axes.get_yticks()))
    np.testing.assert_allclose(curves(axes)["target"], TOWARD, atol=1e-9)
    np.testing.assert_allclose(curves(axes)["end"], TOWARD, atol=1e-9)
    np.testing.assert_allclose(curves(axes)["start"], 0, atol=1e-9)
    assert [circle.radius for circle in axes.patches] == [10, 20]
    assert "median 0.0 %, largest 0.0 %" in words(figure)


def test_great_circles_go_from_start_to_end() -> None:
    """Beside straight ahead they bend outwards: between 20 left and 20 up to 14.4 deg (trigonometry), not 14.1."""
    start, end = looking(np.array([[20.0, 0]])), looking(np.array([[0, 20.0]]))
    share = EASE[:, None]
    way = (1 - share) * start + share * end
    orientation = with_torsion(way / np.linalg.norm(way, axis=-1, keepdims=True), 0.0)
    trajectory = replace(saccades(TOWARD[:1]), orientation=orientation[None])
    (axes,) = pictures.gaze_paths(trajectory, measure(trajectory, of="gaze")).axes
    straight = axes.lines[0].get_xydata()
    np.testing.assert_allclose(straight[[0, -1]], [[20, 0], [0, 20]], atol=1e-9)
    middle = np.rad2deg(np.arctan(np.tan(np.deg2rad(20)) / np.sqrt(2)))
    np.testing.assert_allclose(np.linalg.norm(straight[16]), middle, rtol=1e-9)


def test_components_tell_how_they_go_together() -> None:
    trajectory, measures = made(TOWARD[2:])
    alone = [made(TOWARD[2:] * part) for part in (np.array([1, 0]), np.array([0, 1]))]
    figure = pictures.component_velocities(trajectory, measures, alone)
    assert len(figure.axes) == 6
    told = words(figure)
    assert "15.0 left, 10.0 up" in told
    assert "10.0 right, 12.0 down" in told
    assert told.count("correlation 1.000") == 3
    assert told.count("alone, ") == 6
    shares = [line.get_ydata() for line in figure.axes[3].lines if len(line.get_ydata()) == len(TIME)]
    for share in shares:  # all lie one upon the other
        np.testing.assert_allclose(share, np.gradient(EASE, TIME), atol=2e-3)


@settings(deadline=None, max_examples=40, derandomize=True)
@given(V0=st.floats(100, 900), c=st.floats(3, 40), noise=st.floats(0, 1e-3))
def test_saturation_is_found_again(V0: float, c: float, noise: float) -> None:
    amplitude = np.linspace(1, 60, 30)
    peak = V0 * (1 - np.exp(-amplitude / c)) * (1 + noise * np.cos(9 * amplitude))
    np.testing.assert_allclose(fit_peak_velocity(amplitude, peak), (V0, c), rtol=1e-6 + 20 * noise)


def test_main_sequence_by_direction_beside_people() -> None:
    size = np.array([4.0, 8, 16, 30])
    angle = np.deg2rad([0, 90, 45])
    toward = np.concatenate([size[:, None] * [np.cos(a), np.sin(a)] for a in angle])
    trajectory, measures = made(toward)
    peak = 400 * (1 - np.exp(-measures.amplitude_deg / 10))
    measures = replace(measures, peak_velocity_deg_s=peak, settling_time_s=0.02 + 0.003 * measures.amplitude_deg)
    figure = pictures.main_sequence(trajectory, measures)
    told = words(figure)
    for name in ("horizontal", "vertical", "oblique"):
        assert f"{name}: $V_0$ = 400 deg/s, c = 10.0 deg" in told
        assert f"{name}: 20 ms + 3.0 ms/deg" in told
    assert "people: Andersson et al. 2017" in told
    assert "people, vertical: Hopf et al. 2018" in told
    proportional = replace(measures, peak_velocity_deg_s=12 * measures.amplitude_deg)
    assert "12.0 deg/s a deg, no saturation" in words(pictures.main_sequence(trajectory, proportional))


def test_listings_plane_tells_its_twist() -> None:
    """Fick's gimbal has a twist of -1, and Listing's law none."""
    yaw, pitch = (grid.ravel() for grid in np.meshgrid(np.linspace(-25, 25, 7), np.linspace(-25, 25, 7)))
    look = directions(yaw, pitch)
    flat, fick = with_torsion(look, 0.0), with_torsion(look, ficks_torsion(look))
    figure = pictures.listing_plane(fick, during=fick, compared={"Listing": flat})
    assert "twist -1.00" in words(figure)
    assert "sd on the way" in words(figure)
    assert "sd 0.00 deg" in words(pictures.listing_plane(flat))
    side = curves(figure.axes[0])
    np.testing.assert_allclose(side["Listing"][:, 0], 0, atol=1e-9)
    np.testing.assert_allclose(side["ends"][:, 0], ficks_torsion(look), atol=1e-9)


def test_torsion_over_time_tells_the_blips() -> None:
    figure = pictures.torsion_over_time(*made(torsion_deg=1.5))
    assert "blips: median 1.50, largest 1.50 deg" in words(figure)
    torsion = [line.get_ydata() for line in figure.axes[0].lines if len(line.get_ydata()) == len(TIME)]
    assert len(torsion) == len(TOWARD)
    np.testing.assert_allclose([np.max(one) for one in torsion], 1.5, atol=1e-6)


@pytest.mark.parametrize("tensions", [True, False])
def test_motors_over_time(tensions: bool) -> None:
    trajectory, measures = made()
    trajectory = trajectory if tensions else replace(trajectory, tension=None)
    figure = pictures.motors_over_time(trajectory, measures)
    assert len(figure.axes) == (3 if tensions else 2) * len(trajectory)
    for k in (1, 2, 3):
        np.testing.assert_array_equal(curves(figure.axes[0])[f"motor{k}"][:, 1], trajectory.motor[0, :, k - 1])
    assert ("elastic5" in words(figure)) == tensions


PAIRS = np.array([[0, 2], [1, 3], [4, 5]])


def muscles() -> tuple[Trajectory, Measures]:
    """Six motors that wind up a cable each: in the first saccade motor 1 pulls against 3, in the second 3 against 1."""
    trajectory, measures = made(TOWARD[:3])
    change = EASE[:, None] * np.array([2.0, 1, -2, 1, 0, 0]) * np.array([1.0, -1, 0.5])[:, None, None]
    motor, tension = 60 + 10 * change, 3 + change
    names = tuple(Motor(name, rest=60.0) for name in ("a", "b", "c", "d", "e", "f"))
    return replace(
        trajectory, motor=motor, command=motor, tension=tension, motors=names, tendon_names=tuple("abcdef")
    ), measures


def test_agonist_and_antagonist_and_what_parts_them() -> None:
    trajectory, measures = muscles()
    found = antagonist_correlation(trajectory, measures, PAIRS)
    np.testing.assert_allclose(found[:2], [-1, 1])
    assert np.isnan(found[2])
    figure = pictures.antagonists_over_time(trajectory, measures, PAIRS, [*found[:2], 0.0])
    told = words(figure)
    assert "a/c -1.000, b/d 1.000" in told
    assert "a (dashed c)" in curves(figure.axes[0])
    assert "c (dashed a)" in curves(figure.axes[1])
    mean, half = (line.get_ydata() for line in figure.axes[6].lines[:2])
    np.testing.assert_allclose(mean, 3)
    np.testing.assert_allclose(half, 2 * EASE, atol=1e-12)
    together, apart = (line.get_ydata() for line in figure.axes[6].lines[2:4])
    np.testing.assert_allclose(together, 3 + EASE)
    np.testing.assert_allclose(apart, 0, atol=1e-12)


def test_antagonists_have_one_colour(tmp_path: Path) -> None:
    trajectory, measures = muscles()
    for row in (0, 6):
        lines = pictures.motors_over_time(trajectory, measures, PAIRS).axes[row].lines
        style = {line.get_label(): (line.get_color(), line.get_linestyle()) for line in lines}
        assert list(style) == ["a", "c", "b", "d", "e", "f"]
        assert style["a"][0] == style["c"][0] != style["b"][0]
        assert (style["a"][1], style["c"][1]) == ("-", "--")
    plain, paired = (
        draw_trajectory(trajectory, tmp_path / f"{name}.png", pairs).read_bytes()
        for name, pairs in (("plain", None), ("paired", PAIRS))
    )
    assert plain != paired


def test_the_group_and_people_stand_beside_a_main_sequence() -> None:
    size = np.array([4.0, 8, 16, 30])
    trajectory, measures = made(np.concatenate([size[:, None] * [1, 0], size[:, None] * [0, 1], [[9.0, 9]]]))
    peak = np.where(np.arange(9) < 4, 300, 450) * (1 - np.exp(-measures.amplitude_deg / 10))
    measures = replace(measures, peak_velocity_deg_s=peak, settling_time_s=0.02 + 0.003 * measures.amplitude_deg)
    figure = pictures.main_sequence_beside_group(
        (trajectory, measures), (trajectory, measures), np.full(len(measures.final), 0.25)
    )
    cells = [
        [cell.get_text().get_text() for _, cell in sorted(table.get_celld().items())]
        for axes in figure.axes
        for table in axes.tables
    ]
    fits, ends = ["; ".join(one) for one in cells]
    assert "horizontal; 300; 10.0; 20; 3.0; vertical; 450; 10.0; 20; 3.0" in fits
    assert "288 to 337; 12 to 15; 56 to 58; 3.5" in fits
    assert "people; 505; 5.1; 21; 2.2" in fits
    assert "ours; 0.25; 0.00; 0.0; the group's programs; 1.3 to 1.9; 0.6 to 1.0; 0.9" in ends


def test_a_motor_that_lags_is_drawn_beside_its_command() -> None:
    trajectory, measures = made()
    late = replace(trajectory, command=trajectory.command + np.array([0.0, 1, 0]))
    plain, both = (len(pictures.motors_over_time(one, measures).axes[0].lines) for one in (trajectory, late))
    assert both == plain + 1


def test_a_sequence_on_one_page(tmp_path: Path) -> None:
    trajectory, measures = made()
    figure = pictures.saccade_sequence(trajectory, measures, with_torsion(looking(TOWARD), 0.0))
    left = curves(figure.axes[1])["left"]
    assert len(left) == len(TOWARD) * len(TIME)
    np.testing.assert_allclose(np.diff(left[:, 0]), 0.001)
    assert figures.save(figure, tmp_path / "sequence.png").read_bytes()[1:4] == b"PNG"


def test_a_failed_saccade_spoils_no_picture(tmp_path: Path) -> None:
    trajectory, _ = made()
    arrays = {}
    for name in ("orientation", "angular_velocity", "command", "motor", "tension"):
        arrays[name] = getattr(trajectory, name).copy()
        arrays[name][1] = np.nan
    failed = np.array([False, True, False, False, False])
    trajectory = replace(trajectory, **arrays, failed=failed)
    measures = measure(trajectory, of="gaze")
    target = with_torsion(looking(TOWARD), 0.0)
    drawn = {
        "paths": pictures.gaze_paths(trajectory, measures, target),
        "components": pictures.component_velocities(trajectory, measures),
        "main": pictures.main_sequence(trajectory, measures),
        "listing": pictures.listing_plane(measures.final, during=trajectory.orientation),
        "torsion": pictures.torsion_over_time(trajectory, measures),
        "motors": pictures.motors_over_time(trajectory, measures),
        "sequence": pictures.saccade_sequence(trajectory, measures, target),
    }
    for name, figure in drawn.items():
        assert figures.save(figure, tmp_path / f"{name}.png").stat().st_size > 5000
