"""Figure of the prediction of held-out data by three models: as given, re-tuned, and with the effects found.

Left: an excerpt of a channel, measured and predicted, with the residuals; it is the excerpt in which two predictions
differ most, in units of the noise (`find_excerpt`). Right: rms error of each channel over all held-out samples, divided
by the rms of its noise.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from analysis.diagnosis.result.findings import TimeSeries
from analysis.diagnosis.unit_wording import choose_scale
from analysis.figures.diagnosis.stage_style import (
    COMPLETED_STAGE,
    GIVEN_STAGE,
    MEASURED_HANDLE,
    RETUNED_STAGE,
    STAGES,
    StageStyle,
)
from analysis.figures.picture import Picture
from analysis.figures.style import BLACK, GREY, create_figure, draw_no_data_note, set_ratio_ticks, style_axes
from equalizer.signals.signal import FloatArray

_EXCERPT_CYCLES = 5.0
"""Length of the excerpt, in cycles of the change that the effects make to the prediction. Chosen by eye, as all
constants of this module."""
_SHORTEST_S, _LONGEST_S = 0.1, 3.0
"""Bounds of the excerpt's length (s)."""
_FEWEST_SAMPLES = 8
"""Fewest samples of an excerpt, if the held-out stretch has as many."""
_LEAST_VISIBILITY = 0.1
"""Least visibility (`_compute_visibility`) of a visible change, over the noise's variance."""
_MARKERS = {"before": "s", "retuned": "D", "after": "o"}
_CANDIDATES_PER_STRETCH = 60
"""Number of candidate excerpts per held-out stretch, evenly spaced."""
_OFFSET_WEIGHT = 0.01
"""Weight of the squared mean of a change, relative to its variance, in the choice of the excerpt
(`_compute_visibility`)."""

ChannelErrors = Mapping[str, Mapping[str, float]]
"""Rms error divided by the rms of the noise, by stage ("before", "retuned", "after"), then by channel."""


@dataclass(frozen=True, slots=True)
class Excerpt:
    """An excerpt of one channel of a time series: samples `start` to `stop`, exclusive. channel: index in
    `TimeSeries.channels`."""

    series: TimeSeries
    channel: int
    start: int
    stop: int


def make_held_out_picture(
    time_series: Sequence[TimeSeries], noise_rms: Mapping[str, float], errors: ChannelErrors
) -> Picture:
    """Make the figure with title, caption and alternative text. noise_rms: by channel, in the channel's SI unit."""
    excerpt = find_excerpt(time_series, noise_rms)
    excerpt_text = ""
    if excerpt is not None:
        excerpt_text = (
            f"Left: {excerpt.series.channels[excerpt.channel]} in {excerpt.series.name}, where the predictions "
            "differ most; below, the residual of each prediction, with plus and minus twice the noise (grey). "
        )
    return Picture(
        name="held-out",
        title="Held-out data: as given, re-tuned, with the effects found",
        caption=f"{excerpt_text}{'Right: e' if excerpt_text else 'E'}rror of each channel over all held-out samples in "
        "units of its noise; the line marks noise alone. These data were used neither for fitting nor for model "
        "selection.",
        figure=draw_held_out(excerpt, noise_rms, errors),
        alternative=_describe_errors(errors),
    )


def find_excerpt(time_series: Sequence[TimeSeries], noise_rms: Mapping[str, float]) -> Excerpt | None:
    """Find the held-out excerpt and channel in which the re-tuned and the completed model's predictions differ most, in
    units of the noise; if these do not differ visibly, those of the given and the completed model. None if neither
    pair differs visibly. noise_rms: by channel, in the channel's SI unit."""
    for stage_name in ("retuned", "before"):
        most_visible: tuple[float, Excerpt] | None = None
        for series in time_series:
            channel_noise = np.array([noise_rms.get(channel_name, np.nan) for channel_name in series.channels])
            change = np.nan_to_num((getattr(series, stage_name) - series.after) / channel_noise)
            for start, stop in series.tested:
                candidate = _find_strongest_excerpt(series, change[start:stop], start)
                if candidate is not None and (most_visible is None or candidate[0] > most_visible[0]):
                    most_visible = candidate
        if most_visible is not None and most_visible[0] > _LEAST_VISIBILITY:
            return most_visible[1]
    return None


