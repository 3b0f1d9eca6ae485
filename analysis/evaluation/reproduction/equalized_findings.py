"""Findings on the published figure 5: frequency response of the simulated device with and without the equalizer.

The paper reports that equalization removes the resonance near 11 Hz, reduces coupling peaks by up to a factor of ten,
and keeps the response fairly flat near the edge of the workspace. Findings compare figures of our simulation with these
statements; those on which the paper reports nothing compare nothing. `equalizer.tracking.feedforward.quality` defines
flatness and coupling.
"""

from dataclasses import dataclass

import numpy as np

from analysis.evaluation.reproduction.document import FigureFindings, Finding
from analysis.evaluation.reproduction.played_response import PlayedResponse, make_played_row
from analysis.wording import format_number
from equalizer.signals.signal import ComplexArray, FloatArray

RESONANCE_HZ = (9.0, 14.0)
"""Frequency range that contains the published resonance near 11 Hz. Chosen."""
LARGEST_REMAINING_HEIGHT = 1 / 3
"""Largest remaining share of a resonance's height in dB that counts as "essentially removed". Chosen."""
ORDER_OF_MAGNITUDE_DB = (10.0, 30.0)
"""Reductions of the coupling peaks, in dB, that count as an order of magnitude (20 dB). Chosen."""


@dataclass(frozen=True, slots=True, eq=False)
class EqualizedRows:
    """Measured responses: the rows of figure 5, and the edge without an equalizer, driven by swept sines; two rows on
    friction, driven by a multisine. Responses without an equalizer are normalised by their mean gain
    (`normalise_gain`)."""

    unequalized: PlayedResponse
    """At the centre, without the equalizer."""
    equalized: PlayedResponse
    """At the centre, with the equalizer."""
    edge_unequalized: PlayedResponse
    """Near the edge of the workspace, without the equalizer."""
    edge: PlayedResponse
    """Near the edge, equalized with the model of the centre."""
    edge_blended: PlayedResponse
    """Near the edge, with forces blended from the models of other places."""
    multisine: PlayedResponse
    """At the centre, equalized, all frequencies at once (multisine)."""
    frictionless: PlayedResponse
    """Like `multisine`, on the simulated device without friction, with a model identified on that device."""

    @property
    def figure_rows(self) -> tuple[PlayedResponse, ...]:
        """The rows that are drawn as figure 5."""
        return self.unequalized, self.equalized, self.edge, self.edge_blended

    @property
    def friction_rows(self) -> tuple[PlayedResponse, ...]:
        """The rows of the figure on friction: swept sine, multisine, and multisine on the device without friction."""
        return self.equalized, self.multisine, self.frictionless

    @property
    def all(self) -> tuple[PlayedResponse, ...]:
        """All rows, in the order of the table."""
        return (
            self.unequalized, self.equalized, self.edge_unequalized, self.edge, self.edge_blended, self.multisine,
            self.frictionless,
        )  # fmt: skip


def make_equalized_findings(
    rows: EqualizedRows, held_out_errors: tuple[float, float] | None, remarks: tuple[str, ...] = ()
) -> FigureFindings:
    """Make the findings on figure 5. held_out_errors: relative rms error of the centre's model on a multisine that was
    not fitted, and the same for the device without friction; None = not computed. remarks: added to the findings."""
    findings = (
        _find_resonance(rows),
        _find_peak_reduction(rows),
        _find_worst_coupling("Worst coupling of any line, centre", rows.unequalized, rows.equalized),
        _find_edge_flatness(rows),
        _find_edge_coupling(rows),
        _find_blended_forces(rows),
        _find_friction_cost(rows),
        _find_held_out_error(held_out_errors),
    )
    return FigureFindings(
        figure=5,
        title="What is played with and without the equalizer",
        source="Figure 5 and section IV A",
        published="Transfer functions from 5 to 35 Hz: as identified, equalized at the centre (a model of order 26), "
        "and equalized near the edge of the workspace with the centre's model. At the centre the resonance near 11 Hz "
        "is all but gone and coupling peaks fall to as little as a tenth; at the edge the response stays fairly flat, "
        "with little gain in coupling. Interpolation between models of several places is named as a possibility.",
        findings=tuple(finding for finding in findings if finding is not None),
        differs=_DIFFERENCES_FROM_PAPER,
        remarks=remarks,
    )


