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
from analysis.diagnosis.unit_wording import choose_scale, format_share
from analysis.figures.diagnosis.stage_style import COMPLETED_STAGE, GIVEN_STAGE, MEASURED_HANDLE
from analysis.figures.picture import Picture
from analysis.figures.style import BLACK, BLUE, GREY, create_figure, style_axes
from analysis.wording import conjoin, typeset
from equalizer.signals.signal import FloatArray

_VISIBLE_SHARE = 0.998
"""Share of the samples within the limits of a panel, so that outliers do not compress all other samples. Chosen."""


def make_state_map_pictures(maps: Sequence[StateMaps]) -> tuple[Picture, ...]:
    """Make two pictures of the first axis, of its states and its loops; empty without maps. Of the other axes, only the
    share of missing force is stated, in the caption."""
    if not maps:
        return ()
    first = maps[0]
    axis_text = f" along {first.axis}" if len(maps) > 1 else ""
    other_axes = [f"{format_share(axis_maps.share)} along {axis_maps.axis}" for axis_maps in maps[1:]]
    omitted_text = f" Not drawn: {conjoin(other_axes)}." if other_axes else ""
    residual_text = f" Blue: mean of the residual force {first.completed}." if first.completed else ""
    states = Picture(
        name="state-map",
        title=f"Missing force{axis_text} over the states of motion",
        caption=f"Force on the device that {first.model} {'lack' if ' and ' in first.model else 'lacks'}; grey: "
        f"single samples; black: mean per bin, with two standard errors.{residual_text} A flat line at zero means that "
        f"the missing force does not depend on that state. Rms: {format_share(first.share)} of the force."
        f"{omitted_text}",
        figure=_draw_states(first),
        alternative=" ".join(_describe_view(view, first.unit) for view in first.views),
    )
    completed_text = f", and {first.completed}" if first.completed else ""
    loops = Picture(
        name="state-loops",
        title=f"Force{axis_text} during part of the motion",
        caption="About one period, where the travel is largest: the measured force, and the force computed from "
        f"{first.model}{completed_text}. The area inside a loop over the position is the dissipated work.",
        figure=_draw_loops(first),
        alternative=_describe_loop_errors(first),
    )
    return states, loops


def _draw_states(maps: StateMaps) -> Figure:
    """Draw the missing force over each of the four state variables, in panels with a common ordinate."""
    figure = create_figure(8.8, 5.6)
    scale = choose_scale(maps.unit, max(float(np.abs(view.mean).max(initial=0.0)) for view in maps.views))
    limits = _compute_ordinate_limits(
        [np.concatenate([view.sample_force, view.mean]) for view in maps.views], scale.factor
    )
    for axes, view in zip(figure.subplots(2, 2, sharey=True).ravel(), maps.views, strict=True):
        style_axes(axes)
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
    """Draw samples, means with two standard errors, and the residual of the completed model, if any, over one state
    variable. factor: from SI to the shown unit of force."""
    x_scale = choose_scale(view.unit, float(np.abs(view.sample_abscissa).max(initial=0.0)))
    axes.plot(
        x_scale.factor * view.sample_abscissa,
        factor * view.sample_force,
        ".",
        color=GREY,
        markersize=2.2,
        alpha=0.35,
        zorder=1,
    )
    axes.axhline(0, color=GREY, linewidth=0.8, zorder=2)
    axes.errorbar(
        x_scale.factor * view.bin_abscissa, factor * view.mean, yerr=2 * factor * view.error, fmt="o", color=BLACK,
        markersize=3.2, elinewidth=0.9, capsize=1.5, zorder=4,
    )  # fmt: skip
    if len(view.mean_residual):
        axes.plot(x_scale.factor * view.bin_abscissa, factor * view.mean_residual, color=BLUE, linewidth=1.8, zorder=3)
    axes.set_xlabel(f"{view.abscissa_name.capitalize()} ({x_scale.unit})", fontsize=9)
    axes.locator_params(axis="x", nbins=6)


