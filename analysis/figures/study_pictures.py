"""All figures of one study with titles and captions, in the order of its report (`analysis.reports.study_report`).

Thresholds by frequency and in other units, medians and psychometric functions of the model, delivered acceleration,
staircases, and acceleration ellipses. A figure without data is left out. Begin at `draw_study_pictures`, exported as
`analysis.study_pictures`.
"""

import re
from collections.abc import Sequence

from analysis.figures.delivered_acceleration import draw_delivered_acceleration
from analysis.figures.ellipsoids import draw_ellipsoids
from analysis.figures.medians import draw_medians
from analysis.figures.picture import Picture
from analysis.figures.psychometric import draw_people_curves, draw_person_curves
from analysis.figures.staircases import draw_staircases
from analysis.figures.thresholds import draw_thresholds
from analysis.figures.thresholds_by_unit import can_be_drawn, draw_thresholds_by_unit
from analysis.psychophysics.detection import compute_thresholds_above_detection
from analysis.psychophysics.ellipsoid import EllipsoidResult
from analysis.psychophysics.hierarchy.answers import count_answers
from analysis.psychophysics.hierarchy.observed_shares import BIN_DB
from analysis.psychophysics.hierarchy.primary import CONFIDENCE, PrimaryAnalysis
from analysis.psychophysics.study_analysis import StudyAnalysis
from analysis.psychophysics.threshold_table import ThresholdTable, tabulate_thresholds
from analysis.threshold_words import select_threshold_words


def draw_study_pictures(analysis: StudyAnalysis, ellipsoids: Sequence[EllipsoidResult] = ()) -> tuple[Picture, ...]:
    """Make the pictures of the study, in the order of the report; without those that have no data."""
    pictures = []
    if any(row.complete for row in analysis.thresholds):
        pictures.append(_make_thresholds_picture(analysis))
        pictures += _make_units_pictures(analysis)
    pictures += _make_curve_pictures(analysis)
    if any(trial.is_valid and trial.delivered_mps2 for trial in analysis.trials):
        pictures.append(_make_delivered_picture(analysis))
    pictures += _make_staircase_pictures(analysis)
    if ellipsoids:
        pictures.append(make_ellipsoid_picture(ellipsoids))
    return tuple(pictures)


def make_ellipsoid_picture(ellipsoids: Sequence[EllipsoidResult]) -> Picture:
    """Make the picture of the acceleration ellipses by frequency, with its caption."""
    return Picture(
        name="ellipsoids",
        title="Acceleration ellipses by frequency",
        caption="How the handle accelerates when it is pushed along the test direction (horizontal line), scaled to "
        "the largest axis. Above: root mean squares along the two largest principal axes, where noise and harmonics "
        "count as motion. Below: the motion at the driven frequency alone. A thin, level ellipse is a clean "
        "direction. Where a frequency was played once, the ratio of the axes and the tilt of the larger one are "
        "written above the ellipse.",
        figure=draw_ellipsoids(ellipsoids),
    )


def _make_thresholds_picture(analysis: StudyAnalysis) -> Picture:
    """Make the picture of the thresholds in newtons, with group means and comparison intervals."""
    return Picture(
        name="thresholds",
        title="Thresholds by frequency",
        caption="One marker and line per participant. Hollow markers with an arrow are cut by the cap; those above "
        "the cap are runs that the trial limit stopped. Black: group mean with comparison interval: two means differ "
        f"significantly ({100 * (1 - CONFIDENCE):.0f} % level) when their intervals do not overlap. They are not "
        "confidence intervals of the means."
        + (f" {analysis.table.coverage_warning}" if analysis.table.coverage_warning else ""),
        figure=draw_thresholds(analysis.table, analysis.comparisons, analysis.protocol.staircase.cap_n),
    )


def _make_units_pictures(analysis: StudyAnalysis) -> list[Picture]:
    """Make the picture of the thresholds in all units with data, as a list; empty where fewer than two units have
    data."""
    tables = [
        table
        for table in _list_unit_tables(analysis)
        if any(can_be_drawn(value, table.quantity) for row in table.values for value in row)
    ]
    if len(tables) < 2:
        return []
    return [
        Picture(
            name="units",
            title="Thresholds in every unit that was measured",
            caption="The same runs in each panel, people joined by lines; bar: median of what is shown. Hollow markers "
            "with an arrow are cut by the cap: medians over them are too low. Acceleration and displacement are what "
            f"was measured along the direction in {select_threshold_words(analysis.protocol.staircase).measured_in}."
            + (
                " Above detection: over the level from which the same participant felt the vibration at all, where the "
                "cap did not cut that level."
                if tables[-1].quantity == "above_detection_db"
                else ""
            ),
            figure=draw_thresholds_by_unit(tables),
        )
    ]


