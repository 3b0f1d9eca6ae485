"""Figures and misses of a proof as sentences."""

from analysis.evaluation.blind_test.outcome import Outcome
from analysis.evaluation.blind_test.share import Figure


def figure_text(figure: Figure) -> str:
    """A figure with its 95 % interval, in per cent where it is a share; "none drawn" where it has no value."""
    if figure.value is None or figure.low is None or figure.high is None:
        return "none drawn"
    if figure.hits is None:
        return f"{figure.value:.3g} [{figure.low:.3g}, {figure.high:.3g}], of {figure.of}"
    low, high = 100 * figure.low, 100 * figure.high
    return f"{100 * figure.value:.1f} % [{low:.0f}, {high:.0f}], {figure.hits} of {figure.of}"


def describe_concealed(outcome: Outcome) -> str:
    """The concealed effects with their axes; "nothing" where there are none."""
    return " + ".join(f"{c.effect}{f' of {c.axis}' if c.axis else ''}" for c in outcome.concealed) or "nothing"


def answer_text(outcome: Outcome) -> str:
    """The verdict, and the named effects with their axes and stated probabilities."""
    text = " + ".join(f"{e.effect}{f' of {e.axis}' if e.axis else ''} ({e.probability:.2f})" for e in outcome.named)
    return f"{outcome.verdict.replace('_', ' ')}{f': {text}' if text else ''}"


def strength_text(outcome: Outcome) -> str:
    """The strengths of the concealed effects, from 0 (the weakest that is drawn) to 1, with commas between."""
    return ", ".join(f"{value:.2f}" for value in outcome.strengths)
