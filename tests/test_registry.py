"""Registries: names without loading what is behind them, entries of other packages, errors that list what there is."""

import subprocess
import sys
from pathlib import Path

import pytest

from orient_eye.commands.pulses import PULSES
from orient_eye.errors import InputError
from orient_eye.eyes import EYES
from orient_eye.plants import PLANTS
from orient_eye.registry import Registry, load
from orient_eye.task.actions import ACTIONS
from orient_eye.task.cases import CASES
from orient_eye.task.judge import JUDGES
from orient_eye.task.targets import TARGETS


@pytest.fixture
def installed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Another package, as pip lays it down: it adds three gadgets, and one of them cannot be loaded."""
    module = "THING = object()\nBEFORE = object()\nNOT_OURS = object()\n"
    (tmp_path / "gadget_package.py").write_text(module, encoding="utf-8")
    (tmp_path / "gadget_broken.py").write_text("raise RuntimeError('no licence')\n", encoding="utf-8")
    information = tmp_path / "gadget_package-0.1.dist-info"
    information.mkdir()
    (information / "METADATA").write_text("Metadata-Version: 2.1\nName: gadget-package\nVersion: 0.1\n")
    (information / "entry_points.txt").write_text(
        "[orient_eye.gadgets]\n"
        "their-first = gadget_package:THING\n"
        "their-second = gadget_package:BEFORE\n"
        "broken = gadget_broken:THING\n"
        "nowhere = gadget_package:MISSING\n"
        "ours = gadget_package:NOT_OURS\n"
        "[orient_eye.others]\n"
        "another = gadget_package:THING\n"
    )
    monkeypatch.syspath_prepend(tmp_path)
    for name in ("gadget_package", "gadget_broken"):
        monkeypatch.delitem(sys.modules, name, raising=False)
    return tmp_path


# --- ours -----------------------------------------------------------------------------------------


def test_entries_in_their_order() -> None:
    thing = object()
    registry: Registry[object] = Registry("thing", {"z": thing, "a": 3})
    assert list(registry) == ["z", "a"]
    assert len(registry) == 2
    assert registry["z"] is thing
    assert dict(registry) == {"z": thing, "a": 3}
    assert "a" in registry
    assert "b" not in registry
    assert 3 not in registry


def test_an_entry_is_loaded_when_it_is_asked_for(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "registry_lazy.py").write_text("THING = object()\n", encoding="utf-8")
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.delitem(sys.modules, "registry_lazy", raising=False)
    registry: Registry[object] = Registry("lazy thing", {"one": "registry_lazy:THING"})
    assert list(registry) == ["one"]
    assert "one" in registry
    assert len(registry) == 1
    assert "registry_lazy" not in sys.modules
    thing = registry["one"]
    assert thing is sys.modules["registry_lazy"].THING  # type: ignore[attr-defined]
    assert registry["one"] is thing


def test_load() -> None:
    assert load("orient_eye.registry:Registry") is Registry
    with pytest.raises(AttributeError, match="Nothing"):
        load("orient_eye.registry:Nothing")


def test_unknown_names_are_refused() -> None:
    registry: Registry[int] = Registry("thing", {"z": 1, "a": 2})
    with pytest.raises(InputError, match=r"^unknown thing 'b'; choose one of z, a$"):
        registry["b"]


def test_an_entry_for_this_process() -> None:
    registry: Registry[int] = Registry("thing", {"z": 1})
    registry.register("a", 2)
    assert dict(registry) == {"z": 1, "a": 2}
    for taken in ("z", "a"):
        with pytest.raises(InputError, match=rf"^there is a thing '{taken}' already; choose another name$"):
            registry.register(taken, 3)
    assert dict(registry) == {"z": 1, "a": 2}
    assert "a" not in Registry("thing", {"z": 1})


# --- other people's -------------------------------------------------------------------------------


def test_an_installed_package_adds_entries(installed: Path) -> None:
    """Its names are listed without it; ours is not replaced by one of the same name."""
    ours = object()
    registry: Registry[object] = Registry("gadget", {"ours": ours})
    assert next(iter(registry)) == "ours"
    assert set(registry) == {"ours", "their-first", "their-second", "broken", "nowhere"}
    assert len(registry) == 5
    assert "their-first" in registry
    assert "another" not in registry
    assert not {"gadget_package", "gadget_broken"} & set(sys.modules)
    assert registry["ours"] is ours
    assert registry["their-first"] is sys.modules["gadget_package"].THING  # type: ignore[attr-defined]
    assert registry["their-first"] is registry["their-first"]
    with pytest.raises(InputError, match="there is a gadget 'their-second' already"):
        registry.register("their-second", object())


@pytest.mark.parametrize(("name", "reason"), [("broken", "no licence"), ("nowhere", "MISSING")])
def test_an_entry_that_cannot_be_loaded_names_its_package(installed: Path, name: str, reason: str) -> None:
    """And does not keep the others from being used."""
    registry: Registry[object] = Registry("gadget", {})
    message = rf"^gadget '{name}' of package gadget-package cannot be loaded: .*{reason}"
    for _ in range(2):
        with pytest.raises(InputError, match=message):
            registry[name]
    assert registry["their-first"] is not None
    with pytest.raises(InputError, match=r"unknown gadget 'mine'; choose one of .*their-first"):
        registry["mine"]


def test_the_order_does_not_depend_on_what_was_asked_for(installed: Path) -> None:
    registry: Registry[object] = Registry("gadget", {"ours": object()})
    before = list(registry)
    for name in ("their-second", "their-first"):
        assert registry[name] is not None
    assert list(registry) == before


# --- those of this project ------------------------------------------------------------------------


def test_the_groups_of_entry_points() -> None:
    """Other people's packages name them: the word in the singular is not to change."""
    words = [registry.what for registry in (PLANTS, EYES, PULSES, CASES, TARGETS, JUDGES, ACTIONS)]
    assert words == ["plant", "eye", "pulse", "case", "target", "judge", "action"]


@pytest.mark.parametrize(
    "registry", [PLANTS, EYES, PULSES, CASES, TARGETS, JUDGES, ACTIONS], ids=lambda each: each.what
)
def test_every_entry_of_ours_loads(registry: "Registry[object]") -> None:
    assert len(registry) == len(set(registry)) > 0
    for name in registry:
        assert not isinstance(registry[name], str), name
        with pytest.raises(InputError, match="already"):
            registry.register(name, object())


def test_names_are_listed_without_what_computes() -> None:
    code = (
        "import sys; from orient_eye.plants import PLANTS; from orient_eye.eyes import EYES; "
        "print(list(PLANTS)[:3], len(EYES) > 0, {'mujoco', 'scipy', 'torch'} & set(sys.modules))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "['lpf', 'mujoco', 'tavares'] True set()"
