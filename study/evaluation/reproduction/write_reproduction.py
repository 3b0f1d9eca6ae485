"""Write the results of a reproduction to its folder: figures, document of numbers (JSON), page (HTML)."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from analysis.evaluation.reproduction.document import FigureFindings, Reproduction
from analysis.evaluation.reproduction.ellipsoid_findings import make_ellipsoid_findings
from analysis.evaluation.reproduction.equalized_findings import make_equalized_findings
from analysis.evaluation.reproduction.played_response import make_played_row
from analysis.evaluation.reproduction.response_findings import make_band_findings, make_response_findings
from analysis.evaluation.reproduction.study_findings import find_direction_limit, make_study_findings
from analysis.figures.reproduction_pictures import make_reproduction_pictures
from analysis.reports.reproduction_report import render_reproduction_report, summarise_figures
from equalizer.identification.frequency_response.frequency_bands import (
    PUBLISHED_DIRECTION_LIMIT_HZ,
    FrequencyBand,
    compute_frequency_bands,
)
from study.evaluation.reproduction.reproduction_plan import ReproductionPlan
from study.evaluation.reproduction.reproduction_results import ReproductionResults
from study.local_clock import format_local_now
from study.store.disk.provenance import Provenance, gather_provenance
from study.store.disk.text_file import write_text
from study.store.formats.reproduction_file import REPRODUCTION_NAME, write_reproduction
from study.workflows.picture_files import write_pictures

PAGE_NAME = "report.html"
"""Name of the page in the folder of the reproduction."""


@dataclass(frozen=True, slots=True)
class WrittenReproduction:
    """Result of a reproduction, with the paths of document and page that were written."""

    reproduction: Reproduction
    lines: tuple[str, ...]
    """One line per figure, for a terminal."""
    document: Path
    """Path of the document of numbers (JSON)."""
    report: Path
    """Path of the page (HTML)."""


def write_reproduction_folder(
    plan: ReproductionPlan, results: ReproductionResults, on_progress: Callable[[float], None]
) -> WrittenReproduction:
    """Write figures, document and page, replacing those of an earlier run. on_progress: called with the fraction done,
    0 to 1, approximate between the ends. Raises CannotWriteError."""
    direction_limit_hz = find_direction_limit(results.study)
    # Where the thresholds give no limit of direction, the published one separates the bands.
    band_limit_hz = PUBLISHED_DIRECTION_LIMIT_HZ if direction_limit_hz is None else direction_limit_hz
    bands = compute_frequency_bands(results.device.onset.frequency_hz, band_limit_hz)
    reproduction = _make_document(plan, results, bands, direction_limit_hz, band_limit_hz)
    pictures = make_reproduction_pictures(
        results.study, results.ellipsoids, results.device, bands, band_limit_hz, results.equalized_playback.rows
    )
    on_progress(0.2)
    write_pictures(plan.figures, [picture for figure_pictures in pictures.values() for picture in figure_pictures])
    on_progress(0.8)
    provenance = gather_provenance(
        protocol_hash=results.protocol_hash, seeds={"reproduction": plan.seed}, parents=results.sources
    )
    document_path, report_path = plan.output_folder / REPRODUCTION_NAME, plan.output_folder / PAGE_NAME
    write_reproduction(document_path, reproduction, provenance)
    page_html = render_reproduction_report(reproduction, pictures, _format_provenance(provenance), format_local_now())
    write_text(report_path, page_html, overwrite=True)
    on_progress(1.0)
    return WrittenReproduction(reproduction, summarise_figures(reproduction), document_path, report_path)


def _make_document(
    plan: ReproductionPlan,
    results: ReproductionResults,
    bands: tuple[FrequencyBand, ...],
    direction_limit_hz: float | None,
    band_limit_hz: float,
) -> Reproduction:
    """Make the document: findings on each figure, playback rows, baselines and models. direction_limit_hz: highest
    frequency at which the thresholds show direction to be felt, None without one; band_limit_hz: the limit that
    separates the bands (Hz)."""
    playback = results.equalized_playback
    return Reproduction(
        device=results.device_name,
        subjects=plan.subjects,
        seed=plan.seed,
        band_hz=plan.band_hz,
        order=plan.order,
        figures=(
            make_band_findings(bands, direction_limit_hz, band_limit_hz),
            make_study_findings(results.study),
            make_ellipsoid_findings(results.ellipsoids),
            make_response_findings(results.device.response, results.device.resonances, results.device.onset),
            _make_equalization_findings(results),
        ),
        played=tuple(make_played_row(row) for row in (*playback.rows.all, *playback.table_rows)),
        baselines=tuple(make_played_row(row) for row in results.baselines),
        models=results.models,
    )


def _make_equalization_findings(results: ReproductionResults) -> FigureFindings:
    """Make the findings on figure 5, with the errors of the tested models with and without friction where both are
    known."""
    with_friction, frictionless = results.held_out_test, results.frictionless_test
    errors = (with_friction.error, frictionless.error) if with_friction and frictionless else None
    return make_equalized_findings(
        results.equalized_playback.rows, errors, (*results.remarks, *results.equalized_playback.remarks)
    )


def _format_provenance(provenance: Provenance) -> dict[str, str]:
    """Format the provenance as entries, by their names, of the last section of the page."""
    return {
        "recordings": ", ".join(f"{parent.file} ({parent.sha256[:12]})" for parent in provenance.parents),
        "study protocol": f"hash {provenance.protocol_hash}",
        "versions": ", ".join(f"{name} {version}" for name, version in provenance.versions.items()),
        "command": " ".join(provenance.command),
    }
