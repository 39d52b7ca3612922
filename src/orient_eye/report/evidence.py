"""What the figures of the report are functions of: loaded or computed once, when it is first asked for.

evidence = Evidence()                            # the shipped policies
evidence = Evidence([Path("runs/mine")])         # a run instead of the shipped policy of its kind
evidence.policy("lpf", "2-varying").pairs        # its evaluation saccades, with the searched optimum
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from orient_eye.cached import cached_property
from orient_eye.checks import whole
from orient_eye.constants import EYE
from orient_eye.errors import InputError
from orient_eye.files import read_json
from orient_eye.learning.evaluation import Yardstick, evaluation_saccades
from orient_eye.learning.figures.gaze import gaze_pictures
from orient_eye.learning.figures.saccades import Saccades
from orient_eye.learning.gaze_numbers import gaze_numbers
from orient_eye.learning.policy import NAME as POLICY
from orient_eye.learning.policy import Policy, shipped_policies
from orient_eye.movement.measures import Measures
from orient_eye.movement.velocity_threshold import Bout, above
from orient_eye.plants import make_plant
from orient_eye.resources import data_folder
from orient_eye.search.optimum_file import NAME as OPTIMUM
from orient_eye.sysid import Identification, identify_plant
from orient_eye.tables import read_table
from orient_eye.task.saccade import SaccadeTask

Array = NDArray[np.float64]
COURSE = "metrics.csv"
"""How a training went, beside its policy."""
_OF_COURSE = ("saccades", "reward_mean", "gap_mean")
STEPS_DEG = tuple(float(a) for a in range(1, 26))
"""Amplitudes of the motor's steps, as `orient-eye sysid` takes them."""
MAIN_SEQUENCE_DEG = np.array([1, 1.5, 2, 3, 4, 5, 6, 8, 10, 12.5, 15, 17.5, 20, 25, 30, 35, 40, 50, 60], float)
"""Amplitudes at which main sequences are told, as far as the targets go."""


@dataclass(frozen=True)
class Judged:
    """A policy with the saccades on which it is judged.

    Attributes:
        name: of the shipped policy, or the run directory.
        policy: that acts.
        pairs: random saccades over the whole range with their searched optimum.
        table: symmetric ones.
        metrics: columns of its training's metrics by name; none where it brings none.
    """

    name: str
    policy: Policy
    pairs: Yardstick
    table: Yardstick
    metrics: Mapping[str, Array]

    @property
    def task(self) -> SaccadeTask:
        """Plant, actions, targets and reward."""
        return self.pairs.task

    @property
    def title(self) -> str:
        """Plant and case in words, and which run it is of where it is not shipped."""
        _, eye, case, targets = _kind(self.policy)
        words = [
            self.task.plant.name,
            *([] if eye == EYE else [f"eye {eye}"]),
            *([f"case {case}"] if case else []),
            *([targets] if targets not in (None, "horizontal") else []),
        ]
        mine = "" if self.name in shipped_policies() else f" ({self.name})"
        return ", ".join(words) + mine

    @property
    def course(self) -> Mapping[str, Array]:
        """Columns of its training's metrics by name.

        Raises:
            InputError: it brings none, or not all of them.
        """
        missing = [name for name in _OF_COURSE if name not in self.metrics]
        if missing:
            raise InputError(
                f"policy {self.name} brings no {COURSE} with {', '.join(missing)}; give the run directory of its "
                "training"
            )
        return self.metrics

    @cached_property
    def gap(self) -> Array:
        """Reward gaps of the random saccades."""
        return self.pairs.perform(self.policy.act)[2]

    @cached_property
    def sizes(self) -> Saccades:
        """Saccades of the amplitudes of the main sequence, around straight ahead."""
        largest = 2 * self.task.targets.limit_deg
        return Saccades.symmetric(self.task, self.policy, MAIN_SEQUENCE_DEG[largest >= MAIN_SEQUENCE_DEG])

    @cached_property
    def measures(self) -> Measures:
        """Of those, of what the task looks at: the whole orientation, or gaze."""
        return self.sizes.of_gaze if self.task.judge == "gaze" else self.sizes.outcome.measures

    @cached_property
    def bout(self) -> Bout:
        """The same measured by a velocity threshold, as those of people are."""
        return above(self.sizes.trajectory, of="gaze" if self.task.judge == "gaze" else "orientation")

    @cached_property
    def random(self) -> Saccades:
        """The random saccades."""
        return Saccades.of(self.task, self.policy, self.pairs.start, self.pairs.target)

    @cached_property
    def gaze_numbers(self) -> dict[str, Any]:
        """Of the random saccades in all directions."""
        return gaze_numbers(self.random)

    @cached_property
    def gaze_pictures(self) -> dict[str, Figure]:
        """Of saccades in all directions, by name."""
        return gaze_pictures(self.policy, self.pairs)


