"""The floors of the house: a module imports only from its own floor or below, and nothing goes in circles."""

import ast
from pathlib import Path

import pytest

import orient_eye

SOURCE = Path(orient_eye.__file__).parent
FLOORS = [
    ["errors", "cached", "checks", "constants", "words", "registry", "resources"],
    ["files", "tables", "rotations", "listing", "motor", "state", "progress", "run_directory", "rig"],
    ["commands"],
    ["movement", "human"],
    ["eyes", "surrogate", "modal_surrogate"],
    ["plants"],
    ["task", "statics"],
    ["search"],
    ["recording", "exchange"],
    ["environments"],
    ["sysid", "learning", "figures", "validation"],
    ["report"],
    ["cli", "__main__"],
]
"""From the lowest up; a name is a module or a package of orient_eye. docs: CONTRIBUTING.md."""
FLOOR = {name: height for height, names in enumerate(FLOORS) for name in names}
MODULES = {
    ".".join(file.relative_to(SOURCE).with_suffix("").parts).removesuffix(".__init__"): file
    for file in sorted(SOURCE.rglob("*.py"))
}


def imports(file: Path) -> set[str]:
    """Modules of ours that a file imports, also inside its functions, but not for type checkers only."""
    found = set()

    def visit(node: ast.AST) -> None:
        if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING":
            return
        if isinstance(node, ast.Import):
            found.update(alias.name for alias in node.names)
        if isinstance(node, ast.ImportFrom) and node.module:
            assert not node.level, f"{file}: relative import"
            inside = {f"{node.module}.{alias.name}" for alias in node.names}
            found.update(name if name.removeprefix("orient_eye.") in MODULES else node.module for name in inside)
        for child in ast.iter_child_nodes(node):
            visit(child)

    visit(ast.parse(file.read_text(encoding="utf-8")))
    return {name.removeprefix("orient_eye.") for name in found if name.startswith("orient_eye.")}


GRAPH = {name: imports(file) for name, file in MODULES.items() if name != "__init__"}


def test_every_module_has_a_floor() -> None:
    homeless = {name for name in GRAPH if name.split(".")[0] not in FLOOR}
    assert not homeless, f"add {homeless} to FLOORS"


@pytest.mark.parametrize("module", GRAPH)
def test_no_import_from_a_higher_floor(module: str) -> None:
    height = FLOOR[module.split(".", maxsplit=1)[0]]
    higher = {name for name in GRAPH[module] if FLOOR[name.split(".")[0]] > height}
    assert not higher, f"{module} imports {higher} from above"


def test_nothing_goes_in_circles() -> None:
    done: set[str] = set()

    def follow(module: str, way: tuple[str, ...]) -> None:
        assert module not in way, f"circle: {' -> '.join((*way[way.index(module) :], module))}"
        if module in done:
            return
        for following in sorted(GRAPH.get(module, ())):
            if following != module:
                follow(following, (*way, module))
        done.add(module)

    for module in GRAPH:
        follow(module, ())


def test_the_test_sees_imports_inside_functions(tmp_path: Path) -> None:
    file = tmp_path / "module.py"
    file.write_text("def f():\n    from orient_eye.task.judge import JUDGES\n    import orient_eye.files\n")
    assert imports(file) == {"task.judge", "files"}
