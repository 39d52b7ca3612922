"""Tables that people bring: whatever program wrote them, the same numbers, or an error that names the line."""

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from orient_eye import tables
from orient_eye.errors import InputError
from orient_eye.tables import Table, read_lines, read_table

laws = settings(deadline=None, max_examples=60, derandomize=True)
numbers = st.floats(-1e20, 1e20)


def table(folder: Path, content: str | bytes) -> Table:
    path = folder / "table.csv"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return read_table(path, "t_s,a")


# --- what programs write --------------------------------------------------------------------------

PLAIN = "t_s,a\n0,1.5\n0.25,-2\n"
CONTINENTAL = "t_s;a\n0;1,5\n0,25;-2\n"


@pytest.mark.parametrize(
    "content",
    [
        PLAIN,
        PLAIN.strip(),
        PLAIN.replace("\n", "\r\n"),
        PLAIN.replace("\n", "\r"),
        PLAIN.replace(",", ";"),
        PLAIN.replace(",", "\t"),
        CONTINENTAL,
        CONTINENTAL.replace(";", "\t"),
        " t_s ,\ta\n 0 , 1.5 \n0.25,\t-2\n",
        '"t_s","a"\n"0","1.5"\n"0.25","-2"\n',
        "t_s,a\n0e0,+1.5\n25E-2,-2.\n",
        PLAIN.encode("utf-8-sig"),
        PLAIN.replace("\n", "\r\n").encode("utf-16"),
        b"\xff\xfe" + CONTINENTAL.encode("utf-16-le"),
        b"\xfe\xff" + CONTINENTAL.encode("utf-16-be"),
        "# recorded on Monday; by hand, twice\n" + PLAIN + "# the end\n",
        "\n  \n# note\nt_s,a\n\n0,1.5\n   \n  # note\n0.25,-2\n\n",
        "\ufeff# note\n" + PLAIN,
    ],
)
def test_one_table_in_many_hands(tmp_path: Path, content: str | bytes) -> None:
    read = table(tmp_path, content)
    assert list(read.columns) == ["t_s", "a"]
    np.testing.assert_array_equal(read["t_s"], [0, 0.25])
    np.testing.assert_array_equal(read["a"], [1.5, -2])


@laws
@given(
    rows=st.lists(st.tuples(numbers, numbers, numbers), min_size=1, max_size=8),
    separator=st.sampled_from([",", ";", "\t"]),
    comma=st.booleans(),
    end=st.sampled_from(["\n", "\r\n", "\r"]),
    encoding=st.sampled_from(["utf-8", "utf-8-sig", "utf-16"]),
    data=st.data(),
)
def test_every_finite_number_is_read_exactly(
    tmp_path_factory: pytest.TempPathFactory,
    rows: list[tuple[float, float, float]],
    separator: str,
    comma: bool,
    end: str,
    encoding: str,
    data: st.DataObject,
) -> None:
    """Blank lines and comments anywhere; lines are counted as an editor counts them."""
    content, lines = ["t_s", "a", "größe"], []
    text = [separator.join(content)]
    for row in rows:
        text += data.draw(st.lists(st.sampled_from(["", "  ", "# note", "# 1;2,3"]), max_size=2))
        text.append(separator.join(map(repr, row)))
        lines.append(len(text))
    if comma and separator != ",":
        text = [line if line.startswith("#") else line.replace(".", ",") for line in text]
    read = table(tmp_path_factory.mktemp("table"), (end.join(text) + end).encode(encoding))
    assert list(read.columns) == content
    assert read.lines == tuple(lines)
    np.testing.assert_array_equal(read.stack(("a", "größe", "t_s")), np.array(rows)[:, [1, 2, 0]])


def test_names_that_are_there(tmp_path: Path) -> None:
    read = table(tmp_path, PLAIN)
    assert "a" in read
    assert "b" not in read
    with pytest.raises(InputError, match=r"table\.csv has no column b; it has t_s, a"):
        read["b"]


