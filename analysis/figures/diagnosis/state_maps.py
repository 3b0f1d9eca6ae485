"""Figures of the missing force over the states of motion, and of its hysteresis loops.

The missing force (`result.curves.state_maps`) does not depend on which effects are named. It is drawn as single samples
and as means per bin over four state variables; the loops show the force over about one period of the motion.
"""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from analysis.diagnosis.result.curves.state_maps import Loop, StateMaps, StateView
from analysis.diagnosis.unit_wording import scale_of, share_text
from analysis.figures.diagnosis.stage_style import AFTER, BEFORE, MEASURED
from analysis.figures.picture import Picture
from analysis.figures.style import BLACK, BLUE, GREY, new_figure, plain_axes
from analysis.wording import conjoin, typeset
from equalizer.signals.signal import FloatArray

_SEEN = 0.998
"""Share of the samples within the limits of a panel, so that outliers do not compress all other samples."""


def state_map_pictures(maps: Sequence[StateMaps]) -> tuple[Picture, ...]:
    """Two pictures of the first axis, its states and its loops; empty without maps. Other axes are only mentioned with
    their share of missing force."""
    if not maps:
        return ()
    first = maps[0]
    along = f" along {first.axis}" if len(maps) > 1 else ""
    others = [f"{share_text(each.share)} along {each.axis}" for each in maps[1:]]
    beside = f" Not drawn: {conjoin(others)}." if others else ""
    left = f" Blue: mean of the residual force {first.completed}." if first.completed else ""
    states = Picture(
        name="state-map",
        title=f"Missing force{along} over the states of motion",
        caption=f"Force on the device that {first.model} {'lack' if ' and ' in first.model else 'lacks'}; grey: "
        f"single samples; black: mean per bin, with two standard errors.{left} A flat line at zero means that the "
        f"missing force does not depend on that state. Rms: {share_text(first.share)} of the force.{beside}",
        figure=_draw_states(first),
        alternative=" ".join(_alternative_text(view, first.unit) for view in first.views),
    )
    text = f", and {first.completed}" if first.completed else ""
    loops = Picture(
        name="state-loops",
        title=f"Force{along} during part of the motion",
        caption="About one period, where the travel is largest: the measured force, and the force computed from "
        f"{first.model}{text}. The area inside a loop over the position is the dissipated work.",
        figure=_draw_loops(first),
        alternative=_loop_text(first),
    )
    return states, loops


def _draw_states(maps: StateMaps) -> Figure:
    """Four panels, one per state variable, with a common ordinate."""
    figure = new_figure(8.8, 5.6)
    scale = scale_of(maps.unit, max(float(np.abs(view.mean).max(initial=0.0)) for view in maps.views))
    limits = _limits([np.concatenate([view.cloud, view.mean]) for view in maps.views], scale.factor)
    for axes, view in zip(figure.subplots(2, 2, sharey=True).ravel(), maps.views, strict=True):
        plain_axes(axes)
        _draw_view(axes, view, scale.factor)
        axes.set_ylim(*limits)
    figure.supylabel(f"Missing force ({scale.unit})", fontsize=9.5)
    handles = [
        Line2D([], [], color=GREY, marker=".", linestyle="", alpha=0.6, label="samples"),
        Line2D([], [], color=BLACK, marker="o", linestyle="", markersize=3.5, label="missing, mean"),
    ]
    if maps.completed:
        handles.append(Line2D([], [], color=BLUE, linewidth=1.8, label=f"residual {maps.completed}"))
    figure.legend(handles=handles, loc="outside upper center", ncols=3, fontsize=9, frameon=False)
    return figure


