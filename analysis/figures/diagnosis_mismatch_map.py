"""Where model and device disagree: channel by octave, per input and level; as given, re-tuned, with what was found."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
from matplotlib.image import AxesImage

from analysis.diagnosis.mismatch_cells import MismatchCell
from analysis.figures.diagnosis_style import STAGES, Stage
from analysis.figures.picture import Picture
from analysis.figures.style import BLACK, GREY, new_figure, say_nothing_to_draw
from equalizer.signals.signal import FloatArray

_LOUDEST = 300.0
"""In units of the noise: the end of the colours."""
_MOST_LEVELS = 4
_NUMBERED = 1.15
"""Below it a cell is as good as noise and stays bare."""
_SQUARE = ((-0.46, -0.46), (0.46, -0.46), (0.46, 0.46), (-0.46, 0.46), (-0.46, -0.46))
_NUMBERS_FIT = 10
"""Columns of a panel up to which a number can be read in each cell."""

Maps = Mapping[str, tuple[MismatchCell, ...]]


@dataclass(frozen=True, slots=True)
class _Layout:
    stages: tuple[Stage, ...]
    levels: tuple[float, ...]
    bands: tuple[tuple[float, float], ...]
    channels: tuple[tuple[str, str], ...]


def mismatch_map_pictures(maps: Maps, unit: str = "N") -> tuple[Picture, ...]:
    """unit: of the command. One per driving input, the one with most mismatch first and the others folded."""
    inputs = sorted(
        {cell.input for cells in maps.values() for cell in cells}, key=lambda one: (-_worst(maps, one), one)
    )
    return tuple(
        Picture(
            name=f"mismatch-map-{number}",
            title=f"Where model and device disagree, driven by {input_}",
            caption="Residual in units of what noise alone would leave: 1 is noise. Framed: more than noise and the "
            "margin of equivalence, at a false discovery rate of 1 %. Rows: measured channels; columns: octaves, by "
            "their lower edge; grey: not driven there; without "
            f"a number: below {_NUMBERED:g}." + _grouped_words(maps, input_),
            figure=draw_mismatch_map(maps, input_, unit),
            folded=number > 1,
            alternative=_in_words(maps, input_),
        )
        for number, input_ in enumerate(inputs, start=1)
    )


def draw_mismatch_map(maps: Maps, input_: str, unit: str) -> Figure:
    """One row of panels per level, one column per stage."""
    layout = _layout(maps, input_)
    if not layout.stages or not layout.bands:
        return say_nothing_to_draw(new_figure(8.6, 1.6), "The noise is not known, so there is no map in its units.")
    rows, columns = len(layout.levels), len(layout.stages)
    figure = new_figure(8.8, 0.9 + rows * (0.2 + 0.25 * len(layout.channels)))
    grid = figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False)
    image = None
    for row, level in enumerate(layout.levels):
        for column, stage in enumerate(layout.stages):
            cells = [one for one in maps[stage.name] if one.input == input_ and _level(layout, one) == level]
            image = _draw_panel(grid[row][column], cells, layout)
            if row == 0:
                grid[row][column].set_title(stage.words, fontsize=10, loc="left", pad=4)
        if level:
            grid[row][0].set_ylabel(f"at {level:.3g} {unit}", fontsize=10)
    assert image is not None
    bar = figure.colorbar(image, ax=grid.ravel().tolist(), location="right", shrink=0.9, pad=0.01, aspect=30)
    bar.set_ticks([1, 3, 10, 30, 100, 300], labels=["1", "3", "10", "30", "100", "≥ 300"])
    bar.minorticks_off()
    bar.set_label("residual / noise", fontsize=9)
    bar.ax.tick_params(labelsize=8)
    figure.supxlabel("Octave from (Hz)", fontsize=9.5)
    return figure


def _draw_panel(axes: Axes, cells: Sequence[MismatchCell], layout: _Layout) -> AxesImage:
    table = np.full((len(layout.channels), len(layout.bands)), np.nan)
    frames: list[FloatArray] = []
    for cell in cells:
        at = layout.channels.index((cell.output, cell.quantity)), layout.bands.index(cell.band_hz)
        table[at] = np.nanmax([table[at], cell.in_noise])
        if cell.significant:
            frames.append(np.array(_SQUARE) + np.array([at[1], at[0]]))
    # One collection, for a patch per cell takes seconds to draw.
    axes.add_collection(LineCollection(frames, colors=BLACK, linewidths=0.9, zorder=3), autolim=False)
    axes.set_facecolor("#F2F2F2")
    image = axes.imshow(np.maximum(table, 1.0), cmap="YlOrBr", norm=LogNorm(1.0, _LOUDEST), aspect="auto")
    if len(layout.bands) <= _NUMBERS_FIT:
        for (row, column), value in np.ndenumerate(table):
            if value >= _NUMBERED:
                colour = "white" if value > 35 else BLACK
                text = axes.text(column, row, _short(value), ha="center", va="center", fontsize=6.2, color=colour)
                # Hundreds of them, all inside the panel: the layout need not measure each.
                text.set_in_layout(False)
    axes.set_xticks(range(len(layout.bands)), [f"{low:g}" for low, _ in layout.bands], fontsize=7.5)
    axes.set_yticks(range(len(layout.channels)), [_channel(one, layout) for one in layout.channels], fontsize=8.5)
    axes.tick_params(length=0)
    for spine in axes.spines.values():
        spine.set_color(GREY)
        spine.set_linewidth(0.5)
    return image


def _layout(maps: Maps, input_: str) -> _Layout:
    cells = [one for each in maps.values() for one in each if one.input == input_]
    levels = sorted({one.amplitude for one in cells})
    groups = [part for part in np.array_split(levels, min(_MOST_LEVELS, len(levels))) if len(part)] if levels else []
    return _Layout(
        tuple(stage for stage in STAGES if maps.get(stage.name)),
        tuple(float(part[-1]) for part in groups),
        tuple(sorted({one.band_hz for one in cells})),
        tuple(dict.fromkeys((one.output, one.quantity) for one in cells)),
    )


def _level(layout: _Layout, cell: MismatchCell) -> float:
    """The group's highest level stands for the group."""
    return next(level for level in layout.levels if cell.amplitude <= level)


