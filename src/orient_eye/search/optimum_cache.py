"""Searched optima that are not searched again: taken along with a policy, or kept on disk.

An optimum that travels is bound to plant, actions, reward and saccades (`task_key`, and the saccades in its file), not
to a version of orient-eye or of the search: a later search may end a hair beside it, and is not worth its time. What
a version changes in the eye shows in the rewards: those of the actions in the file are told anew, and where they are
not what the file says, the optimum is searched.

The cache is the user's, and what it forgets costs only time: one file a search, named by the hash of everything its
answer depends on, the search itself and the version of orient-eye among it. Delete the folder at any time.
"""

import contextlib
import hashlib
import json
from collections.abc import Callable
from dataclasses import replace
from importlib import metadata
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from orient_eye.errors import InputError
from orient_eye.resources import user_cache
from orient_eye.search.optimum import Optimum, find_optimum
from orient_eye.search.optimum_file import Found, read_optimum, write_optimum
from orient_eye.state import State
from orient_eye.task.saccade import SaccadeTask

Array = NDArray[np.float64]
_SEARCH = "simplices 1, evolutions 2"  # changes when the search does
_SEED = 20_210
_STILL = 1e-4  # of |R|: as far as a reward may be from the one in a file that travelled


def cache_folder() -> Path:
    """Where optima are kept: in the user's cache folder."""
    return user_cache("optimum")


def task_key(task: SaccadeTask) -> str:
    """Hash of plant, plain actions and reward: all that an optimum depends on but the saccades."""
    return _hash({name: value for name, value in task.plain.identity().items() if name != "targets"})


def searched_optimum(
    task: SaccadeTask,
    start: State,
    target: Array,
    *,
    progress: Callable[[float], None] | None = None,
    folder: Path | None = None,
    carried: Path | None = None,
) -> Optimum:
    """The best actions of saccades, searched once.

    Args:
        task: plant, command and reward.
        start: where each saccade begins, of (saccades,).
        target: desired orientations, (saccades, 4).
        progress: called with the share of the work done, when there is any.
        folder: of the cache; None for `cache_folder()`.
        carried: a file that travels with a policy, where there is one: it is looked into first.
    """
    taken = None if carried is None else carried_optimum(carried, task.plain, start, target)
    if taken is not None:
        return taken
    key = {
        "search": _SEARCH,
        "version": metadata.version("orient-eye"),
        "task": task_key(task),
        "start": start.to_plain(),
        "target": target.tolist(),
    }
    path = (folder or cache_folder()) / f"{_hash(key)[:24]}.safetensors"
    kept = read_optimum(path)
    if kept is not None and kept.optimum.action.shape == (len(target), len(task.actions.numbers)):
        return kept.optimum
    found = find_optimum(task, start, target, np.random.default_rng(_SEED), progress=progress)
    with contextlib.suppress(InputError):  # a folder that cannot be written costs the next search, nothing else
        write_optimum(path, Found(task_key(task), start, target, found))
    return found


def carried_optimum(path: Path, task: SaccadeTask, start: State, target: Array) -> Optimum | None:
    """The optimum of saccades from a file that travels, with the rewards that its actions have now.

    Args:
        path: of the file.
        task: plant, command and reward.
        start: where each saccade begins, of (saccades,).
        target: desired orientations, (saccades, 4).

    Returns:
        None where there is no such file, or it is of another task, lacks one of the saccades, or tells a reward that
        its action does not have.
    """
    found = read_optimum(path)
    optimum = None if found is None or found.key != task_key(task) else found.of(start, target)
    if optimum is None or optimum.action.shape != (len(target), len(task.actions.numbers)):
        return None
    reward = task.perform(start, optimum.action, target).reward.total
    still = np.abs(reward - optimum.reward) <= _STILL * np.abs(optimum.reward)
    return replace(optimum, reward=reward) if still.all() else None


def _hash(content: Any) -> str:
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()
