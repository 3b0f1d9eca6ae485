"""All figures of one study, in the order of the report."""

import re
from collections.abc import Sequence

from analysis.figures.delivered import draw_delivered
from analysis.figures.ellipsoids import draw_ellipsoids
from analysis.figures.picture import Picture
from analysis.figures.staircases import draw_staircases
from analysis.figures.thresholds import draw_thresholds
from analysis.psychophysics.ellipsoid import EllipsoidResult
from analysis.psychophysics.study_analysis import StudyAnalysis


def study_pictures(analysis: StudyAnalysis, ellipsoids: Sequence[EllipsoidResult] = ()) -> tuple[Picture, ...]:
    """Only what there is data for."""
    pictures = []
    if any(row.complete for row in analysis.thresholds):
        pictures.append(_thresholds_picture(analysis))
    if any(trial.counts and trial.delivered_mps2 for trial in analysis.trials):
        pictures.append(_delivered_picture(analysis))
    pictures += _staircase_pictures(analysis)
    if ellipsoids:
        pictures.append(ellipsoid_picture(ellipsoids))
    return tuple(pictures)


def ellipsoid_picture(ellipsoids: Sequence[EllipsoidResult]) -> Picture:
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


def _thresholds_picture(analysis: StudyAnalysis) -> Picture:
    return Picture(
        name="thresholds",
        title="Thresholds by frequency",
        caption="One marker and line per participant. Hollow markers with an arrow are cut by the cap; those above "
        "the cap are runs that the trial limit stopped. Black: group mean with comparison interval: two means differ "
        "significantly when their intervals do not overlap. They are not confidence intervals of the means."
        + (f" {analysis.table.coverage}" if analysis.table.coverage else ""),
        figure=draw_thresholds(analysis.table, analysis.comparisons, analysis.protocol.staircase.cap_n),
    )


def _delivered_picture(analysis: StudyAnalysis) -> Picture:
    return Picture(
        name="delivered",
        title="Delivered acceleration against commanded level",
        caption="Amplitude at the stimulus frequency, measured in every counted trial, along and off the direction of "
        "the stimulus; all participants. Points off the line mark levels or trials where the device did not follow "
        "in proportion; the distance between the two kinds is the coupling.",
        figure=draw_delivered(analysis.trials),
    )


def _staircase_pictures(analysis: StudyAnalysis) -> list[Picture]:
    subjects = dict.fromkeys(run.subject for run in analysis.runs)
    return [
        Picture(
            name=f"staircases-{index}-{re.sub(r'[^A-Za-z0-9]+', '-', subject).strip('-')}",
            title=f"Staircases of {subject}",
            caption="Level of every counted trial, right and wrong answers, and the reversals; the black ones are "
            "averaged into the threshold (solid line).",
            figure=draw_staircases(
                [run for run in analysis.runs if run.subject == subject], analysis.protocol.staircase
            ),
            folded=True,
        )
        for index, subject in enumerate(subjects, start=1)
    ]