class Evidence:
    """Policies, an identification and studies, each made when it is first asked for.

    Args:
        runs: run directories of `orient-eye train`, each in place of the shipped policy of the same plant, eye, case
            and targets, or beside them.
        pairs: random saccades on which each policy is judged; None for as many as it was trained with.

    Raises:
        InputError: a run that is none, or is not finished; or pairs below 1.
    """

    def __init__(self, runs: Sequence[Path] = (), *, pairs: int | None = None) -> None:
        if pairs is not None:
            whole("pairs", pairs, 1, 10**5)
        self.pairs = pairs
        self._policies = {name: Policy.load(folder) for name, folder in shipped_policies().items()}
        self._folders = dict(shipped_policies())
        for run in runs:
            self._add(run)
        self._judged: dict[str, Judged] = {}

    def _add(self, named: Path) -> None:
        policy = Policy.load(named)
        run = shipped_policies().get(str(named), named)
        run = run.parent if run.name == POLICY else run
        same = [name for name, other in self._policies.items() if _kind(other) == _kind(policy)]
        for name in same:
            del self._policies[name], self._folders[name]
        self._policies[str(run)], self._folders[str(run)] = policy, run

    def names(self) -> tuple[str, ...]:
        """Of all policies."""
        return tuple(self._policies)

    def policy(self, plant: str, case: str, targets: str | None = None, *, eye: str = EYE) -> Judged:
        """The policy of a plant with an eye, a case, and a set of targets; None for any about one axis.

        Raises:
            InputError: there is none.
        """
        for name, policy in self._policies.items():
            *of, of_targets = _kind(policy)
            if of == [plant, eye, case] and targets in (None, of_targets):
                return self.judged(name)
        options = ("" if eye == EYE else f" --eye {eye}") + ("" if targets is None else f" --targets {targets}")
        raise InputError(
            f"the report has no policy of plant {plant!r} and case {case!r}; give the run directory of one, which "
            f"orient-eye train --plant {plant}{options} --case {case} makes"
        )

    def judged(self, name: str) -> Judged:
        """A policy by its name, judged."""
        if name not in self._judged:
            policy, folder = self._policies[name], self._folders[name]
            task = policy.task()
            usual = policy.manifest.get("result", {}).get("pairs") or task.plant.evaluation_pairs
            pairs, table = evaluation_saccades(task, self.pairs or usual, carried=folder / OPTIMUM)
            course = folder / COURSE
            columns = read_table(course, ",".join(_OF_COURSE)).columns if course.exists() else {}
            self._judged[name] = Judged(name, policy, pairs, table, columns)
        return self._judged[name]

    @cached_property
    def identification(self) -> Identification:
        """Of the MuJoCo eye by steps of its motor (thesis 3.3)."""
        return identify_plant(make_plant("mujoco"), STEPS_DEG, ())

    @cached_property
    def studies(self) -> dict[str, Any]:
        """What trainings with several seeds came to (`scripts/studies.py`)."""
        return dict(read_json(data_folder("models") / "studies.json", hint="install orient-eye again"))


def _kind(policy: Policy) -> tuple[str, str, str | None, str | None]:
    """Plant, eye, case and targets."""
    task = policy.manifest["task"]
    plant, case = task["plant"], policy.manifest.get("case")
    return plant.get("plant"), plant.get("eye", EYE), case, task.get("targets", {}).get("targets")
