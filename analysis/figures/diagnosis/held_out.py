"""Figure of held-out data: an excerpt in which the effect shows, measured and predicted, and all channels' errors."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from analysis.diagnosis.result.findings import TimeSeries
from analysis.diagnosis.unit_wording import scale_of
from analysis.figures.diagnosis.stage_style import AFTER, BEFORE, MEASURED, RETUNED, STAGES, Stage
from analysis.figures.picture import Picture
from analysis.figures.style import BLACK, GREY, draw_no_data_note, new_figure, plain_axes, ratio_ticks
from equalizer.signals.signal import FloatArray

_CYCLES = 5.0
"""Cycles of the effect's change in the excerpt."""
_SHORTEST_S, _LONGEST_S = 0.1, 3.0
"""Shortest and longest stretch that is drawn."""
_MARKERS = {"before": "s", "retuned": "D", "after": "o"}
_STRETCHES = 60
"""Number of stretches from which the drawn one is chosen."""
_STANDING = 0.01
"""Weight of a constant change beside a varying one, when a stretch is chosen."""

ChannelErrors = Mapping[str, Mapping[str, float]]


@dataclass(frozen=True, slots=True)
class Excerpt:
    """A stretch of a channel of a time series: samples `start` to `stop`."""

    series: TimeSeries
    channel: int
    start: int
    stop: int


def held_out_picture(
    time_series: Sequence[TimeSeries], noise_rms: Mapping[str, float], errors: ChannelErrors
) -> Picture:
    """Figure of held-out samples with the predictions. errors: by stage and channel, in units of the noise."""
    excerpt = find_excerpt(time_series, noise_rms)
    where = ""
    if excerpt is not None:
        where = (
            f"Left: {excerpt.series.channels[excerpt.channel]} in {excerpt.series.name}, where what was found changes "
            "the prediction most; below, what each prediction leaves, over twice the noise to either side (grey). "
        )
    return Picture(
        name="held-out",
        title="Held-out data: as given, re-tuned, with what was found",
        caption=f"{where}{'Right: e' if where else 'E'}rror of each channel over all held-out samples in units of its "
        "noise; at the line there is nothing but noise. Nothing was fitted to or chosen by these data.",
        figure=draw_held_out(excerpt, noise_rms, errors),
        alternative=_alternative_text(errors),
    )


def find_excerpt(time_series: Sequence[TimeSeries], noise_rms: Mapping[str, float]) -> Excerpt | None:
    """The held-out excerpt and channel where re-tuned and final prediction differ most, in units of the noise; where
    they do not differ, those where given and final do. None without a difference."""
    for each in ("retuned", "before"):
        best: tuple[float, Excerpt] | None = None
        for series in time_series:
            noise = np.array([noise_rms.get(name, np.nan) for name in series.channels])
            change = np.nan_to_num((getattr(series, each) - series.after) / noise)
            for start, stop in series.tested:
                found = _strongest_excerpt(series, change[start:stop], start)
                if found is not None and (best is None or found[0] > best[0]):
                    best = found
        if best is not None and best[0] > 0.1:
            return best[1]
    return None


def _strongest_excerpt(series: TimeSeries, change: FloatArray, start: int) -> tuple[float, Excerpt] | None:
    if not len(change):
        return None
    channel = int(np.argmax(_visibility(change)))
    signal = change[:, channel]
    rms, speed = float(np.std(signal)), float(np.sqrt(np.mean(np.diff(signal, prepend=signal[0]) ** 2)))
    if not signal.any():
        return None
    # The frequency at which a sine of this size would change as fast.
    cycle_s = 2 * np.pi * rms / max(speed * series.sample_rate_hz, 1e-12)
    length = int(np.clip(_CYCLES * cycle_s, _SHORTEST_S, _LONGEST_S) * series.sample_rate_hz)
    length = min(max(length, 8), len(signal))
    places = np.unique(np.linspace(0, len(signal) - length, _STRETCHES).astype(int))
    strengths = [float(_visibility(signal[at : at + length])) for at in places]
    at = int(places[int(np.argmax(strengths))])
    return max(strengths), Excerpt(series, channel, start + at, start + at + length)


def _visibility(change: FloatArray) -> FloatArray:
    """Weight of a change for the excerpt: its variance, and little of its mean square, because motion shows more."""
    return np.asarray(np.var(change, axis=0) + _STANDING * np.mean(change, axis=0) ** 2)


