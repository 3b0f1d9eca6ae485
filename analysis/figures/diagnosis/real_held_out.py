"""Figure of a real recording: a held-out excerpt, measured and predicted, and the held-out errors of all models.

Errors are rms errors relative to the signal, on a logarithmic axis.
"""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from analysis.diagnosis.real_answer.real_answer import DrawnExcerpt, RealAnswer
from analysis.diagnosis.unit_wording import choose_scale
from analysis.figures.diagnosis.stage_style import COMPLETED_STAGE, MEASURED_HANDLE, RETUNED_STAGE
from analysis.figures.picture import Picture
from analysis.figures.style import BLACK, GREEN, GREY, ORANGE, create_figure, draw_no_data_note, style_axes

_LEAST_ERROR = 1e-4
"""Smallest error, relative to the signal, that is drawn; smaller ones are drawn at this value. Chosen."""


def make_real_picture(answer: RealAnswer) -> Picture:
    """Make the picture of a recording's held-out data, with the errors as its text for screen readers."""
    rows = list_error_rows(answer)
    text = "; ".join(f"{name} {100 * value:.3g} %" for name, value, _ in rows)
    return Picture(
        name=f"held-out-{_make_plain_name(answer.folder)}-{_make_plain_name(answer.recording)}",
        title=f"Held-out data of {answer.recording}",
        caption="Left: where the effects found change the prediction most. Right: errors on all held-out data as a "
        "share of the signal, logarithmic; shorter is better.",
        figure=_draw_answer(answer.excerpt, rows),
        alternative=text or "Nothing was held out.",
    )


def list_error_rows(answer: RealAnswer) -> list[tuple[str, float, str]]:
    """List per model: name, held-out error relative to the signal, colour. Unknown errors and zeros are left out; empty
    where nothing was held out."""
    if answer.held_out is None:
        return []
    errors = answer.held_out
    labelled_errors = (
        ("as given", errors.before, ORANGE),
        ("re-tuned", errors.retuned, RETUNED_STAGE.colour),
        ("with the effects found", errors.after if answer.effects else None, COMPLETED_STAGE.colour),
        ("black box", answer.black_box, GREEN),
        ("noise alone", errors.noise, GREY),
    )
    return [(name, value, colour) for name, value, colour in labelled_errors if value is not None and value > 0]


def _draw_answer(excerpt: DrawnExcerpt | None, rows: list[tuple[str, float, str]]) -> Figure:
    """Draw the excerpt on the left and the errors on the right; only a note where either is missing."""
    if excerpt is None or not rows:
        return draw_no_data_note(create_figure(8.6, 1.6), "There are no held-out data to draw.")
    figure = create_figure(8.8, 3.4)
    grid = figure.add_gridspec(1, 2, width_ratios=[1.75, 1])
    _draw_excerpt(figure.add_subplot(grid[0, 0]), excerpt)
    _draw_errors(figure.add_subplot(grid[0, 1]), rows)
    handles = [MEASURED_HANDLE, RETUNED_STAGE.handle, COMPLETED_STAGE.handle]
    figure.legend(handles=handles, loc="outside upper center", ncols=3, fontsize=9, frameon=False)
    return figure


def _draw_excerpt(axes: Axes, excerpt: DrawnExcerpt) -> None:
    """Draw measured and predicted curves over time. The ordinate is limited to 1.6 times the largest measured magnitude
    (chosen), so that a diverging prediction does not compress the measured curve."""
    style_axes(axes)
    measured = np.array(excerpt.measured)
    scale = choose_scale(excerpt.unit, float(np.max(np.abs(measured), initial=0.0)))
    times_s = excerpt.start_s + excerpt.step_s * np.arange(len(measured))
    axes.plot(times_s, scale.factor * measured, color=BLACK, linewidth=2.6, alpha=0.35)
    for stage, values in ((RETUNED_STAGE, excerpt.retuned), (COMPLETED_STAGE, excerpt.after)):
        predicted = scale.factor * np.array(values)
        axes.plot(times_s, predicted, color=stage.colour, linestyle=stage.dash, linewidth=stage.width)
    ordinate_limit = 1.6 * scale.factor * max(float(np.max(np.abs(measured), initial=0.0)), np.finfo(float).tiny)
    low, high = axes.get_ylim()
    axes.set_ylim(max(low, -ordinate_limit), min(high, ordinate_limit))
    axes.set_xlabel(f"Time in {excerpt.record} (s)", fontsize=9.5)
    axes.set_ylabel(f"{excerpt.channel} ({scale.unit})", fontsize=9.5)


def _draw_errors(axes: Axes, rows: list[tuple[str, float, str]]) -> None:
    """Draw the errors as horizontal bars, labelled in per cent of the signal. rows: from `list_error_rows`, at least
    one."""
    style_axes(axes)
    positions = np.arange(len(rows))
    values = [max(value, _LEAST_ERROR) for _, value, _ in rows]
    bar_start = 0.5 * min(values)
    axes.barh(
        positions,
        [value - bar_start for value in values],
        left=bar_start,
        height=0.6,
        color=[colour for _, _, colour in rows],
    )
    axes.set_xscale("log")
    axes.set_xlim(bar_start, 3.0 * max(values))
    for row, value in zip(positions, values, strict=True):
        axes.annotate(
            f"{100 * value:.3g} %", (value, row), xytext=(3, 0), textcoords="offset points", va="center", fontsize=8.5
        )
    axes.set_yticks(positions, [name for name, _, _ in rows])
    axes.set_ylim(len(rows) - 0.4, -0.6)
    axes.grid(False, axis="y")
    axes.set_xticks([])
    axes.set_xticks([], minor=True)


def _make_plain_name(name: str) -> str:
    """Make a name for files and links: the name with a hyphen for every character that is no letter or digit."""
    return "".join(character if character.isalnum() else "-" for character in name)
