"""Report of an identified device: an HTML page and its figures, in the folder of the results.

The page shows estimate and model, resonances, the frequency above which the axes couple, the frequency bands with
their control methods, and a comparison of model orders (`compare_orders`).
"""

from collections.abc import Callable
from pathlib import Path

from analysis.reports.identification_report import (
    IdentificationFindings,
    identification_pictures,
    render_identification_report,
)
from equalizer.identification.frequency_response.coupling_onset import coupling_onset
from equalizer.identification.frequency_response.frequency_bands import PUBLISHED_DIRECTION_LIMIT_HZ, frequency_bands
from equalizer.identification.frequency_response.resonances import find_resonances
from equalizer.identification.state_space.order_report import OrderReport, compare_orders
from equalizer.identification.state_space.refusals import IdentificationRefused
from equalizer.identification.state_space.settings import IdentificationSettings
from study.local_clock import local_now
from study.store.disk.text_file import write_text
from study.workflows.equalizer.identified_summary import summary_lines
from study.workflows.equalizer.identify_model import IdentifiedDevice
from study.workflows.picture_files import write_pictures

FREER = 1.5
"""Ratio of the bound on the decay time in the comparison of orders to the slowest decay time that was found."""
PAGE_NAME = "report.html"
"""File name of the page in the folder of the results."""


def report_identification(device: IdentifiedDevice, folder: Path, on_progress: Callable[[float], None]) -> Path:
    """Write report.html and figures/ into `folder`; returns the path of the page. on_progress: called with the share
    done, 0 to 1. Raises CannotWriteError."""
    report_findings = findings(device, lambda share: on_progress(0.8 * share))
    pictures = identification_pictures(report_findings)
    write_pictures(folder / "figures", pictures)
    on_progress(0.95)
    page = render_identification_report(report_findings, pictures, _origin_entries(device), local_now())
    write_text(folder / PAGE_NAME, page, overwrite=True)
    on_progress(1.0)
    return folder / PAGE_NAME


def findings(device: IdentifiedDevice, on_progress: Callable[[float], None]) -> IdentificationFindings:
    """Content of the page. on_progress: called with the share done, 0 to 1; the comparison of orders takes the time."""
    onset = coupling_onset(device.estimate)
    lowest, highest = max(1.0, float(device.estimate.frequency_hz[0])), float(device.estimate.frequency_hz[-1])
    return IdentificationFindings(
        estimate=device.estimate,
        model=device.model,
        resonances=find_resonances(device.estimate),
        onset=onset,
        bands=frequency_bands(onset.frequency_hz, lowest_hz=lowest, highest_hz=highest),
        direction_limit_hz=PUBLISHED_DIRECTION_LIMIT_HZ,
        order=_order(device, on_progress),
        results=summary_lines(device),
        remarks=device.remarks,
    )


def _order(device: IdentifiedDevice, on_progress: Callable[[float], None]) -> OrderReport | None:
    """Comparison of the order asked for with lower ones; None where the estimate has too few lines for it."""
    requested_order = device.plan.order
    orders = sorted({order for order in (10, 14, 16, 20, 26) if order <= requested_order} | {requested_order})
    # With a tighter bound on the decay time than the device needs, no order could fit its slowly decaying resonances.
    needed_s = FREER * device.identified.relaxed[0].decay_s if device.identified.relaxed else None
    settings = IdentificationSettings(device.plan.band_hz, requested_order, device.plan.longest_decay_s or needed_s)
    try:
        return compare_orders(device.fitted, settings, orders, on_progress)
    except IdentificationRefused:  # half of the lines, used for each fit, are too few for the order
        return None


def _origin_entries(device: IdentifiedDevice) -> dict[str, str]:
    """Origin of the model: recordings with the first digits of their SHA-256, device, and kind of input."""
    parents = device.model.provenance.get("parents", [])
    return {
        "recordings": ", ".join(f"{parent['file']} ({parent['sha256'][:12]})" for parent in parents),
        "device": str(device.model.provenance.get("device", "")),
        "input": str(device.model.provenance.get("input", "")),
    }
