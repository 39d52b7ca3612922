"""What `import orient_eye` offers: every name loads, lazily, and the example of the docstring runs as it stands."""

import ast
import re
import subprocess
import sys
from typing import Any

import numpy as np
import pytest

import orient_eye
from orient_eye.movement.measures import Measures
from orient_eye.movement.trajectory import Trajectory

DOCSTRING = orient_eye.__doc__ or ""


@pytest.mark.parametrize("name", orient_eye.__all__)
def test_every_name_loads(name: str) -> None:
    found = getattr(orient_eye, name)
    assert found is not None
    if isinstance(found, type):
        assert found.__name__ == name
        assert found.__module__.startswith("orient_eye.")


def test_names_are_listed_once_and_known_to_dir() -> None:
    assert len(orient_eye.__all__) == len(set(orient_eye.__all__))
    assert set(orient_eye.__all__) <= set(dir(orient_eye))
    assert len(orient_eye.__all__) > 30


def test_star_gives_all() -> None:
    names: dict[str, Any] = {}
    exec("from orient_eye import *", names)
    assert set(orient_eye.__all__) <= set(names)


UNKNOWN = pytest.mark.parametrize("name", ["nothing", "Plants", "_PRIVATE", "saccade"])


@UNKNOWN
def test_an_unknown_name_is_an_error_of_attributes(name: str) -> None:
    with pytest.raises(AttributeError, match=rf"orient_eye.* attribute '?{name}\b"):
        getattr(orient_eye, name)
    assert not hasattr(orient_eye, name)
    with pytest.raises(ImportError, match=name):
        exec(f"from orient_eye import {name}", {})


def test_the_docstring_names_what_there_is() -> None:
    """In its table: names of the package, or of another (gymnasium.make)."""
    rows = [line for line in DOCSTRING.splitlines() if line.startswith("| a")]
    told = set(re.findall(r"`(\w+)`", "\n".join(rows)))
    assert len(rows) > 5
    assert len(told) > 20
    assert told <= set(orient_eye.__all__)


def example() -> str:
    """The indented lines of the docstring."""
    lines = [line.removeprefix("    ") for line in DOCSTRING.splitlines() if line.startswith("    ")]
    return "\n".join(lines)


def test_the_example_of_the_docstring_runs() -> None:
    """Literally; its last line is what a person would look at."""
    tree = ast.parse(example())
    last = tree.body.pop()
    assert isinstance(last, ast.Expr)
    assert len(tree.body) == 6  # the import, and the five lines before the last
    names: dict[str, Any] = {}
    exec(compile(tree, "<docstring>", "exec"), names)
    settling_time_s, reward, trajectory = eval(compile(ast.Expression(last.value), "<docstring>", "eval"), names)
    measures = names["outcome"].measures
    assert isinstance(measures, Measures)
    assert isinstance(trajectory, Trajectory)
    assert settling_time_s.shape == reward.shape == (1,)
    assert measures.settled.all()
    assert 0.02 < settling_time_s[0] < 0.2
    weights = names["task"].weights
    terms = names["outcome"].reward.terms
    np.testing.assert_allclose(reward, sum(weights[name] * terms[name] for name in weights), rtol=1e-12)
    assert trajectory.yaw_deg[0, 0] == pytest.approx(0, abs=1e-6)
    assert trajectory.yaw_deg[0, -1] == pytest.approx(20, abs=1)
    np.testing.assert_allclose(names["outcome"].movement.measure().settling_time_s, settling_time_s)


def test_importing_it_loads_nothing_that_computes() -> None:
    code = (
        "import sys, orient_eye; dir(orient_eye); orient_eye.__version__; "
        "print({'mujoco', 'torch', 'scipy', 'rerun', 'matplotlib', 'stable_baselines3'} & set(sys.modules))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "set()"
