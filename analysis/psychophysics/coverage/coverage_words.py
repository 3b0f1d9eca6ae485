"""Measured coverage of each confidence interval near the force cap, as sentences for reports and as a table.

Coverage is the share of 95 % intervals, in simulated studies, that contain the true value. `measured_coverage` has the
counts; `make coverage` (tests/references) writes the table into docs/statistics.md.
"""

from collections.abc import Sequence
from dataclasses import dataclass

from analysis.psychophysics.catch_trials import compute_wilson_interval
from analysis.wording import format_number, format_signed

MEDIAN_TEXTS = {25.0: "0.85 N", 35.0: "3 N, the cap", 45.0: "4 N, above the cap"}
"""Reported frequencies (Hz) of the simulated studies, and the true median threshold at each; at 5 Hz it is 0.35 N."""
INTERVAL_TITLES = {
    "model": "difference to 5 Hz by the model of all answers, dB",
    "means": "difference to 5 Hz by reversal means, paired, dB",
    "tobit": "difference to 5 Hz by reversal means, Tobit, dB",
    "tukey": "difference to 5 Hz by reversal means, as published (Tukey), N",
    "run": "single threshold by likelihood, with the model's slopes",
    "single": "single threshold by likelihood, one participant alone",
    "one-way": "type-1 error of the one-way analysis at equal medians of 2.2 N",
}
"""Text for the interval of each analysis, by its key."""
ANALYSES_BELOW_CAP = ("run", "single")
"""Analyses that give an estimate only where it is below the cap. Near the cap their mean error is due to this
selection, so sentences leave it out."""


@dataclass(frozen=True, slots=True)
class MeasuredCoverage:
    """Coverage of an interval in simulated studies of ten people (analysis "single": of one), with the published
    staircase and a cap of 3 N."""

    analysis: str
    """A key of `INTERVAL_TITLES`."""
    frequency_hz: float
    """0 where all frequencies are tested together."""
    bias_db: float | None
    """Mean error of the estimates, over the cases that have one; None for an analysis that gives none in dB."""
    covered: int
    """Number of 95 % intervals that contain the true value; for a type-1 error, of studies that found a difference."""
    intervals: int
    """Number of all intervals; for a type-1 error, of all studies."""

    @property
    def percent(self) -> str:
        """Share of `covered` in per cent with Wilson's 95 % interval, such as: 94.0 % (92.4 to 95.3)."""
        lower, upper = compute_wilson_interval(self.covered, self.intervals)
        share = 100 * self.covered / self.intervals
        return f"{format_number(share, 1)} % ({format_number(100 * lower, 1)} to {format_number(100 * upper, 1)})"


def format_coverage_table(rows: Sequence[MeasuredCoverage]) -> list[str]:
    """Format the table in Markdown, one line per row, ordered as `INTERVAL_TITLES`."""
    lines = [
        "| interval | median threshold | bias of the estimates (dB) | contains the true value |",
        "|---|---|---|---|",
    ]
    for analysis, title in INTERVAL_TITLES.items():
        for row in rows:
            if row.analysis == analysis:
                bias_text = "" if row.bias_db is None else format_signed(row.bias_db)
                lines.append(f"| {title} | {MEDIAN_TEXTS.get(row.frequency_hz, '')} | {bias_text} | {row.percent} |")
    return lines


def describe_coverage(rows: Sequence[MeasuredCoverage], analysis: str) -> str:
    """Describe the coverage and bias of one analysis (a key of `INTERVAL_TITLES`) at each median threshold, or its
    type-1 error (a row with the frequency 0); empty where no row has the analysis."""
    texts = []
    for row in rows:
        if row.analysis == analysis and row.frequency_hz:
            has_bias = row.bias_db is not None and analysis not in ANALYSES_BELOW_CAP
            bias = f" (bias {format_signed(row.bias_db or 0.0, 1)} dB)" if has_bias else ""
            texts.append(
                f"{format_number(100 * row.covered / row.intervals, 0)} % at {MEDIAN_TEXTS[row.frequency_hz]}{bias}"
            )
        elif row.analysis == analysis:
            return f"{_OPENING}: the {INTERVAL_TITLES[analysis]} is {row.percent}, nominally 5 %."
    if not texts:
        return ""
    return f"{_OPENING}: the 95 % interval ({INTERVAL_TITLES[analysis]}) contains the true value in {'; '.join(texts)}."


_OPENING = "Measured near the cap in simulated studies with the published staircase"
"""Beginning of every sentence."""
