"""Pictures of a policy and of its training, named after the thesis' figures (its Chapter 5, variant 1).

    save(figure_5_1(policy, yardstick), "figure_5_1.png")        # orient_eye.figures.save

The functions return matplotlib Figures made without pyplot. Where they say "mean over starting points",
saccades of every size start at points spread evenly over the range, to either side; the shade is the range of
what came out. The size of a saccade is the angle from start to target, its progress the angle turned from the start.
Of saccades in all directions `gaze_pictures` shows the gaze, its components, and torsion.
"""

from orient_eye.learning.figures.gaze import gaze_page, gaze_pictures
from orient_eye.learning.figures.main_sequence import figure_5_4
from orient_eye.learning.figures.movement import figure_5_2, figure_5_3
from orient_eye.learning.figures.output import figure_5_1, figure_5_25
from orient_eye.learning.figures.page import draw_learning, draw_policy
from orient_eye.learning.figures.reward import figure_5_24

__all__ = [
    "draw_learning",
    "draw_policy",
    "figure_5_1",
    "figure_5_2",
    "figure_5_3",
    "figure_5_4",
    "figure_5_24",
    "figure_5_25",
    "gaze_page",
    "gaze_pictures",
]
