"""Command lines that nobody thought of: any options with any values, any files; what comes out is always an answer.

Made from the commands' own fields, so that a new option is tried without being told of. A few examples in the suite,
thousands by `make fuzz`.
"""

import contextlib
import io
import itertools
import json
import shutil
import time
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any, Literal, get_args, get_origin, get_type_hints

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from bad_files import write_pool
from fuzzing import budget
from orient_eye.cli import COMMANDS, main
from orient_eye.cli.options import REGISTRIES, offered
from orient_eye.registry import load

QUICK: dict[str, tuple[list[str], dict[str, list[str]]]] = {
    "simulate": ([], {"--motor": ["command.csv"], "--plant": ["lpf"]}),
    "sysid": ([], {"--plant": ["lpf"], "--amplitudes": ["5"], "--held-out": []}),
    "predict": (["lpf-1"], {"--target": ["20"]}),
    "check": (["thesis"], {"--command": ["sent.csv"], "--executed": ["step.csv"]}),
    "optimum": ([], {}),
    "weights": ([], {"--case": ["1"]}),
    "listing": ([], {"--gaze": ["10", "5"]}),
    "export": (["lpf-1"], {}),
    "evaluate": (["lpf-1"], {"--pairs": ["0"]}),
    "view": (["step.csv"], {}),
    "validate": ([], {"--random-runs": ["-1"]}),
    "models": ([], {}),
}
"""Commands, with arguments and options that make them quick; a training takes longer than a moment in any case."""
SLOW = {"--physical", "--all-motors", "--accurate", "--check", "--web"}
"""Options with which a command rightly takes many seconds."""
NUMBERS = ["0", "-1", "1", "5", "20", "-30", "0.02", "1e-300", "1e308", "-1e308", "nan", "inf", "-inf", "1" + 400 * "0"]
WORDS = ["", " ", "true", "5 deg", "nosuch", "--", "-", "[red]", "a[/b]", "%s", "{}", "é", "x" * 300, "..", "varying"]
"""That are no numbers."""
FILES = [
    "command.csv", "step.csv", "step_q.csv", "step_far.csv", "sent_rad.csv", "pairs.csv", "pairs_far.csv",
    "garbage.csv", "garbage.xml", "empty.csv", "cut.csv", "folder",
]  # fmt: skip
"""Of the pool."""
SECONDS = 60.0
"""No line takes as long, on a busy machine either."""


@pytest.fixture(scope="module")
def pool(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_pool(tmp_path_factory.mktemp("pool"))


def options_of(command: str) -> dict[str, Any]:
    """Every option of a command, by its flag, with its type; also those inside."""
    found: dict[str, Any] = {}

    def visit(kind: Any) -> None:
        hints = get_type_hints(kind)
        for each in fields(kind):
            if isinstance(hints[each.name], type) and is_dataclass(hints[each.name]):
                visit(hints[each.name])
            else:
                found[f"--{each.name.replace('_', '-')}"] = hints[each.name]

    visit(offered(load(COMMANDS[command])))
    return {flag: hint for flag, hint in found.items() if flag not in SLOW}


def parts(hint: Any) -> set[Any]:
    """All the types in one."""
    return {hint}.union(*map(parts, get_args(hint))) if get_origin(hint) not in (None, Literal) else {hint}


def values(flag: str, hint: Any) -> st.SearchStrategy[list[str]]:
    """What may follow an option: mostly of its kind, sometimes anything."""
    kinds = parts(hint)
    choices = [name for kind in kinds if get_origin(kind) is Literal for name in get_args(kind)]
    if flag.removeprefix("--") in REGISTRIES:
        choices += ["nosuch"]
    if bool in kinds:
        return st.just([])
    anything = st.sampled_from([*WORDS, *NUMBERS])
    if Path in kinds or str in kinds:
        likely = st.sampled_from([*choices, *FILES, "thesis", "prototype", "OUT/new", "lpf-1", "nosuch.csv"])
    elif choices:
        likely = st.sampled_from([str(name) for name in choices])
    else:
        likely = st.sampled_from(NUMBERS)
    one = likely | likely | likely | anything
    several = any(get_origin(kind) is tuple for kind in kinds)
    return st.lists(one, max_size=3) if several else st.lists(one, min_size=1, max_size=1)


@st.composite
def lines(draw: st.DrawFn) -> list[str]:
    """A command line, most of it sensible."""
    command = draw(st.sampled_from(sorted(QUICK)))
    told, (first, given) = options_of(command), QUICK[command]
    chosen = draw(st.lists(st.sampled_from(sorted(told)), max_size=3, unique=True)) if told else []
    given = {**given, **{flag: draw(values(flag, told[flag])) for flag in chosen}}
    if "--out" in told and "--out" not in given:
        given["--out"] = ["OUT"]
    line = [command, *first, *(word for flag, after in given.items() for word in (flag, *after))]
    if draw(st.integers(0, 9)) == 0:
        line.insert(draw(st.integers(1, len(line))), draw(st.sampled_from([*WORDS, *NUMBERS])))
    return [*line, "--json"] if draw(st.booleans()) else line


def takes_long(line: list[str]) -> bool:
    """Whether it rightly does: many saccades are searched or simulated, or the random runs of a validation."""
    counts = [after for flag, after in itertools.pairwise(line) if flag in ("--pairs", "--random-runs")]
    return any(text.isdigit() and len(text) < 5 and int(text) > 0 for text in counts)


@budget(40)
@given(lines())
def test_every_line_ends_with_an_answer(pool: Path, tmp_path: Path, line: list[str]) -> None:
    assume(not takes_long(line))
    folder = tmp_path / "here"
    shutil.rmtree(folder, ignore_errors=True)
    shutil.copytree(pool, folder)
    before = set(folder.rglob("*"))
    out, err = io.StringIO(), io.StringIO()
    began = time.monotonic()
    with (
        contextlib.chdir(folder),
        contextlib.redirect_stdout(out),
        contextlib.redirect_stderr(err),
        pytest.raises(SystemExit) as ended,
    ):
        main(line)
    code, told = ended.value.code, err.getvalue()
    new = [each for each in folder.rglob("*") if each not in before]
    assert time.monotonic() - began < SECONDS
    assert code in (0, 1, 2)
    assert "Traceback" not in told
    assert not [each for each in new if each.name.startswith(".")], "a temporary is left"
    if code == 2 and "were written" not in told and "was written" not in told:  # of an identification, fits are
        assert not new, "something is left of a run that was refused"
    if code != 2:
        assert all(each.is_dir() or each.stat().st_size for each in new), "an output is empty"
        if "--json" in line and not {"--help", "--version"} & set(line):
            json.loads(out.getvalue())
