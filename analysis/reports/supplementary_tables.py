"""Supplementary tables of a study report: detection, delivered acceleration, catch trials, practice and
acceleration ellipses.

Detection threshold: the level from which a vibration is felt at all, in contrast to that from which its direction is
felt. A threshold is "cut" where the force cap limited it (censored).
"""

from collections.abc import Iterator, Sequence

from analysis.psychophysics.bias import CRITERION_DEFINITION
from analysis.psychophysics.ellipsoid import EllipsoidResult
from analysis.psychophysics.equalized_delivery import compute_deliveries
from analysis.psychophysics.study_analysis import StudyAnalysis
from analysis.reports.methods_text import describe_levels
from analysis.reports.page import Table
from analysis.threshold_words import select_threshold_words
from analysis.wording import MISSING, format_newtons, format_number, format_signed, mark_cut
from protocols.procedure.staircase import to_db


def make_detection_table(analysis: StudyAnalysis) -> Table:
    """Make the table of detection and direction thresholds (N) per participant and frequency, with their ratio in
    dB."""
    thresholds = analysis.detection_table
    rows = [
        (
            subject,
            f"{frequency_hz:g} Hz",
            *_format_detection_cells(analysis, subject, frequency_hz, detection_n, is_detection_cut),
        )
        for subject, subject_thresholds_n, subject_cut_marks in zip(
            thresholds.subjects, thresholds.values, thresholds.censored, strict=True
        )
        for frequency_hz, detection_n, is_detection_cut in zip(
            thresholds.frequencies_hz, subject_thresholds_n, subject_cut_marks, strict=True
        )
    ]
    return Table(
        caption="Detection thresholds (N)",
        header=("Participant", "Frequency", "Felt from", "Direction felt from", "Direction above detection (dB)"),
        rows=tuple(rows),
        notes=(
            f"{select_threshold_words(analysis.protocol.staircase).cut_note} –: no completed run. The last column is "
            "given where both are thresholds. Near 0 dB the vibration has a direction as soon as it is felt; far "
            "above, it is felt long before its direction is.",
        ),
    )


def make_detection_run_table(analysis: StudyAnalysis) -> Table:
    """Make the folded (collapsed) table of all detection runs; only staircases have a column of reversals."""
    reversal_header = () if analysis.protocol.staircase.is_bayesian else ("Reversals",)
    return Table(
        caption="All detection runs",
        header=("Participant", "Session", "Run", "Hz", "N", *reversal_header, "Trials", "% right", "d'", "Criterion"),
        rows=tuple(
            (
                row.subject, row.session, str(row.run), f"{row.frequency_hz:g}",
                mark_cut(row.threshold_n, row.censored), *([str(row.reversals)] if reversal_header else []),
                str(row.trials), format_number(row.percent_correct, 0), format_number(row.d_prime),
                format_number(row.criterion),
            )
            for row in analysis.detection
        ),
        notes=(f"d' of two intervals. Criterion: {CRITERION_DEFINITION}. Chance is 50 % right.",),
        folded=True,
    )  # fmt: skip


def make_delivery_tables(analysis: StudyAnalysis) -> tuple[Table, ...]:
    """Make the table of delivered over requested acceleration by frequency; empty without trials that have a requested
    and a measured acceleration."""
    rows = tuple(
        (
            f"{delivery.frequency_hz:g} Hz",
            str(delivery.trials),
            *map(_format_percent, delivery.along),
            _format_percent(delivery.off_axis),
        )
        for delivery in compute_deliveries(analysis.trials)
    )
    if not rows:
        return ()
    header = ("Frequency", "Trials", "Along, direction 1", "Along, direction 2", "Off the direction")
    note = "Medians of trials. Along: delivered over target. Off: over the delivered acceleration along the direction."
    return (Table("Delivered over target acceleration", header, rows, notes=(note,)),)


