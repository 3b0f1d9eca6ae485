"""Draw figures of the blind test (`hapteq prove`): detection thresholds, detection by effect size, confusion matrix,
reliability.

The outcomes are those of a bank of simulated devices with concealed effects. Vertical bars in the figure of detection
thresholds mark an ideal observer, which compares the device with and without the effect and has no model to re-tune.
"""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from analysis.evaluation.blind_test.calibration import Calibration
from analysis.evaluation.blind_test.detection import EffectDraws, collect_effect_draws, compute_rates_by_size
from analysis.evaluation.blind_test.outcome import Outcome
from analysis.figures.picture import Picture
from analysis.figures.style import BLACK, BLUE, GREY, ORANGE, VERMILLION, create_axes, create_figure, set_ratio_ticks

OUTCOME_MARKS = {
    "right": ("o", BLUE),
    "in the set": ("D", ORANGE),
    "missed": ("X", VERMILLION),
    "invisible": (".", GREY),
}
"""Marker and colour of each outcome of a single effect (`detection.classify_outcome`)."""
NO_NAME_COLUMN = "no name"
"""Column of the confusion matrix for devices of which no effect is named."""


def make_blind_test_pictures(outcomes: Sequence[Outcome], calibration: Calibration) -> tuple[Picture, ...]:
    """Make the pictures of detection thresholds, detection by effect size and confusion where the bank has devices with
    a single effect; and of reliability where effects were named. () without either."""
    singles = [outcome for outcome in outcomes if outcome.kind == "single"]
    pictures = []
    if singles:
        pictures += [
            _make_thresholds_picture(collect_effect_draws(singles)),
            _make_size_picture(singles),
            _make_confusion_picture(singles),
        ]
    if calibration.bins:
        pictures.append(_make_reliability_picture(calibration))
    return tuple(pictures)


def _make_thresholds_picture(effects: Sequence[EffectDraws]) -> Picture:
    """Draw the detection thresholds: a row per effect, with the outcome of each device over the effect's strength (0 to
    1)."""
    figure, axes = create_axes(8.8, 1.3 + 0.21 * len(effects))
    for row, effect in enumerate(effects):
        for strength, outcome in effect.draws:
            marker, colour = OUTCOME_MARKS[outcome]
            axes.plot(strength, row, marker, color=colour, markersize=6.5 if marker != "." else 5)
        if effect.ideal_threshold is not None:
            axes.vlines(effect.ideal_threshold, row - 0.38, row + 0.38, color=BLACK, linewidth=1.4)
    axes.set_yticks(range(len(effects)), labels=[effect.effect.replace("_", " ") for effect in effects])
    axes.set_ylim(len(effects) - 0.4, -0.6)
    axes.set_xlim(-0.03, 1.03)
    axes.set_xlabel("strength, from the weakest that is drawn to the strongest (logarithmic)")
    handles = [
        Line2D([], [], marker=marker_style, color=marker_colour, linestyle="", label=outcome)
        for outcome, (marker_style, marker_colour) in OUTCOME_MARKS.items()
    ]
    handles.append(
        Line2D([], [], marker="|", color=BLACK, linestyle="", markersize=9, label="ideal observer detects it")
    )
    figure.legend(handles=handles, loc="outside upper center", ncols=len(handles), frameon=False)
    return Picture(
        "detection", "Strength from which an effect is named",
        "Each mark is a device with one concealed effect. Invisible: the error of the re-tuned model is at most 1.25 "
        "times the noise, so there is nothing to explain; in the set: named as indistinguishable from the named "
        "effect. Bars: strength from which an ideal observer, who compares the same device with and without the "
        "effect, detects it: no re-tuning can hide the effect from it (line fit to the logarithms of the changes "
        "that the effects cause).",
        figure,
        alternative=" ".join(
            f"{entry.effect}: {', '.join(f'{size:.2f} {result}' for size, result in entry.draws)}." for entry in effects
        ),
    )  # fmt: skip


