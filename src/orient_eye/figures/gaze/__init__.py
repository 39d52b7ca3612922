"""Pictures of saccades in all directions, of any plant and any policy.

    trajectory, measures = movement.trajectory(), movement.measure(of="gaze")
    save(gaze_paths(trajectory, measures, target), "paths.png")          # orient_eye.figures.save

The functions take trajectories, the measures of their gaze, and orientations, and return matplotlib Figures made
without pyplot. Gaze is told to the left and up of straight ahead (`orient_eye.movement.oblique.seen_from`) and drawn as
the eye sees it, left on the left. Torsion and rotation vectors are those of `orient_eye.listing`.
"""

from orient_eye.figures.gaze.antagonists import antagonists_over_time
from orient_eye.figures.gaze.beside_group import main_sequence_beside_group
from orient_eye.figures.gaze.components import component_velocities
from orient_eye.figures.gaze.listing import listing_plane, torsion_over_time
from orient_eye.figures.gaze.main_sequence import main_sequence
from orient_eye.figures.gaze.motors import motors_over_time
from orient_eye.figures.gaze.paths import gaze_paths
from orient_eye.figures.gaze.sequence import saccade_sequence
from orient_eye.figures.gaze.statics import torsion_maps, workspace

__all__ = [
    "antagonists_over_time",
    "component_velocities",
    "gaze_paths",
    "listing_plane",
    "main_sequence",
    "main_sequence_beside_group",
    "motors_over_time",
    "saccade_sequence",
    "torsion_maps",
    "torsion_over_time",
    "workspace",
]
