"""The part of a page about faults that were injected into real recordings."""

from collections.abc import Sequence

from analysis.proof.injected import DETECTABLE, InjectedOutcome, injected_figures
from analysis.proof.share import Figure
from analysis.reports.page import Section, Table


def injected_section(outcomes: Sequence[InjectedOutcome]) -> Section:
    figures = injected_figures(outcomes)
    rates = Table(
        "How often it was right",
        ("what", "rate, 95 % interval"),
        tuple((one.name, figure_text(one)) for one in figures),
    )
    missed = [one for one in outcomes if not one.right and (one.detectable or not one.effect)]
    listed = Table(
        "Every miss",
        ("recording", "injected", "error grows by", "verdict", "named"),
        tuple(
            (
                one.recording,
                one.effect or "nothing",
                f"{one.adds:.2f}",
                one.verdict.replace("_", " "),
                ", ".join(one.named) or "-",
            )
            for one in missed
        ),
    )
    return Section(
        "Faults injected into real recordings",
        paragraphs=(
            "Half of a recording was left as it is, and served as the clean one; into the other half a fault of the "
            "sensor or the clock was put, drawn and sealed beforehand. The diagnosis was given the model that knows "
            "what is really there, both halves, and nothing else.",
            f"A fault is detectable where it makes that model's error {DETECTABLE} times as large or more, also once "
            "the model's own numbers are re-tuned within their tolerances.",
        ),
        tables=(rates, listed) if missed else (rates,),
    )


def figure_text(figure: Figure) -> str:
    """ "88 % [69, 96] of 24"."""
    if figure.value is None or figure.low is None or figure.high is None:
        return "none was drawn"
    return f"{100 * figure.value:.0f} % [{100 * figure.low:.0f}, {100 * figure.high:.0f}] of {figure.of}"