def _make_size_picture(singles: Sequence[Outcome]) -> Picture:
    """Draw the detection curve: share of devices whose effect is named right, over the change of the readings by the
    effect (rms over the noise's rms)."""
    figure, axes = create_axes(7.4, 3.6)
    size_bins = compute_rates_by_size(singles)
    axes.set_xscale("log")
    changes = [size_bin.median_change for size_bin in size_bins]
    axes.vlines(
        changes,
        [size_bin.low for size_bin in size_bins],
        [size_bin.high for size_bin in size_bins],
        color=BLUE,
        linewidth=1.4,
    )
    axes.plot(changes, [size_bin.rate for size_bin in size_bins], "o-", color=BLUE, linewidth=1.2)
    axes.set_ylim(-0.02, 1.02)
    if max(changes) > min(changes):
        set_ratio_ticks(axes.xaxis, min(changes), max(changes))
    axes.set_xlabel("change of the readings by the effect: rms over the noise's, worst channel")
    axes.set_ylabel("share named right")
    return Picture(
        "detection-by-size", "How large an effect must be",
        "All effects together, in bins of equal count; bars are Wilson's 95 % intervals. The abscissa compares the "
        "same device with and without the effect, before a re-tuned model hides part of it.",
        figure,
        alternative=" ".join(
            f"{described_bin.median_change:.3g}: {100 * described_bin.rate:.0f} % of {described_bin.count}."
            for described_bin in size_bins
        ),
    )  # fmt: skip


def _make_confusion_picture(singles: Sequence[Outcome]) -> Picture:
    """Draw the confusion matrix of the detectable single effects: concealed effect (rows) against the first named
    (columns)."""
    detectable = [outcome for outcome in singles if outcome.detectable]
    answers = [outcome.named_effect_names[0] if outcome.named else NO_NAME_COLUMN for outcome in detectable]
    pairs = [(outcome.names[0], answer) for outcome, answer in zip(detectable, answers, strict=True)]
    effect_names = sorted(
        {concealed for concealed, _ in pairs} | {answer for _, answer in pairs if answer != NO_NAME_COLUMN}
    )
    columns = [*effect_names, NO_NAME_COLUMN]
    counts = np.zeros((len(effect_names), len(columns)))
    for concealed, answer in pairs:
        counts[effect_names.index(concealed), columns.index(answer)] += 1
    figure = create_figure(9.6, 2.2 + 0.23 * len(effect_names))
    axes = figure.add_subplot()
    _draw_counts(axes, counts)
    axes.set_yticks(range(len(effect_names)), labels=[name.replace("_", " ") for name in effect_names], fontsize=8)
    axes.set_xticks(range(len(columns)), labels=[name.replace("_", " ") for name in columns], rotation=90, fontsize=8)
    axes.set_xlabel("named first")
    axes.set_ylabel("concealed")
    return Picture(
        "confusion", "Confusion matrix",
        "Devices with one concealed effect that shows; blue is right, red is not.", figure,
        alternative=" ".join(f"{concealed} named {answer}." for concealed, answer in pairs),
    )  # fmt: skip


def _draw_counts(axes: Axes, counts: np.ndarray[tuple[int, ...], np.dtype[np.float64]]) -> None:
    """Draw the cells of the confusion matrix, shaded by their count: blue on the diagonal, red elsewhere; empty cells
    are not drawn. counts: (rows, columns)."""
    row_count, column_count = counts.shape
    largest_count = max(counts.max(initial=1.0), 1.0)
    for row in range(row_count):
        for column in range(column_count):
            if counts[row, column]:
                colour = BLUE if row == column else VERMILLION
                shade = 0.25 + 0.65 * counts[row, column] / largest_count
                axes.fill_between(
                    [column - 0.5, column + 0.5], row - 0.5, row + 0.5, color=colour, alpha=shade, linewidth=0
                )
                axes.text(
                    column, row, f"{counts[row, column]:.0f}", ha="center", va="center", fontsize=7.5, color=BLACK
                )
    axes.set_xlim(-0.5, column_count - 0.5)
    axes.set_ylim(row_count - 0.5, -0.5)
    axes.set_axisbelow(True)
    axes.grid(True, color="#EEEEEE", linewidth=0.5)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)


def _make_reliability_picture(calibration: Calibration) -> Picture:
    """Draw the reliability diagram: share of right names over their stated probability, with the diagonal."""
    figure, axes = create_axes(5.2, 4.4)
    axes.plot([0, 1], [0, 1], color=GREY, linewidth=1.0, linestyle="--")
    for probability_bin in calibration.bins:
        axes.vlines(probability_bin.stated, probability_bin.low, probability_bin.high, color=BLUE, linewidth=1.4)
        axes.plot(probability_bin.stated, probability_bin.right, "o", color=BLUE)
    axes.set_xlim(-0.02, 1.02)
    axes.set_ylim(-0.02, 1.02)
    axes.set_xlabel("stated probability")
    axes.set_ylabel("share that is right")
    return Picture(
        "reliability", "Reliability of stated probabilities",
        "All named effects in bins of equal count, with Wilson's 95 % intervals. Dashed: perfect calibration.",
        figure,
        alternative=" ".join(
            f"{described_bin.stated:.2f} stated, {described_bin.right:.2f} right, of {described_bin.of}."
            for described_bin in calibration.bins
        ),
    )  # fmt: skip