def _draw_view(axes: Axes, view: StateView, factor: float) -> None:
    """Samples, means with two standard errors, and the completed model's residual. factor: from SI to the shown
    unit."""
    along = scale_of(view.unit, float(np.abs(view.cloud_at).max(initial=0.0)))
    axes.plot(along.factor * view.cloud_at, factor * view.cloud, ".", color=GREY, markersize=2.2, alpha=0.35, zorder=1)
    axes.axhline(0, color=GREY, linewidth=0.8, zorder=2)
    axes.errorbar(
        along.factor * view.at, factor * view.mean, yerr=2 * factor * view.error, fmt="o", color=BLACK, markersize=3.2,
        elinewidth=0.9, capsize=1.5, zorder=4,
    )  # fmt: skip
    if len(view.left):
        axes.plot(along.factor * view.at, factor * view.left, color=BLUE, linewidth=1.8, zorder=3)
    axes.set_xlabel(f"{view.along.capitalize()} ({along.unit})", fontsize=9)
    axes.locator_params(axis="x", nbins=6)


def _draw_loops(maps: StateMaps) -> Figure:
    """Two panels with a common ordinate: measured force, and forces of the model before and after its completion."""
    figure = new_figure(8.8, 3.9)
    every = [each for loop in maps.loops for each in (loop.measured, loop.before, loop.after)]
    scale = scale_of(maps.unit, float(np.abs(np.concatenate(every)).max(initial=0.0)))
    for axes, loop in zip(figure.subplots(1, 2, sharey=True), maps.loops, strict=True):
        plain_axes(axes)
        _draw_loop(axes, loop, scale.factor)
    figure.supylabel(f"Force ({scale.unit})", fontsize=9.5)
    before = BEFORE.handle
    before.set_label(maps.model)
    handles = [MEASURED, before]
    if maps.completed:
        handles.append(AFTER.handle)
        handles[-1].set_label(maps.completed)
    figure.legend(handles=handles, loc="outside upper center", ncols=3, fontsize=9, frameon=False)
    return figure


def _draw_loop(axes: Axes, loop: Loop, factor: float) -> None:
    """Forces of one loop over its state variable. factor: from SI to the shown unit of force."""
    along = scale_of(loop.unit, float(np.abs(loop.at).max(initial=0.0)))
    at = along.factor * loop.at
    axes.plot(at, factor * loop.measured, color=BLACK, linewidth=2.6, alpha=0.35)
    for stage, values in ((BEFORE, loop.before), (AFTER, loop.after)):
        if len(values):
            axes.plot(at, factor * values, color=stage.colour, linestyle=stage.dash, linewidth=stage.width)
    axes.set_xlabel(f"{loop.along.capitalize()} ({along.unit})", fontsize=9)
    axes.locator_params(axis="x", nbins=6)


def _limits(values: Sequence[FloatArray], factor: float) -> tuple[float, float]:
    """Limits of the ordinate in the shown unit: quantiles that contain the share `_SEEN` of all values, and 0."""
    whole = factor * np.concatenate(values)
    low, high = np.quantile(whole, [(1 - _SEEN) / 2, (1 + _SEEN) / 2])
    room = 0.06 * max(float(high - low), 1e-300)
    return float(min(low, 0.0)) - room, float(max(high, 0.0)) + room


def _alternative_text(view: StateView, unit: str) -> str:
    """Smallest and largest mean of the missing force and where they occur, in words. unit: of the force, SI."""
    if not len(view.mean):
        return f"Against {view.along}: too few samples."
    low, high = int(np.argmin(view.mean)), int(np.argmax(view.mean))
    ends = [
        f"{typeset(f'{view.mean[k]:.3g}')} {unit} at {typeset(f'{view.at[k]:.3g}')} {view.unit}" for k in (low, high)
    ]
    return f"Against {view.along}: mean missing force from {ends[0]} to {ends[1]}."


def _loop_text(maps: StateMaps) -> str:
    """Rms difference of the models' forces from the measured force in the first loop, relative to its standard
    deviation, in words."""
    loop = maps.loops[0]
    size = max(float(np.std(loop.measured)), 1e-300)
    kinds = ((maps.model, loop.before), (maps.completed, loop.after))
    left = [
        f"{words}: {share_text(float(np.sqrt(np.mean((values - loop.measured) ** 2))) / size)}"
        for words, values in kinds
        if len(values)
    ]
    return f"Error of the computed force in this stretch, rms relative to the measured force: {'; '.join(left)}."
