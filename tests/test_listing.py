"""Torsion and Listing's plane, against scipy's rotations and the closed forms of two gimbals."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from orient_eye.listing import directions, ficks_torsion, fit_plane, rotation_vectors, torsion, with_torsion
from orient_eye.rotations import from_euler, gaze

Array = NDArray[np.float64]
AHEAD = np.array([1.0, 0.0, 0.0])
ANGLES = st.floats(-60, 60)
GRID = np.stack([g.ravel() for g in np.meshgrid(np.linspace(-30, 30, 7), np.linspace(-30, 30, 7))], axis=1)


def quaternion(turn: Rotation) -> Array:
    return np.asarray(turn.as_quat(scalar_first=True))


@given(st.tuples(ANGLES, ANGLES, ANGLES), st.floats(0.01, 170))
def test_a_rotation_vector_is_the_axis_times_the_tangent_of_half_the_angle(way: tuple[float, ...], turn: float) -> None:
    axis = np.add(way, [0, 0, 1e-3])
    axis /= np.linalg.norm(axis)
    found = rotation_vectors(quaternion(Rotation.from_rotvec(turn * axis, degrees=True)))
    np.testing.assert_allclose(found, np.tan(np.deg2rad(turn) / 2) * axis, rtol=1e-9, atol=1e-12)


def test_directions_by_hand() -> None:
    np.testing.assert_allclose(directions([0, 90, 0], [0, 0, 90]), [[1, 0, 0], [0, 1, 0], [0, 0, -1]], atol=1e-15)
    yaw, pitch = np.deg2rad([25.0, -10.0])
    by_hand = [np.cos(pitch) * np.cos(yaw), np.cos(pitch) * np.sin(yaw), -np.sin(pitch)]
    np.testing.assert_allclose(directions(25, -10), by_hand, atol=1e-15)


@given(ANGLES, ANGLES, st.floats(-40, 40))
def test_an_orientation_with_torsion_is_listings_rolled_about_its_line_of_sight(y: float, p: float, t: float) -> None:
    direction = directions(y, p)
    found = with_torsion(direction, t)
    np.testing.assert_allclose(gaze(found), direction, atol=1e-12)
    assert torsion(found) == pytest.approx(t, abs=1e-9)
    assert torsion(-found) == pytest.approx(t, abs=1e-9)
    # One turn about the axis square to straight ahead and to the direction (Listing), then a roll about the direction.
    axis = np.cross(AHEAD, direction)
    turn = np.arctan2(np.linalg.norm(axis), direction[0])
    listings = Rotation.from_rotvec(turn * axis / max(np.linalg.norm(axis), 1e-300))
    rolled = Rotation.from_rotvec(t * direction, degrees=True) * listings
    assert abs(np.dot(quaternion(rolled), found)) == pytest.approx(1, abs=1e-12)


@given(ANGLES, ANGLES)
def test_ficks_torsion_in_closed_form(yaw: float, pitch: float) -> None:
    tangents = np.tan(np.deg2rad([yaw, pitch]) / 2)
    by_hand = np.rad2deg(2 * np.arctan(-tangents[0] * tangents[1]))
    assert ficks_torsion(directions(yaw, pitch)) == pytest.approx(by_hand, abs=1e-9)


def test_many_at_once() -> None:
    direction = directions(*GRID.T).reshape(7, 7, 3)
    assert torsion(with_torsion(direction, np.full((7, 7), 3.0))) == pytest.approx(np.full((7, 7), 3.0))
    assert with_torsion(direction, 0.0).shape == (7, 7, 4)
    assert rotation_vectors(with_torsion(direction, 0.0))[..., 0] == pytest.approx(np.zeros((7, 7)), abs=1e-15)


# --- the plane --------------------------------------------------------------------------------------------


def test_listings_law_is_a_flat_plane() -> None:
    plane = fit_plane(with_torsion(directions(*GRID.T), 0.0))
    numbers = [plane.offset, plane.by_y, plane.by_z, plane.sd_deg, plane.twist, plane.twisted_sd_deg, *plane.tilt_deg]
    assert numbers == pytest.approx([0] * 8, abs=1e-12)


@pytest.mark.parametrize(("first", "twist"), [("yaw", -1.0), ("pitch", 1.0)], ids=["Fick", "Helmholtz"])
def test_gimbals_twist_it_by_one(first: str, twist: float) -> None:
    yaw, pitch = (
        Rotation.from_rotvec(np.outer(angle, axis), degrees=True)
        for axis, angle in zip(np.eye(3)[[2, 1]], GRID.T, strict=True)
    )
    plane = fit_plane(quaternion(yaw * pitch if first == "yaw" else pitch * yaw))
    assert plane.twist == pytest.approx(twist, abs=1e-12)
    assert plane.twisted_sd_deg == pytest.approx(0, abs=1e-10)
    assert plane.sd_deg > 1


def test_a_turned_plane_is_told_by_its_normal() -> None:
    """Rotation vectors of Listing's plane, turned: the normal then points along what the turn makes of ahead."""
    points = rotation_vectors(with_torsion(directions(*GRID.T), 0.0))
    for yaw, pitch in ((6.0, 0.0), (0.0, -4.0), (5.0, 3.0)):
        r = Rotation.from_quat(from_euler(yaw, pitch, 0.0), scalar_first=True).apply(points)
        q = np.concatenate([np.ones((len(r), 1)), r], axis=1)
        plane = fit_plane(q / np.linalg.norm(q, axis=1, keepdims=True))
        assert plane.sd_deg == pytest.approx(0, abs=1e-9)
        normal = directions(yaw, pitch)
        assert plane.by_y == pytest.approx(-normal[1] / normal[0])
        assert plane.by_z == pytest.approx(-normal[2] / normal[0])
        assert plane.tilt_deg[0] == pytest.approx(yaw)
        assert plane.tilt_deg[1] == pytest.approx(pitch, rel=0.005)  # of the slope straight ahead


def test_its_thickness_is_the_spread_of_torsion() -> None:
    """Half of the eyes at each direction rolled one way, half the other: nothing for the plane to follow."""
    direction = np.concatenate([directions(*GRID.T)] * 2)
    torsions = np.repeat([1.5, -1.5], len(GRID))
    orientation = with_torsion(direction, torsions)
    assert fit_plane(orientation).sd_deg == pytest.approx(1.5, rel=1e-3)
    broken = np.concatenate([orientation, np.full((3, 4), np.nan)])
    assert fit_plane(broken) == fit_plane(orientation)
