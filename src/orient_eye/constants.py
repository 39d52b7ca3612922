"""Numbers that more than one part needs, each once, without anything to import."""

SPEED_LIMIT = 7200.0
"""V [deg/s], to which a varying C brings the motor (thesis, after 4.18)."""
BAND = 0.01
"""Settling band: share of the amplitude around the end (thesis 4.4.2)."""
DOUBT = 1e-6
"""Share of the amplitude: doubt about what a simulated saccade will still do that changes no measure by as much."""
HORIZON_S = 0.5
"""How long a simulated saccade lasts."""
YAW_LIMIT_DEG = 35.0
"""Starts and targets are drawn up to here, to either side (thesis 4.6)."""
STEP_S = 0.001
"""Interval between the samples of commands and trajectories (thesis 3.2)."""
LONGEST_S = 3600.0
"""No movement is simulated longer than this."""
EYE = "thesis"
"""Preset of the eye, where none is named (`orient_eye.eyes.EYES`)."""
ANGLES = ("yaw", "pitch", "roll")
"""By which an orientation is told: turns about z, y and x (`orient_eye.rotations`)."""
