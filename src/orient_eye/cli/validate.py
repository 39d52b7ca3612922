"""orient-eye validate."""

from dataclasses import asdict, dataclass
from typing import Any


@dataclass(frozen=True)
class Validate:
    """Hold the MuJoCo eye against the author's runs, the NumPy reference and a converged solution.

    Prints a table of largest orientation errors; exits with 1 when one is beyond its limit.
    """

    random_runs: int = 20
    """Random pulse-steps of all three motors, beside the author's 12 runs."""
    seed: int = 0
    """Of the random runs."""

    def run(self) -> dict[str, Any]:
        """Validate."""
        from rich.table import Table

        from orient_eye.cli import say
        from orient_eye.errors import InputError
        from orient_eye.validation import passed, validate

        if self.random_runs < 0 or self.seed < 0:
            raise InputError(f"--random-runs and --seed must not be negative, got {self.random_runs} and {self.seed}")
        checks = validate(random_runs=self.random_runs, seed=self.seed)
        table = Table("run", "against", "largest error", "limit", "")
        for check in checks:
            short = check.run if len(check.run) < 50 else check.run[:47] + "..."
            limit = f"{check.limit_deg:g} deg" if check.limit_deg < 1e9 else "none"
            verdict = "ok" if check.passed else "[red]FAILED[/red]"
            table.add_row(short, check.against, f"{check.error_deg:.2e} deg", limit, verdict)
        say(table)
        return {"passed": passed(checks), "checks": [{**asdict(c), "passed": c.passed} for c in checks]}