def _list_unit_tables(analysis: StudyAnalysis) -> list[ThresholdTable]:
    """List the tables of thresholds in N, m/s², mm, and dB above the detection threshold, in this order."""
    frequencies_hz = analysis.table.frequencies_hz
    measured = [
        tabulate_thresholds(analysis.thresholds, frequencies_hz, quantity)
        for quantity in ("threshold_mps2", "threshold_mm")
    ]
    return [analysis.table, *measured, compute_thresholds_above_detection(analysis.table, analysis.detection_table)]


def _make_curve_pictures(analysis: StudyAnalysis) -> list[Picture]:
    """Make the pictures of the medians by the hierarchical model and of the psychometric functions of all people
    together, where that model was fitted, then of those of each person; empty without a fit or without answers."""
    fit = analysis.primary or analysis.single_persons
    answer_counts = count_answers(analysis.trials, fit.frequencies_hz) if fit is not None else None
    if fit is None or answer_counts is None:
        return []
    points_text = (
        f"Points: shares of right answers in bins of {BIN_DB:g} dB, with Wilson's 95 % intervals; the larger, the more "
        "trials. "
    )
    primary = analysis.primary
    people_picture = primary and Picture(
        name="psychometric",
        title="Psychometric functions, all people together",
        caption=f"{points_text}Levels are relative to each person's threshold by the hierarchical model of all "
        f"answers, whose curve is drawn. {select_threshold_words(analysis.protocol.staircase).misfit_note}",
        figure=draw_people_curves(answer_counts, primary),
    )
    return [
        *([_make_medians_picture(primary, analysis.protocol.staircase.cap_n)] if primary else []),
        *([people_picture] if people_picture else []),
        *(
            Picture(
                name=f"psychometric-{subject_number}-{_sanitize_subject_code(subject)}",
                title=f"Psychometric functions of {subject}",
                caption=points_text
                + (
                    "Curves: the hierarchical model of all answers; it shrinks a person's threshold towards those of "
                    "the others where the person's own answers carry little information."
                    if primary
                    else "Curves: the most probable ones of this person."
                ),
                figure=draw_person_curves(answer_counts, fit, subject_number - 1, analysis.protocol.staircase.cap_n),
                folded=True,
            )
            for subject_number, subject in enumerate(answer_counts.subjects, start=1)
        ),
    ]


def _make_medians_picture(primary: PrimaryAnalysis, cap_n: float) -> Picture:
    """Make the picture of the median thresholds by the hierarchical model, with the direction limit."""
    return Picture(
        name="medians",
        title="Thresholds by the hierarchical model of all answers",
        caption=f"Black: threshold of the median participant with its {100 * primary.confidence:g} % interval. The "
        "size of a threshold above the cap is not known. Such a median is an arrow, which begins at its one-sided "
        "lower bound, or at the lower end of the axis where there is no bound; such thresholds of participants are "
        "hollow markers on a line above the cap. An interval without an upper mark continues above the axis. Coloured "
        "lines join the thresholds of a participant, as estimated by the model: it shrinks them towards those of the "
        "others where the participant's own answers carry little information. Diamond and thick line on the cap: the "
        "direction limit, the frequency at which the median threshold reaches the cap, and its interval; both are "
        "known only within the range of the frequencies played.",
        figure=draw_medians(primary, cap_n),
    )


def _sanitize_subject_code(subject: str) -> str:
    """Replace each run of characters of a subject's code other than ASCII letters and digits by a hyphen, and remove
    hyphens at both ends, as picture names need."""
    return re.sub(r"[^A-Za-z0-9]+", "-", subject).strip("-")


def _make_delivered_picture(analysis: StudyAnalysis) -> Picture:
    """Make the picture of the delivered acceleration over the commanded level, along and off the direction."""
    return Picture(
        name="delivered",
        title="Delivered acceleration against commanded level",
        caption="Amplitude at the stimulus frequency, measured in every counted trial, along and off the direction of "
        "the stimulus; all participants. Points off the line mark levels or trials where the device did not follow "
        "in proportion; the distance between the two kinds is the coupling.",
        figure=draw_delivered_acceleration(analysis.trials),
    )


def _make_staircase_pictures(analysis: StudyAnalysis) -> list[Picture]:
    """Make a picture per participant with the levels of all runs."""
    subjects = dict.fromkeys(run.subject for run in analysis.runs)
    return [
        Picture(
            name=f"staircases-{subject_number}-{_sanitize_subject_code(subject)}",
            title=f"{'Levels' if analysis.protocol.staircase.is_bayesian else 'Staircases'} of {subject}",
            caption=select_threshold_words(analysis.protocol.staircase).run_caption,
            figure=draw_staircases(
                [run for run in analysis.runs if run.subject == subject], analysis.protocol.staircase
            ),
            folded=True,
        )
        for subject_number, subject in enumerate(subjects, start=1)
    ]