@laws
@given(content=st.binary(max_size=60) | st.text(max_size=60).map(str.encode))
def test_any_file_is_a_table_or_an_error_that_names_it(
    tmp_path_factory: pytest.TempPathFactory, content: bytes
) -> None:
    try:
        read = table(tmp_path_factory.mktemp("any"), content)
    except InputError as error:
        refused = str(error)
        assert "table.csv" in refused
    else:
        assert {column.shape for column in read.columns.values()} == {(len(read.lines),)}


def test_one_endless_line(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"table\.csv"):
        table(tmp_path, "a" * 200_000 + "\n1\n")


# --- cells that are empty or not finite -----------------------------------------------------------


@pytest.mark.parametrize("separator", [",", ";"])
def test_an_empty_cell_matters_only_where_its_column_is_used(tmp_path: Path, separator: str) -> None:
    read = table(tmp_path, "t_s,a,b\n0,1,\n1, ,3\n2,5,\n".replace(",", separator))
    np.testing.assert_array_equal(read["t_s"], [0, 1, 2])
    np.testing.assert_array_equal(read.columns["a"], [1, np.nan, 5])
    np.testing.assert_array_equal(read.columns["b"], [np.nan, 3, np.nan])
    with pytest.raises(InputError, match=r"table\.csv, line 3: a is not a finite number; mend that row"):
        read["a"]
    with pytest.raises(InputError, match="line 2: b is not a finite number"):
        read.stack(("t_s", "b"))


@pytest.mark.parametrize("row", ["0\t1\t", "0\t\t", "\t1\t2", "\t\t"])
def test_an_empty_cell_between_tabs(tmp_path: Path, row: str) -> None:
    read = table(tmp_path, f"t_s\ta\tb\n{row}\n5\t6\t7\n")
    found = [read.columns[name][0] for name in ("t_s", "a", "b")]
    np.testing.assert_array_equal(found, [float(cell) if cell else np.nan for cell in row.split("\t")])


@pytest.mark.parametrize("cell", ["nan", "inf", "-inf", "Infinity", "1e999", "", "1e21", "-1e300"])
def test_the_line_of_a_number_that_is_not_finite(tmp_path: Path, cell: str) -> None:
    read = table(tmp_path, f"# note\nt_s,a\n\n0,1\n\n0.5,{cell}\n1,nan\n")
    np.testing.assert_array_equal(read["t_s"], [0, 0.5, 1])
    with pytest.raises(
        InputError, match=r"table\.csv, line 6: a is (not a finite number|beyond 1e\+20); mend that row"
    ):
        read["a"]


# --- what is refused ------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("", r"is empty; it needs a header \(t_s,a\) and rows of numbers below"),
        ("\n# only this\n  \n", "is empty"),
        ("t_s,a\n", "has no rows of numbers below its header; the header reads t_s, a"),
        ("t_s,a\n# 0,1\n", "has no rows of numbers below its header"),
        ("t_s,a,t_s\n0,1,2\n", "a column stands twice in the header t_s, a, t_s; name each once"),
        ('t_s,a,"a"\n0,1,2\n', "a column stands twice"),
        ("0,1\n2,3\n", "begins with numbers; its first line must name the columns: t_s,a"),
        ("0.5;1.5\n1;2\n", "begins with numbers"),
        ("nan\tinf\n1\t2\n", "begins with numbers"),
        ("\n-1e3\n2\n", "begins with numbers"),
        ("t_s,a\n0,1\n\n2\n", r"line 4: 1 cells, but there are 2 columns \(t_s, a\); the file may be cut off"),
        ("t_s,a\n0,1,2\n", "line 2: 3 cells, but there are 2 columns"),
        ("t_s,a\n0,1\n0;1\n", "line 3: 1 cells"),
        ("t_s;a\n0;1\n# note\n0;1;5\n", "line 4: 3 cells"),
        ("t_s,a\n0,1\n0.5,one\n", "line 3: a is 'one', not a number"),
        ("t_s,a\n0,1\n0.5,1 2\n", "line 3: a is '1 2', not a number"),
        ("t_s,a\n0,0x10\n", "line 2: a is '0x10', not a number"),
        ("t_s;a\n0;1.000,5\n", r"line 2: a is '1.000,5', not a number"),
        ("t_s,a\n0,1\n0.5,2 # note\n", "line 3: a is '2 # note', not a number"),
    ],
)
def test_what_is_no_table(tmp_path: Path, content: str, message: str) -> None:
    with pytest.raises(InputError, match=rf"table\.csv.*({message})"):
        table(tmp_path, content)


