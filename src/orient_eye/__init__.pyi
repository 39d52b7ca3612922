# The public interface: what `import orient_eye` offers, loaded when it is first used.

from .commands import Sampled as Sampled
from .commands.motor_file import read_command as read_command
from .commands.pulse_step import PulseStep as PulseStep
from .commands.pulses import PULSES as PULSES
from .environments.saccade_env import SaccadeEnv as SaccadeEnv
from .environments.sb3_env import SaccadeVecEnv as SaccadeVecEnv
from .environments.vector_env import SaccadeVectorEnv as SaccadeVectorEnv
from .errors import InputError as InputError
from .eyes import EYES as EYES
from .eyes.model import build_model as build_model
from .learning.config import TrainConfig as TrainConfig
from .learning.policy import Policy as Policy
from .learning.training import train as train
from .listing import (
    fit_plane as fit_plane,
)
from .listing import (
    torsion as torsion,
)
from .listing import (
    with_torsion as with_torsion,
)
from .modal_surrogate import ModalSurrogate as ModalSurrogate
from .motor import Motor as Motor
from .movement import Movement as Movement
from .movement.measures import (
    Measures as Measures,
)
from .movement.measures import (
    measure as measure,
)
from .movement.trajectory import Trajectory as Trajectory
from .plants import (
    PLANTS as PLANTS,
)
from .plants import (
    Plant as Plant,
)
from .plants import (
    PlantKind as PlantKind,
)
from .plants import (
    make_plant as make_plant,
)
from .plants.fixation import Fixations as Fixations
from .recording import record as record
from .recording.frames import (
    frames as frames,
)
from .recording.frames import (
    write_film as write_film,
)
from .recording.sequence import record_sequence as record_sequence
from .search.optimum import find_optimum as find_optimum
from .search.optimum_cache import searched_optimum as searched_optimum
from .state import State as State
from .surrogate import Surrogate as Surrogate
from .sysid import (
    identify_plant as identify_plant,
)
from .sysid import (
    identify_recordings as identify_recordings,
)
from .sysid import (
    read_recordings as read_recordings,
)
from .sysid.modes import identify_modes as identify_modes
from .task.cases import (
    CASES as CASES,
)
from .task.cases import (
    Case as Case,
)
from .task.judge import (
    JUDGES as JUDGES,
)
from .task.judge import (
    Judge as Judge,
)
from .task.saccade import (
    Outcome as Outcome,
)
from .task.saccade import (
    SaccadeTask as SaccadeTask,
)
from .task.solved_weights import solve_weights as solve_weights

__version__: str
from .task.target_sets import TARGETS as TARGETS
from .task.targets import make_targets as make_targets
from .task.targets import saccades as saccades
