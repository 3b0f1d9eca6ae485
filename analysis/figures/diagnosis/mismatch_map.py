"""Figure of the mismatch map: residual by channel and octave, per input and level, for the three predictions."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure

from analysis.diagnosis.localisation.mismatch_cells import MismatchCell
from analysis.figures.diagnosis.stage_style import STAGES, StageStyle
from analysis.figures.picture import Picture
from analysis.figures.style import BLACK, GREY, create_figure, draw_no_data_note, set_ratio_ticks
from equalizer.signals.signal import FloatArray

_LEAST_COLOUR_LIMIT = 300.0
"""Smallest upper end of the colour scale, in units of the noise."""
_WHITE_TEXT_FROM = 0.62
"""Share of the colour scale from which numbers are white."""
_LETTER_IN = 0.075
"""Width of a letter beside the map, inches."""
_ROW_IN, _PANEL_GAP_IN = 0.25, 0.2
"""Height of a row of cells, and between panels, inches."""
_MOST_LEVELS = 4
"""Most levels drawn separately; more are grouped."""
_MIN_NUMBERED_RATIO = 1.15
"""Residual over noise below which a cell has no number."""
_SQUARE = ((-0.46, -0.46), (0.46, -0.46), (0.46, 0.46), (-0.46, 0.46), (-0.46, -0.46))
_UNIT = np.array([(0, 0), (1, 0), (1, 1), (0, 1)])
_WIDTH_IN = 8.8
"""Width of the figure, inches."""
_POINTS_PER_CELL, _GAP_CELLS = 4, 0.25
"""Points per cell, along each side, and cells between panels: a whole number of points."""
_MOST_NUMBERED_COLUMNS = 10
"""Columns of a panel up to which a number can be read in each cell."""

Maps = Mapping[str, tuple[MismatchCell, ...]]


@dataclass(frozen=True, slots=True)
class _Layout:
    """Stages (columns of panels), levels (rows of panels), bands and channels (columns and rows of cells) of a map."""

    stages: tuple[StageStyle, ...]
    levels: tuple[float, ...]
    bands: tuple[tuple[float, float], ...]
    channels: tuple[tuple[str, str], ...]

    def corner(self, row: int, column: int) -> FloatArray:
        """(2,): x and y of a panel's first cell, in cells."""
        return np.array([column * (len(self.bands) + _GAP_CELLS), row * (len(self.channels) + _GAP_CELLS)])


def rank_driving_inputs(maps: Maps) -> tuple[str, ...]:
    """Names of the driving inputs, that with the largest residual over noise first."""
    inputs = {cell.input for cells in maps.values() for cell in cells}
    return tuple(sorted(inputs, key=lambda name: (-_find_worst_mismatch(maps, name), name)))


def make_mismatch_map_picture(maps: Maps, number: int, unit: str) -> Picture:
    """Mismatch map of one driving input. number: of the driving input in `rank_driving_inputs`; all but the first are
    folded. unit: of the command."""
    input_ = rank_driving_inputs(maps)[number]
    return Picture(
        name=f"mismatch-map-{number + 1}",
        title=f"Where model and device disagree, driven by {input_}",
        caption="Residual relative to that of noise alone: 1 is noise. Framed: significantly larger than the noise "
        "and the model's error elsewhere, at a false discovery rate of 1 %. Rows: measured channels; columns: "
        f"octaves, by their lower edge{_describe_levels(maps, input_, unit)}; grey: not driven there; without a number"
        f": below {_MIN_NUMBERED_RATIO:g}." + _describe_groups(maps, input_),
        figure=draw_mismatch_map(maps, input_, unit),
        folded=number > 0,
        bitmap=number == 0,
        alternative=_write_alternative_text(maps, input_),
    )


