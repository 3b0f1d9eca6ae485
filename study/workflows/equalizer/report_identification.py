"""Page about an identified device, with its figures beside it."""

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
"""Factor between the bound on the decay time and the slowest decay found."""
PAGE_NAME = "report.html"
"""Page about the model, in the folder of results."""


def report_identification(device: IdentifiedDevice, folder: Path, on_progress: Callable[[float], None]) -> Path:
    """Write report.html and figures/ into `folder`; returns the page. Raises CannotWriteError."""
    found = findings(device, lambda share: on_progress(0.8 * share))
    pictures = identification_pictures(found)
    write_pictures(folder / "figures", pictures)
    on_progress(0.95)
    page = render_identification_report(found, pictures, _origin_entries(device), local_now())
    write_text(folder / PAGE_NAME, page, overwrite=True)
    on_progress(1.0)
    return folder / PAGE_NAME


def findings(device: IdentifiedDevice, on_progress: Callable[[float], None]) -> IdentificationFindings:
    """Content of the page."""
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
    asked = device.plan.order
    orders = sorted({order for order in (10, 14, 16, 20, 26) if order <= asked} | {asked})
    # Orders are compared under the bound that the device needs, or all of them would miss what rings.
    needed_s = FREER * device.identified.relaxed[0].decay_s if device.identified.relaxed else None
    settings = IdentificationSettings(device.plan.band_hz, asked, device.plan.longest_decay_s or needed_s)
    try:
        return compare_orders(device.fitted, settings, orders, on_progress)
    except IdentificationRefused:  # half of the lines are too few for the order: then there is nothing to compare
        return None


def _origin_entries(device: IdentifiedDevice) -> dict[str, str]:
    parents = device.model.provenance.get("parents", [])
    return {
        "recordings": ", ".join(f"{parent['file']} ({parent['sha256'][:12]})" for parent in parents),
        "device": str(device.model.provenance.get("device", "")),
        "input": str(device.model.provenance.get("input", "")),
    }
