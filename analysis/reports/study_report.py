"""Report of a psychophysical study as one self-contained HTML page.

This module decides which sections the page has and in which order: declared contrast, quality of the device model,
warnings, thresholds and their comparison, detection, catch and practice trials, delivered stimuli, cues, acceleration
ellipses, single runs, methods. The tables come from `study_tables` and its neighbours, the statistics from
`analysis.psychophysics.study_analysis`; no statistic is computed here.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace

from analysis.figures.picture import Picture
from analysis.psychophysics.ellipsoid import EllipsoidResult
from analysis.psychophysics.population import Population
from analysis.psychophysics.study_analysis import StudyAnalysis
from analysis.reports.cue_section import make_cue_sections
from analysis.reports.declared_section import make_declared_section
from analysis.reports.methods_text import compose_methods_text
from analysis.reports.page import Page, Section, render_page
from analysis.reports.primary_tables import primary_section
from analysis.reports.side_tables import (
    catch_table,
    delivery_tables,
    detection_run_table,
    detection_table,
    practice_table,
)
from analysis.reports.study_tables import (
    ellipsoid_table,
    group_table,
    one_way_table,
    pair_table,
    run_table,
    threshold_table_text,
    within_table,
)

_BANNERS = {
    Population.PEOPLE: "",
    Population.SIMULATED: "Simulated participants: no person took part. These numbers test the method and the "
    "program; they are no evidence about human perception.",
    Population.NOT_FELT: "Nothing was felt: people answered while a simulated device moved nothing. These numbers are "
    "a rehearsal and must not be used as measurements of people.",
}
"""Banner on top of the page, by who answered; empty where people felt the stimuli."""


def render_study_report(
    analysis: StudyAnalysis,
    pictures: Sequence[Picture],
    provenance: Mapping[str, str],
    generated: str,
    ellipsoids: Sequence[EllipsoidResult] = (),
    qualities: Sequence[tuple[str, str]] = (),
) -> str:
    """The page as HTML text.

    pictures: those of `analysis.figures.study_pictures` for the same analysis and ellipsoids. provenance: versions,
    hashes and inputs by name. generated: local time of the report with its UTC offset. qualities: pairs (sessions,
    sentence) on the device models that converted accelerations to forces.
    """
    by_name = {picture.name: picture for picture in pictures}
    sections = [
        *_declared_sections(analysis),
        *_model_sections(qualities),
        _warning_section(analysis),
        *_result_sections(analysis, by_name),
        *_side_sections(analysis),
        *_delivery_sections(analysis, by_name),
        *make_cue_sections(analysis.cues, analysis.cue_gaps, analysis.protocol.staircase),
        *_ellipsoid_sections(ellipsoids, by_name),
        *_run_sections(analysis, pictures),
        Section("Methods", paragraphs=compose_methods_text(analysis.protocol)),
    ]
    return render_page(
        Page(
            title=analysis.protocol.title,
            summary=_summary_line(analysis),
            banner=_BANNERS[analysis.population] if analysis.population else "",
            sections=tuple(sections),
            generated=generated,
            provenance=provenance,
        )
    )


def _summary_line(analysis: StudyAnalysis) -> str:
    """Line under the title: numbers of participants, runs, complete runs and counted trials."""
    if not analysis.thresholds:
        return _detection_summary(analysis)
    complete = sum(row.complete for row in analysis.thresholds)
    people, runs = len(analysis.table.subjects), len(analysis.thresholds)
    simulated = "simulated " if analysis.population is Population.SIMULATED else ""
    return (
        f"{people} {simulated}participant{'s' if people != 1 else ''}, {runs} run{'s' if runs != 1 else ''}, "
        f"{complete} of them complete, {sum(row.trials for row in analysis.thresholds)} counted trials."
    )


def _detection_summary(analysis: StudyAnalysis) -> str:
    if not analysis.detection:
        return "There is no run to analyse."
    runs = len(analysis.detection)
    return f"No test run; {runs} detection run{'s' if runs != 1 else ''}."


def _declared_sections(analysis: StudyAnalysis) -> list[Section]:
    """Section on the declared (preregistered) contrast, the first of the report; empty without frequencies."""
    if not analysis.protocol.stimulus.frequencies_hz:
        return []
    return [make_declared_section(analysis.declared, analysis.declared_result)]


def _model_sections(qualities: Sequence[tuple[str, str]]) -> list[Section]:
    """Section on the quality of the models that converted accelerations to forces, placed before all values that depend
    on them; empty without models."""
    if not qualities:
        return []
    points = tuple(f"{sessions}: {sentence}" for sessions, sentence in qualities)
    return [Section("How good the model of the device is", points=points)]


def _warning_section(analysis: StudyAnalysis) -> Section:
    no_warning_note = ("No irregularities: all runs are complete, and no threshold touched the cap.",)
    return Section(
        "Before you read the numbers", paragraphs=() if analysis.warnings else no_warning_note, points=analysis.warnings
    )


def _result_sections(analysis: StudyAnalysis, by_name: Mapping[str, Picture]) -> list[Section]:
    """Thresholds, the primary analysis, and the published comparison, in this order; empty without a test run."""
    if not analysis.thresholds:
        return []
    pairs = (pair_table(analysis),) if analysis.comparisons.pairs else ()
    thresholds = Section(
        "Thresholds",
        pictures=tuple(by_name[name] for name in ("thresholds", "units") if name in by_name),
        tables=(threshold_table_text(analysis), group_table(analysis)),
    )
    comparison = Section(
        "Comparison of the frequencies, as published",
        paragraphs=(analysis.difference,),
        tables=(one_way_table(analysis), *pairs, within_table(analysis)),
    )
    model = replace(
        primary_section(analysis),
        pictures=tuple(picture for name, picture in by_name.items() if name.startswith(("medians", "psychometric"))),
    )
    return [thresholds, model, comparison]


def _side_sections(analysis: StudyAnalysis) -> list[Section]:
    """Detection runs, catch trials and practice runs, each only where the study has them."""
    sections = []
    if analysis.detection:
        detection_note = (
            "Which of two intervals held a vibration, in any direction: the level from which it is felt at all."
        )
        tables = (detection_table(analysis), detection_run_table(analysis))
        sections.append(Section("Is the vibration felt at all?", paragraphs=(detection_note,), tables=tables))
    if analysis.catches:
        catch_note = (
            "Trials at full level, mixed into the test runs. They changed no level of a run and enter no threshold."
        )
        sections.append(Section("Catch trials", paragraphs=(catch_note,), tables=(catch_table(analysis),)))
    if analysis.practice:
        practice_note = (
            "Short runs at a fixed level, before the test runs. They enter no result and excluded no participant."
        )
        sections.append(Section("Practice", paragraphs=(practice_note,), tables=(practice_table(analysis),)))
    return sections


def _delivery_sections(analysis: StudyAnalysis, by_name: Mapping[str, Picture]) -> list[Section]:
    """Section on the accelerations that the device delivered; empty where the figure `delivered` does not exist."""
    if "delivered" not in by_name:
        return []
    tables = delivery_tables(analysis)
    return [Section("What the device delivered", pictures=(by_name["delivered"],), tables=tables)]


def _ellipsoid_sections(results: Sequence[EllipsoidResult], by_name: Mapping[str, Picture]) -> list[Section]:
    if not results:
        return []
    pictures = (by_name["ellipsoids"],) if "ellipsoids" in by_name else ()
    return [Section("Acceleration ellipses", pictures=pictures, tables=(ellipsoid_table(results),))]


def _run_sections(analysis: StudyAnalysis, pictures: Sequence[Picture]) -> list[Section]:
    if not analysis.runs:
        return []
    tracks = tuple(picture for picture in pictures if picture.name.startswith("staircases-"))
    return [Section("Runs", pictures=tracks, tables=(run_table(analysis),))]