def draw_mismatch_map(maps: Maps, input_: str, unit: str) -> Figure:
    """A row of panels per level, a column per stage; all in a single Axes object, because one per panel takes
    seconds."""
    layout = _make_layout(maps, input_)
    if not layout.stages or not layout.bands:
        return draw_no_data_note(create_figure(8.6, 1.6), "The noise is not known, so there is no map in its units.")
    figure = create_figure(_WIDTH_IN, 0.9 + len(layout.levels) * (_PANEL_GAP_IN + _ROW_IN * len(layout.channels)))
    axes, colour_bar_axes = _add_axes(figure, layout)
    table, frames = _fill_table(maps, input_, layout)
    panels = [layout.corner(row, column) for row, column in np.ndindex(len(layout.levels), len(layout.stages))]
    size = np.array([len(layout.bands), len(layout.channels)])
    corners = [(panel - 0.5) + _UNIT * size for panel in panels]
    for zorder, face, edge in ((0, "#F2F2F2", "none"), (2, "none", GREY)):
        axes.add_collection(PolyCollection(corners, facecolors=face, edgecolors=edge, linewidths=0.5, zorder=zorder))
    height, width = table.shape
    extent = (-0.5, width / _POINTS_PER_CELL - 0.5, height / _POINTS_PER_CELL - 0.5, -0.5)
    largest = _choose_colour_limit(table)
    image = axes.imshow(np.maximum(table, 1.0), cmap="YlOrBr", norm=LogNorm(1.0, largest), aspect="auto",
                        interpolation="nearest", extent=extent)  # fmt: skip
    axes.add_collection(LineCollection(frames, colors=BLACK, linewidths=0.9, zorder=3), autolim=False)
    if len(layout.bands) <= _MOST_NUMBERED_COLUMNS:
        _write_numbers(axes, table, panels, layout)
    _label_axes(axes, layout, unit)
    bar = figure.colorbar(image, cax=colour_bar_axes)
    set_ratio_ticks(bar.ax.yaxis, 1.0, largest)
    bar.set_label("residual / noise", fontsize=9)
    colour_bar_axes.tick_params(labelsize=8)
    return figure


def _choose_colour_limit(table: FloatArray) -> float:
    """Upper end of the colour scale, above all cells, so that the worst differs from the next."""
    largest = float(np.nanmax(table, initial=1.0))
    return _LEAST_COLOUR_LIMIT if largest <= _LEAST_COLOUR_LIMIT else float(10 ** np.ceil(np.log10(largest)))


def _fits_upright(layout: _Layout) -> bool:
    """Whether levels fit upright along the panels' sides; else they are written behind the channels."""
    longest = max((len(f"at {level:.3g} N m") for level in layout.levels), default=0)
    return _LETTER_IN * (longest - 2) <= _PANEL_GAP_IN + _ROW_IN * len(layout.channels)


def _format_row_label(channel: tuple[str, str], level: float, layout: _Layout) -> str:
    label = _format_channel_label(channel, layout)
    return label if _fits_upright(layout) or not level else f"{label} at {level:.3g}"


def _add_axes(figure: Figure, layout: _Layout) -> tuple[Axes, Axes]:
    """Axes of the map and of its colour bar, laid out by computed sizes instead of a layout engine."""
    figure.set_layout_engine("none")
    width, height = figure.get_size_inches()
    longest = max(
        len(_format_row_label(channel, level, layout)) for channel in layout.channels for level in layout.levels
    )
    left_in = (0.33 if any(layout.levels) and _fits_upright(layout) else 0.1) + _LETTER_IN * longest
    bottom, top, right_edge = 0.5 / height, 1 - 0.26 / height, 1 - 1.15 / width
    axes = figure.add_axes((left_in / width, bottom, right_edge - left_in / width, top - bottom))
    colour_bar_axes = figure.add_axes(
        (right_edge + 0.09 / width, bottom + 0.05 * (top - bottom), 0.22 / width, 0.9 * (top - bottom))
    )
    return axes, colour_bar_axes


def _fill_table(maps: Maps, input_: str, layout: _Layout) -> tuple[FloatArray, list[FloatArray]]:
    """Residual over noise with `_POINTS_PER_CELL` squared points per cell, NaN between panels and where nothing was
    driven; and the outlines of the significant cells."""
    rows, columns = len(layout.levels), len(layout.stages)
    last = layout.corner(rows - 1, columns - 1)
    size = last[1] + len(layout.channels), last[0] + len(layout.bands)
    table = np.full([round(_POINTS_PER_CELL * cells) for cells in size], np.nan)
    frames: list[FloatArray] = []
    for column, stage in enumerate(layout.stages):
        for cell in (map_cell for map_cell in maps[stage.name] if map_cell.input == input_):
            corner = layout.corner(_find_level_group(layout, cell), column)
            offset = layout.bands.index(cell.band_hz), layout.channels.index((cell.output, cell.quantity))
            x, y = (round(_POINTS_PER_CELL * coordinate) for coordinate in corner + offset)
            part = table[y : y + _POINTS_PER_CELL, x : x + _POINTS_PER_CELL]
            part[:] = np.fmax(part, cell.in_noise)
            if cell.significant:
                frames.append(np.array(_SQUARE) + corner + offset)
    return table, frames


def _write_numbers(axes: Axes, table: FloatArray, panels: Sequence[FloatArray], layout: _Layout) -> None:
    for corner in panels:
        for row, column in np.ndindex(len(layout.channels), len(layout.bands)):
            x, y = float(corner[0]) + column, float(corner[1]) + row
            value = table[round(_POINTS_PER_CELL * y), round(_POINTS_PER_CELL * x)]
            if value >= _MIN_NUMBERED_RATIO:
                colour = "white" if np.log(value) > _WHITE_TEXT_FROM * np.log(_choose_colour_limit(table)) else BLACK
                axes.text(x, y, _format_short(value), ha="center", va="center", fontsize=6.2, color=colour)