def _find_strongest_excerpt(series: TimeSeries, change: FloatArray, start: int) -> tuple[float, Excerpt] | None:
    """Find the part of a held-out stretch in which the change is most visible, and its visibility
    (`_compute_visibility`); None if the stretch is empty or the change is zero. change: (n, channels), difference of
    two predictions in units of the noise. start: index of the stretch's first sample in the series."""
    if not len(change):
        return None
    channel = int(np.argmax(_compute_visibility(change)))
    signal = change[:, channel]
    rms, rms_step = float(np.std(signal)), float(np.sqrt(np.mean(np.diff(signal, prepend=signal[0]) ** 2)))
    if not signal.any():
        return None
    # Period of a sine with the same rms and the same rms slope: 2 pi rms(x) / rms(dx/dt).
    cycle_s = 2 * np.pi * rms / max(rms_step * series.sample_rate_hz, 1e-12)
    length_samples = int(np.clip(_EXCERPT_CYCLES * cycle_s, _SHORTEST_S, _LONGEST_S) * series.sample_rate_hz)
    length_samples = min(max(length_samples, _FEWEST_SAMPLES), len(signal))
    candidate_offsets = np.unique(np.linspace(0, len(signal) - length_samples, _CANDIDATES_PER_STRETCH).astype(int))
    visibilities = [
        float(_compute_visibility(signal[offset : offset + length_samples])) for offset in candidate_offsets
    ]
    offset = int(candidate_offsets[int(np.argmax(visibilities))])
    return max(visibilities), Excerpt(series, channel, start + offset, start + offset + length_samples)


def _compute_visibility(change: FloatArray) -> FloatArray:
    """Compute the visibility of a change (n, channels) or (n,), per channel: its variance plus `_OFFSET_WEIGHT` times
    its squared mean, because a varying change is easier to see in a plot than an offset."""
    return np.asarray(np.var(change, axis=0) + _OFFSET_WEIGHT * np.mean(change, axis=0) ** 2)


def draw_held_out(excerpt: Excerpt | None, noise_rms: Mapping[str, float], errors: ChannelErrors) -> Figure:
    """Draw an excerpt, measured and predicted, with the errors of all channels to its right; the errors alone if
    `excerpt` is None; a note if there are no errors either."""
    channels = list(next(iter(errors.values()), {}))
    if excerpt is None and not channels:
        return draw_no_data_note(create_figure(8.6, 1.6), "There are no held-out data to draw.")
    figure = create_figure(8.8, max(4.2, 1.4 + 0.34 * len(channels)))
    if excerpt is None:
        _draw_errors(figure.add_subplot(), errors)
    else:
        grid = figure.add_gridspec(2, 2, width_ratios=[1.75, 1], height_ratios=[1.5, 1])
        signal_axes = figure.add_subplot(grid[0, 0])
        residual_axes = figure.add_subplot(grid[1, 0], sharex=signal_axes)
        _draw_excerpt(signal_axes, residual_axes, excerpt, noise_rms)
        _draw_errors(figure.add_subplot(grid[:, 1]), errors)
    handles = ([MEASURED_HANDLE] if excerpt else []) + [stage.handle for stage in STAGES]
    figure.legend(handles=handles, loc="outside upper center", ncols=len(handles), fontsize=9, frameon=False)
    return figure


