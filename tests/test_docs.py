"""The pages: every one is in the site, every link leads somewhere, every command line is one, notebooks are kept bare.

`make docs` builds the site of them, with any warning an error, and runs the notebooks.
"""

import json
import re
import shlex
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from orient_eye.cli import COMMANDS
from orient_eye.cli.options import parse
from orient_eye.registry import load

pytest.importorskip("sphinx", reason="pip install 'orient-eye[docs]'")
import docstrings
import elsewhere
import made_pages
import nothing_outside

ROOT = Path(__file__).resolve().parents[1]
DOCS = ROOT / "docs"
MADE = (DOCS / "_build", DOCS / "elsewhere", DOCS / "reference" / "commands", DOCS / "reference" / "python")
"""Of a build, and in no checkout."""


def pages(pattern: str) -> list[Path]:
    return sorted(page for page in DOCS.rglob(pattern) if not any(page.is_relative_to(made) for made in MADE))


NOTEBOOKS = pages("*.ipynb")
SITE = [*pages("*.md"), *NOTEBOOKS]
PAGES = [
    *(ROOT / name for name in ("README.md", "CONTRIBUTING.md", "CHANGELOG.md")),
    *(ROOT / "models").rglob("*.md"),
    *SITE,
]
ADDED = re.compile(r"--(?:plant|pulse|case) (?:spring|bell|calm)\b")
"""Of the packages that pages have as examples; other tests build them and run their command lines."""
OPTION = re.compile(r"(?<!\S)--[a-z][a-z0-9-]*")


def markdown(page: Path) -> str:
    text = page.read_text(encoding="utf-8")
    if page.suffix == ".md":
        return text
    return "\n\n".join("".join(cell["source"]) for cell in json.loads(text)["cells"] if cell["cell_type"] == "markdown")


def name_of(page: Path) -> str:
    return page.relative_to(ROOT).as_posix()


@pytest.fixture(scope="module", params=PAGES, ids=name_of)
def page(request: pytest.FixtureRequest) -> Path:
    return Path(request.param)


def test_there_are_pages() -> None:
    assert len(PAGES) > 25
    assert len(NOTEBOOKS) > 1


def in_toctrees() -> set[str]:
    blocks = re.findall(r"```\{toctree\}\n(.*?)```", (DOCS / "index.md").read_text(encoding="utf-8"), re.DOTALL)
    return {line for block in blocks for line in block.splitlines() if line and not line.startswith(":")}


def test_every_page_is_in_the_site_once() -> None:
    """The pages of a folder are chapters of its README."""
    chapters = {page for page in SITE if page.with_name("README.md") in SITE and page.name != "README.md"}
    named = [page.relative_to(DOCS).with_suffix("").as_posix() for page in SITE if page not in chapters]
    assert set(named) - {"index"} == {name for name in in_toctrees() if not name.startswith("elsewhere/")}
    outside = {name.removeprefix("elsewhere/") + ".md" for name in in_toctrees() if name.startswith("elsewhere/")}
    assert outside <= set(elsewhere.copied())


def slug(heading: str) -> str:
    """The anchor of a heading, as GitHub makes it."""
    return re.sub(r"[^\w\- ]", "", re.sub(r"[`*]|\]\([^)]*\)", "", heading).strip().lower()).replace(" ", "-")


def anchors(text: str) -> set[str]:
    outside_blocks = re.sub(r"^```.*?^```", "", text, flags=re.DOTALL | re.MULTILINE)
    return {slug(heading) for heading in re.findall(r"^#{1,6} +(.+)$", outside_blocks, re.MULTILINE)}


def test_links_lead_to_files_and_headings_that_are_there(page: Path) -> None:
    for link in re.findall(r"\]\((?!\w+:)([^()\s]+)\)", markdown(page)):
        path, _, anchor = link.partition("#")
        target = page.parent / path if path else page
        assert target.exists(), f"{name_of(page)} links to {link}"
        if anchor and target.suffix in (".md", ".ipynb"):
            assert anchor in anchors(markdown(target)), f"{name_of(page)} links to {link}"


FOLDERS = ("src", "eye_mjcf", "models", "tests", "scripts", "benchmarks", "examples", "docs", ".ci")
NAMED = re.compile(rf"(?<![\w./-])(?:{'|'.join(map(re.escape, FOLDERS))})/[\w./*-]*\w(?![\w/])")


