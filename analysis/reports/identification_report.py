"""HTML report of an identified device: measured transfer functions, resonances, fitted state-space model and its order.

The response maps commanded forces (N) to accelerations of the handle (m/s²). The report has the published figures 1
(frequency bands) and 4 (transfer functions), and the held-out error of each candidate model order.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from analysis.figures.frequency_bands import frequency_bands_picture
from analysis.figures.model_order import model_order_picture
from analysis.figures.picture import Picture
from analysis.figures.transfer_functions import ResponseCurve, make_transfer_functions_picture
from analysis.reports.page import Page, Section, Table, render_page
from equalizer.identification.frequency_response.coupling_onset import CouplingOnset
from equalizer.identification.frequency_response.frequency_bands import FrequencyBand
from equalizer.identification.frequency_response.frequency_response import FrequencyResponse
from equalizer.identification.frequency_response.resonances import Resonance
from equalizer.identification.state_space.order_report import OrderReport
from equalizer.plant.identified_model import IdentifiedModel
from equalizer.plant.model_response import model_response

CURVE_LINES = 400
"""Number of frequencies at which the model's response is drawn."""


@dataclass(frozen=True, slots=True, eq=False)
class IdentificationFindings:
    """The content of an identification report: the measured response, the model, and results derived from them."""

    estimate: FrequencyResponse
    """Measured response."""
    model: IdentifiedModel
    resonances: tuple[Resonance, ...]
    onset: CouplingOnset
    """Frequency from which the axes are coupled."""
    bands: tuple[FrequencyBand, ...]
    direction_limit_hz: float
    """Highest frequency at which directions are perceived, drawn with the bands."""
    order: OrderReport | None
    """Comparison of model orders; None where there are too few lines to hold some out."""
    results: tuple[str, ...]
    """Sentences on the model."""
    remarks: tuple[str, ...]
    """Further sentences, shown as a list."""


def identification_pictures(findings: IdentificationFindings) -> tuple[Picture, ...]:
    """Pictures of the transfer functions (published figure 4), the bands (figure 1) and the choice of order; those
    without data are left out."""
    low, high = findings.model.band_hz
    curve_hz = np.geomspace(low, high, CURVE_LINES)
    curve = ResponseCurve("model", curve_hz, model_response(findings.model, curve_hz))
    pictures = [make_transfer_functions_picture(findings.estimate, curve, findings.model.band_hz)]
    if findings.bands:
        pictures.append(
            frequency_bands_picture(findings.estimate, findings.onset, findings.bands, findings.direction_limit_hz)
        )
    if findings.order is not None:
        pictures.append(model_order_picture(findings.order, findings.model.order))
    return tuple(pictures)


def render_identification_report(
    findings: IdentificationFindings, pictures: Sequence[Picture], provenance: Mapping[str, str], generated: str
) -> str:
    """The report as an HTML page. pictures: those of `identification_pictures`, recognised by name; missing pictures
    are left out. generated: local time of the report; provenance: versions and hashes by name."""
    by_name = {picture.name: picture for picture in pictures}
    low, high = findings.model.band_hz

    def find_picture(name: str) -> tuple[Picture, ...]:
        """The picture of this name; empty where it is missing."""
        return (by_name[name],) if name in by_name else ()

    sections = (
        Section("The model", paragraphs=findings.results, points=findings.remarks),
        Section(
            "Transfer functions",
            pictures=find_picture("transfer-functions"),
            tables=(_resonance_table(findings.resonances),),
        ),
        Section("Bands", paragraphs=(_onset_sentence(findings.onset),), pictures=find_picture("frequency-bands")),
        Section("Order", pictures=find_picture("model-order"), tables=_order_tables(findings.order)),
    )
    return render_page(
        Page(
            title="Identified device",
            summary=f"A model of order {findings.model.order} for {low:g} to {high:g} Hz, "
            f"{len(findings.model.input_channels)} forces to {len(findings.model.output_channels)} accelerations.",
            banner="",
            sections=sections,
            generated=generated,
            provenance=provenance,
        )
    )


def _resonance_table(resonances: Sequence[Resonance]) -> Table:
    """Table of resonance frequencies and damping ratios with 95 % intervals."""
    rows = tuple(
        (
            f"{resonance.frequency_hz:.2f} Hz",
            f"{resonance.frequency_interval_hz[0]:.2f} to {resonance.frequency_interval_hz[1]:.2f} Hz",
            f"{resonance.damping_ratio:.3f}",
            f"{resonance.damping_interval[0]:.3f} to {resonance.damping_interval[1]:.3f}",
            ", ".join(resonance.seen_in),
        )
        for resonance in resonances
    )
    return Table("Resonances", ("Frequency", "95 % interval", "Damping ratio", "95 % interval", "Seen in"), rows)


def _onset_sentence(onset: CouplingOnset) -> str:
    """Sentence on the frequency at which coupling begins, and the rule by which it was found."""
    if onset.frequency_hz is None:
        return f"No onset of coupling was found. Rule: {onset.rule}."
    interval_text = ""
    if onset.interval_hz is not None:
        interval_text = f" (95 % interval {onset.interval_hz[0]:.2f} to {onset.interval_hz[1]:.2f} Hz)"
    return f"Coupling begins at {onset.frequency_hz:.2f} Hz{interval_text}. Rule: {onset.rule}."


def _order_tables(order: OrderReport | None) -> tuple[Table, ...]:
    """Table of held-out error and multiplications per tick by model order; empty without a comparison."""
    if order is None:
        return ()
    rows = tuple(
        (
            str(row.order),
            f"{100 * row.held_out_error:.2f} %",
            str(row.multiply_adds_per_tick),
            str(row.dense_multiply_adds_per_tick),
        )
        for row in order.rows
    )
    noise = f"The noise alone gives {100 * order.held_out_noise:.2f} %."
    header = ("Order", "Error on held-out lines", "Multiplications per tick", "With a full matrix")
    return (Table("Error and cost by order", header, rows, notes=(noise,)),)
