"""Searched optima, kept on disk: a search on the MuJoCo eye takes minutes, and its answer never changes.

One .npz file a search, named by the hash of everything its answer depends on: plant, pulse, reward,
bounds, saccades, the search itself and the version of orient-eye. Delete the folder at any time.
"""

import contextlib
import hashlib
import json
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from platformdirs import user_cache_path

from orient_eye import __version__
from orient_eye.files import write_atomically
from orient_eye.search.optimum import Optimum, find_optimum
from orient_eye.task.saccade import SaccadeTask, horizontal

Array = NDArray[np.float64]
_SEARCH = "differential evolution 2"  # changes when the search does
_SEED = 20_210


def cache_folder() -> Path:
    """Where optima are kept: the user's cache folder (the variable XDG_CACHE_HOME moves it)."""
    return user_cache_path("orient-eye") / "optimum"


def searched_optimum(
    task: SaccadeTask,
    start_yaw_deg: Array,
    target_yaw_deg: Array,
    *,
    progress: Callable[[float], None] | None = None,
    folder: Path | None = None,
) -> Optimum:
    """The best actions of saccades between gaze directions [deg], each (saccades,), searched once.

    Args:
        task: plant, command and reward.
        start_yaw_deg: (saccades,).
        target_yaw_deg: (saccades,).
        progress: called with the share of the work done, when there is any.
        folder: of the cache; None for `cache_folder()`.
    """
    key = {
        "search": _SEARCH,
        "version": __version__,
        "task": task.identity(),
        "start_yaw_deg": start_yaw_deg.tolist(),
        "target_yaw_deg": target_yaw_deg.tolist(),
    }
    name = hashlib.sha256(json.dumps(key, sort_keys=True).encode()).hexdigest()[:24]
    path = (folder or cache_folder()) / f"{name}.npz"
    kept = _read(path)
    if kept is not None:
        return kept
    found = find_optimum(
        task,
        task.fixate(horizontal(start_yaw_deg)),
        horizontal(target_yaw_deg),
        np.random.default_rng(_SEED),
        progress=progress,
    )
    arrays: dict[str, Any] = {"action": found.action, "reward": found.reward, "evaluations": found.evaluations}
    with contextlib.suppress(OSError):  # a folder that cannot be written costs the next search, nothing else
        write_atomically(path, lambda temporary: np.savez(temporary, **arrays))
    return found


def _read(path: Path) -> Optimum | None:
    try:
        with np.load(path, allow_pickle=False) as file:
            return Optimum(file["action"], file["reward"], int(file["evaluations"]))
    except (OSError, ValueError, KeyError, EOFError, RuntimeError, zipfile.BadZipFile):  # damaged: search again
        return None
