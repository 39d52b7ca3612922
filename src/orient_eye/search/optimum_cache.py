"""Searched optima, kept on disk: a search on the MuJoCo eye takes minutes, and its answer never changes.

One .npz file a search, named by the hash of everything its answer depends on: plant, pulse, reward,
bounds, saccades, the search itself and the version of orient-eye. Delete the folder at any time.
"""

import contextlib
import hashlib
import json
import zipfile
from collections.abc import Callable
from importlib import metadata
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from platformdirs import user_cache_path

from orient_eye.errors import InputError
from orient_eye.files import write_atomically
from orient_eye.search.optimum import Optimum, find_optimum
from orient_eye.state import State
from orient_eye.task.saccade import SaccadeTask

Array = NDArray[np.float64]
_SEARCH = "differential evolution 3"  # changes when the search does
_SEED = 20_210


def cache_folder() -> Path:
    """Where optima are kept: the user's cache folder (the variable XDG_CACHE_HOME moves it)."""
    return user_cache_path("orient-eye") / "optimum"


def searched_optimum(
    task: SaccadeTask,
    start: State,
    target: Array,
    *,
    progress: Callable[[float], None] | None = None,
    folder: Path | None = None,
) -> Optimum:
    """The best actions of saccades, searched once.

    Args:
        task: plant, command and reward.
        start: where each saccade begins, of (saccades,).
        target: desired orientations, (saccades, 4).
        progress: called with the share of the work done, when there is any.
        folder: of the cache; None for `cache_folder()`.
    """
    key = {
        "search": _SEARCH,
        "version": metadata.version("orient-eye"),
        "task": {name: value for name, value in task.identity().items() if name != "targets"},
        "start": start.to_plain(),
        "target": target.tolist(),
    }
    name = hashlib.sha256(json.dumps(key, sort_keys=True).encode()).hexdigest()[:24]
    path = (folder or cache_folder()) / f"{name}.npz"
    kept = _read(path)
    if kept is not None:
        return kept
    found = find_optimum(task, start, target, np.random.default_rng(_SEED), progress=progress)
    arrays: dict[str, Any] = {"action": found.action, "reward": found.reward, "evaluations": found.evaluations}
    with contextlib.suppress(InputError):  # a folder that cannot be written costs the next search, nothing else
        write_atomically(path, lambda temporary: np.savez(temporary, **arrays))
    return found


def _read(path: Path) -> Optimum | None:
    try:
        with np.load(path, allow_pickle=False) as file:
            return Optimum(file["action"], file["reward"], int(file["evaluations"]))
    except (OSError, ValueError, KeyError, EOFError, RuntimeError, zipfile.BadZipFile):  # damaged: search again
        return None