def test_files_that_are_named_are_there(page: Path) -> None:
    """In prose, in backticks and in command lines; tests/test_wheel.py has that all of them are shipped."""
    named = {path for path in NAMED.findall(markdown(page)) if not any((ROOT / path).is_relative_to(m) for m in MADE)}
    assert [path for path in sorted(named) if not any(ROOT.glob(path))] == []


def test_pages_name_many_files() -> None:
    assert len({path for each in PAGES for path in NAMED.findall(markdown(each))}) > 70


def test_the_test_of_links_knows_headings() -> None:
    assert anchors("# The eye: `orient-eye listing`\n\n```sh\n# none\n```\n## What it is, [now](a.md)\n") == {
        "the-eye-orient-eye-listing",
        "what-it-is-now",
    }


def command_lines(text: str) -> Iterator[list[str]]:
    """Arguments of `orient-eye` on each line of a block."""
    fenced = re.findall(r"^```\w*\n(.*?)^```", text, re.DOTALL | re.MULTILINE)
    for line in [*re.findall(r"^ {4,}.*$", text, re.MULTILINE), *"".join(fenced).splitlines()]:
        given = re.match(r"[ $]*(?:\S*/)?orient-eye (.*)", line)
        if given:
            yield shlex.split(ADDED.sub("", given[1]).split(" && ")[0], comments=True)


def mentions(text: str) -> Iterator[list[str]]:
    """The same inside backticks, where a command is often named without all that it needs."""
    return (told.split() for told in re.findall(r"`orient-eye\s([^`]+)`", text))


@pytest.fixture(scope="module")
def helps() -> dict[str, str]:
    """What each command's `--help` says."""
    program = (
        "import io, json, sys; from contextlib import redirect_stdout as to, suppress; from orient_eye.cli import *\n"
        "def told(name):\n"
        "    with to(io.StringIO()) as page, suppress(SystemExit): main([name, '--help'])\n"
        "    return page.getvalue()\n"
        "json.dump({name: told(name) for name in COMMANDS}, sys.stdout)\n"
    )
    done = subprocess.run([sys.executable, "-c", program], check=True, capture_output=True, text=True)
    return dict(json.loads(done.stdout))