def _draw_loops(maps: StateMaps) -> Figure:
    """Draw the two loops in panels with a common ordinate: measured force, force of the model without new physics, and
    force of the completed model, if any."""
    figure = create_figure(8.8, 3.9)
    forces = [force for loop in maps.loops for force in (loop.measured, loop.model_force, loop.completed_force)]
    scale = choose_scale(maps.unit, float(np.abs(np.concatenate(forces)).max(initial=0.0)))
    for axes, loop in zip(figure.subplots(1, 2, sharey=True), maps.loops, strict=True):
        style_axes(axes)
        _draw_loop(axes, loop, scale.factor)
    figure.supylabel(f"Force ({scale.unit})", fontsize=9.5)
    given_handle = GIVEN_STAGE.handle
    given_handle.set_label(maps.model)
    handles = [MEASURED_HANDLE, given_handle]
    if maps.completed:
        handles.append(COMPLETED_STAGE.handle)
        handles[-1].set_label(maps.completed)
    figure.legend(handles=handles, loc="outside upper center", ncols=3, fontsize=9, frameon=False)
    return figure


def _draw_loop(axes: Axes, loop: Loop, factor: float) -> None:
    """Draw the forces of one loop over its state variable. factor: from SI to the shown unit of force."""
    x_scale = choose_scale(loop.unit, float(np.abs(loop.abscissa).max(initial=0.0)))
    positions = x_scale.factor * loop.abscissa
    axes.plot(positions, factor * loop.measured, color=BLACK, linewidth=2.6, alpha=0.35)
    for stage, values in ((GIVEN_STAGE, loop.model_force), (COMPLETED_STAGE, loop.completed_force)):
        if len(values):
            axes.plot(positions, factor * values, color=stage.colour, linestyle=stage.dash, linewidth=stage.width)
    axes.set_xlabel(f"{loop.abscissa_name.capitalize()} ({x_scale.unit})", fontsize=9)
    axes.locator_params(axis="x", nbins=6)


def _compute_ordinate_limits(values: Sequence[FloatArray], factor: float) -> tuple[float, float]:
    """Compute the limits of the ordinate in the shown unit: quantiles that contain the share `_VISIBLE_SHARE` of all
    values, and 0, with a margin of 6 % on both sides (chosen). values: forces in SI units; factor: to the shown
    unit."""
    all_values = factor * np.concatenate(values)
    low, high = np.quantile(all_values, [(1 - _VISIBLE_SHARE) / 2, (1 + _VISIBLE_SHARE) / 2])
    margin = 0.06 * max(float(high - low), 1e-300)
    return float(min(low, 0.0)) - margin, float(max(high, 0.0)) + margin


def _describe_view(view: StateView, unit: str) -> str:
    """Describe the smallest and largest mean of the missing force and where they occur, for screen readers. unit: of
    the force, SI."""
    if not len(view.mean):
        return f"Against {view.abscissa_name}: too few samples."
    low, high = int(np.argmin(view.mean)), int(np.argmax(view.mean))
    extreme_texts = [
        f"{typeset(f'{view.mean[k]:.3g}')} {unit} at {typeset(f'{view.bin_abscissa[k]:.3g}')} {view.unit}"
        for k in (low, high)
    ]
    return f"Against {view.abscissa_name}: mean missing force from {extreme_texts[0]} to {extreme_texts[1]}."


def _describe_loop_errors(maps: StateMaps) -> str:
    """Describe the rms errors of the forces of both models in the first loop, relative to the standard deviation of the
    measured force, for screen readers."""
    loop = maps.loops[0]
    force_deviation = max(float(np.std(loop.measured)), 1e-300)
    labelled_forces = ((maps.model, loop.model_force), (maps.completed, loop.completed_force))
    error_texts = [
        f"{model_name}: {format_share(float(np.sqrt(np.mean((values - loop.measured) ** 2))) / force_deviation)}"
        for model_name, values in labelled_forces
        if len(values)
    ]
    return f"Error of the computed force in this stretch, rms relative to the measured force: {'; '.join(error_texts)}."