_DIFFERENCES_FROM_PAPER = (
    "The measured quantity is the true acceleration of the handle, which is known only in a simulation; the paper's "
    "curves are those of its accelerometer, whose mounting error would be in them.",
    "The simulated drives have Coulomb friction of about 0.2 N, which no linear model contains. Swept sines, as in "
    "the paper, drive one frequency at a time and far above it; a signal of all frequencies at once is weaker at "
    "each frequency and is affected more. Both are in the table, together with a copy of the device without friction.",
    "The accelerometer's mounting is off by about 1° and 1 %, and a model identified from it contains this error: "
    "coupling of the true motion cannot fall much below −30 dB, with or without friction.",
    "How much a place in the workspace changes the response is a matter of our geometry; the paper does not say how "
    "far off the centre its third row was taken. The fourth row is ours.",
)
"""Differences between the simulation and the published measurement, for the report."""


def _find_resonance(rows: EqualizedRows) -> Finding:
    """Judge whether the resonance near 11 Hz is essentially removed: its height in dB falls to at most
    `LARGEST_REMAINING_HEIGHT` times that without the equalizer."""
    unequalized_db, equalized_db = _measure_height_db(rows.unequalized), _measure_height_db(rows.equalized)
    low, high = RESONANCE_HZ
    return Finding(
        what=f"Rise and fall along the axes, {low:g} to {high:g} Hz",
        published="the resonance near 11 Hz is essentially removed",
        here=f"{format_number(unequalized_db, 1)} dB without, {format_number(equalized_db, 1)} dB with the equalizer",
        value=equalized_db,
        unit="dB",
        as_published=equalized_db <= LARGEST_REMAINING_HEIGHT * unequalized_db,
        rule="at most a third of what it was, in dB",
    )


def _find_peak_reduction(rows: EqualizedRows) -> Finding:
    """Judge whether the largest reduction of a coupling peak at the centre is about an order of magnitude
    (`ORDER_OF_MAGNITUDE_DB`)."""
    reduction_db = _measure_peaks_db(rows.unequalized.response) - _measure_peaks_db(rows.equalized.response)
    low, high = ORDER_OF_MAGNITUDE_DB
    return Finding(
        what="Fall of the coupling peaks, centre",
        published="up to an order of magnitude, that is 20 dB",
        here=f"{format_number(reduction_db.min(), 0)} to {format_number(reduction_db.max(), 0)} dB, by channel",
        value=float(reduction_db.max()),
        unit="dB",
        as_published=bool(low <= reduction_db.max() <= high),
        rule=f"the largest is {low:g} to {high:g} dB",
    )


def _find_worst_coupling(title: str, unequalized: PlayedResponse, equalized: PlayedResponse) -> Finding:
    """Compare the worst coupling with and without the equalizer; the paper has no such number."""
    unequalized_db, equalized_db = make_played_row(unequalized).coupling_db, make_played_row(equalized).coupling_db
    return Finding(
        what=title,
        published="",
        here=f"{format_number(unequalized_db, 1)} dB without, {format_number(equalized_db, 1)} dB with the equalizer",
        value=equalized_db,
        unit="dB",
        as_published=None,
    )


def _find_edge_flatness(rows: EqualizedRows) -> Finding:
    """Judge whether the model of the centre at least halves the deviation from flatness (dB) near the edge."""
    unequalized_db, equalized_db = (
        make_played_row(rows.edge_unequalized).flatness_db,
        make_played_row(rows.edge).flatness_db,
    )
    return Finding(
        what="Flatness at the edge, model of the centre",
        published="remains fairly flat",
        here=f"{format_number(unequalized_db, 1)} dB without, {format_number(equalized_db, 1)} dB with the equalizer "
        f"(centre: {format_number(make_played_row(rows.equalized).flatness_db, 1)} dB)",
        value=equalized_db,
        unit="dB",
        as_published=equalized_db <= unequalized_db / 2,
        rule="at most half of what it is there without",
    )