def _label_axes(axes: Axes, layout: _Layout, unit: str) -> None:
    stages, levels = range(len(layout.stages)), range(len(layout.levels))
    xs = [layout.corner(0, column)[0] + band for column in stages for band in range(len(layout.bands))]
    ys = [layout.corner(row, 0)[1] + channel for row in levels for channel in range(len(layout.channels))]
    axes.set_xticks(xs, [f"{low:g}" for low, _ in layout.bands] * len(stages), fontsize=7.5)
    rows = [_format_row_label(channel, level, layout) for level in layout.levels for channel in layout.channels]
    axes.set_yticks(ys, rows, fontsize=8.5)
    axes.tick_params(length=0)
    axes.spines[:].set_visible(False)
    axes.set_xlabel("Octave from (Hz)", fontsize=9.5)
    for column in stages:
        axes.annotate(layout.stages[column].label, (float(layout.corner(0, column)[0]) - 0.5, -0.5), xytext=(0, 4),
                      textcoords="offset points", fontsize=10)  # fmt: skip
    middle = (len(layout.channels) - 1) / 2
    for row in levels:
        if layout.levels[row] and _fits_upright(layout):
            axes.annotate(
                f"at {layout.levels[row]:.3g} {unit}".rstrip(), (0.02, layout.corner(row, 0)[1] + middle),
                xycoords=("figure fraction", "data"), rotation="vertical", ha="center", va="center", fontsize=10,
            )  # fmt: skip


def _make_layout(maps: Maps, input_: str) -> _Layout:
    cells = [map_cell for stage_cells in maps.values() for map_cell in stage_cells if map_cell.input == input_]
    levels = sorted({cell.amplitude for cell in cells})
    groups = [group for group in np.array_split(levels, min(_MOST_LEVELS, len(levels))) if len(group)] if levels else []
    return _Layout(
        tuple(stage for stage in STAGES if maps.get(stage.name)),
        tuple(float(group[-1]) for group in groups),
        tuple(sorted({cell.band_hz for cell in cells})),
        tuple(dict.fromkeys((cell.output, cell.quantity) for cell in cells)),
    )


def _find_level_group(layout: _Layout, cell: MismatchCell) -> int:
    """Index of the cell's group of levels, which is named by its highest level."""
    return next(row for row, level in enumerate(layout.levels) if cell.amplitude <= level)


def _format_channel_label(channel: tuple[str, str], layout: _Layout) -> str:
    name, quantity = channel
    return f"{name} ({quantity})" if [other_name for other_name, _ in layout.channels].count(name) > 1 else name


def _format_short(value: float) -> str:
    if value >= 999.5:
        return f"{value / 1e3:.1f}k" if value < 9950 else f"{min(value / 1e3, 999):.0f}k"
    return f"{value:.1f}".removesuffix(".0") if value < 9.95 else f"{value:.0f}"


def _find_worst_mismatch(maps: Maps, input_: str) -> float:
    return max((cell.in_noise for cells in maps.values() for cell in cells if cell.input == input_), default=0.0)


def _describe_levels(maps: Maps, input_: str, unit: str) -> str:
    levels = {cell.amplitude for cells in maps.values() for cell in cells if cell.input == input_}
    return f", at levels of the excitation{f' in {unit}' if unit else ''}" if any(levels) else ""


def _describe_groups(maps: Maps, input_: str) -> str:
    levels = {cell.amplitude for cells in maps.values() for cell in cells if cell.input == input_}
    if len(levels) <= _MOST_LEVELS:
        return ""
    return (
        f" {len(levels)} levels are drawn in {_MOST_LEVELS} groups, named by their highest; the worst of each is shown."
    )


def _write_alternative_text(maps: Maps, input_: str) -> str:
    sentences = []
    for stage in STAGES:
        cells = [map_cell for map_cell in maps.get(stage.name, ()) if map_cell.input == input_]
        if not cells:
            continue
        worst = max(cells, key=lambda cell: cell.in_noise)
        count = sum(cell.significant for cell in cells)
        sentences.append(
            f"{stage.label.capitalize()}: {count} of {len(cells)} cells differ significantly; the worst is "
            f"{worst.output} at {worst.band_hz[0]:g} to {worst.band_hz[1]:g} Hz and {worst.amplitude:g}, with "
            f"{worst.in_noise:.3g} times the noise."
        )
    return " ".join(sentences)
