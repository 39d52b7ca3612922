"""What saccades in all directions come to in numbers: the gaze, its two components, and torsion.

    gaze_numbers(made)["gaze_error_mean_deg"]        # of `orient_eye.learning.figures.saccades.Saccades`

Measures are those of `orient_eye.movement.oblique` and `orient_eye.listing`; None where there is nothing to tell.
"""

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from orient_eye import rotations
from orient_eye.learning.figures.saccades import Saccades
from orient_eye.learning.policy import Policy
from orient_eye.listing import fit_plane
from orient_eye.movement.oblique import (
    component_correlation,
    component_durations,
    path_deviation,
    torsion_blip,
)
from orient_eye.task.saccade import SaccadeTask

Array = NDArray[np.float64]
PLANE_OF = 5
"""Ends through which a twisted plane is fitted, at least: it has four numbers."""
_P95 = partial(np.quantile, q=0.95)


def gaze_numbers(made: Saccades) -> dict[str, float | None]:
    """Of a batch of saccades.

    Returns:
        gaze_error_..._deg: angle between wanted and reached gaze at rest, and at the settling time.
        path_deviation_...: distance from the straight path, share of the amplitude.
        component_correlation_...: of saccades whose smaller component is at least 30 % of the larger.
        listing_...: the plane through the orientations at rest, its thickness and twist.
        torsion_blip_..._deg: torsion beside the way from start to end, also what was drawn for the start and goes away.
    """
    trajectory, measures, wanted = made.trajectory, made.of_gaze, rotations.gaze(made.target)
    at_rest, settled = (
        rotations.angle_between_directions(wanted, rotations.gaze(q)) for q in (measures.final, measures.at_settling)
    )
    told: tuple[tuple[str, Array, Callable[[Array], Any]], ...] = (
        ("gaze_error_mean_deg", at_rest, np.mean),
        ("gaze_error_max_deg", at_rest, np.max),
        ("gaze_error_at_settling_mean_deg", settled, np.mean),
        ("gaze_error_at_settling_max_deg", settled, np.max),
        ("path_deviation_median", path_deviation(trajectory, measures), np.median),
        ("path_deviation_p95", path_deviation(trajectory, measures), _P95),
        ("component_correlation_median", component_correlation(trajectory, measures), np.median),
        ("component_correlation_least", component_correlation(trajectory, measures), np.min),
        ("torsion_blip_median_deg", torsion_blip(trajectory, measures), np.median),
        ("torsion_blip_max_deg", torsion_blip(trajectory, measures), np.max),
    )
    return {name: _known(values, what) for name, values, what in told} | _plane(measures.final)


def _plane(ends: Array) -> dict[str, float | None]:
    keys = ("sd_deg", "tilt_left_deg", "tilt_down_deg", "twist")
    values: tuple[float | None, ...] = (None,) * len(keys)
    if np.isfinite(ends).all(axis=1).sum() >= PLANE_OF:
        plane = fit_plane(ends)
        values = (plane.sd_deg, *plane.tilt_deg, plane.twist)
    return {f"listing_{key}": value for key, value in zip(keys, values, strict=True)}


def stretching(task: SaccadeTask, policy: Policy, made: Saccades) -> dict[str, float | None]:
    """How many times longer the components of oblique saccades last than the same policy's saccades along them alone.

    Only components at least 30 % of the other, whose saccade alone ends inside the range of the targets.

    Args:
        task: on which the policy acts.
        policy: whose saccades they are.
        made: its saccades.
    """
    took, found = component_durations(made.trajectory, made.of_gaze, task.band), {}
    oblique = np.isfinite(took).all(axis=1)
    for k, (name, alone) in enumerate(
        zip(("horizontal", "vertical"), made.components_alone(task, policy), strict=True)
    ):
        gaze = rotations.gaze(alone.target)
        inside = rotations.angle_between_directions(gaze, [1.0, 0.0, 0.0]) <= task.targets.limit_deg
        took_alone, told = component_durations(alone.trajectory, alone.of_gaze, task.band), oblique & inside
        found[f"stretching_{name}_median"] = _known(took[told, k] / took_alone[told, k], np.median)
    return found


def _known(values: Array, what: Callable[[Array], Any]) -> float | None:
    """Of those values that are numbers; None where none is."""
    finite = values[np.isfinite(values)]
    return float(what(finite)) if finite.size else None
