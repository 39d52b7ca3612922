"""What is printed for people: tables lose no number, however narrow the terminal."""

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from orient_eye.cli import tables

NUMBERS = st.floats(-1e9, 1e9, allow_nan=False)


@given(rows=st.lists(st.tuples(NUMBERS, NUMBERS, NUMBERS), min_size=1, max_size=4), width=st.integers(40, 200))
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_no_number_and_no_name_is_cut_off(
    rows: list[tuple[float, float, float]], width: int, capsys: pytest.CaptureFixture[str]
) -> None:
    columns = {"policy": lambda row: row["name"], "in words": lambda row: "one two three four five six seven"}
    columns |= {f"number {key} [1/s]": tables.column(key, ".6g", " 1/s") for key in "abc"}
    told = [{"name": f"tavares-gaze-{i}", **dict(zip("abc", row, strict=True))} for i, row in enumerate(rows)]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(tables, "_WIDTH", width)
        tables.say(tables.table("A title.", columns, told, left=("policy", "in words")))
    printed = capsys.readouterr().err
    assert "…" not in printed
    assert max(map(len, printed.splitlines())) <= width
    for row in told:
        assert row["name"] in printed
        for key in "abc":
            assert f"{row[key]:.6g} 1/s" in printed


@pytest.mark.parametrize(("width", "in_lines"), [(200, False), (60, True)])
def test_a_table_too_wide_is_told_in_lines(
    width: int, in_lines: bool, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(tables, "_WIDTH", width)
    columns = {f"a heading of {name}": tables.column(name) for name in ("some", "such", "more")}
    tables.say(tables.table("A title.", columns, [{"some": 1.5, "such": 2.5}, {"some": 3.5}]))
    lines = capsys.readouterr().err.splitlines()
    assert lines[0].strip() == "A title."
    assert any(line.split() == ["a", "heading", "of", "some", "3.5"] for line in lines) == in_lines
    assert any("1.5" in line and "2.5" in line for line in lines) != in_lines
