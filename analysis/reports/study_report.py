"""Report of a psychophysical study as one self-contained HTML page.

`render_study_report` decides which sections the page has and in which order. The tables come from `study_tables`,
`primary_tables` and `supplementary_tables`, the statistics from `analysis.psychophysics.study_analysis`.
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
from analysis.reports.page import Page, Section, drop_empty, render_page
from analysis.reports.primary_tables import make_primary_section
from analysis.reports.study_tables import (
    make_group_table,
    make_one_way_table,
    make_pair_table,
    make_run_table,
    make_threshold_table,
    make_within_table,
)
from analysis.reports.supplementary_tables import (
    make_catch_table,
    make_delivery_tables,
    make_detection_run_table,
    make_detection_table,
    make_ellipsoid_table,
    make_practice_table,
)

_BANNER_BY_POPULATION = {
    Population.PEOPLE: "",
    Population.SIMULATED: "Simulated participants: no person took part. These numbers test the method and the "
    "program; they are no evidence about human perception.",
    Population.NOT_FELT: "Nothing was felt: people answered while a simulated device moved nothing. These numbers are "
    "a rehearsal and must not be used as measurements of people.",
}
"""Banner by kind of respondents; empty where people felt the stimuli."""


def render_study_report(
    analysis: StudyAnalysis,
    pictures: Sequence[Picture],
    provenance: Mapping[str, str],
    generated: str,
    ellipsoids: Sequence[EllipsoidResult] = (),
    qualities: Sequence[tuple[str, str]] = (),
) -> str:
    """Render the report as an HTML page.

    pictures: those of `analysis.figures.study_pictures` for the same analysis and ellipsoids, recognised by name.
    provenance: versions, hashes and inputs by name. generated: local time of the report with its UTC offset.
    ellipsoids: acceleration ellipsoids from recordings of the device. qualities: pairs (sessions, sentence) on the
    device models that converted accelerations to forces; empty without models.
    """
    pictures_by_name = {picture.name: picture for picture in pictures}
    sections = [
        *_make_declared_sections(analysis),
        *drop_empty(
            Section(
                "How good the model of the device is",
                points=tuple(f"{sessions}: {sentence}" for sessions, sentence in qualities),
            )
        ),
        _make_warning_section(analysis),
        *_make_result_sections(analysis, pictures_by_name),
        *_make_supplementary_sections(analysis),
        *_make_delivery_sections(analysis, pictures_by_name),
        *make_cue_sections(analysis.cues, analysis.cue_gaps, analysis.protocol.staircase),
        *_make_ellipsoid_sections(ellipsoids, pictures_by_name),
        *_make_run_sections(analysis, pictures),
        Section("Methods", paragraphs=compose_methods_text(analysis.protocol)),
    ]
    return render_page(
        Page(
            title=analysis.protocol.title,
            summary=_summarise_runs(analysis),
            banner=_BANNER_BY_POPULATION[analysis.population] if analysis.population else "",
            sections=tuple(sections),
            generated=generated,
            provenance=provenance,
        )
    )


def _summarise_runs(analysis: StudyAnalysis) -> str:
    """Summarise the study in a sentence below the title: numbers of participants, test runs, complete runs and counted
    trials; without test runs, the number of detection runs."""
    if not analysis.thresholds:
        return _summarise_detection_runs(analysis)
    complete_count = sum(row.complete for row in analysis.thresholds)
    participant_count, run_count = len(analysis.table.subjects), len(analysis.thresholds)
    simulated_prefix = "simulated " if analysis.population is Population.SIMULATED else ""
    return (
        f"{participant_count} {simulated_prefix}participant{'s' if participant_count != 1 else ''}, "
        f"{run_count} run{'s' if run_count != 1 else ''}, "
        f"{complete_count} of them complete, {sum(row.trials for row in analysis.thresholds)} counted trials."
    )


def _summarise_detection_runs(analysis: StudyAnalysis) -> str:
    """Summarise a study without test runs: the number of its detection runs, or that there is no run."""
    if not analysis.detection:
        return "There is no run to analyse."
    run_count = len(analysis.detection)
    return f"No test run; {run_count} detection run{'s' if run_count != 1 else ''}."


def _make_declared_sections(analysis: StudyAnalysis) -> list[Section]:
    """Make the section on the declared (preregistered) contrast; empty where the protocol has no test frequencies."""
    if not analysis.protocol.stimulus.frequencies_hz:
        return []
    return [make_declared_section(analysis.declaration, analysis.declared_result)]


def _make_warning_section(analysis: StudyAnalysis) -> Section:
    """Make the section of warnings; without any, it states that no irregularity was found."""
    no_warning_note = ("No irregularities: all runs are complete, and no threshold touched the cap.",)
    return Section(
        "Before you read the numbers", paragraphs=() if analysis.warnings else no_warning_note, points=analysis.warnings
    )


def _make_result_sections(analysis: StudyAnalysis, pictures_by_name: Mapping[str, Picture]) -> list[Section]:
    """Make the sections on thresholds, the primary analysis (model of all answers) and the comparison as published, in
    this order; empty without a test run. The table of pairs is left out where no pair can be compared."""
    if not analysis.thresholds:
        return []
    pair_tables = (make_pair_table(analysis),) if analysis.comparisons.pairs else ()
    threshold_section = Section(
        "Thresholds",
        pictures=tuple(pictures_by_name[name] for name in ("thresholds", "units") if name in pictures_by_name),
        tables=(make_threshold_table(analysis), make_group_table(analysis)),
    )
    comparison_section = Section(
        "Comparison of the frequencies, as published",
        paragraphs=(analysis.design_difference,),
        tables=(make_one_way_table(analysis), *pair_tables, make_within_table(analysis)),
    )
    model_section = replace(
        make_primary_section(analysis),
        pictures=tuple(
            picture for name, picture in pictures_by_name.items() if name.startswith(("medians", "psychometric"))
        ),
    )
    return [threshold_section, model_section, comparison_section]


def _make_supplementary_sections(analysis: StudyAnalysis) -> list[Section]:
    """Make the sections on detection, catch trials and practice runs, each only where the study has them."""
    sections = []
    if analysis.detection:
        detection_note = (
            "Which of two intervals held a vibration, in any direction: the level from which it is felt at all."
        )
        tables = (make_detection_table(analysis), make_detection_run_table(analysis))
        sections.append(Section("Is the vibration felt at all?", paragraphs=(detection_note,), tables=tables))
    if analysis.catches:
        catch_note = (
            "Trials at full level, mixed into the test runs. They changed no level of a run and enter no threshold."
        )
        sections.append(Section("Catch trials", paragraphs=(catch_note,), tables=(make_catch_table(analysis),)))
    if analysis.practice:
        practice_note = (
            "Short runs without a staircase, before the test runs. They enter no result and excluded no participant."
        )
        sections.append(Section("Practice", paragraphs=(practice_note,), tables=(make_practice_table(analysis),)))
    return sections


def _make_delivery_sections(analysis: StudyAnalysis, pictures_by_name: Mapping[str, Picture]) -> list[Section]:
    """Make the section on the accelerations that the device delivered; empty where the figure `delivered` does not
    exist."""
    if "delivered" not in pictures_by_name:
        return []
    tables = make_delivery_tables(analysis)
    return [Section("What the device delivered", pictures=(pictures_by_name["delivered"],), tables=tables)]


def _make_ellipsoid_sections(
    results: Sequence[EllipsoidResult], pictures_by_name: Mapping[str, Picture]
) -> list[Section]:
    """Make the section on the acceleration ellipses; empty without results. It has no picture where the figure
    `ellipsoids` does not exist."""
    if not results:
        return []
    pictures = (pictures_by_name["ellipsoids"],) if "ellipsoids" in pictures_by_name else ()
    return [Section("Acceleration ellipses", pictures=pictures, tables=(make_ellipsoid_table(results),))]


def _make_run_sections(analysis: StudyAnalysis, pictures: Sequence[Picture]) -> list[Section]:
    """Make the section with the staircase figures and the table of all test runs; empty without test runs."""
    if not analysis.runs:
        return []
    staircase_pictures = tuple(picture for picture in pictures if picture.name.startswith("staircases-"))
    return [Section("Runs", pictures=staircase_pictures, tables=(make_run_table(analysis),))]
