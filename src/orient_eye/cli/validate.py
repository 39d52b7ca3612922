"""orient-eye validate."""

from dataclasses import asdict, dataclass
from typing import Any


@dataclass(frozen=True)
class Validate:
    """Hold the MuJoCo eyes against the author's runs, the compiled reference and a converged solution.

    The thesis' eye and the six-motor eye; of the latter's authors no runs may be shipped.

    Prints a table of largest orientation errors; exits with 1 when one is beyond its limit.
    """

    random_runs: int = 20
    """Number of random pulse-steps of all motors of each eye, beside the author's 12 runs."""
    seed: int = 0
    """Seed of the random runs."""

    def run(self) -> dict[str, Any]:
        """Validate."""
        from rich.text import Text

        from orient_eye.cli.tables import column, say, table
        from orient_eye.validation import passed, validate

        checks = validate(random_runs=self.random_runs, seed=self.seed)
        rows = [{**asdict(check), "passed": check.passed} for check in checks]
        columns = {
            "eye": lambda row: row["eye"],
            "run": lambda row: row["run"] if len(row["run"]) < 50 else f"{row['run'][:47]}...",
            "against": lambda row: row["against"],
            "largest error": column("error_deg", ".2e", " deg"),
            "limit": lambda row: f"{row['limit_deg']:g} deg" if row["limit_deg"] < 1e9 else "none",
            "verdict": lambda row: "ok" if row["passed"] else Text("FAILED", "red"),
        }
        title = "Largest angle between two orientations over each run."
        say(table(title, columns, rows, left=("eye", "run", "against", "verdict")))
        return {"passed": passed(checks), "checks": rows}
