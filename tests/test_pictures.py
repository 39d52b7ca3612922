"""The pictures of the documentation: small, whole, the same each time, and safe to show anywhere."""

import re
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from PIL import Image

from orient_eye.learning.policy import Policy
from orient_eye.task.targets import saccades
from page_pictures import KINDS, START, blocks, figures, pictures
from road_picture import COLUMNS, LAYERS, Curves, curves, picture

PICTURES = Path(__file__).resolve().parents[1] / "docs" / "pictures"
_SVG = "{http://www.w3.org/2000/svg}"


@pytest.fixture(scope="module")
def what() -> Curves:
    """Of the road: the policy's saccade and what stands beside it."""
    return curves()


def words(text: str) -> list[str]:
    return [element.text or "" for element in ElementTree.fromstring(text).iter(f"{_SVG}text")]


def test_the_road_asks_nothing_of_the_page_it_stands_on() -> None:
    text = (PICTURES / "road.svg").read_text(encoding="utf-8")
    root = ElementTree.fromstring(text)
    assert len(text.encode()) < 60_000
    assert {element.tag.removeprefix(_SVG) for element in root.iter()} <= {
        *("svg", "g", "title", "desc", "rect", "path", "circle", "text")
    }
    assert not re.search(r"href|url\(|@import|@font-face|\son\w+=|NaN|nan|inf\b", text)
    background = next(root.iter(f"{_SVG}rect"))
    assert root.get("viewBox") == f"0 0 {background.get('width')} {background.get('height')}"
    assert {*COLUMNS, *(layer[0] for layer in LAYERS), "learner", "sysid", "search"} <= set(words(text))


def test_the_road_is_what_the_script_draws(what: Curves) -> None:
    """To the stroke on one machine; simulated curves differ in the last digit on others, so here its words and size."""
    kept = (PICTURES / "road.svg").read_text(encoding="utf-8")
    drawn = picture(what)
    assert drawn == picture(what)
    assert words(kept) == words(drawn)
    assert abs(len(kept) / len(drawn) - 1) < 0.02, "python scripts/road_picture.py"


def test_the_curves_of_the_road_are_the_policys(what: Curves) -> None:
    task = Policy.load("mujoco-1").task()
    start, target = saccades(task.targets, [[0.0]], [[20.0]])
    action = Policy.load("mujoco-1").act(start.orientation, target)
    made = task.perform(start, action, target)
    assert abs(what.gaze[-1] - made.measures.amplitude_deg[0]) < 0.05
    assert what.worse.max() > 1.05 * what.gaze.max(), "the one beside it overshoots"
    assert np.argmax(what.reward) not in (0, len(what.reward) - 1)
    assert what.reward.max() >= made.reward.total[0] - 50
    assert np.abs(what.stepped - what.fitted).max() < 0.5, "the surrogate is near the eye"


def test_every_picture_is_made_by_the_script() -> None:
    kept = {file.name for file in PICTURES.iterdir()}
    assert kept == pictures()
    assert {re.split(r"[-.]", name)[0] for name in kept} == set(KINDS)


def test_pages_to_start_with_have_commands_for_their_pictures() -> None:
    for page, made in START.items():
        commands = "".join(blocks(page))
        assert commands.count("orient-eye") >= 2
        for file in made.values():
            assert str(Path(file).parent) in commands or file in commands, file


def test_the_reports_pictures_are_on_its_page() -> None:
    page = (PICTURES.parent / "report.md").read_text(encoding="utf-8")
    assert sorted(re.findall(r"pictures/report-([\w.-]+)\.(?:svg|png)", page)) == sorted(figures())
    with Image.open(PICTURES / "report-human.png") as image:
        assert image.width == 1100


def test_the_picture_of_the_eye_is_small_and_shows_something() -> None:
    file = PICTURES / "eye.png"
    assert file.stat().st_size < 400_000
    with Image.open(file) as image:
        assert 1200 <= image.width <= 1600
        colours = image.convert("RGB").getcolors(2**24) or []
        assert len(colours) > 100
