"""orient-eye report: every figure of the thesis is there and says its number; the page needs nothing outside itself."""

import json
import re
import shutil
from html.parser import HTMLParser
from pathlib import Path

import altair
import numpy as np
import pytest

from orient_eye.cli import main
from orient_eye.errors import InputError
from orient_eye.learning.evaluation import Yardstick
from orient_eye.learning.policy import Policy, shipped_policies
from orient_eye.plants import make_plant
from orient_eye.report import EXHIBITS, Evidence, chosen_figures, write_report
from orient_eye.report.evidence import Judged
from orient_eye.report.exhibit import Drawn
from orient_eye.report.page import save_figure, write_page
from orient_eye.search.optimum import Optimum
from orient_eye.task.saccade import SaccadeTask

OF_THESIS = ["2.2", "3.5", "3.6", "4.3", "4.4", "4.5", "4.6", "4.9", *(f"5.{n}" for n in range(1, 26))]
QUICK = ("2.2", "4.9", "5.3", "5.10", "5.24")


@pytest.fixture(scope="module")
def evidence() -> Evidence:
    return Evidence(pairs=20)


@pytest.fixture(scope="module")
def folder(evidence: Evidence, tmp_path_factory: pytest.TempPathFactory) -> Path:
    place = tmp_path_factory.mktemp("report")
    write_report(place, evidence, QUICK)
    return place


class Links(HTMLParser):
    """Addresses that a browser would fetch, and ids."""

    def __init__(self) -> None:
        super().__init__()
        self.fetched: list[str] = []
        self.ids: list[str] = []
        self.anchors: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        for name, value in attrs:
            if name in ("src", "srcset", "data", "poster") or (name == "href" and tag in ("link", "image", "use")):
                self.fetched.append(value or "")
            elif name == "href":
                self.anchors.append(value or "")
            elif name == "id":
                self.ids.append(value or "")


def test_every_figure_of_the_thesis_is_in_the_report() -> None:
    assert [name for name in EXHIBITS if re.fullmatch(r"\d\.\d+", name)] == OF_THESIS
    for name in EXHIBITS:
        exhibit = EXHIBITS[name]
        assert exhibit.title
        assert exhibit.caption.endswith(".")


def test_the_page_needs_nothing_outside_itself(folder: Path) -> None:
    text = (folder / "index.html").read_text(encoding="utf-8")
    links = Links()
    links.feed(text)
    assert len(links.fetched) == len(QUICK)
    assert all(address.startswith("data:") for address in links.fetched)
    assert "@import" not in text
    assert not re.search(r"url\(|fetch\(|https?://", text)
    assert {anchor.removeprefix("#") for anchor in links.anchors} <= set(links.ids)


def test_every_figure_is_there_as_svg_and_png_and_says_its_number(folder: Path, evidence: Evidence) -> None:
    for name in QUICK:
        assert (folder / "figures" / f"{name}.svg").read_text(encoding="utf-8").rstrip().endswith("</svg>")
        assert (folder / "figures" / f"{name}.png").read_bytes().startswith(b"\x89PNG")
        drawn = EXHIBITS[name].draw(evidence)
        assert re.search(r"\d", drawn.says)
        assert drawn.says.endswith(".")


def test_the_same_evidence_gives_the_same_picture(folder: Path, evidence: Evidence, tmp_path: Path) -> None:
    write_report(tmp_path, evidence, ("4.9",))
    assert (tmp_path / "figures" / "4.9.svg").read_bytes() == (folder / "figures" / "4.9.svg").read_bytes()


def test_the_interactive_page_carries_its_script(evidence: Evidence, tmp_path: Path) -> None:
    chart = altair.Chart({"values": [{"a": 1, "b": 2, "who": "</script>"}]}).mark_point().encode(x="a:Q", y="b:Q")
    drawn = Drawn(chart, "One point.")
    svg = save_figure(drawn, tmp_path, "x")
    page = write_page(tmp_path / "index.html", {"x": (EXHIBITS["2.2"], drawn, svg)}, (), "t", "i", "m")
    text = page.read_text(encoding="utf-8")
    assert "vegaEmbed(document.getElementById" in text
    assert text.count("<script>") == text.count("</script>") == 2
    links = Links()
    links.feed(text)
    assert not links.fetched


@pytest.fixture(scope="module")
def six(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, SaccadeTask]:
    """A policy of the six-motor eye whose network of zeros acts as the usual command."""
    task = SaccadeTask.of_case(make_plant("tavares", eye="six"), "smooth", targets="gaze")
    size, place = len(task.actions.numbers), tmp_path_factory.mktemp("six")
    Policy.of_task(task, (np.zeros((6, size)),), (np.zeros(size),), case="smooth").save(place)
    return place, task