def _find_edge_coupling(rows: EqualizedRows) -> Finding:
    """Judge whether the reduction of coupling near the edge is positive, and less than half of that at the centre, in
    dB."""
    unequalized_db, equalized_db = (
        make_played_row(rows.edge_unequalized).coupling_db,
        make_played_row(rows.edge).coupling_db,
    )
    centre_reduction_db = make_played_row(rows.unequalized).coupling_db - make_played_row(rows.equalized).coupling_db
    return Finding(
        what="Coupling at the edge, model of the centre",
        published="still a minor improvement",
        here=f"{format_number(unequalized_db, 1)} dB without, {format_number(equalized_db, 1)} dB with the equalizer, "
        "worst line",
        value=unequalized_db - equalized_db,
        unit="dB",
        as_published=0 < unequalized_db - equalized_db < centre_reduction_db / 2,
        rule="better, but by less than half of the gain at the centre, in dB",
    )


def _find_blended_forces(rows: EqualizedRows) -> Finding:
    """Report flatness and coupling near the edge with blended forces, which the paper does not test."""
    blended = make_played_row(rows.edge_blended)
    return Finding(
        what="The same place, forces blended between models of other places (ours)",
        published="named as a possibility, not tried",
        here=f"flatness {format_number(blended.flatness_db, 1)} dB, "
        f"coupling {format_number(blended.coupling_db, 1)} dB",
        value=blended.coupling_db,
        unit="dB",
        as_published=None,
    )


def _find_friction_cost(rows: EqualizedRows) -> Finding:
    """Compare flatness and coupling under a multisine with and without friction, which the paper does not test."""
    with_friction, frictionless = make_played_row(rows.multisine), make_played_row(rows.frictionless)
    return Finding(
        what="What friction costs, all frequencies at once (ours)",
        published="",
        here=f"flatness {format_number(with_friction.flatness_db)} dB and coupling "
        f"{format_number(with_friction.coupling_db, 1)} dB with friction; "
        f"{format_number(frictionless.flatness_db)} dB and "
        f"{format_number(frictionless.coupling_db, 1)} dB without friction",
        value=with_friction.error,
        unit="1",
        as_published=None,
    )


def _find_held_out_error(held_out_errors: tuple[float, float] | None) -> Finding | None:
    """Report the held-out errors of both models (`make_equalized_findings`); None without them."""
    if held_out_errors is None:
        return None
    error, frictionless_error = held_out_errors
    return Finding(
        what="Model of the centre on a held-out multisine",
        published="",
        here=f"error {100 * error:.1f} %; on the device without friction, by the same steps, "
        f"{100 * frictionless_error:.1f} %",
        value=error,
        unit="1",
        as_published=None,
    )


def _measure_height_db(playback: PlayedResponse) -> float:
    """Measure the height of the resonance in dB: maximum minus minimum of the gain within `RESONANCE_HZ` (ends
    included) along an axis; of the axes, the largest. Raises ValueError where no line lies within the range."""
    low, high = RESONANCE_HZ
    in_range = (playback.frequency_hz >= low) & (playback.frequency_hz <= high)
    level_db = 20 * np.log10(np.abs(np.einsum("lii->li", playback.response[in_range])))
    return float(np.ptp(level_db, axis=0).max())


def _measure_peaks_db(response: ComplexArray) -> FloatArray:
    """Measure (axes (axes - 1),): largest gain of each off-axis channel over frequency, in dB. response: (lines, axes,
    axes)."""
    is_off_axis = ~np.eye(response.shape[1], dtype=bool)
    peaks_db: FloatArray = 20 * np.log10(np.abs(response).max(axis=0)[is_off_axis])
    return peaks_db
