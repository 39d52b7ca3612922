"""All figures of the report, in the order in which it shows them."""

from orient_eye.registry import Registry
from orient_eye.report import chapter2, chapter3, chapter4, chapter5, left_open, likeness, ours, six
from orient_eye.report.exhibit import Exhibit

EXHIBITS: Registry[Exhibit] = Registry(
    "figure",
    {
        **chapter2.EXHIBITS,
        **chapter3.EXHIBITS,
        **chapter4.EXHIBITS,
        **chapter5.EXHIBITS,
        **ours.EXHIBITS,
        **six.EXHIBITS,
        **left_open.EXHIBITS,
        **likeness.EXHIBITS,
    },
    Exhibit,
)
"""Id to figure, the thesis' number where it has one; another package adds its own by the entry points
`orient_eye.figures`."""