def _format_percent(share: float | None) -> str:
    """Format a ratio in percent without decimals; `MISSING` for None."""
    return MISSING if share is None else f"{100 * share:.0f} %"


def make_catch_table(analysis: StudyAnalysis) -> Table:
    """Make the table of catch trials by participant and frequency, with the lapse rate and Wilson's 95 % interval."""
    return Table(
        caption="Catch trials",
        header=("Participant", "Frequency", "Given", "Wrong", "Lapse rate", "95 % interval"),
        rows=tuple(
            (
                tally.subject,
                f"{tally.frequency_hz:g} Hz",
                str(tally.given),
                str(tally.wrong),
                f"{100 * tally.lapse_rate:.0f} %",
                f"{100 * tally.lower:.0f} to {100 * tally.upper:.0f} %",
            )
            for tally in analysis.catches
        ),
        notes=(
            "Wilson's interval. At high frequencies even the full level may have no direction for a hand: a wrong "
            "answer there is no proof of inattention.",
        ),
    )


def make_practice_table(analysis: StudyAnalysis) -> Table:
    """Make the folded (collapsed) table of practice runs."""
    settings = analysis.protocol.practice
    return Table(
        caption="Practice runs",
        header=(
            "Participant",
            "Session",
            "Frequency",
            "Trials",
            "Right",
            f"Right of the last {settings.of_last}",
            "Outcome",
        ),
        rows=tuple(
            (
                run.subject,
                run.session,
                f"{run.frequency_hz:g} Hz",
                str(run.trials),
                str(run.right),
                str(run.right_of_last),
                "passed" if run.passed else "not passed" if run.over else "broken off",
            )
            for run in analysis.practice
        ),
        notes=(f"At {describe_levels(settings)}; passed with {settings.right_needed} right.",),
        folded=True,
    )


def make_ellipsoid_table(results: Sequence[EllipsoidResult]) -> Table:
    """Make the table of acceleration ellipses: ratio of the axes and tilt, from second moments and from phasors at the
    driven frequency; off-axis over on-axis acceleration; energy of the harmonics in % of that of the fundamental."""
    return Table(
        caption="Acceleration ellipses",
        header=(
            "Frequency", "Along", "Force (N)", "Along (m/s²)", "Axes, mean squares", "Tilt", "Axes, phasors", "Tilt",
            "Off / on axis", "Harmonics",
        ),
        rows=tuple(
            (
                f"{result.frequency_hz:g} Hz", result.along.replace("_", " "), format_newtons(result.amplitude_n),
                format_number(result.phasor.on_axis_mps2), f"1 : {format_number(result.moments.normalised_axes[1])}",
                f"{format_number(result.moments.tilt_deg, 0)}°", f"1 : {format_number(result.phasor.ellipticity)}",
                f"{format_number(result.phasor.tilt_deg, 0)}°", format_number(result.phasor.off_axis_ratio),
                f"{100 * result.phasor.harmonic_share:.1f} %",
            )
            for result in results
        ),
        notes=(
            "Tilt: of the largest axis from the test direction. Harmonics: energy at 2 to 5 times the driven frequency "
            "over that of the fundamental.",
        ),
    )  # fmt: skip


def _format_detection_cells(
    analysis: StudyAnalysis, subject: str, frequency_hz: float, detection_n: float | None, is_detection_cut: bool
) -> Iterator[str]:
    """Format the cells of detection threshold, direction threshold and their ratio in dB; the ratio is `MISSING` where
    either is missing or cut. detection_n: detection threshold (N), None = missing."""
    direction_n, is_direction_cut = analysis.table.look_up(subject, frequency_hz)
    yield mark_cut(detection_n, is_detection_cut)
    yield mark_cut(direction_n, is_direction_cut)
    if detection_n is None or direction_n is None or is_detection_cut or is_direction_cut:
        yield MISSING
    else:
        yield format_signed(to_db(direction_n) - to_db(detection_n), 1)
