"""What newcomers copy from docs/start, docs/howto and docs/concepts.md: whole command lines, and programs."""

import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

from orient_eye.cli import COMMANDS
from orient_eye.cli.options import parse
from orient_eye.registry import load

DOCS = Path(__file__).parents[1] / "docs"
PAGES = sorted([*(DOCS / "start").glob("*.md"), *(DOCS / "howto").glob("*.md"), DOCS / "concepts.md"])
ADDED = re.compile(r"--(?:plant|case) (?:spring|bell|calm)\b|--judge calm")  # by the packages of test_third_party.py


def name(page: Path) -> str:
    return page.relative_to(DOCS).as_posix()


def command_lines(page: Path) -> list[str]:
    """The lines `orient-eye ...` that a page shows as blocks, without comments."""
    return re.findall(r"^(?:    )?(orient-eye [^#\n]*)", page.read_text(encoding="utf-8"), re.M)


def test_there_are_pages_and_commands() -> None:
    assert {"start/researcher.md", "start/roboticist.md", "start/learner.md"} < set(map(name, PAGES))
    assert all(command_lines(page) for page in PAGES if name(page) != "concepts.md")


@pytest.mark.parametrize("page", PAGES, ids=name)
def test_every_command_line_has_options_that_there_are(page: Path) -> None:
    for line in command_lines(page):
        words = shlex.split(ADDED.sub("", line))
        parse(load(COMMANDS[words[1]]), words[2:], program=words[1])


@pytest.mark.parametrize("program", ["one_step.py", "bar.py", "cliff.py"])
def test_the_learners_programs_print_what_the_page_says(program: str, tmp_path: Path) -> None:
    text = (DOCS / "start" / "learner.md").read_text(encoding="utf-8")
    source, shown = re.findall(
        rf"^cat > {re.escape(program)} <<'END'\n(.*?)^END\n.*?^```\n\n((?:    [^\n]*\n)+)", text, re.M | re.S
    )[0]
    (tmp_path / program).write_text(source, encoding="utf-8")
    printed = subprocess.run(
        [sys.executable, program], cwd=tmp_path, capture_output=True, text=True, check=True, timeout=120
    ).stdout
    numbers = [[float(n) for n in re.findall(r"-?\d+(?:\.\d+)?(?:e[+-]\d+)?", text)] for text in (printed, shown)]
    assert numbers[0] == pytest.approx(numbers[1], rel=1e-3, abs=0.011)