def test_sizes_without_bounds(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Neither lines without end, nor a header that asks for more memory than the rows that it has."""
    monkeypatch.setattr(tables, "_MOST_LINES", 3)
    with pytest.raises(InputError, match=r"table\.csv: it has more than 3 lines, or one of 100,000 characters"):
        table(tmp_path, PLAIN + "1,2\n")
    monkeypatch.undo()
    wide = ",".join(f"column{i}" for i in range(9000))
    with pytest.raises(
        InputError, match=r"line 2: 1 cells, but there are 9000 columns \(column0, .* \.\.\.\)"
    ) as caught:
        table(tmp_path, wide + "\n0\n" * 100_000)
    assert len(str(caught.value)) < 1000
    with pytest.raises(InputError, match=r"line 2: a is '9") as caught:
        table(tmp_path, "a\n" + "9" * 90_000 + "x\n")
    assert len(str(caught.value)) < 1000


def test_files_that_cannot_be_read(tmp_path: Path) -> None:
    for path in (tmp_path, tmp_path / "nowhere.csv", "nul\0.csv"):
        with pytest.raises(InputError, match=r"^cannot read .*; give a text file$"):
            read_table(path, "t_s,a")
    for content in ("größe\n1\n".encode("latin-1"), b"\xff\xfe\x00", bytes(range(256))):
        with pytest.raises(InputError, match=r"^cannot read .*table\.csv: .*; give a text file$"):
            table(tmp_path, content)


def test_a_file_larger_than_any_table_is_not_read(tmp_path: Path) -> None:
    """One of nothing but a hole: it takes no room on the disk."""
    path = tmp_path / "large.csv"
    with path.open("wb") as file:
        file.write(b"t_s,a\n0,1\n")
        file.truncate(256 * 2**20 + 1)
    with pytest.raises(InputError, match=r"cannot read .*large\.csv: it is larger than 256 MB; give a text file"):
        read_table(path, "t_s,a")


def test_the_largest_table_is_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "table.csv"
    path.write_text(PLAIN)
    monkeypatch.setattr(tables, "_LARGEST_BYTES", len(PLAIN))
    assert read_lines(path) == [(1, "t_s,a"), (2, "0,1.5"), (3, "0.25,-2")]
    monkeypatch.setattr(tables, "_LARGEST_BYTES", len(PLAIN) - 1)
    with pytest.raises(InputError, match="it is larger than"):
        read_lines(path)


# --- time -----------------------------------------------------------------------------------------


@laws
@given(time=st.lists(st.integers(-4, 4) | numbers, min_size=1, max_size=6), strictly=st.booleans())
def test_time_rises(tmp_path_factory: pytest.TempPathFactory, time: list[float], strictly: bool) -> None:
    """Or the first line where it does not is named."""
    read = table(tmp_path_factory.mktemp("time"), "a\n" + "".join(f"{float(t)!r}\n" for t in time))
    pairs = enumerate(pairwise(time))
    bad = [k for k, (one, then) in pairs if then < one or (strictly and then - one < 1e-9)]
    if bad:
        with pytest.raises(InputError, match=rf"table\.csv, line {bad[0] + 3}: time must rise .* a = .* follows"):
            read.rising_time("a", strictly=strictly)
    else:
        np.testing.assert_array_equal(read.rising_time("a", strictly=strictly), time)


def test_time_that_stands(tmp_path: Path) -> None:
    read = table(tmp_path, "t_s,a\n0,1\n\n1,2\n1,3\n")
    np.testing.assert_array_equal(read.rising_time(strictly=False), [0, 1, 1])
    with pytest.raises(
        InputError, match="line 5: time must rise from row to row, but t_s = 1 follows 1; sort the rows"
    ):
        read.rising_time()


def test_time_that_is_none(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="line 3: t_s is not a finite number"):
        table(tmp_path, "t_s,a\n0,1\nnan,2\n").rising_time()
    with pytest.raises(InputError, match="has no column t_s"):
        table(tmp_path, "time,a\n0,1\n").rising_time()
