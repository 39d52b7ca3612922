"""System identification: from step responses to the low-pass surrogate (thesis 3.3).

    found = identify_plant(make_plant("mujoco"), amplitudes=range(1, 26))
    found = identify_recordings(read_recordings([Path("rig.csv")]))
    found.surrogate                                  # K, w0
    found.preferred.fit["dead_time"].interval        # of the model that describes the data best

Step responses (`step_response.py`) come from a plant (`plant_steps.py`) or from files (`recordings.py`,
`prototype_log.py`). Models (`models.py`) are driven by the motor movement as it was measured, not by an
ideal step. `fit.py` fits one, `comparison.py` all of them, `identification.py` puts it together and
`report.py` writes it down.
"""

from orient_eye.sysid.identification import Identification, identify_plant, identify_recordings
from orient_eye.sysid.recordings import read_recording, read_recordings
from orient_eye.sysid.step_response import StepResponse

__all__ = [
    "Identification",
    "StepResponse",
    "identify_plant",
    "identify_recordings",
    "read_recording",
    "read_recordings",
]