def test_command_lines_are_understood(page: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """As they stand, to the last option and value."""
    for name, *rest in command_lines(markdown(page)):
        if name not in ("--help", "--version", "COMMAND"):
            assert name in COMMANDS, f"{name_of(page)}: orient-eye {name}"
            try:
                parse(load(COMMANDS[name]), [word for word in rest if word != "--json"], program=name)
            except SystemExit:
                pytest.fail(f"{name_of(page)}: orient-eye {shlex.join([name, *rest])}\n{capsys.readouterr().err}")


def test_mentions_have_commands_and_options_that_are_there(page: Path, helps: dict[str, str]) -> None:
    for name, *rest in mentions(markdown(page)):
        if name not in ("--help", "--version", "COMMAND"):
            assert name in COMMANDS, f"{name_of(page)}: orient-eye {name}"
            for option in (word.split("=")[0] for word in rest if re.fullmatch(r"--[a-z].*", word)):
                known = {"--json", *OPTION.findall(helps[name])}
                assert option in known, f"{name_of(page)}: orient-eye {name} {option}"


def test_pages_have_many_command_lines() -> None:
    assert sum(len(list(command_lines(markdown(each)))) for each in PAGES) > 100
    assert sum(len(list(mentions(markdown(each)))) for each in PAGES) > 50


def test_a_commands_page_has_its_help(helps: dict[str, str]) -> None:
    """All options, and the examples of its docstring; plain text."""
    made = dict(made_pages.commands())
    assert made.keys() == {f"{name}.md" for name in COMMANDS}
    for name, told in helps.items():
        page = made[f"{name}.md"]
        assert set(OPTION.findall(told)) <= set(OPTION.findall(page)), name
        assert set(re.findall(r"^\$ (orient-eye .*)$", told, re.MULTILINE)) <= set(page.splitlines()), name
        assert "\x1b" not in page


def test_a_help_page_that_is_read_wrongly_is_an_error(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(made_pages, "main", lambda arguments: print("usage: another form"))
    with pytest.raises(RuntimeError, match="orient-eye simulate --help has no options"):
        dict(made_pages.commands())


def test_names_of_orient_eye_are_described_where_the_reference_says() -> None:
    import orient_eye

    named = {name: (home, words) for name, home, words in made_pages.public()}
    assert named.keys() == set(orient_eye.__all__)
    described = {name for _, names in made_pages.modules() for name in names}
    for name, (home, words) in named.items():
        module, _, last = home.rpartition(".")
        assert last == name
        assert getattr(sys.modules[module], name) is getattr(orient_eye, name)
        assert module in described, f"{name} is described in {module}, which has no page"
        assert words, f"nothing is said of {name}"


@pytest.mark.parametrize("notebook", NOTEBOOKS, ids=name_of)
def test_notebooks_are_valid_and_kept_without_outputs(notebook: Path) -> None:
    nbformat = pytest.importorskip("nbformat")
    read = nbformat.read(notebook, as_version=nbformat.NO_CONVERT)
    nbformat.validate(read)
    code = [cell for cell in read.cells if cell.cell_type == "code"]
    assert len(code) > 3
    assert all(cell.outputs == [] and cell.execution_count is None for cell in code)
    assert all(not cell.metadata for cell in read.cells)
    assert read.metadata == {"kernelspec": {"display_name": "Python 3", "language": "python", "name": "python3"}}


@pytest.mark.parametrize(
    ("page", "link", "leads_to"),
    [
        ("docs/eye.md", "six.md", "six.md"),
        ("docs/index.md", "../CONTRIBUTING.md", "elsewhere/CONTRIBUTING.md"),
        ("docs/index.md", "../README.md", "index.md"),
        ("docs/start/learner.md", "../../CHANGELOG.md", "../elsewhere/CHANGELOG.md"),
        ("docs/elsewhere/CONTRIBUTING.md", "docs/decisions", "../decisions/README.md"),
        ("docs/elsewhere/CONTRIBUTING.md", "CHANGELOG.md", "CHANGELOG.md"),
        ("docs/elsewhere/models/README.md", "../docs/policies.md", "../../policies.md"),
        ("docs/elsewhere/models/README.md", "weights.json", "../../../models/weights.json"),
    ],
)
def test_links_of_pages_outside_docs_are_turned(page: str, link: str, leads_to: str) -> None:
    assert elsewhere.on_site(page, link) == leads_to


def test_docstrings_are_turned() -> None:
    told = [
        "Move `eyes` of |D - F| deg; see `Plant` and `a b`s.",
        "",
        "    move(x)  # `as it is`",
        "",
        "| a | b |",
        "|---|---|",
        "| `c` | R_ |",
        "",
        "Args:",
        "    x: a *star*.",
    ]
    turned = "\n".join(docstrings.converted(told))
    assert list(docstrings.converted(["A move.", "", "made = move(x)", "made.end"]))[-4:] == [
        *("", "    made = move(x)", "    made.end", ""),
    ]
    assert r":py:obj:`eyes <eyes>` of \|D - F\| deg" in turned
    assert ":py:obj:`Plant <orient_eye.plants.Plant>` and ``a b``\\ s." in turned
    assert "::\n\n    move(x)  # `as it is`" in turned
    assert re.search(r"list-table::\n +:header-rows: 1\n\n +\* - a\n +- b\n +\* - :py:obj:`c <c>`\n +- R\\_", turned)
    assert turned.endswith("Args:\n    x: a \\*star\\*.")


@pytest.mark.parametrize(
    ("text", "loaded"),
    [
        ('<a href="https://a.org">a</a><img src="b.png"><link rel="canonical" href="https://a.org">', []),
        ('<script src="https://cdn.org/mathjax.js"></script>', ["https://cdn.org/mathjax.js"]),
        ('<link rel="stylesheet" href="//fonts.org/a.css">', ["//fonts.org/a.css"]),
        ('<img srcset="a.png 1x, https://a.org/b.png 2x">', ["https://a.org/b.png 2x"]),
        ("<style>@import 'https://a.org/c.css'; p { color: red }</style>", ["https://a.org/c.css"]),
        ('<p style="background: url(https://a.org/d.png)">', ["https://a.org/d.png"]),
    ],
)
def test_what_a_page_loads_from_elsewhere_is_found(text: str, loaded: list[str]) -> None:
    assert nothing_outside.loaded(text) == loaded


def test_what_a_style_sheet_loads_from_elsewhere_is_found() -> None:
    assert nothing_outside.loaded("a { src: url('//f.org/x.woff') } b { src: url(y.woff) }", style=True) == [
        "//f.org/x.woff"
    ]
