"""Programs that newcomers copy from docs/start print what the page says. Command lines and links: test_docs.py."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

DOCS = Path(__file__).parents[1] / "docs"


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