def _channel(channel: tuple[str, str], layout: _Layout) -> str:
    name, quantity = channel
    return f"{name} ({quantity})" if [one for one, _ in layout.channels].count(name) > 1 else name


def _short(value: float) -> str:
    if value >= 999.5:
        return f"{value / 1e3:.1f}k" if value < 9950 else f"{min(value / 1e3, 999):.0f}k"
    return f"{value:.1f}".removesuffix(".0") if value < 9.95 else f"{value:.0f}"


def _worst(maps: Maps, input_: str) -> float:
    return max((one.in_noise for cells in maps.values() for one in cells if one.input == input_), default=0.0)


def _grouped_words(maps: Maps, input_: str) -> str:
    levels = {one.amplitude for cells in maps.values() for one in cells if one.input == input_}
    if len(levels) <= _MOST_LEVELS:
        return ""
    return (
        f" {len(levels)} levels are drawn in {_MOST_LEVELS} groups, named by their highest; the worst of each is shown."
    )


def _in_words(maps: Maps, input_: str) -> str:
    sentences = []
    for stage in STAGES:
        cells = [one for one in maps.get(stage.name, ()) if one.input == input_]
        if not cells:
            continue
        worst = max(cells, key=lambda one: one.in_noise)
        count = sum(one.significant for one in cells)
        sentences.append(
            f"{stage.words.capitalize()}: {count} of {len(cells)} cells differ significantly; the worst is "
            f"{worst.output} at {worst.band_hz[0]:g} to {worst.band_hz[1]:g} Hz and {worst.amplitude:g}, with "
            f"{worst.in_noise:.3g} times the noise."
        )
    return " ".join(sentences)