def _draw_excerpt(signal_axes: Axes, residual_axes: Axes, excerpt: Excerpt, noise_rms: Mapping[str, float]) -> None:
    """Draw the measured and predicted signals, and the residuals with a grey band of plus and minus twice the noise's
    rms. noise_rms: by channel, in the channel's SI unit."""
    series, samples, channel = excerpt.series, slice(excerpt.start, excerpt.stop), excerpt.channel
    channel_name, unit = series.channels[channel], series.units[channel]
    time_s = np.arange(excerpt.start, excerpt.stop) / series.sample_rate_hz
    measured = series.measured[samples, channel]
    signal_scale = choose_scale(unit, float(np.max(np.abs(measured))))
    residuals = [(stage, measured - getattr(series, stage.name)[samples, channel]) for stage in STAGES]
    # The residual of the given model does not set the scale: it may be so large that the others would look flat.
    largest = max(float(np.max(np.abs(deviation))) for stage, deviation in residuals if stage is not GIVEN_STAGE)
    residual_scale = choose_scale(unit, largest)
    signal_axes.plot(time_s, signal_scale.factor * measured, color=BLACK, linewidth=2.6, alpha=0.35)
    for stage, residual in residuals:
        for axes, values in (
            (signal_axes, signal_scale.factor * (measured - residual)),
            (residual_axes, residual_scale.factor * residual),
        ):
            axes.plot(time_s, values, color=stage.colour, linestyle=stage.dash, linewidth=stage.width)
    twice_noise = 2 * residual_scale.factor * noise_rms.get(channel_name, 0.0)
    residual_axes.axhspan(-twice_noise, twice_noise, color=GREY, alpha=0.3, linewidth=0, zorder=0)
    half_range = 1.25 * max(residual_scale.factor * largest, 1.5 * twice_noise)
    residual_axes.set_ylim(-half_range, half_range)
    for axes in (signal_axes, residual_axes):
        style_axes(axes)
    signal_axes.tick_params(labelbottom=False)
    signal_axes.set_xlim(float(time_s[0]), float(time_s[-1]))
    signal_axes.set_ylabel(f"{channel_name} ({signal_scale.unit})", fontsize=9.5)
    residual_axes.set_ylabel(f"residual ({residual_scale.unit})", fontsize=9.5)
    residual_axes.set_xlabel("Time (s)", fontsize=9.5)


def _draw_errors(axes: Axes, errors: ChannelErrors) -> None:
    """Draw the rms error of each channel (rows), divided by its noise, on a logarithmic axis, for each stage."""
    style_axes(axes)
    channels = list(next(iter(errors.values())))
    rows = np.arange(len(channels), dtype=float)
    for stage in (COMPLETED_STAGE, RETUNED_STAGE, GIVEN_STAGE):
        values = [errors[stage.name].get(channel, np.nan) for channel in channels] if stage.name in errors else []
        if values:
            _draw_stage(axes, stage, np.array(values), rows)
    axes.axvline(1, color=BLACK, linewidth=1.1)
    axes.annotate("noise", (1, 1), xycoords=("data", "axes fraction"), xytext=(3, 2), textcoords="offset points",
                  fontsize=8.5, annotation_clip=False)  # fmt: skip
    axes.set_xscale("log")
    low, high = axes.get_xlim()
    low, high = min(low, 0.7), max(high, 3.0)
    axes.set_xlim(low, high)
    set_ratio_ticks(axes.xaxis, low, high)
    axes.set_yticks(rows, channels)
    axes.set_ylim(len(channels) - 0.4, -0.6)
    axes.grid(False, axis="y")
    axes.set_xlabel("Error / noise, all held-out data", fontsize=9.5)


def _draw_stage(axes: Axes, stage: StageStyle, values: FloatArray, rows: FloatArray) -> None:
    """Draw the errors of one stage as lines from the noise level (1); stages are offset within a channel's row."""
    positions = rows + 0.24 * (STAGES.index(stage) - 1)
    axes.hlines(positions, 1.0, values, color=stage.colour, linewidth=1.6, alpha=0.75)
    axes.plot(values, positions, _MARKERS[stage.name], color=stage.colour, markersize=5)


def _describe_errors(errors: ChannelErrors) -> str:
    """Describe the errors of each stage by channel, for screen readers."""
    sentences = []
    for stage in STAGES:
        if stage.name in errors:
            values = ", ".join(f"{channel} {value:.3g}" for channel, value in errors[stage.name].items())
            sentences.append(f"{stage.label.capitalize()}, error over noise: {values}.")
    return " ".join(sentences)
