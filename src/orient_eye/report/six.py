"""The group's six-motor eye, a motor for each muscle: how muscles share the work, and its main sequence."""

from collections.abc import Callable
from functools import partial

import numpy as np

from orient_eye.errors import InputError
from orient_eye.eyes.muscles import Muscles
from orient_eye.figures.gaze.beside_group import axial_main_sequences
from orient_eye.learning.figures.gaze import main_sequence_saccades
from orient_eye.learning.sequences import imposed
from orient_eye.listing import fit_plane
from orient_eye.movement.antagonists import antagonist_correlation
from orient_eye.plants.cables import muscles_of
from orient_eye.report.evidence import Evidence, Judged
from orient_eye.report.exhibit import Drawn, Exhibit

_CHAPTER = "Six motors"
_SLACK_N = 1e-9


def _tensions(judged: Judged) -> str:
    tension = judged.random.trajectory.tension
    assert tension is not None
    slack = (tension <= _SLACK_N).any(axis=(1, 2)).mean()
    return (
        f"Over {len(tension)} random saccades tensions go from {np.nanmin(tension):.1f} to {np.nanmax(tension):.1f} N; "
        f"in {slack:.0%} of them a cable hangs slack for a moment."
    )


def _antagonists(judged: Judged) -> str:
    muscles, made = _muscles(judged), judged.random
    each = zip(muscles.pairs, antagonist_correlation(made.trajectory, made.of_gaze, muscles.pairs), strict=True)
    told = ", ".join(f"{' and '.join(muscles.names[i] for i in pair)} {r:.3f}" for pair, r in each)
    return f"Over {len(made.target)} random saccades the changes of antagonists' motors correlate by: {told}."


def _main_sequence(judged: Judged) -> str:
    made = main_sequence_saccades(judged.task, judged.policy)
    told = [
        f"{name} V0 = {fit.V0:.0f} deg/s, c = {fit.c:.1f} deg, duration {fit.D0_ms:.0f} ms + {fit.d_ms:.1f} ms/deg"
        for name, (fit, _) in axial_main_sequences(made.trajectory, made.of_gaze).items()
        if fit is not None
    ]
    return f"Of this eye: {'; '.join(told)}."


def _listing(judged: Judged) -> str:
    wanted = fit_plane(judged.pairs.target)
    sd = judged.gaze_numbers["listing_sd_deg"]
    scatter = "" if sd is None else f"Ends scatter by {sd:.2f} deg about a plane, those that the statics want "
    return f"{scatter}{'' if sd is None else f'by {wanted.sd_deg:.2f} deg. '}{imposed(judged.task)}"


def _muscles(judged: Judged) -> Muscles:
    muscles = muscles_of(judged.task.plant)
    if muscles is None:
        raise InputError(f"the eye of policy {judged.name} has no antagonists with a motor each; give one of eye six")
    return muscles


def _draw(picture: str, says: Callable[[Judged], str], evidence: Evidence) -> Drawn:
    judged = evidence.policy("tavares", "smooth", "gaze", eye="six")
    _muscles(judged)
    figure = judged.gaze_pictures[picture]
    if figure.get_suptitle() == "":
        figure.suptitle(judged.title)
    return Drawn(figure, says(judged))


EXHIBITS = {
    f"six-{name}": Exhibit(_CHAPTER, f"{title}: six-motor eye, case smooth", caption, partial(_draw, picture, says))
    for name, picture, says, title, caption in (
        (
            "tensions",
            "motors",
            _tensions,
            "Motors and muscles' tensions",
            "A motor for each of the six muscles of a right eye: inferior, medial, superior, lateral rectus, inferior "
            "and superior oblique. Two antagonists have one colour. Cables pull and cannot push, so that all of them "
            "are under tension while the eye rests.",
        ),
        (
            "antagonists",
            "muscles",
            _antagonists,
            "Agonist and antagonist, and their co-contraction",
            "The agonist winds up its cable while the antagonist lets go, as in people (Sherrington's law). In part "
            "that is built in: motors go where the statics hold the target, and a generator takes all of them there in "
            "time with each other. The co-contraction at rest is that of the statics too, no policy learns it.",
        ),
        (
            "main-sequence",
            "main_sequence_beside_group",
            _main_sequence,
            "Main sequence beside the group's and people's",
            "The group's numbers are from its published six-motor programs and papers, which plan each saccade by "
            "optimal control; the shade is what lies between them. Durations are not measured alike: ours last until "
            "the gaze stays within the settling band, people's until the eye is slow. The error at rest is 0 by "
            "construction: where the motors go is told by the statics.",
        ),
        (
            "listing",
            "listing_plane",
            _listing,
            "Listing's plane at the ends, which is imposed",
            "Ends of saccades and samples on the way, as rotation vectors. Where the motors go is that of the statics, "
            "the least change of the motors from their pretension, so that Listing's law at rest is imposed and "
            "nothing of it emerges; the ends lie upon the targets. On the way torsion is free.",
        ),
    )
}
