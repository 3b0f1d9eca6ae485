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

from analysis.diagnosis.effect_words import noun_of
from analysis.diagnosis.errors.fit_score import FitScore
from analysis.diagnosis.errors.hypothesis import Claim
from analysis.diagnosis.search.explain import Explanation
from analysis.diagnosis.search.search_context import FittedCandidate
from analysis.figures.diagnosis.stage_style import AFTER, RETUNED
from analysis.figures.picture import Picture
from analysis.figures.style import BLACK, GREY, draw_no_data_note, new_figure, plain_axes, ratio_ticks
from equalizer.effects.placing import place_of_effect
from equalizer.signals.signal import FloatArray

MOST_RIVALS = 8
"""Largest number of explanations that are drawn in a figure."""
_SEEN = "Errors on the data that were used for fitting and model selection; rivals are not evaluated on held-out data."
_BOTH = "Filled: data that were used for fitting and model selection; open: held-out data, which were used for neither."
_ORDINALS = ("first", "second", "third", "fourth", "fifth")


@dataclass(frozen=True, slots=True)
class TriedExplanation:
    """An explanation with its errors: geometric mean over channels of error / noise; 1 = noise alone."""

    words: str
    """Effect and axis, in words."""
    seen: float
    """Error on the data that were fitted to and chosen by."""
    test: float
    """Error on held-out data; NaN where not computed."""


def list_explanations(round_: Sequence[FittedCandidate], axes: Sequence[str]) -> tuple[TriedExplanation, ...]:
    """The best fit of each hypothesis of a round: first the round's choice, which may have a larger error than a less
    simple one; then the others, the smallest error first. axes: displayed names of the axes."""
    best: dict[object, TriedExplanation] = {}
    for item in round_:
        words = ", ".join(_claim_words(claim, axes) for claim in item.fitted.hypothesis.claims[-1:])
        best.setdefault(item.fitted.hypothesis.key, _make_explanation(words, item.score))
    chosen, others = list(best.values())[:1], list(best.values())[1:]
    return (*chosen, *sorted(others, key=lambda each: each.seen))[:MOST_RIVALS]


def rivals_pictures(explanation: Explanation, axes: Sequence[str]) -> tuple[Picture, ...]:
    """A picture per round in which several explanations were tried; folded where none of them was added."""
    retuned = _make_explanation("re-tuned, no physics", explanation.retuned.score)
    pictures = []
    several = [number for number, round_ in enumerate(explanation.rounds, start=1) if len(round_) > 1]
    for number in several[: len(_ORDINALS)]:
        round_ = explanation.rounds[number - 1]
        tried, held = list_explanations(round_, axes), number <= len(explanation.steps)
        if tried:
            pictures.append(
                Picture(
                    name=f"rivals-{number}",
                    title=f"What was tried for the {_ORDINALS[several.index(number)]} effect"
                    + ("" if held else "; none was accepted"),
                    caption="Error in units of the noise, mean over the channels, of each explanation after its fit, "
                    "in addition to the effects found before. "
                    + (_BOTH if any(np.isfinite(each.test) for each in tried) else _SEEN)
                    + " Dashed: the re-tuned model alone.",
                    figure=draw_rivals(tried, retuned, held),
                    folded=not held,
                    bitmap=held,
                    alternative=" ".join(_alternative_text(each) for each in tried),
                )
            )
    return tuple(pictures)


def draw_rivals(tried: Sequence[TriedExplanation], retuned: TriedExplanation, held: bool = True) -> Figure:
    """Figure with a row per explanation, the chosen one on top. held: whether the chosen explanation was added, and is
    marked."""
    if not tried:
        return draw_no_data_note(new_figure(7.4, 1.4), "Nothing was tried.")
    figure = new_figure(8.8, 1.05 + 0.3 * len(tried))
    axes = figure.add_subplot()
    plain_axes(axes)
    for row, item in enumerate(tried):
        colour = AFTER.colour if row == 0 and held else GREY
        axes.plot([item.seen, item.test], [row, row], color=colour, linewidth=1.2, zorder=2)
        axes.plot(item.seen, row, "o", color=colour, markersize=6.5, zorder=3)
        if np.isfinite(item.test):
            axes.plot(item.test, row, "o", color=colour, markersize=6.5, markerfacecolor="white", zorder=3)
    axes.axvline(retuned.seen, color=RETUNED.colour, linestyle=RETUNED.dash, linewidth=RETUNED.width, zorder=1)
    axes.axvline(1, color=BLACK, linewidth=1.0, zorder=1)
    _draw_mark(axes, 1.0, "noise", "right")
    _draw_mark(axes, retuned.seen, "re-tuned", "left")
    axes.set_yticks(range(len(tried)), [each.words for each in tried])
    if held:
        axes.get_yticklabels()[0].set_fontweight("bold")
    axes.set_ylim(len(tried) - 0.5, -0.5)
    axes.grid(False, axis="y")
    values = np.array([*(each.seen for each in tried), *(each.test for each in tried), retuned.seen])
    _scale_axis(axes, values[np.isfinite(values)])
    axes.set_xlabel("Error / noise", fontsize=9.5)
    return figure


def _draw_mark(axes: Axes, at: float, words: str, side: Literal["left", "right"]) -> None:
    """A label above the axes at the abscissa `at`. side: horizontal alignment of the text, as in Matplotlib."""
    axes.annotate(
        words, (at, 1), xycoords=("data", "axes fraction"), xytext=(5 if side == "right" else -5, 2),
        textcoords="offset points", ha=side, fontsize=8.5, annotation_clip=False,
    )  # fmt: skip


def _alternative_text(rival: TriedExplanation) -> str:
    held_out = f", held-out {rival.test:.3g}" if np.isfinite(rival.test) else ""
    return f"{rival.words}: {rival.seen:.3g}{held_out}."


def _scale_axis(axes: Axes, values: FloatArray) -> None:
    """Set the abscissa to the range of the errors; logarithmic if that exceeds 4."""
    low, high = min(0.9, 0.9 * float(values.min(initial=1.0))), 1.15 * float(values.max(initial=1.0))
    axes.set_xscale("log" if high > 4 else "linear")
    axes.set_xlim(low, max(high, 1.5))
    if high > 4:
        ratio_ticks(axes.xaxis, low, high)


def _claim_words(claim: Claim, axes: Sequence[str]) -> str:
    """Effect and axis of a claim, or how its axes share parameters, in words."""
    noun = noun_of(claim.effect.name)
    if claim.spread != "one" or place_of_effect(claim.effect) == "hand":
        return f"{noun}, {'all alike' if claim.spread == 'all' else 'each its own'}" if len(claim.sites) > 1 else noun
    site = claim.sites[0]
    return f"{noun}, {axes[site] if site < len(axes) else site + 1}" if len(axes) > 1 else noun


def _make_explanation(words: str, score: FitScore) -> TriedExplanation:
    """The explanation with the geometric means of its errors."""
    seen = np.concatenate([score.fit, score.choose])
    return TriedExplanation(words, _geometric_mean(seen), _geometric_mean(score.test))


def _geometric_mean(values: FloatArray) -> float:
    return float(np.exp(np.mean(np.log(np.maximum(values, 1e-6)))))
