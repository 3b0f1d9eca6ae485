"""Texts for reports of a blind test: scores with confidence intervals, concealed effects, and answers."""

from analysis.evaluation.blind_test.confidence_intervals import IntervalEstimate
from analysis.evaluation.blind_test.outcome import Outcome


def format_figure(figure: IntervalEstimate) -> str:
    """Format a figure with its 95 % interval and its number of cases, a share in per cent, such as "95.7 % [90, 98],
    110 of 115", a statistic in the unit of its values; "none drawn" where it has no value."""
    if figure.value is None or figure.low is None or figure.high is None:
        return "none drawn"
    if figure.hits is None:
        return f"{figure.value:.3g} [{figure.low:.3g}, {figure.high:.3g}], of {figure.of}"
    low, high = 100 * figure.low, 100 * figure.high
    return f"{100 * figure.value:.1f} % [{low:.0f}, {high:.0f}], {figure.hits} of {figure.of}"


def describe_concealed(outcome: Outcome) -> str:
    """Describe the concealed effects with their axes, such as "coulomb_friction of x + end_stop of y"; "nothing" where
    there are none."""
    return (
        " + ".join(f"{effect.effect}{f' of {effect.axis}' if effect.axis else ''}" for effect in outcome.concealed)
        or "nothing"
    )


def describe_answer(outcome: Outcome) -> str:
    """Describe the answer: the verdict, then the named effects, if any, with their axes and probabilities (0 to 1)."""
    text = " + ".join(
        f"{effect.effect}{f' of {effect.axis}' if effect.axis else ''} ({effect.probability:.2f})"
        for effect in outcome.named
    )
    return f"{outcome.verdict.replace('_', ' ')}{f': {text}' if text else ''}"


def describe_strengths(outcome: Outcome) -> str:
    """Describe the strengths of the concealed effects, from 0 (the weakest that is drawn) to 1 (the strongest),
    separated by commas; empty where nothing was concealed."""
    return ", ".join(f"{value:.2f}" for value in outcome.strengths)
