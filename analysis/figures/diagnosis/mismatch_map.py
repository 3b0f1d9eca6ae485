"""Figure of the mismatch map: residual by channel and octave, per input and level, for each stage of the model.

Stages are those of `stage_style`: given, re-tuned, and completed with the named effects.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure

from analysis.diagnosis.limits import FALSE_DISCOVERY_RATE
from analysis.diagnosis.localisation.mismatch_cells import MismatchCell
from analysis.figures.diagnosis.stage_style import STAGES, StageStyle
from analysis.figures.picture import Picture
from analysis.figures.style import BLACK, GREY, create_figure, draw_no_data_note, set_ratio_ticks
from equalizer.signals.signal import FloatArray

_LEAST_COLOUR_LIMIT = 300.0
"""Smallest upper end of the colour scale, in units of the noise. Chosen by eye, as all sizes of this figure."""
_WHITE_TEXT_FROM = 0.62
"""Share of the logarithmic colour scale above which numbers are white."""
_LETTER_WIDTH_IN = 0.075
"""Width reserved per letter of the labels beside the map, inches."""
_ROW_HEIGHT_IN, _PANEL_GAP_IN = 0.25, 0.2
"""Height of a row of cells, and between panels, inches."""
_MOST_LEVELS = 4
"""Largest number of rows of panels; more levels are put into this number of groups."""
_MIN_NUMBERED_RATIO = 1.15
"""Residual over noise below which a cell has no number."""
_FRAME_OUTLINE = ((-0.46, -0.46), (0.46, -0.46), (0.46, 0.46), (-0.46, 0.46), (-0.46, -0.46))
"""Outline of a significant cell about its centre, in cells: slightly smaller than the cell, so that outlines of
neighbours do not touch."""
_UNIT_SQUARE = np.array([(0, 0), (1, 0), (1, 1), (0, 1)])
"""Corners of a panel, relative to its size."""
_WIDTH_IN = 8.8
_POINTS_PER_CELL, _GAP_CELLS = 4, 0.25
"""Points of the drawn table per cell, along each side; gap between panels in cells, a whole number of points."""
_MOST_NUMBERED_COLUMNS = 10
"""Columns of a panel up to which a number can be read in each cell."""

Maps = Mapping[str, tuple[MismatchCell, ...]]
"""Cells of each stage, by the name of the stage."""


@dataclass(frozen=True, slots=True)
class _Layout:
    """Columns and rows of panels in a map, and of cells in a panel."""

    stages: tuple[StageStyle, ...]
    """Columns of panels."""
    levels: tuple[float, ...]
    """Rows of panels: highest level of each group, rising, in the unit of the command; 0 where it is not known."""
    bands: tuple[tuple[float, float], ...]
    """Columns of cells: lower and upper edge, Hz, rising."""
    channels: tuple[tuple[str, str], ...]
    """Rows of cells: name and quantity of the measured channel."""

    def find_corner(self, row: int, column: int) -> FloatArray:
        """Find the centre of a panel's first cell: (2,), x to the right and y downwards, in cells. row, column: of
        panels, from 0."""
        return np.array([column * (len(self.bands) + _GAP_CELLS), row * (len(self.channels) + _GAP_CELLS)])


def rank_driving_inputs(maps: Maps) -> tuple[str, ...]:
    """Rank the names of the driving inputs by the largest residual over noise, largest first, then by name."""
    inputs = {cell.input for cells in maps.values() for cell in cells}
    return tuple(sorted(inputs, key=lambda name: (-_find_worst_mismatch(maps, name), name)))


def make_mismatch_map_picture(maps: Maps, input_index: int, unit: str) -> Picture:
    """Make the mismatch map of one driving input. input_index: of the driving input in `rank_driving_inputs`; the
    first map is also written as PNG, all others are folded. unit: of the command, empty if unknown."""
    input_ = rank_driving_inputs(maps)[input_index]
    return Picture(
        name=f"mismatch-map-{input_index + 1}",
        title=f"Where model and device disagree, driven by {input_}",
        caption="Residual relative to that of noise alone: 1 is noise. Framed: significantly larger than the noise "
        f"and the model's error elsewhere, at a false discovery rate of {100 * FALSE_DISCOVERY_RATE:g} %. "
        "Rows: measured channels; columns: octaves, by their lower edge"
        f"{_describe_levels(maps, input_, unit)}; grey: not driven there; where cells have numbers, those without: "
        f"below {_MIN_NUMBERED_RATIO:g}.{_describe_groups(maps, input_)}",
        figure=draw_mismatch_map(maps, input_, unit),
        folded=input_index > 0,
        bitmap=input_index == 0,
        alternative=_write_alternative_text(maps, input_),
    )


def draw_mismatch_map(maps: Maps, input_: str, unit: str) -> Figure:
    """Draw the map of one input: a row of panels per level and a column per stage, all in a single Axes object, because
    one per panel takes seconds; a note where no stage has cells. unit: of the command."""
    layout = _make_layout(maps, input_)
    if not layout.stages or not layout.bands:
        return draw_no_data_note(create_figure(8.6, 1.6), "The noise is not known, so there is no map in its units.")
    figure = create_figure(
        _WIDTH_IN, 0.9 + len(layout.levels) * (_PANEL_GAP_IN + _ROW_HEIGHT_IN * len(layout.channels))
    )
    axes, colour_bar_axes = _add_axes(figure, layout)
    table, frames = _fill_table(maps, input_, layout)
    panel_corners = [
        layout.find_corner(row, column) for row, column in np.ndindex(len(layout.levels), len(layout.stages))
    ]
    panel_size = np.array([len(layout.bands), len(layout.channels)])
    panel_outlines = [(panel_corner - 0.5) + _UNIT_SQUARE * panel_size for panel_corner in panel_corners]
    for zorder, face, edge in ((0, "#F2F2F2", "none"), (2, "none", GREY)):
        axes.add_collection(
            PolyCollection(panel_outlines, facecolors=face, edgecolors=edge, linewidths=0.5, zorder=zorder)
        )
    height, width = table.shape
    extent = (-0.5, width / _POINTS_PER_CELL - 0.5, height / _POINTS_PER_CELL - 0.5, -0.5)
    colour_limit = _choose_colour_limit(table)
    image = axes.imshow(np.maximum(table, 1.0), cmap="YlOrBr", norm=LogNorm(1.0, colour_limit), aspect="auto",
                        interpolation="nearest", extent=extent)  # fmt: skip
    axes.add_collection(LineCollection(frames, colors=BLACK, linewidths=0.9, zorder=3), autolim=False)
    if len(layout.bands) <= _MOST_NUMBERED_COLUMNS:
        _write_numbers(axes, table, panel_corners, layout)
    _label_axes(axes, layout, unit)
    bar = figure.colorbar(image, cax=colour_bar_axes)
    set_ratio_ticks(bar.ax.yaxis, 1.0, colour_limit)
    bar.set_label("residual / noise", fontsize=9)
    colour_bar_axes.tick_params(labelsize=8)
    return figure


def _choose_colour_limit(table: FloatArray) -> float:
    """Choose the upper end of the colour scale: `_LEAST_COLOUR_LIMIT`, or where the largest residual exceeds it, the
    next power of ten from that residual on."""
    largest = float(np.nanmax(table, initial=1.0))
    return _LEAST_COLOUR_LIMIT if largest <= _LEAST_COLOUR_LIMIT else float(10 ** np.ceil(np.log10(largest)))


def _can_write_levels_upright(layout: _Layout) -> bool:
    """Whether the longest label of a level fits along the height of a panel; else levels follow the channels' names.
    The length is estimated with the longest unit, N m, less about two narrow letters."""
    longest_label = max((len(f"at {level:.3g} N m") for level in layout.levels), default=0)
    return _LETTER_WIDTH_IN * (longest_label - 2) <= _PANEL_GAP_IN + _ROW_HEIGHT_IN * len(layout.channels)


def _format_row_label(channel: tuple[str, str], level: float, layout: _Layout) -> str:
    """Format the label of a row of cells: its channel, and its level where that is not written along the panel's
    side."""
    label = _format_channel_label(channel, layout)
    return label if _can_write_levels_upright(layout) or not level else f"{label} at {level:.3g}"


def _add_axes(figure: Figure, layout: _Layout) -> tuple[Axes, Axes]:
    """Add the axes of the map and of its colour bar, placed by sizes in inches instead of a layout engine.
    layout: at least one channel and level."""
    figure.set_layout_engine("none")
    width, height = figure.get_size_inches()
    longest_label = max(
        len(_format_row_label(channel, level, layout)) for channel in layout.channels for level in layout.levels
    )
    left_in = (
        0.33 if any(layout.levels) and _can_write_levels_upright(layout) else 0.1
    ) + _LETTER_WIDTH_IN * longest_label
    bottom, top, right_edge = 0.5 / height, 1 - 0.26 / height, 1 - 1.15 / width
    axes = figure.add_axes((left_in / width, bottom, right_edge - left_in / width, top - bottom))
    colour_bar_axes = figure.add_axes(
        (right_edge + 0.09 / width, bottom + 0.05 * (top - bottom), 0.22 / width, 0.9 * (top - bottom))
    )
    return axes, colour_bar_axes


def _fill_table(maps: Maps, input_: str, layout: _Layout) -> tuple[FloatArray, list[FloatArray]]:
    """Fill a table (rows, columns of points) with the residual over noise, `_POINTS_PER_CELL` squared points per cell:
    the largest of a group of levels, NaN between panels and where nothing was driven. Also returns the outlines (5, 2)
    of the significant cells, in cells."""
    rows, columns = len(layout.levels), len(layout.stages)
    last_corner = layout.find_corner(rows - 1, columns - 1)
    table_cells = last_corner[1] + len(layout.channels), last_corner[0] + len(layout.bands)
    table = np.full([round(_POINTS_PER_CELL * cells) for cells in table_cells], np.nan)
    frames: list[FloatArray] = []
    for column, stage in enumerate(layout.stages):
        for cell in (map_cell for map_cell in maps[stage.name] if map_cell.input == input_):
            corner = layout.find_corner(_find_level_group(layout, cell), column)
            offset = layout.bands.index(cell.band_hz), layout.channels.index((cell.output, cell.quantity))
            x, y = (round(_POINTS_PER_CELL * coordinate) for coordinate in corner + offset)
            cell_points = table[y : y + _POINTS_PER_CELL, x : x + _POINTS_PER_CELL]
            cell_points[:] = np.fmax(cell_points, cell.in_noise)
            if cell.significant:
                frames.append(np.array(_FRAME_OUTLINE) + corner + offset)
    return table, frames


def _write_numbers(axes: Axes, table: FloatArray, panel_corners: Sequence[FloatArray], layout: _Layout) -> None:
    """Write residual over noise into each cell from `_MIN_NUMBERED_RATIO` on; white on dark colours."""
    for corner in panel_corners:
        for row, column in np.ndindex(len(layout.channels), len(layout.bands)):
            x, y = float(corner[0]) + column, float(corner[1]) + row
            value = table[round(_POINTS_PER_CELL * y), round(_POINTS_PER_CELL * x)]
            if value >= _MIN_NUMBERED_RATIO:
                colour = "white" if np.log(value) > _WHITE_TEXT_FROM * np.log(_choose_colour_limit(table)) else BLACK
                axes.text(x, y, _format_ratio(value), ha="center", va="center", fontsize=6.2, color=colour)


def _label_axes(axes: Axes, layout: _Layout, unit: str) -> None:
    """Label octaves (x), channels (y), stages (above the panels) and levels (left, where they fit). unit: of levels."""
    stages, levels = range(len(layout.stages)), range(len(layout.levels))
    x_ticks = [layout.find_corner(0, column)[0] + band for column in stages for band in range(len(layout.bands))]
    y_ticks = [layout.find_corner(row, 0)[1] + channel for row in levels for channel in range(len(layout.channels))]
    axes.set_xticks(x_ticks, [f"{low:g}" for low, _ in layout.bands] * len(stages), fontsize=7.5)
    row_labels = [_format_row_label(channel, level, layout) for level in layout.levels for channel in layout.channels]
    axes.set_yticks(y_ticks, row_labels, fontsize=8.5)
    axes.tick_params(length=0)
    axes.spines[:].set_visible(False)
    axes.set_xlabel("Octave from (Hz)", fontsize=9.5)
    for column in stages:
        axes.annotate(layout.stages[column].label, (float(layout.find_corner(0, column)[0]) - 0.5, -0.5), xytext=(0, 4),
                      textcoords="offset points", fontsize=10)  # fmt: skip
    middle_row = (len(layout.channels) - 1) / 2
    for row in levels:
        if layout.levels[row] and _can_write_levels_upright(layout):
            axes.annotate(
                f"at {layout.levels[row]:.3g} {unit}".rstrip(), (0.02, layout.find_corner(row, 0)[1] + middle_row),
                xycoords=("figure fraction", "data"), rotation="vertical", ha="center", va="center", fontsize=10,
            )  # fmt: skip


def _make_layout(maps: Maps, input_: str) -> _Layout:
    """Make the layout of the cells of one input; levels are grouped where there are more than `_MOST_LEVELS`."""
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
    """Find the index of the cell's group of levels: the first whose highest level is not below the cell's."""
    return next(row for row, level in enumerate(layout.levels) if cell.amplitude <= level)


def _format_channel_label(channel: tuple[str, str], layout: _Layout) -> str:
    """Format the name of a channel, with its quantity where channels share the name. channel: name and quantity."""
    name, quantity = channel
    return f"{name} ({quantity})" if [other_name for other_name, _ in layout.channels].count(name) > 1 else name


def _format_ratio(value: float) -> str:
    """Format the residual over noise in at most four characters: 1.2, 12, 1.2k, at most 999k."""
    if value >= 999.5:
        return f"{value / 1e3:.1f}k" if value < 9950 else f"{min(value / 1e3, 999):.0f}k"
    return f"{value:.1f}".removesuffix(".0") if value < 9.95 else f"{value:.0f}"


def _find_worst_mismatch(maps: Maps, input_: str) -> float:
    """Find the largest residual over noise of one input, over all stages; 0 without cells."""
    return max((cell.in_noise for cells in maps.values() for cell in cells if cell.input == input_), default=0.0)


def _describe_levels(maps: Maps, input_: str, unit: str) -> str:
    """Write the clause of the caption about the levels; empty where no level is known."""
    levels = {cell.amplitude for cells in maps.values() for cell in cells if cell.input == input_}
    return f", at levels of the excitation{f' in {unit}' if unit else ''}" if any(levels) else ""


def _describe_groups(maps: Maps, input_: str) -> str:
    """Write the sentence of the caption about groups of levels; empty where each level has a row of panels."""
    levels = {cell.amplitude for cells in maps.values() for cell in cells if cell.input == input_}
    if len(levels) <= _MOST_LEVELS:
        return ""
    return (
        f" {len(levels)} levels are drawn in {_MOST_LEVELS} groups, named by their highest; the worst of each is shown."
    )


def _write_alternative_text(maps: Maps, input_: str) -> str:
    """Write the text for screen readers: per stage with cells, the number of significant cells and the cell with the
    largest residual over noise."""
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
