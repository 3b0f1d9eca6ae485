"""HTML report of an identified device: measured transfer functions, resonances, fitted state-space model and its order.

The responses map commanded forces (N) to accelerations of the handle (m/s²). The figures are laid out as the published
figures 1 (frequency bands) and 4 (transfer functions); a third shows the held-out error of each model order.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from analysis.figures.frequency_bands import make_frequency_bands_picture
from analysis.figures.model_order import make_model_order_picture
from analysis.figures.picture import Picture
from analysis.figures.transfer_functions import ResponseCurve, make_transfer_functions_picture
from analysis.reports.page import Page, Section, Table, render_page
from equalizer.identification.frequency_response.coupling_onset import CouplingOnset
from equalizer.identification.frequency_response.frequency_bands import FrequencyBand
from equalizer.identification.frequency_response.frequency_response import FrequencyResponse
from equalizer.identification.frequency_response.resonances import Resonance
from equalizer.identification.state_space.order_report import OrderReport
from equalizer.plant.identified_model import IdentifiedModel
from equalizer.plant.model_response import compute_model_response

CURVE_POINT_COUNT = 400
"""Number of frequencies, logarithmically spaced over the model's band, at which the model's response is drawn.
Chosen."""


@dataclass(frozen=True, slots=True, eq=False)
class IdentificationFindings:
    """Content of an identification report: the measured response, the fitted model, and results derived from them."""

    estimate: FrequencyResponse
    """Frequency response estimated from the recordings, m/s² per N."""
    model: IdentifiedModel
    resonances: tuple[Resonance, ...]
    """Resonances of the estimate; empty where none was found."""
    onset: CouplingOnset | str
    """Frequency from which the axes are coupled, or that none was found; the reason, as a clause, where coupling cannot
    be judged."""
    bands: tuple[FrequencyBand, ...]
    """Frequency bands of figure 1 in ascending order; without bands or onset, the figure is left out."""
    direction_limit_hz: float
    """Highest frequency (Hz) at which people perceive the direction of a vibration; drawn with the bands."""
    order: OrderReport | None
    """Held-out error by model order; None where the estimate has too few lines to hold some out."""
    results: tuple[str, ...]
    """Paragraphs on the model, shown first."""
    remarks: tuple[str, ...]
    """Remarks of the identification, shown as a list below the results."""


def make_identification_pictures(findings: IdentificationFindings) -> tuple[Picture, ...]:
    """Make the pictures of the transfer functions (published figure 4), the frequency bands (figure 1; only with bands)
    and the held-out error by model order (only with a comparison of orders)."""
    low_hz, high_hz = findings.model.band_hz
    curve_hz = np.geomspace(low_hz, high_hz, CURVE_POINT_COUNT)
    model_curve = ResponseCurve("model", curve_hz, compute_model_response(findings.model, curve_hz))
    pictures = [make_transfer_functions_picture(findings.estimate, model_curve, findings.model.band_hz)]
    if findings.bands and not isinstance(findings.onset, str):
        pictures.append(
            make_frequency_bands_picture(findings.estimate, findings.onset, findings.bands, findings.direction_limit_hz)
        )
    if findings.order is not None:
        pictures.append(make_model_order_picture(findings.order, findings.model.order))
    return tuple(pictures)


def render_identification_report(
    findings: IdentificationFindings, pictures: Sequence[Picture], provenance: Mapping[str, str], generated: str
) -> str:
    """Render the report as an HTML page. pictures: those of `make_identification_pictures`, recognised by name; a
    missing picture is left out. provenance: facts on the origin of the model, by their names. generated: local time of
    the report, as text."""
    pictures_by_name = {picture.name: picture for picture in pictures}
    low_hz, high_hz = findings.model.band_hz

    def find_picture(name: str) -> tuple[Picture, ...]:
        """Return the picture of this name; empty where it is missing."""
        return (pictures_by_name[name],) if name in pictures_by_name else ()

    sections = (
        Section("The model", paragraphs=findings.results, points=findings.remarks),
        Section(
            "Transfer functions",
            pictures=find_picture("transfer-functions"),
            tables=(_make_resonance_table(findings.resonances),),
        ),
        Section("Bands", paragraphs=(_describe_onset(findings.onset),), pictures=find_picture("frequency-bands")),
        Section("Order", pictures=find_picture("model-order"), tables=_make_order_tables(findings.order)),
    )
    return render_page(
        Page(
            title="Identified device",
            summary=f"A model of order {findings.model.order} for {low_hz:g} to {high_hz:g} Hz, "
            f"{len(findings.model.input_channels)} forces to {len(findings.model.output_channels)} accelerations.",
            banner="",
            sections=sections,
            generated=generated,
            provenance=provenance,
        )
    )


def _make_resonance_table(resonances: Sequence[Resonance]) -> Table:
    """Make the table of resonance frequencies and damping ratios with their 95 % intervals, and the curves (gain,
    coupling) in which each resonance has a peak."""
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


def _describe_onset(onset: CouplingOnset | str) -> str:
    """Describe in a sentence the frequency at which coupling begins, with its interval if known, and the rule by which
    it was found, or the reason why coupling cannot be judged."""
    if isinstance(onset, str):
        return f"The onset of coupling is not known: {onset}."
    if onset.frequency_hz is None:
        return f"No onset of coupling was found. Rule: {onset.rule}."
    interval_text = ""
    if onset.interval_hz is not None:
        interval_text = f" (95 % interval {onset.interval_hz[0]:.2f} to {onset.interval_hz[1]:.2f} Hz)"
    return f"Coupling begins at {onset.frequency_hz:.2f} Hz{interval_text}. Rule: {onset.rule}."


def _make_order_tables(order: OrderReport | None) -> tuple[Table, ...]:
    """Make the table of held-out error (%) and multiplications per tick by model order; empty without a comparison of
    orders."""
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
    noise_note = f"The noise alone gives {100 * order.held_out_noise:.2f} %."
    header = ("Order", "Error on held-out lines", "Multiplications per tick", "With a full matrix")
    return (Table("Error and cost by order", header, rows, notes=(noise_note,)),)
