"""Which trainings a sweep is: options with several values make a grid, and every run of it gets a name.

    runs = named(product_of({"case": ("1", "2-fixed"), "seed": (0, 1, 2)}))
    runs["2-fixed-seed1"]                            # {"case": "2-fixed", "seed": 1}
    config_of(runs["2-fixed-seed1"])                 # TrainConfig(case="2-fixed", seed=1)

Options are those of `TrainConfig` and of its plant, by name, side by side.
"""

import itertools
import math
import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import fields
from typing import Any

from orient_eye.checks import shown
from orient_eye.errors import InputError
from orient_eye.learning.config import TrainConfig

Options = dict[str, Any]
"""What is said of one run."""
_OWN = [field.name for field in fields(TrainConfig) if field.name != "plant_options"]
_BARE = ("plant", "case", "targets", "preset")  # whose values tell by themselves what they are of
_MOST, _LONGEST = 10**5, 100


def product_of(values: Mapping[str, Sequence[Any]]) -> list[Options]:
    """All combinations of the values of each option; the last one changes first.

    Raises:
        InputError: an option without a value or with one twice, or more runs than anybody waits for.
    """
    for option, of in values.items():
        if not of:
            raise InputError(f"{option} names no value; give at least one, or leave it out")
        seen: set[str] = set()
        for value in of:
            if repr(value) in seen:
                raise InputError(f"{option} names {shown(value)} twice; name each value once")
            seen.add(repr(value))
    count = math.prod(len(of) for of in values.values())
    if count > _MOST:
        raise InputError(f"a sweep has at most {_MOST} runs, this grid has {count}; make several sweeps of it")
    names = sorted(values, key=_place)
    return [dict(zip(names, each, strict=True)) for each in itertools.product(*(values[name] for name in names))]


def named(runs: Sequence[Options]) -> dict[str, Options]:
    """Runs by names that say what differs between them, fit for folders.

    Raises:
        InputError: there is no run, or two are the same.
    """
    if not runs:
        raise InputError("a sweep needs at least one run, there is none; name an option with its values")
    names = sorted({name for run in runs for name in run}, key=_place)
    varied = [name for name in names if not all(name in run and _same(run[name], runs[0].get(name)) for run in runs)]
    found: dict[str, Options] = {}
    seen: set[str] = set()
    alike: Counter[str] = Counter()
    for run in runs:
        told = repr(sorted(run.items()))
        if told in seen:
            raise InputError(f"two runs of the sweep are the same: {run or 'no option'}; name each once")
        seen.add(told)
        parts = (_part(name, run[name]) for name in varied if name in run)
        name = usual = "-".join(parts)[:_LONGEST].strip(".") or "usual"
        while name in found:  # values that look alike in a folder's name
            alike[usual] += 1
            name = f"{usual}+{alike[usual]}"
        found[name] = run
    return found


def config_of(options: Options) -> TrainConfig:
    """The configuration that `orient-eye train` makes of these options."""
    values: dict[str, Any] = {}
    for name, value in options.items():
        values[name] = tuple(value) if isinstance(value, list) else value
    own: Any = {name: values.pop(name) for name in _OWN if name in values}
    return TrainConfig(**own, plant_options=values)


def plant_options(options: Options) -> Options:
    """Those of the plant."""
    return {name: value for name, value in options.items() if name not in _OWN}


def without_seed(options: Options) -> Options:
    """The setting of a run: what its repetitions have in common."""
    return {name: value for name, value in options.items() if name != "seed"}


def _place(name: str) -> tuple[int, str]:
    """Where an option stands among others: as in `TrainConfig`, those of plants after them."""
    return (_OWN.index(name) if name in _OWN else len(_OWN), name)


def _same(one: Any, other: Any) -> bool:
    """Equal, and of one type: 1 is not True."""
    return repr(one) == repr(other)


def _part(name: str, value: Any) -> str:
    text = " ".join(map(str, value)) if isinstance(value, list | tuple) else str(value)
    told = re.sub(r"[^A-Za-z0-9.+]+", "-", text).strip("-")
    return told if name in _BARE and told else f"{name.replace('_', '')}{told}"