def draw_held_out(excerpt: Excerpt | None, noise_rms: Mapping[str, float], errors: ChannelErrors) -> Figure:
    """Figure of an excerpt, measured and predicted, beside the errors of all channels; only the errors where `excerpt`
    is None."""
    channels = list(next(iter(errors.values()), {}))
    if excerpt is None and not channels:
        return draw_no_data_note(new_figure(8.6, 1.6), "There are no held-out data to draw.")
    figure = new_figure(8.8, max(4.2, 1.4 + 0.34 * len(channels)))
    if excerpt is None:
        _draw_errors(figure.add_subplot(), errors)
    else:
        grid = figure.add_gridspec(2, 2, width_ratios=[1.75, 1], height_ratios=[1.5, 1])
        above = figure.add_subplot(grid[0, 0])
        below = figure.add_subplot(grid[1, 0], sharex=above)
        _draw_excerpt(above, below, excerpt, noise_rms)
        _draw_errors(figure.add_subplot(grid[:, 1]), errors)
    handles = ([MEASURED] if excerpt else []) + [stage.handle for stage in STAGES]
    figure.legend(handles=handles, loc="outside upper center", ncols=len(handles), fontsize=9, frameon=False)
    return figure


def _draw_excerpt(above: Axes, below: Axes, excerpt: Excerpt, noise_rms: Mapping[str, float]) -> None:
    series, part, k = excerpt.series, slice(excerpt.start, excerpt.stop), excerpt.channel
    name, unit = series.channels[k], series.units[k]
    seconds = np.arange(excerpt.start, excerpt.stop) / series.sample_rate_hz
    measured = series.measured[part, k]
    shown = scale_of(unit, float(np.max(np.abs(measured))))
    left = [(stage, measured - getattr(series, stage.name)[part, k]) for stage in STAGES]
    # The given model may be so far off that it would flatten the others.
    largest = max(float(np.max(np.abs(each))) for stage, each in left if stage is not BEFORE)
    small = scale_of(unit, largest)
    above.plot(seconds, shown.factor * measured, color=BLACK, linewidth=2.6, alpha=0.35)
    for stage, residual in left:
        for axes, values in ((above, shown.factor * (measured - residual)), (below, small.factor * residual)):
            axes.plot(seconds, values, color=stage.colour, linestyle=stage.dash, linewidth=stage.width)
    noise = 2 * small.factor * noise_rms.get(name, 0.0)
    below.axhspan(-noise, noise, color=GREY, alpha=0.3, linewidth=0, zorder=0)
    reach = 1.25 * max(small.factor * largest, 1.5 * noise)
    below.set_ylim(-reach, reach)
    for axes in (above, below):
        plain_axes(axes)
    above.tick_params(labelbottom=False)
    above.set_xlim(float(seconds[0]), float(seconds[-1]))
    above.set_ylabel(f"{name} ({shown.unit})", fontsize=9.5)
    below.set_ylabel(f"left over ({small.unit})", fontsize=9.5)
    below.set_xlabel("Time (s)", fontsize=9.5)


def _draw_errors(axes: Axes, errors: ChannelErrors) -> None:
    plain_axes(axes)
    channels = list(next(iter(errors.values())))
    rows = np.arange(len(channels), dtype=float)
    for stage in (AFTER, RETUNED, BEFORE):
        values = [errors[stage.name].get(name, np.nan) for name in channels] if stage.name in errors else []
        if values:
            _draw_stage(axes, stage, np.array(values), rows)
    axes.axvline(1, color=BLACK, linewidth=1.1)
    axes.annotate("noise", (1, 1), xycoords=("data", "axes fraction"), xytext=(3, 2), textcoords="offset points",
                  fontsize=8.5, annotation_clip=False)  # fmt: skip
    axes.set_xscale("log")
    low, high = axes.get_xlim()
    low, high = min(low, 0.7), max(high, 3.0)
    axes.set_xlim(low, high)
    ratio_ticks(axes.xaxis, low, high)
    axes.set_yticks(rows, channels)
    axes.set_ylim(len(channels) - 0.4, -0.6)
    axes.grid(False, axis="y")
    axes.set_xlabel("Error / noise, all held-out data", fontsize=9.5)


def _draw_stage(axes: Axes, stage: Stage, values: FloatArray, rows: FloatArray) -> None:
    at = rows + 0.24 * (STAGES.index(stage) - 1)
    axes.hlines(at, 1.0, values, color=stage.colour, linewidth=1.6, alpha=0.75)
    axes.plot(values, at, _MARKERS[stage.name], color=stage.colour, markersize=5)


def _alternative_text(errors: ChannelErrors) -> str:
    sentences = []
    for stage in STAGES:
        if stage.name in errors:
            values = ", ".join(f"{name} {value:.3g}" for name, value in errors[stage.name].items())
            sentences.append(f"{stage.words.capitalize()}, error over noise: {values}.")
    return " ".join(sentences)
