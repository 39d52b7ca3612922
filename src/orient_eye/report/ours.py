"""What the thesis did not have: the same on the MuJoCo eye, and saccades in all directions with three motors."""

from collections.abc import Callable
from functools import partial

import numpy as np

from orient_eye.report import chapter5
from orient_eye.report.evidence import Evidence, Judged
from orient_eye.report.exhibit import Drawn, Exhibit

_MUJOCO, _GAZE = "The MuJoCo eye, one motor", "Three motors, all directions"
_OF_GAZE = {
    "gaze_paths": (
        "Paths of the gaze",
        "Saccades from straight ahead in eight directions, and between their ends. People's oblique saccades are "
        "nearly straight too, with curvatures of a few per cent.",
    ),
    "components": (
        "Velocities of the horizontal and the vertical component of oblique saccades",
        "Solid lines, horizontal and vertical, rise and fall together: the smaller component is stretched to the "
        "duration of the larger one, as in people. Dashed: a saccade along that component alone.",
    ),
    "main_sequence": (
        "Main sequence of the gaze by direction, beside people",
        "Vertical saccades are much slower than horizontal ones here; those of people hardly (Hopf et al. 2018).",
    ),
    "listing_plane": (
        "Listing's plane",
        "Ends of saccades and samples on the way, as rotation vectors. People's scatter by about 1 deg about a "
        "plane; here the least force of the elastics imposes one.",
    ),
    "torsion": (
        "Torsion on the way",
        "How far torsion leaves the straight way between its values at start and end: a blip of a fraction of a "
        "degree.",
    ),
    "motors": ("Commands of the three motors", "Each motor gets a pulse-step of its own."),
    "reward_gap": ("Reward gap by size and direction", "How far each saccade is from the best a search finds."),
}


def _of_mujoco(kind: Callable[[Judged], Drawn], evidence: Evidence) -> Drawn:
    return kind(evidence.policy("mujoco", "1", "horizontal"))


def _of_gaze(name: str, evidence: Evidence) -> Drawn:
    judged = evidence.policy("tavares", "1", "gaze")
    numbers, measures, gap = judged.gaze_numbers, judged.measures, 100 * judged.gap
    says = {
        "main_sequence": f"Horizontal saccades of {measures.amplitude_deg.max():.0f} deg reach "
        f"{measures.peak_velocity_deg_s.max():.0f} deg/s.",
        "motors": f"Gaze at rest is off by {numbers['gaze_error_mean_deg']:.2f} deg in the mean.",
        "gaze_paths": f"Paths deviate from straight by {100 * numbers['path_deviation_median']:.1f} % in the median.",
        "components": f"The components correlate by {numbers['component_correlation_median']:.3f} in the median.",
        "listing_plane": f"Ends scatter by {numbers['listing_sd_deg']:.2f} deg about a plane.",
        "torsion": f"Blips are {numbers['torsion_blip_median_deg']:.2f} deg in the median.",
        "reward_gap": f"The mean gap is {gap.mean():.1f} %, the 95th percentile {np.quantile(gap, 0.95):.1f} %.",
    }
    figure = judged.gaze_pictures[name]
    if figure.get_suptitle() == "":
        figure.suptitle(judged.title)
    return Drawn(figure, says[name])


EXHIBITS = {
    **{
        f"mujoco-{name}": Exhibit(
            _MUJOCO,
            f"{chapter5.CAPTIONS[kind][0]}: MuJoCo eye, case 1",
            chapter5.CAPTIONS[kind][1] + more,
            partial(_of_mujoco, kind),
        )
        for name, kind, more in (
            (
                "output",
                chapter5.output,
                " On this eye the best k0 of saccades around straight ahead falls with size, as the thesis expected "
                "and did not show; it also depends on where a saccade begins.",
            ),
            ("signals", chapter5.signals, ""),
            ("step", chapter5.against_step, ""),
            ("main-sequence", chapter5.main_sequence, ""),
        )
    },
    **{
        f"gaze-{name.removeprefix('gaze_').replace('_', '-')}": Exhibit(
            _GAZE, f"{title}: tavares, case 1", caption, partial(_of_gaze, name)
        )
        for name, (title, caption) in _OF_GAZE.items()
    },
}
