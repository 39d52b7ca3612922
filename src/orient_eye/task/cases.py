"""The learning cases: a kind of motor command, and how it is learned (the thesis' five: its Chapter 5).

Another case is a line in `CASES`, or an entry point `orient_eye.cases` of a package of your own. Its weights
are solved on the plant where nobody has solved them (`known_weights`).
"""

from dataclasses import dataclass

from orient_eye.registry import Registry


@dataclass(frozen=True)
class Case:
    """A kind of motor command.

    Attributes:
        pulse: a name of `orient_eye.commands.pulses.PULSES` (thesis 4.3).
        C: onset rate [1/s], "varying" for the one that brings the motor to its speed limit, None for the pulse's
            fixed value or where it has none.
        summary: for people.
        judge: a name of `orient_eye.task.judge.JUDGES`; None for that of the targets.
        B: bounds of B [1/s], where the thesis' are too narrow; None for the plant's own.
    """

    pulse: str
    C: float | str | None = None
    summary: str = ""
    judge: str | None = None
    B: tuple[float, float] | None = None


CASES: Registry[Case] = Registry(
    "case",
    {
        "1": Case("1", None, "thesis 5.1"),
        "2-fixed": Case("2", None, "thesis 5.2.1"),
        "2-varying": Case("2", "varying", "thesis 5.2.2"),
        "3-fixed": Case("3", None, "thesis 5.3.1"),
        "3-varying": Case("3", "varying", "thesis 5.3.2"),
        "smooth": Case("smooth", None, "a pulse that begins gently: the motor starts from rest"),
        "human": Case("3", None, "people's main sequence (docs/human.md)", "impatient", (18.0, 300.0)),
    },
    Case,
)
"""Name to case."""
