"""All pictures of the documentation, each as the command that its page names leaves it.

    python scripts/page_pictures.py                        # into docs/pictures
    python scripts/page_pictures.py --kinds report concept

Pages to start with are followed in a folder of their own, block by block, until their pictures are there; the report's
are those of the command on its page. The others have scripts of their own: `concept_pictures.py`, `eye_picture.py`,
`road_picture.py`.
"""

import os
import re
import shlex
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from shutil import copyfile
from tempfile import TemporaryDirectory

import tyro
from PIL import Image

import concept_pictures
import eye_picture
import road_picture
from orient_eye.errors import InputError
from orient_eye.files import write_atomically, write_text

ROOT = Path(__file__).resolve().parents[1]
DOCS = ROOT / "docs"
START = {
    "researcher": {"eye": "eye.png", "main-sequence": "runs/compared/main_sequence.png"},
    "learner": {"policy": "runs/judged/policy_output.png", "cliff": "runs/judged/reward_against_k0.png"},
    "roboticist": {"command": "runs/there/trajectory.png"},
}
"""A page to start with; of each of its pictures the name, and the file that the page's commands leave."""
WIDTH = 1100  # pixels, of a picture that is made smaller


def blocks(page: str) -> list[str]:
    """What a page to start with has a shell do, after the installation."""
    return re.findall(
        r"^```sh\n(.*?)^```$", (DOCS / "start" / f"{page}.md").read_text("utf-8"), re.DOTALL | re.MULTILINE
    )


def report_command() -> list[str]:
    """The command of the report whose pictures its page has."""
    (told,) = re.findall(r"`orient-eye (report --figures [\w.,-]+)`", (DOCS / "report.md").read_text("utf-8"))
    return shlex.split(told)


def figures() -> list[str]:
    """Names of the report's figures that its page shows."""
    return report_command()[-1].split(",")


def _shell(folder: Path, words: list[str]) -> None:
    """Run something as in a clone with orient-eye installed."""
    for name in ("scripts", "examples"):
        if not (folder / name).exists():
            (folder / name).symlink_to(ROOT / name)
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    done = subprocess.run(
        words, cwd=folder, env={**os.environ, "PATH": path}, capture_output=True, text=True, check=False
    )
    if done.returncode:
        raise InputError(f"{shlex.join(words)}: exit code {done.returncode}; {done.stderr.strip()[-800:]}")


def start(out: Path) -> None:
    """Pictures of the pages to start with."""
    for page, pictures in START.items():
        with TemporaryDirectory(prefix="orient-eye-") as folder:
            for block in blocks(page):
                if not all((Path(folder) / file).exists() for file in pictures.values()):
                    _shell(Path(folder), ["bash", "-e", "-c", block])
            for name, file in pictures.items():
                if not (Path(folder) / file).exists():
                    raise InputError(f"the commands of docs/start/{page}.md leave no {file}; mend the page or START")
                copyfile(Path(folder) / file, out / f"start-{name}.png")


def report(out: Path) -> None:
    """Pictures of the report's page, that of people as a small PNG."""
    with TemporaryDirectory(prefix="orient-eye-") as folder:
        _shell(Path(folder), ["orient-eye", *report_command(), "--out", "report"])
        for name in figures():
            drawn = Path(folder) / "report" / "figures" / name
            if name == "human":
                with Image.open(f"{drawn}.png") as large:
                    size = WIDTH, round(large.height * WIDTH / large.width)
                    small = large.convert("RGB").resize(size, Image.Resampling.LANCZOS)
                few = small.quantize(256, dither=Image.Dither.NONE)
                write_atomically(out / "report-human.png", partial(few.save, optimize=True))
            else:
                copyfile(f"{drawn}.svg", out / f"report-{name}.svg")


def concept(out: Path) -> None:
    """Pictures of the concepts' page."""
    concept_pictures.main(out)


def eye(out: Path) -> None:
    """The eye in the viewer."""
    eye_picture.main(eye_picture.EyePicture(out / "eye.png"))


def road(out: Path) -> None:
    """The data's road."""
    write_text(out / "road.svg", road_picture.picture(road_picture.curves()))


KINDS: dict[str, Callable[[Path], None]] = {
    "concept": concept,
    "eye": eye,
    "report": report,
    "road": road,
    "start": start,
}
"""Begin of a picture's name, and what makes those."""


def pictures() -> set[str]:
    """Names of all files."""
    names = {f"start-{name}.png" for made in START.values() for name in made}
    names |= {f"report-{name}.{'png' if name == 'human' else 'svg'}" for name in figures()}
    return names | {f"concept-{name}.svg" for name in concept_pictures.DRAWN} | {"eye.png", "road.svg"}


@dataclass(frozen=True)
class PagePictures:
    """Make pictures of the documentation."""

    out: Path = DOCS / "pictures"
    """Folder of the pictures."""
    kinds: tuple[str, ...] = tuple(KINDS)
    """Which, by the begin of their names."""


if __name__ == "__main__":
    wanted = tyro.cli(PagePictures, description=__doc__)
    try:
        for kind in wanted.kinds:
            if kind not in KINDS:
                raise InputError(f"no pictures are called {kind!r}; choose from {', '.join(KINDS)}")
            KINDS[kind](wanted.out)
    except InputError as error:
        sys.exit(f"error: {error}")
