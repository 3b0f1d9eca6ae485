"""Figures of the rival explanations in each round of the search, with the error that each of them leaves.

Errors are geometric means, over the channels, of the rms error over the rms noise (1 = noise alone), on the samples
that decided the choice and, where computed, on held-out samples.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from analysis.diagnosis.effect_words import get_noun
from analysis.diagnosis.errors.fit_score import FitScore
from analysis.diagnosis.errors.hypothesis import Claim
from analysis.diagnosis.search.explain import Explanation
from analysis.diagnosis.search.search_context import FittedCandidate
from analysis.figures.diagnosis.stage_style import COMPLETED_STAGE, RETUNED_STAGE
from analysis.figures.picture import Picture
from analysis.figures.style import BLACK, GREY, create_axes, create_figure, draw_no_data_note, set_ratio_ticks
from equalizer.effects.placing import find_device_part
from equalizer.signals.signal import FloatArray

MOST_RIVALS = 8
"""Largest number of explanations that are drawn in a figure. Chosen by hand."""
_TRAINING_NOTE = (
    "Errors on the data that were used for fitting and model selection; rivals are not evaluated on held-out data."
)
_TRAINING_AND_TEST_NOTE = (
    "Filled: data that were used for fitting and model selection; open: held-out data, which were used for neither."
)
"""Sentences of a caption, without and with held-out errors."""
_ORDINALS = ("first", "second", "third", "fourth", "fifth")
"""Words for the rounds; further rounds are not drawn."""


@dataclass(frozen=True, slots=True)
class TriedExplanation:
    """An explanation with its errors: geometric mean over channels of error / noise; 1 = noise alone."""

    words: str
    """Effect and axis, in words."""
    training_error: float
    """Error on the data that were used for fitting and model selection."""
    test_error: float
    """Error on held-out data; NaN where not computed."""


def list_explanations(round_: Sequence[FittedCandidate], axes: Sequence[str]) -> tuple[TriedExplanation, ...]:
    """List the first fit of each hypothesis of a round, at most `MOST_RIVALS`: first the round's choice, which may have
    a larger error than a more complex one; then the others by increasing training error. axes: displayed names of the
    axes."""
    best_by_hypothesis: dict[object, TriedExplanation] = {}
    for candidate in round_:
        effect_words = ", ".join(_describe_claim(claim, axes) for claim in candidate.fitted.hypothesis.claims[-1:])
        best_by_hypothesis.setdefault(candidate.fitted.hypothesis.key, _make_explanation(effect_words, candidate.score))
    chosen, alternatives = list(best_by_hypothesis.values())[:1], list(best_by_hypothesis.values())[1:]
    return (*chosen, *sorted(alternatives, key=lambda rival: rival.training_error))[:MOST_RIVALS]


def make_rivals_pictures(explanation: Explanation, axes: Sequence[str]) -> tuple[Picture, ...]:
    """Make a picture per round in which several explanations were tried, of the first five rounds; folded where none of
    them was added."""
    retuned = _make_explanation("re-tuned, no physics", explanation.retuned.score)
    pictures = []
    tested_rounds = [round_number for round_number, round_ in enumerate(explanation.rounds, start=1) if len(round_) > 1]
    for round_number in (number for number in tested_rounds if number <= len(_ORDINALS)):
        round_ = explanation.rounds[round_number - 1]
        explanations, is_accepted = list_explanations(round_, axes), round_number <= len(explanation.steps)
        if explanations:
            pictures.append(
                Picture(
                    name=f"rivals-{round_number}",
                    title=f"What was tried for the {_ORDINALS[round_number - 1]} effect"
                    + ("" if is_accepted else "; none was accepted"),
                    caption="Error in units of the noise, mean over the channels, of each explanation after its fit, "
                    "in addition to the effects found before. "
                    + (
                        _TRAINING_AND_TEST_NOTE
                        if any(np.isfinite(rival.test_error) for rival in explanations)
                        else _TRAINING_NOTE
                    )
                    + " Dashed: the re-tuned model alone.",
                    figure=draw_rivals(explanations, retuned, is_accepted),
                    folded=not is_accepted,
                    bitmap=is_accepted,
                    alternative=" ".join(_describe_rival(rival) for rival in explanations),
                )
            )
    return tuple(pictures)


def draw_rivals(
    explanations: Sequence[TriedExplanation], retuned: TriedExplanation, is_accepted: bool = True
) -> Figure:
    """Draw a row per explanation, the chosen one on top. is_accepted: whether the chosen explanation was added,
    and is marked."""
    if not explanations:
        return draw_no_data_note(create_figure(7.4, 1.4), "Nothing was tried.")
    figure, axes = create_axes(8.8, 1.05 + 0.3 * len(explanations))
    for row, entry in enumerate(explanations):
        colour = COMPLETED_STAGE.colour if row == 0 and is_accepted else GREY
        axes.plot([entry.training_error, entry.test_error], [row, row], color=colour, linewidth=1.2, zorder=2)
        axes.plot(entry.training_error, row, "o", color=colour, markersize=6.5, zorder=3)
        if np.isfinite(entry.test_error):
            axes.plot(entry.test_error, row, "o", color=colour, markersize=6.5, markerfacecolor="white", zorder=3)
    axes.axvline(
        retuned.training_error,
        color=RETUNED_STAGE.colour,
        linestyle=RETUNED_STAGE.dash,
        linewidth=RETUNED_STAGE.width,
        zorder=1,
    )
    axes.axvline(1, color=BLACK, linewidth=1.0, zorder=1)
    _draw_label(axes, 1.0, "noise", "right")
    _draw_label(axes, retuned.training_error, "re-tuned", "left")
    axes.set_yticks(range(len(explanations)), [rival.words for rival in explanations])
    if is_accepted:
        axes.get_yticklabels()[0].set_fontweight("bold")
    axes.set_ylim(len(explanations) - 0.5, -0.5)
    axes.grid(False, axis="y")
    drawn_errors = np.array(
        [
            *(rival.training_error for rival in explanations),
            *(rival.test_error for rival in explanations),
            retuned.training_error,
        ]
    )
    _scale_axis(axes, drawn_errors[np.isfinite(drawn_errors)])
    axes.set_xlabel("Error / noise", fontsize=9.5)
    return figure


def _draw_label(axes: Axes, error_ratio: float, label: str, side: Literal["left", "right"]) -> None:
    """Draw a label above the axes at the abscissa `error_ratio`. side: horizontal alignment of the text, as in
    Matplotlib."""
    axes.annotate(
        label, (error_ratio, 1), xycoords=("data", "axes fraction"), xytext=(5 if side == "right" else -5, 2),
        textcoords="offset points", ha=side, fontsize=8.5, annotation_clip=False,
    )  # fmt: skip


def _describe_rival(rival: TriedExplanation) -> str:
    """Describe an explanation and its errors, for screen readers."""
    held_out_text = f", held-out {rival.test_error:.3g}" if np.isfinite(rival.test_error) else ""
    return f"{rival.words}: {rival.training_error:.3g}{held_out_text}."


def _scale_axis(axes: Axes, errors: FloatArray) -> None:
    """Set the abscissa to the range of the errors and 1 (noise alone), with margins of 10 % below and 15 % above, at
    least up to 1.5; logarithmic if 1.15 times the largest error exceeds 4. The numbers are chosen by hand."""
    low, high = min(0.9, 0.9 * float(errors.min(initial=1.0))), 1.15 * float(errors.max(initial=1.0))
    axes.set_xscale("log" if high > 4 else "linear")
    axes.set_xlim(low, max(high, 1.5))
    if high > 4:
        set_ratio_ticks(axes.xaxis, low, high)


def _describe_claim(claim: Claim, axes: Sequence[str]) -> str:
    """Describe effect and axis of a claim in words, or how its axes share parameters."""
    noun = get_noun(claim.effect.name)
    if claim.spread != "one" or find_device_part(claim.effect) == "hand":
        return f"{noun}, {'all alike' if claim.spread == 'all' else 'each its own'}" if len(claim.sites) > 1 else noun
    site = claim.sites[0]
    return f"{noun}, {axes[site] if site < len(axes) else site + 1}" if len(axes) > 1 else noun


def _make_explanation(words: str, score: FitScore) -> TriedExplanation:
    """Make the explanation from the errors of a fit: geometric means over the channels and sets of samples."""
    training_errors = np.concatenate([score.fit, score.choose])
    return TriedExplanation(words, _compute_geometric_mean(training_errors), _compute_geometric_mean(score.test))


def _compute_geometric_mean(errors: FloatArray) -> float:
    """Compute the geometric mean; errors below 1e-6 count as 1e-6, so that the logarithm of 0 is finite; NaN gives
    NaN."""
    return float(np.exp(np.mean(np.log(np.maximum(errors, 1e-6)))))
