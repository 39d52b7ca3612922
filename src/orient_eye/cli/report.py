"""orient-eye report."""

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated, Any

import tyro


@dataclass(frozen=True)
class Report:
    """Write the evidence as one HTML page: the thesis' figures, the newer eyes, and how human it all is.

    Needs nothing but the shipped policies; a run directory of orient-eye train stands in for the shipped policy of its
    plant, case and targets. The page works from a file, without a network.

    $ orient-eye report

    $ orient-eye report --figures 5.4,5.9 --out figures

    $ orient-eye report runs/mine
    """

    runs: Annotated[tuple[Path, ...], tyro.conf.Positional, tyro.conf.arg(metavar="RUN ...")] = ()
    """Run directories whose policies are shown instead of shipped ones."""
    figures: Annotated[str | None, tyro.conf.arg(metavar="ID,ID", help_behavior_hint="(default: all)")] = None
    """Figures to make: the thesis' numbers (5.4), or names."""
    pairs: Annotated[int | None, tyro.conf.arg(help_behavior_hint="(default: as trained)")] = None
    """Random saccades on which each policy is judged."""
    out: Annotated[Path | None, tyro.conf.arg(help_behavior_hint="(default: runs/report-DATE-TIME)")] = None
    """Directory of the report, new or empty."""
    quiet: bool = False
    """Show no progress bar."""

    def run(self) -> dict[str, Any]:
        """Write the report."""
        from orient_eye.cli.tables import say
        from orient_eye.progress import progress_bar
        from orient_eye.report import Evidence, chosen_figures, write_report
        from orient_eye.run_directory import RunDirectory

        asked = None if self.figures is None else [name.strip() for name in self.figures.split(",")]
        names = chosen_figures(asked)
        evidence = Evidence(self.runs, pairs=self.pairs)
        run = RunDirectory.create(self.out, "report", asdict(self))
        with progress_bar("drawing", quiet=self.quiet) as advance:
            result = write_report(run.path, evidence, names, advance)
        result = {"out": str(run.path), **result}
        run.write_json("result.json", result)
        say(f"in {run.path}: index.html, figures/*.svg and *.png" + (", human.csv" if result["human"] else ""))
        return result
