"""How a recording of saccades is laid out in the Rerun viewer: tabs, plots, colours.

The first tab compares all saccades, if there are several; then comes one tab a saccade, inside one a group. All stand
on one timeline, so the time cursor stays where it is when another saccade is picked.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from orient_eye.recording.curves import Plot
from orient_eye.recording.scene import TIMELINE, Colour, Scene

Array = NDArray[np.float64]
SACCADE_COLOURS = np.array(
    [[90, 140, 255], [50, 200, 220], [90, 210, 110], [235, 215, 70], [250, 150, 60], [240, 80, 90], [220, 100, 210]]
)
"""Colours of saccades, by title; more than seven are mixed from them."""
_PLAYBACK_SPEED = 0.1  # a saccade lasts some tenths of a second


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


def blueprint(saccades: Sequence[SaccadeTab], plots: Sequence[Plot], compared: Sequence[Plot], scene: Scene) -> Any:
    """The viewer's layout.

    Args:
        saccades: those to show.
        plots: of each saccade's tab.
        compared: of the first tab, all saccades in each.
        scene: what is drawn in 3-D.
    """
    import rerun as rr
    import rerun.blueprint as rrb

    def view(name: str, contents: list[str]) -> rrb.Spatial3DView:
        return rrb.Spatial3DView(
            origin="/",
            contents=["/head/**", *contents],
            name=name,
            line_grid=False,
            eye_controls=rrb.EyeControls3D(position=scene.camera, look_target=scene.middle, eye_up=[0, 0, 1]),
        )

    def plot(which: Plot, shown: Sequence[SaccadeTab], name: str = "") -> rrb.TimeSeriesView:
        low, high = which.span
        margin = 0.05 * max(high - low, 1e-3)
        recoloured: Any = {f"{s.root}/{which.series[0]}": rr.SeriesLines(colors=[s.colour]) for s in shown}
        return rrb.TimeSeriesView(
            origin="/" if len(shown) > 1 else shown[0].root,
            contents=[f"{s.root}/{part}{path}" for s in shown for path in which.series for part in ("", "reference/")],
            name=name or which.name,
            axis_y=rrb.ScalarAxis(range=(low - margin, high + margin)),
            plot_legend=rrb.PlotLegend("righttop", visible=which.legend and len(shown) == 1),
            overrides=recoloured if which.shaded else None,
        )

    def tab(saccade: SaccadeTab) -> rrb.Horizontal:
        return rrb.Horizontal(
            view("eye", [f"{saccade.root}/scene/**"]),
            rrb.Grid(*(plot(p, [saccade]) for p in plots), grid_columns=2),
            name=saccade.title,
        )

    groups: dict[str, list[SaccadeTab]] = {}
    for saccade in saccades:
        groups.setdefault(saccade.group, []).append(saccade)
    info = rrb.TextDocumentView(origin="/info", name="info")
    tabs: list[Any] = []
    if len(saccades) > 1:
        lines = [f"{s.root}/{part}" for s in saccades for part in (f"scene/{scene.gaze}", "scene/target")]
        fan = view(f"eye of {saccades[0].title}, lines of sight of all", [f"{saccades[0].root}/scene/**", *lines])
        beside = [plot(p, saccades) for p in compared]
        if len(beside) < 4:
            first = rrb.Horizontal(fan, rrb.Grid(*beside, info, grid_columns=2), name="all saccades")
        else:
            grid = rrb.Grid(*beside, grid_columns=3)
            first = rrb.Horizontal(rrb.Vertical(fan, info), grid, column_shares=[2, 3], name="all saccades")
        tabs.append(first)
    if len(groups) > 1:
        each = [plot(compared[0], members, f"{group}: {compared[0].name}") for group, members in groups.items()]
        tabs.append(rrb.Grid(*each, name="by group"))
        tabs += [rrb.Tabs(*(tab(s) for s in members), name=group) for group, members in groups.items()]
    else:
        tabs += [tab(s) for s in saccades]
    if len(saccades) < 2:
        tabs.append(info)
    return rrb.Blueprint(
        rrb.Tabs(*tabs, active_tab=0),
        rrb.BlueprintPanel(state="collapsed"),
        rrb.SelectionPanel(state="collapsed"),
        rrb.TimePanel(state="collapsed", timeline=TIMELINE, playback_speed=_PLAYBACK_SPEED, loop_mode="all"),
        auto_views=False,
        auto_layout=False,
    )