def test_policies_of_other_eyes_stand_beside_each_other(six: tuple[Path, SaccadeTask]) -> None:
    evidence = Evidence([six[0]], pairs=20)
    others = tuple(name for name in shipped_policies() if name != "six-gaze")
    assert evidence.names() == (*others, str(six[0]))  # in place of the shipped one of the same eye alone
    manifest = Policy.load("tavares-gaze").manifest
    assert manifest["task"]["plant"]["eye"] == "thesis"
    for eye, words in (("thesis", "--plant tavares --case"), ("six", "--plant tavares --eye six --case")):
        with pytest.raises(InputError, match=words):
            evidence.policy("tavares", "none", eye=eye)


def test_six_motors_have_a_chapter(six: tuple[Path, SaccadeTask]) -> None:
    """The optimum is not searched here: the usual command counts as the best."""
    place, task = six
    evidence, policy = Evidence([place]), Policy.load(place)
    start, target = task.targets.draw(8, np.random.default_rng(0))
    best = policy.act(start.orientation, target)
    reward = task.perform(start, best, target).reward.total
    pairs = Yardstick(task, start, target, Optimum(task.actions.as_plain(start, target, best), reward, 1))
    evidence._judged[str(place)] = Judged(str(place), policy, pairs, pairs, {})
    assert (
        evidence.policy("tavares", "smooth", "gaze", eye="six").title
        == f"tavares, eye six, case smooth, gaze ({place})"
    )
    says = {name: EXHIBITS[name].draw(evidence).says for name in EXHIBITS if name.startswith("six-")}
    assert list(says) == ["six-tensions", "six-antagonists", "six-main-sequence", "six-listing"]
    assert re.search(r"IR and SR -0\.9\d\d, MR and LR -0\.9\d\d, IO and SO -0\.9\d\d", says["six-antagonists"])
    assert re.search(r"horizontal V0 = \d+ deg/s, .*; vertical V0 = \d+ deg/s", says["six-main-sequence"])
    assert "Imposed on torsion: at rest all of it" in says["six-listing"]
    spread, wanted = re.findall(r"by (\d\.\d\d) deg", says["six-listing"])
    assert spread == wanted


def test_unknown_figures_and_runs_that_are_none_are_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(InputError, match=r"unknown figure '9\.9'"):
        chosen_figures(["9.9"])
    for arguments in (["--figures", "9.9"], [str(tmp_path / "none")], ["--figures", ""], ["--pairs", "0"]):
        with pytest.raises(SystemExit) as stop:
            main(["report", *arguments, "--out", str(tmp_path / "out"), "--quiet"])
        assert stop.value.code == 2
        assert not (tmp_path / "out").exists()
    capsys.readouterr()


def test_the_command_writes_what_it_says(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as stop:
        main(["report", "--figures", "4.4, 2.2", "--out", str(tmp_path / "out"), "--quiet", "--json"])
    assert stop.value.code == 0
    told = json.loads(capsys.readouterr().out)
    assert list(told["figures"]) == ["2.2", "4.4"]
    assert {path.name for path in (tmp_path / "out").iterdir()} == {"index.html", "figures", "run.json", "result.json"}


def test_a_policy_without_the_course_of_its_training_is_refused_where_that_is_shown(tmp_path: Path) -> None:
    for case in ("2-varying", "3-varying"):
        folder = tmp_path / case
        shutil.copytree(shipped_policies()[f"lpf-{case}"], folder)
        (folder / "metrics.csv").write_text("update,saccades\n0,0\n", encoding="utf-8")
    evidence = Evidence([tmp_path / "2-varying", tmp_path / "3-varying"], pairs=20)
    with pytest.raises(InputError, match=r"brings no metrics\.csv with reward_mean, gap_mean; give the run directory"):
        write_report(tmp_path / "out", evidence, ["5.23"])
    assert not (tmp_path / "out" / "index.html").exists()


def test_an_unfinished_run_is_told_so(tmp_path: Path) -> None:
    (tmp_path / "run.json").write_text("{}", encoding="utf-8")
    with pytest.raises(InputError, match="the run is not finished; go on with it by orient-eye train --resume"):
        Evidence([tmp_path])


def test_a_run_stands_in_for_the_shipped_policy_of_its_kind(tmp_path: Path) -> None:
    run = tmp_path / "run"
    shutil.copytree(shipped_policies()["lpf-1"], run)
    evidence = Evidence([run], pairs=20)
    names = evidence.names()
    assert evidence.policy("lpf", "1").title == f"lpf, case 1 ({run})"
    assert str(run) in names
    assert "lpf-1" not in names
    assert len(names) == len(shipped_policies())
    with pytest.raises(InputError, match=r"no policy of plant 'lpf' and case 'none'.*--case none"):
        Evidence().policy("lpf", "none")
