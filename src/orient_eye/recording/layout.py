"""How a recording of saccades is laid out in the Rerun viewer: tabs, plots, colours.

The first tab compares all saccades, if there are several; then comes one tab a saccade. Of groups the first tab
compares all, each in a plot of its own; then comes a tab a group, in which those tabs stand. All stand on one timeline,
so the time cursor stays where it is when another saccade is picked.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from orient_eye.recording.curves import Plot
from orient_eye.recording.rotation_vectors import RotationVectors
from orient_eye.recording.scene import TIMELINE, Colour, Scene

Array = NDArray[np.float64]
SACCADE_COLOURS = np.array(
    [[90, 140, 255], [50, 200, 220], [90, 210, 110], [235, 215, 70], [250, 150, 60], [240, 80, 90], [220, 100, 210]]
)
"""Colours of saccades, by title; more than seven are mixed from them."""
_BEYOND = 1.12  # of a saccade's duration: how far plots go, so that the last tick has room
_SPEED, _SEQUENCE_SPEED = 0.1, 0.4  # of playing: a saccade lasts some tenths of a second


@dataclass(frozen=True)
class SaccadeTab:
    """One saccade of a recording.

    Attributes:
        index: in the trajectory's batch.
        root: its entity path; what is drawn in 3-D is under root/scene.
        title: name of its tab.
        group: name of the tab it stands in, or "".
        colour: of its curves and its line of sight; the same for the same title in every group.
    """

    index: int
    root: str
    title: str
    group: str
    colour: Colour


def saccade_colours(titles: Sequence[str]) -> list[Colour]:
    """A colour for each title; equal titles have equal colours."""
    distinct = list(dict.fromkeys(titles))
    anchors = len(SACCADE_COLOURS)
    places = np.arange(len(distinct)) if len(distinct) <= anchors else np.linspace(0, anchors - 1, len(distinct))
    mixed = np.stack([np.interp(places, np.arange(anchors), c) for c in SACCADE_COLOURS.T], axis=-1).astype(int)
    colours: dict[str, Colour] = {title: (c[0], c[1], c[2]) for title, c in zip(distinct, mixed.tolist(), strict=True)}
    return [colours[title] for title in titles]


def blueprint(
    saccades: Sequence[SaccadeTab],
    plots: Sequence[Plot],
    compared: Sequence[Plot],
    scene: Scene,
    vectors: RotationVectors | None = None,
    *,
    lasts_s: float,
) -> Any:
    """The viewer's layout.

    Args:
        saccades: those to show.
        plots: of each saccade's tab.
        compared: of the first tab, all saccades in each.
        scene: what is drawn in 3-D.
        vectors: what is drawn of rotation vectors, or None.
        lasts_s: how long a saccade lasts [s].
    """
    import rerun.blueprint as rrb

    until_s = _BEYOND * lasts_s

    def listing(shown: Sequence[SaccadeTab]) -> list[Any]:
        return [_vectors_view(vectors, [f"{s.root}/listing/**" for s in shown])] if vectors else []

    def gaze(shown: Sequence[SaccadeTab]) -> list[Any]:
        return [_gaze_view(scene, [f"{s.root}/scene" for s in shown])] if scene.graticule.around_deg else []

    def tab(saccade: SaccadeTab) -> rrb.Horizontal:
        eye = _eye_view(scene, "eye", [f"{saccade.root}/scene/**"])
        if any(p.row for p in plots):
            more = [*gaze([saccade]), *listing([saccade])]
            views = rrb.Vertical(eye, *more, row_shares=[2, *(1 for _ in more)])
            rows = rrb.Vertical(*_rows(plots, saccade, until_s))
            return rrb.Horizontal(views, rows, column_shares=[2, 3], name=saccade.title)
        beside = [_plot(p, [saccade], until_s=until_s) for p in plots] + listing([saccade])
        return rrb.Horizontal(
            rrb.Vertical(eye, *gaze([saccade])), rrb.Grid(*beside, grid_columns=2), name=saccade.title
        )

    def together(shown: Sequence[SaccadeTab], *more: Any) -> rrb.Horizontal:
        """A tab that compares saccades."""
        lines = [line for s in shown for line in _lines(f"{s.root}/scene", scene.gaze)]
        name = f"eye of {shown[0].title}, lines of sight of all"
        fan = _eye_view(scene, name, [f"{shown[0].root}/scene/**", *lines])
        beside = [_plot(p, shown, until_s=until_s) for p in compared]
        if len(beside) < 4:
            return rrb.Horizontal(fan, rrb.Grid(*beside, *more, grid_columns=2), name="all saccades")
        views = [*gaze(shown), *listing(shown)] or more
        grid = rrb.Grid(*beside, grid_columns=3)
        return rrb.Horizontal(rrb.Vertical(fan, *views), grid, column_shares=[2, 3], name="all saccades")

    groups: dict[str, list[SaccadeTab]] = {}
    for saccade in saccades:
        groups.setdefault(saccade.group, []).append(saccade)
    info = rrb.TextDocumentView(origin="/info", name="info")
    tabs: list[Any] = []
    if len(groups) > 1:
        name = compared[0].name
        each = [_plot(compared[0], own, f"{group}: {name}", until_s=until_s) for group, own in groups.items()]
        tabs += [rrb.Grid(*each, name="by group"), info]
        tabs += [rrb.Tabs(together(own), *(tab(s) for s in own), name=group) for group, own in groups.items()]
    else:
        tabs += [together(saccades, info)] if len(saccades) > 1 else []
        tabs += [tab(s) for s in saccades]
        if len(saccades) < 2 or scene.graticule.around_deg:
            tabs.append(info)
    return _whole(tabs, _SPEED)


def sequence_blueprint(
    sequence: SaccadeTab, plots: Sequence[Plot], scene: Scene, vectors: RotationVectors | None, *, lasts_s: float
) -> Any:
    """The viewer's layout of saccades one after the other.

    Args:
        sequence: all of them, as one.
        plots: its curves.
        scene: what is drawn in 3-D.
        vectors: what is drawn of rotation vectors, or None.
        lasts_s: how long it lasts [s]; the curves leave room beyond for their legends.
    """
    import rerun.blueprint as rrb

    root, trace = sequence.root, [f"{sequence.root}/scene/trace"]
    eye = _eye_view(scene, "eye", [f"{root}/scene/**"], growing=trace)
    views = [_gaze_view(scene, [f"{root}/scene"], growing=trace)] if scene.graticule.around_deg else []
    if vectors:
        growing = [f"{root}/listing/path", f"{root}/listing/ends"]
        views.append(_vectors_view(vectors, [f"{root}/listing/**"], growing=growing))
    left = rrb.Vertical(eye, rrb.Horizontal(*views)) if views else eye
    until_s = 1.15 * lasts_s
    if any(p.row for p in plots):
        curves = rrb.Vertical(*_rows(plots, sequence, until_s))
    else:
        shares = [max(5, 2 + 1.3 * p.legend) for p in plots]  # so that legends have room
        curves = rrb.Vertical(*(_plot(p, [sequence], until_s=until_s) for p in plots), row_shares=shares)
    shown = rrb.Horizontal(left, curves, name=sequence.title)
    return _whole([shown, rrb.TextDocumentView(origin="/info", name="info")], _SEQUENCE_SPEED)


def _rows(plots: Sequence[Plot], saccade: SaccadeTab, until_s: float) -> list[Any]:
    """Plots of a saccade in their rows."""
    import rerun.blueprint as rrb

    rows = [[p for p in plots if p.row == row] for row in dict.fromkeys(p.row for p in plots)]
    return [rrb.Horizontal(*(_plot(p, [saccade], until_s=until_s) for p in row)) for row in rows]


def _eye_view(scene: Scene, name: str, contents: list[str], growing: Sequence[str] = ()) -> Any:
    return _view(name, ["/head/**", *contents], scene.camera, scene.middle, growing)


def _gaze_view(scene: Scene, roots: Sequence[str], growing: Sequence[str] = ()) -> Any:
    """The lines ahead of the eye as it sees them: left is left, up is up."""
    lines = [line for root in roots for line in _lines(root, "moment", "reference_trace")]
    contents = [f"/head/{scene.graticule.name}/**", *lines]
    return _view("gaze, from behind the eye", contents, scene.behind, scene.ahead, growing)


def _lines(root: str, *parts: str) -> list[str]:
    """What tells where a saccade looks."""
    return [f"{root}/{part}" for part in (*parts, "target/**", "trace", "start")]


def _vectors_view(vectors: RotationVectors, contents: list[str], growing: Sequence[str] = ()) -> Any:
    return _view(vectors.name, ["/listing/**", *contents], vectors.camera, np.zeros(3), growing)


def _view(name: str, contents: list[str], camera: Array, middle: Array, growing: Sequence[str]) -> Any:
    """Of something in 3-D; what grows is shown from the beginning up to the moment."""
    import rerun.blueprint as rrb

    until_now = rrb.VisibleTimeRanges(
        timeline=TIMELINE, start=rrb.TimeRangeBoundary.infinite(), end=rrb.TimeRangeBoundary.cursor_relative()
    )
    return rrb.Spatial3DView(
        origin="/",
        contents=contents,
        name=name,
        line_grid=False,
        eye_controls=rrb.EyeControls3D(position=camera, look_target=middle, eye_up=[0, 0, 1]),
        overrides=dict.fromkeys(growing, until_now),
    )


def _plot(which: Plot, shown: Sequence[SaccadeTab], name: str = "", until_s: float | None = None) -> Any:
    import rerun as rr
    import rerun.blueprint as rrb

    low, high = which.span
    margin = 0.05 * max(high - low, 1e-3)
    styled: Any = {}
    if which.shaded:
        styled = {f"{s.root}/{which.series[0]}": rr.SeriesLines(colors=[s.colour]) for s in shown}
    elif len(shown) == 1:
        for label, path in zip(which.labels, which.series, strict=False):
            for part in ("", "reference "):
                called = rr.SeriesLines.from_fields(names=[part + label])
                styled[f"{shown[0].root}/{part.replace(' ', '/')}{path}"] = called
    return rrb.TimeSeriesView(
        origin="/" if len(shown) > 1 else shown[0].root,
        contents=[f"{s.root}/{part}{path}" for s in shown for path in which.series for part in ("", "reference/")],
        name=name or which.name,
        axis_x=None if until_s is None else rrb.TimeAxis(view_range=_from_the_beginning(until_s)),
        axis_y=rrb.ScalarAxis(range=(low - margin, high + margin)),
        plot_legend=rrb.PlotLegend("righttop", visible=which.legend > 0 and len(shown) == 1),
        overrides=styled or None,
    )


def _from_the_beginning(until_s: float) -> Any:
    import rerun as rr
    import rerun.blueprint as rrb

    begin, end = (rrb.TimeRangeBoundary.absolute(seconds=seconds) for seconds in (0.0, until_s))
    return rr.TimeRange(start=begin, end=end)


def _whole(tabs: Sequence[Any], speed: float) -> Any:
    import rerun.blueprint as rrb

    return rrb.Blueprint(
        rrb.Tabs(*tabs, active_tab=0),
        rrb.BlueprintPanel(state="collapsed"),
        rrb.SelectionPanel(state="collapsed"),
        rrb.TimePanel(state="collapsed", timeline=TIMELINE, playback_speed=speed, loop_mode="all"),
        auto_views=False,
        auto_layout=False,
    )
