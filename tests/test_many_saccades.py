"""examples/many_saccades.py: what it leaves is what each file's seed says, and what is missing is made."""

import runpy
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as pq
import pytest

import orient_eye as oe
from orient_eye import resources, rotations

FILE = Path(__file__).parents[1] / "examples" / "many_saccades.py"


@pytest.fixture
def example(monkeypatch: pytest.MonkeyPatch) -> dict[str, Any]:
    """Files of forty saccades, by twenty."""
    monkeypatch.setattr(resources, "_SHARE", [])  # it takes one core for itself
    loaded = runpy.run_path(str(FILE))
    loaded["perform"].__globals__.update(BATCH=20, FILE=40)
    return loaded


def test_files_are_made_from_their_seed_and_those_that_are_there_are_kept(
    example: dict[str, Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("sys.argv", ["many_saccades.py", "--saccades", "70", "--jobs", "1", "--out", str(tmp_path)])
    example["main"]()
    assert "80 saccades on lpf, 1 processes" in capsys.readouterr().out
    files = sorted((tmp_path / "lpf").iterdir())
    assert [file.name for file in files] == ["saccades-000000.parquet", "saccades-000001.parquet"]
    first, second = (pq.read_table(file) for file in files)
    assert not first.equals(second)
    kept = files[0].stat().st_mtime_ns
    files[1].unlink()
    example["main"]()
    assert files[0].stat().st_mtime_ns == kept
    assert pq.read_table(files[1]).equals(second)


def test_a_row_is_the_saccade_that_it_says(example: dict[str, Any], tmp_path: Path) -> None:
    """The same start, target and numbers, given to the environment one by one."""
    file, _ = example["perform"]("tavares", 3, tmp_path)
    table = pq.read_table(file).to_pylist()
    assert len(table) == 40
    task = oe.SaccadeTask.of_case(oe.make_plant("tavares"), "1")
    for row in table[::13]:
        start, target = oe.saccades(task.targets, [[row["start_yaw_deg"]]], [[row["target_yaw_deg"]]])
        outcome = task.perform(start, np.array([[row["B"], row["D_deg"], row["k0"]]]), target)
        assert outcome.reward.total[0] == pytest.approx(row["reward"], rel=1e-5)
        final = rotations.to_euler(outcome.measures.final)[0][0]
        assert final == pytest.approx(row["final_yaw_deg"], abs=1e-5)
        assert abs(final - row["target_yaw_deg"]) < 3  # the step is the one that lands on the target
