"""Report of an identified device: the measurement, the fitted model, and its quality."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from analysis.figures.frequency_bands import frequency_bands_picture
from analysis.figures.model_order import model_order_picture
from analysis.figures.picture import Picture
from analysis.figures.transfer_functions import ResponseCurve, transfer_functions_picture
from analysis.reports.page import Page, Section, Table, render_page
from equalizer.identification.frequency_response.coupling_onset import CouplingOnset
from equalizer.identification.frequency_response.frequency_bands import FrequencyBand
from equalizer.identification.frequency_response.frequency_response import FrequencyResponse
from equalizer.identification.frequency_response.resonances import Resonance
from equalizer.identification.state_space.order_report import OrderReport
from equalizer.plant.identified_model import IdentifiedModel
from equalizer.plant.model_response import model_response

CURVE_LINES = 400
"""Points of a drawn curve."""


@dataclass(frozen=True, slots=True, eq=False)
class IdentificationFindings:
    """The content of an identification report: the measured response, the model, and what follows from them."""

    estimate: FrequencyResponse
    model: IdentifiedModel
    resonances: tuple[Resonance, ...]
    onset: CouplingOnset
    bands: tuple[FrequencyBand, ...]
    direction_limit_hz: float
    order: OrderReport | None
    """None where the data are too few to hold lines out."""
    results: tuple[str, ...]
    remarks: tuple[str, ...]


def identification_pictures(found: IdentificationFindings) -> tuple[Picture, ...]:
    """Transfer functions (the published figure 4), bands (figure 1) and the choice of order."""
    low, high = found.model.band_hz
    curve_hz = np.geomspace(low, high, CURVE_LINES)
    curve = ResponseCurve("model", curve_hz, model_response(found.model, curve_hz))
    pictures = [transfer_functions_picture(found.estimate, curve, found.model.band_hz)]
    if found.bands:
        pictures.append(frequency_bands_picture(found.estimate, found.onset, found.bands, found.direction_limit_hz))
    if found.order is not None:
        pictures.append(model_order_picture(found.order, found.model.order))
    return tuple(pictures)


def render_identification_report(
    found: IdentificationFindings, pictures: Sequence[Picture], provenance: Mapping[str, str], generated: str
) -> str:
    """The report as a page of HTML. pictures: by name; those that are missing are left out."""
    by_name = {picture.name: picture for picture in pictures}
    low, high = found.model.band_hz

    def shown(name: str) -> tuple[Picture, ...]:
        return (by_name[name],) if name in by_name else ()

    sections = (
        Section("The model", paragraphs=found.results, points=found.remarks),
        Section(
            "Transfer functions", pictures=shown("transfer-functions"), tables=(_resonance_table(found.resonances),)
        ),
        Section("Bands", paragraphs=(_onset_sentence(found.onset),), pictures=shown("frequency-bands")),
        Section("Order", pictures=shown("model-order"), tables=_order_tables(found.order)),
    )
    return render_page(
        Page(
            title="Identified device",
            summary=f"A model of order {found.model.order} for {low:g} to {high:g} Hz, "
            f"{len(found.model.input_channels)} forces to {len(found.model.output_channels)} accelerations.",
            banner="",
            sections=sections,
            generated=generated,
            provenance=provenance,
        )
    )


def _resonance_table(resonances: Sequence[Resonance]) -> Table:
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
    if onset.frequency_hz is None:
        return f"No onset of coupling was found. Rule: {onset.rule}."
    between = ""
    if onset.interval_hz is not None:
        between = f" (95 % interval {onset.interval_hz[0]:.2f} to {onset.interval_hz[1]:.2f} Hz)"
    return f"Coupling begins at {onset.frequency_hz:.2f} Hz{between}. Rule: {onset.rule}."


def _order_tables(order: OrderReport | None) -> tuple[Table, ...]:
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
    return (Table("What an order buys and costs", header, rows, notes=(noise,)),)
