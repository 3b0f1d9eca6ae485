"""Figure for the choice of a model order: singular values, error on held-out lines, multiplications per tick.

The values are those of `OrderReport`: each order is fitted to every second spectral line and tested on the others. A
tick is one step of the device loop.
"""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator

from analysis.figures.picture import Picture
from analysis.figures.style import BLUE, GREY, ORANGE, VERMILLION, create_figure, style_axes
from equalizer.identification.state_space.order_report import VISIBLE_RATIO, OrderReport


def make_model_order_picture(report: OrderReport, chosen_order: int) -> Picture:
    """Make the picture of the compared model orders. chosen_order: order of the identified model."""
    return Picture(
        name="model-order",
        title="Error and cost of the model by its order",
        caption=f"Left: singular values of the data, in units of the noise; states above {VISIBLE_RATIO:g} times the "
        "noise (dashed) are seen. Right: error on held-out lines, with its lower bound, the noise (dashed), and the "
        f"multiplications per tick. This model has order {chosen_order}; of those tried, the lowest that is as good as "
        f"the best is {report.suggested_order}.",
        figure=draw_model_order(report, chosen_order),
    )


def draw_model_order(report: OrderReport, chosen_order: int) -> Figure:
    """Draw the singular values (left), and errors and multiplications by order (right). chosen_order: order of the
    identified model, a vertical line."""
    figure = create_figure(8.6, 3.2)
    left_axes, right_axes = figure.subplots(1, 2)
    _draw_singular_values(left_axes, report)
    _draw_errors(right_axes, report, chosen_order)
    return figure


def _draw_singular_values(axes: Axes, report: OrderReport) -> None:
    """Draw the singular values in units of the noise; those of the first `visible_order` states are filled."""
    style_axes(axes)
    singular_values = report.singular_values
    state_numbers = np.arange(1, len(singular_values) + 1)
    is_visible = state_numbers <= report.visible_order
    axes.semilogy(state_numbers[is_visible], singular_values[is_visible], "o", color=BLUE, markersize=4, label="seen")
    axes.semilogy(
        state_numbers[~is_visible],
        singular_values[~is_visible],
        "o",
        color=GREY,
        markersize=4,
        markerfacecolor="none",
        label="noise",
    )
    axes.axhline(VISIBLE_RATIO, color=GREY, linestyle="--", linewidth=1)
    axes.yaxis.set_major_formatter("{x:g}")
    axes.set_xlabel("State")
    axes.set_ylabel("Singular value (noise = 1)")
    axes.legend(frameon=False, fontsize=9)


def _draw_errors(axes: Axes, report: OrderReport, chosen_order: int) -> None:
    """Draw the held-out errors in per cent with the noise as their lower limit, and multiplications per tick on a
    second axis."""
    style_axes(axes)
    orders = [row.order for row in report.rows]
    axes.semilogy(orders, [100 * row.held_out_error for row in report.rows], "o-", color=VERMILLION, markersize=5)
    axes.axhline(100 * report.held_out_noise, color=GREY, linestyle="--", linewidth=1)
    axes.axvline(chosen_order, color=GREY, linewidth=1)
    axes.yaxis.set_major_formatter("{x:g}")
    axes.yaxis.set_minor_locator(LogLocator(subs=(2, 3, 5)))
    axes.yaxis.set_minor_formatter("{x:g}")
    axes.set_xticks(orders)
    axes.set_xlabel("Order")
    axes.set_ylabel("Error, held-out lines (%)", color=VERMILLION)
    cost_axes = axes.twinx()
    cost_axes.plot(orders, [row.multiply_adds_per_tick for row in report.rows], "s:", color=ORANGE, markersize=5)
    cost_axes.set_ylabel("Multiplications per tick", color=ORANGE)
    cost_axes.set_ylim(bottom=0)
    cost_axes.spines["top"].set_visible(False)
