"""Table of thresholds by participant and frequency, the input of the analyses of variance; missing ones are gaps."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from analysis.psychophysics.thresholds import RunEnd, Threshold

Quantity = Literal["threshold_n", "threshold_db", "threshold_mps2", "threshold_mm", "above_detection_db"]
"""A threshold as force (N, or dB re 1 N), acceleration (m/s²), displacement (mm), or dB above the detection
threshold."""


@dataclass(frozen=True, slots=True)
class ThresholdTable:
    """Thresholds by participant and frequency, with marks for censored and stopped runs."""

    quantity: Quantity
    """Quantity of `values`, which determines their unit."""
    subjects: tuple[str, ...]
    """Codes of the participants: the rows."""
    frequencies_hz: tuple[float, ...]
    """Ascending: the columns."""
    values: tuple[tuple[float | None, ...], ...]
    """values[subject][frequency]; None where there is no completed run, or it has no value of this quantity."""
    censored: tuple[tuple[bool, ...], ...]
    """Same shape as `values`: True where the cap cut into the threshold of the completed run, also where `values` has
    None for lack of a measurement."""
    stopped: tuple[tuple[bool, ...], ...]
    """Same shape as `values`: True where there is no value because the trial limit ended a run and none was
    completed."""
    notes: tuple[str, ...]
    """Sentences on runs that were left out of the table."""

    def group_by_frequency(self) -> dict[str, tuple[float | None, ...]]:
        """Group the values by frequency, named like "35 Hz", one entry per participant."""
        columns = zip(*self.values, strict=True) if self.values else ((),) * len(self.frequencies_hz)
        return {
            format_frequency(frequency_hz): column
            for frequency_hz, column in zip(self.frequencies_hz, columns, strict=True)
        }

    def look_up(self, subject: str, frequency_hz: float) -> tuple[float | None, bool]:
        """Look up a threshold (None where missing), and whether it is censored."""
        if subject not in self.subjects or frequency_hz not in self.frequencies_hz:
            return None, False
        row, column = self.subjects.index(subject), self.frequencies_hz.index(frequency_hz)
        return self.values[row][column], self.censored[row][column]

    @property
    def censored_count(self) -> int:
        """Number of thresholds into which the cap cut (censored)."""
        return sum(map(sum, self.censored))

    @property
    def coverage_warning(self) -> str:
        """Sentences that warn that the stated confidence of intervals and effect sizes does not hold; empty where
        neither the cap nor the trial limit affected a threshold."""
        missing_count = sum(map(sum, self.stopped))
        causes = (
            [f"{self.censored_count} of the values {'is' if self.censored_count == 1 else 'are'} cut by the cap"]
            if self.censored_count
            else []
        )
        causes += (
            [f"{missing_count} {'is' if missing_count == 1 else 'are'} missing because of the trial limit"]
            if missing_count
            else []
        )
        if not causes:
            return ""
        return (
            f"Without coverage: {' and '.join(causes)}. Means near the cap are too low, and the stated confidence of "
            "intervals and effect sizes does not hold."
        )

    def list_gaps(self) -> tuple[tuple[str, float], ...]:
        """List participant and frequency of every gap."""
        return tuple(
            (subject, frequency_hz)
            for subject, row in zip(self.subjects, self.values, strict=True)
            for frequency_hz, threshold in zip(self.frequencies_hz, row, strict=True)
            if threshold is None
        )


def tabulate_thresholds(
    rows: Sequence[Threshold],
    frequencies_hz: Sequence[float],
    quantity: Quantity = "threshold_n",
    is_detection: bool = False,
) -> ThresholdTable:
    """Tabulate the first completed run of each participant at each of the frequencies.

    The first, because a run repeated after its result was seen must not replace it; later ones are named in the notes,
    and so are runs at further frequencies. Frequencies ascend; participants are in the order of their first row; those
    without any completed run have a row of gaps. is_detection: whether these are detection runs, whose answers enter no
    model.
    """
    subjects = tuple(dict.fromkeys(row.subject for row in rows))
    first_runs: dict[tuple[str, float], Threshold] = {}
    trial_limited_cells = {(row.subject, row.frequency_hz) for row in rows if row.ended is RunEnd.TRIAL_LIMIT}
    notes = []
    for row in rows:
        cell = (row.subject, row.frequency_hz)
        if row.frequency_hz not in frequencies_hz:
            notes.append(f"{row.subject} has a run at {row.frequency_hz:g} Hz, which the protocol does not name.")
        elif row.complete and cell in first_runs:
            notes.append(_describe_repeated_run(first_runs[cell], row, is_detection))
        elif row.complete:
            first_runs[cell] = row
    ordered_hz = tuple(sorted(frequencies_hz))
    return ThresholdTable(
        quantity=quantity,
        subjects=subjects,
        frequencies_hz=ordered_hz,
        values=tuple(
            tuple(_read_finite_value(first_runs.get((subject, f_hz)), quantity) for f_hz in ordered_hz)
            for subject in subjects
        ),
        censored=tuple(
            tuple((subject, f_hz) in first_runs and first_runs[subject, f_hz].censored for f_hz in ordered_hz)
            for subject in subjects
        ),
        stopped=tuple(
            tuple((subject, f_hz) in trial_limited_cells and (subject, f_hz) not in first_runs for f_hz in ordered_hz)
            for subject in subjects
        ),
        notes=tuple(notes),
    )


def _describe_repeated_run(first: Threshold, repeated: Threshold, is_detection: bool) -> str:
    """Describe which of two completed runs of a participant at the same frequency gives the threshold."""
    run_noun, model_note = (
        ("detection run", "") if is_detection else ("run", " A model of all answers takes the answers of both.")
    )
    return (
        f"{first.subject} completed more than one {run_noun} at {first.frequency_hz:g} Hz; the threshold is that of "
        f"the first (session {first.session}), not of run {repeated.run} of session {repeated.session}.{model_note}"
    )


def format_frequency(frequency_hz: float) -> str:
    """Format the name of a frequency's group, such as "35 Hz"."""
    return f"{frequency_hz:g} Hz"


def _read_finite_value(row: Threshold | None, quantity: Quantity) -> float | None:
    """Read a quantity of a run; None without a run, and for NaN."""
    threshold: float | None = None if row is None else getattr(row, quantity)
    return None if threshold is None or math.isnan(threshold) else threshold
