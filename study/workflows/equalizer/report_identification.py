"""Write the report of an identified device: an HTML page and its figures, in the folder of the results.

The page shows estimate and model, resonances, the frequency above which the axes couple, the frequency bands with their
control methods, and a comparison of model orders (`compare_orders`).
"""

from collections.abc import Callable
from pathlib import Path

from analysis.reports.identification_report import (
    IdentificationFindings,
    make_identification_pictures,
    render_identification_report,
)
from equalizer.identification.frequency_response.coupling_onset import CouplingOnset, find_coupling_onset
from equalizer.identification.frequency_response.frequency_bands import (
    PUBLISHED_DIRECTION_LIMIT_HZ,
    FrequencyBand,
    compute_frequency_bands,
)
from equalizer.identification.frequency_response.frequency_response import FrequencyResponse
from equalizer.identification.frequency_response.resonances import find_resonances
from equalizer.identification.state_space.order_report import OrderReport, compare_orders
from equalizer.identification.state_space.refusals import IdentificationError
from equalizer.identification.state_space.settings import IdentificationSettings
from study.local_clock import format_local_now
from study.store.disk.text_file import write_text
from study.workflows.equalizer.identified_summary import format_summary
from study.workflows.equalizer.identify_model import IdentifiedDevice
from study.workflows.picture_files import write_pictures

DECAY_BOUND_RATIO = 1.5
"""Ratio of the bound on the decay time in the comparison of orders to the slowest decay time that was found; chosen."""
PAGE_NAME = "report.html"
"""File name of the page in the folder of the results."""


def report_identification(device: IdentifiedDevice, folder: Path, on_progress: Callable[[float], None]) -> Path:
    """Write report.html and figures/ into `folder`, replacing earlier files; returns the path of the page. on_progress:
    called with the share done, 0 to 1. Raises CannotWriteError."""
    # The shares 0.8 and 0.95 are chosen: the comparison of orders takes most of the time, then the figures.
    report_findings = collect_findings(device, lambda share: on_progress(0.8 * share))
    pictures = make_identification_pictures(report_findings)
    write_pictures(folder / "figures", pictures)
    on_progress(0.95)
    page_html = render_identification_report(report_findings, pictures, _format_origin(device), format_local_now())
    write_text(folder / PAGE_NAME, page_html, overwrite=True)
    on_progress(1.0)
    return folder / PAGE_NAME


def collect_findings(device: IdentifiedDevice, on_progress: Callable[[float], None]) -> IdentificationFindings:
    """Collect the content of the page. on_progress: called with the share done, 0 to 1, of the comparison of orders."""
    onset, bands = _find_onset_and_bands(device.estimate)
    return IdentificationFindings(
        estimate=device.estimate,
        model=device.model,
        resonances=find_resonances(device.estimate),
        onset=onset,
        bands=bands,
        direction_limit_hz=PUBLISHED_DIRECTION_LIMIT_HZ,
        order=_compare_lower_orders(device, on_progress),
        results=format_summary(device),
        remarks=device.remarks,
    )


def _find_onset_and_bands(estimate: FrequencyResponse) -> tuple[CouplingOnset | str, tuple[FrequencyBand, ...]]:
    """Find the onset of coupling, or the reason why it cannot be judged, and the frequency bands; no bands without an
    onset, or where the direction limit is not within the measured frequencies."""
    try:
        onset = find_coupling_onset(estimate)
    except ValueError as problem:  # outputs and inputs differ in number, too few lines, or too much noise
        return str(problem), ()
    # Bands begin at 1 Hz or above, as by default in `compute_frequency_bands`.
    lowest_hz, highest_hz = max(1.0, float(estimate.frequency_hz[0])), float(estimate.frequency_hz[-1])
    if not lowest_hz < PUBLISHED_DIRECTION_LIMIT_HZ < highest_hz:
        return onset, ()
    return onset, compute_frequency_bands(onset.frequency_hz, lowest_hz=lowest_hz, highest_hz=highest_hz)


def _compare_lower_orders(device: IdentifiedDevice, on_progress: Callable[[float], None]) -> OrderReport | None:
    """Compare the requested order with the lower ones of the default orders of `compare_orders`; None where the
    estimate has too few spectral lines for it."""
    requested_order = device.plan.order
    orders = sorted({order for order in (10, 14, 16, 20, 26) if order <= requested_order} | {requested_order})
    # The slowest pole beyond the ordinary bound on the decay time: with a tighter bound no order could fit it.
    decay_bound_s = DECAY_BOUND_RATIO * device.identified.relaxed[0].decay_s if device.identified.relaxed else None
    settings = IdentificationSettings(
        device.plan.band_hz, requested_order, device.plan.longest_decay_s or decay_bound_s
    )
    try:
        return compare_orders(device.fitted, settings, orders, on_progress)
    except IdentificationError:  # half of the lines, used for each fit, are too few for the order
        return None


def _format_origin(device: IdentifiedDevice) -> dict[str, str]:
    """Format the origin of the model by heading: recordings with the first 12 digits of their SHA-256, device, and kind
    of input."""
    parents = device.model.provenance.get("parents", [])
    return {
        "recordings": ", ".join(f"{parent['file']} ({parent['sha256'][:12]})" for parent in parents),
        "device": str(device.model.provenance.get("device", "")),
        "input": str(device.model.provenance.get("input", "")),
    }
