"""Findings on the published figure 5: the response of the simulated device with and without the equalizer.

The paper reports that equalization removes the resonance near 11 Hz, reduces coupling peaks by up to a factor of ten,
and keeps the response fairly flat near the edge of the workspace. Flatness and coupling: `played_response`.
"""

from dataclasses import dataclass

import numpy as np

from analysis.evaluation.reproduction.document import FigureFindings, Finding
from analysis.evaluation.reproduction.played_response import PlayedResponse, describe_played
from analysis.wording import number
from equalizer.signals.signal import ComplexArray, FloatArray

RESONANCE_HZ = (9.0, 14.0)
"""Range around the published resonance near 11 Hz."""
REMOVED = 1 / 3
"""Largest remaining share of a resonance's height in dB that counts as "essentially removed"."""
ORDER_DB = (10.0, 30.0)
"""Reductions of the coupling peaks, in dB, that count as an order of magnitude (20 dB)."""


@dataclass(frozen=True, slots=True, eq=False)
class EqualizedRows:
    """The rows of figure 5, all played with swept sines, and two rows on friction, played with a multisine. The
    responses without an equalizer are normalised by their mean gain (`normalise_gain`)."""

    plain: PlayedResponse
    """At the centre, without the equalizer."""
    equalized: PlayedResponse
    """At the centre, with the equalizer."""
    edge_plain: PlayedResponse
    """Near the edge of the workspace, without the equalizer."""
    edge: PlayedResponse
    """Near the edge, equalized with the model of the centre."""
    edge_blended: PlayedResponse
    """Near the edge, with forces blended from the models of other places."""
    broad: PlayedResponse
    """At the centre, equalized, all frequencies at once (multisine)."""
    frictionless: PlayedResponse
    """As `broad`, on the device without friction, with a model identified on that device."""

    @property
    def drawn(self) -> tuple[PlayedResponse, ...]:
        """The rows that are drawn as figure 5."""
        return self.plain, self.equalized, self.edge, self.edge_blended

    @property
    def of_friction(self) -> tuple[PlayedResponse, ...]:
        """The rows of the figure on friction: swept sine, multisine, and multisine on the device without friction."""
        return self.equalized, self.broad, self.frictionless

    @property
    def all(self) -> tuple[PlayedResponse, ...]:
        """All rows, in the order of the table."""
        return (
            self.plain, self.equalized, self.edge_plain, self.edge, self.edge_blended, self.broad, self.frictionless,
        )  # fmt: skip


def find_equalized(
    rows: EqualizedRows, held_out: tuple[float, float] | None, remarks: tuple[str, ...] = ()
) -> FigureFindings:
    """Findings on figure 5. held_out: relative error of the centre's model on a multisine that was not fitted, and the
    same for the device without friction; None = not computed. remarks: of the analyses."""
    findings = (
        _resonance(rows),
        _peaks(rows),
        _worst_coupling("Worst coupling of any line, centre", rows.plain, rows.equalized),
        _edge_flat(rows),
        _edge_coupling(rows),
        _find_blended_forces(rows),
        _friction(rows),
        _held_out_finding(held_out),
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
        differs=_DIFFERS,
        remarks=remarks,
    )


_DIFFERS = (
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


def _resonance(rows: EqualizedRows) -> Finding:
    """Whether the resonance near 11 Hz is essentially removed: its height falls to at most `REMOVED` in dB."""
    before, after = _height_db(rows.plain), _height_db(rows.equalized)
    low, high = RESONANCE_HZ
    return Finding(
        what=f"Rise and fall along the axes, {low:g} to {high:g} Hz",
        published="the resonance near 11 Hz is essentially removed",
        here=f"{number(before, 1)} dB without, {number(after, 1)} dB with the equalizer",
        value=after,
        unit="dB",
        as_published=after <= REMOVED * before,
        rule="at most a third of what it was, in dB",
    )


def _peaks(rows: EqualizedRows) -> Finding:
    """Whether the largest reduction of a coupling peak at the centre is about an order of magnitude (`ORDER_DB`)."""
    fall = _peaks_db(rows.plain.response) - _peaks_db(rows.equalized.response)
    low, high = ORDER_DB
    return Finding(
        what="Fall of the coupling peaks, centre",
        published="up to an order of magnitude, that is 20 dB",
        here=f"{number(fall.min(), 0)} to {number(fall.max(), 0)} dB, by channel",
        value=float(fall.max()),
        unit="dB",
        as_published=bool(low <= fall.max() <= high),
        rule=f"the largest is {low:g} to {high:g} dB",
    )


def _worst_coupling(what: str, before: PlayedResponse, after: PlayedResponse) -> Finding:
    first, second = describe_played(before).coupling_db, describe_played(after).coupling_db
    return Finding(
        what=what,
        published="",
        here=f"{number(first, 1)} dB without, {number(second, 1)} dB with the equalizer",
        value=second,
        unit="dB",
        as_published=None,
    )


def _edge_flat(rows: EqualizedRows) -> Finding:
    """Whether the model of the centre at least halves the deviation from flatness (dB) near the edge."""
    before, after = describe_played(rows.edge_plain).flatness_db, describe_played(rows.edge).flatness_db
    return Finding(
        what="Flatness at the edge, model of the centre",
        published="remains fairly flat",
        here=f"{number(before, 1)} dB without, {number(after, 1)} dB with the equalizer (centre: "
        f"{number(describe_played(rows.equalized).flatness_db, 1)} dB)",
        value=after,
        unit="dB",
        as_published=after <= before / 2,
        rule="at most half of what it is there without",
    )


def _edge_coupling(rows: EqualizedRows) -> Finding:
    """Whether the reduction of coupling near the edge is positive, and less than half of that at the centre, in dB."""
    before, after = describe_played(rows.edge_plain).coupling_db, describe_played(rows.edge).coupling_db
    centre = describe_played(rows.plain).coupling_db - describe_played(rows.equalized).coupling_db
    return Finding(
        what="Coupling at the edge, model of the centre",
        published="still a minor improvement",
        here=f"{number(before, 1)} dB without, {number(after, 1)} dB with the equalizer, worst line",
        value=before - after,
        unit="dB",
        as_published=0 < before - after < centre / 2,
        rule="better, but by less than half of the gain at the centre, in dB",
    )


def _find_blended_forces(rows: EqualizedRows) -> Finding:
    found = describe_played(rows.edge_blended)
    return Finding(
        what="The same place, forces blended between models of other places (ours)",
        published="named as a possibility, not tried",
        here=f"flatness {number(found.flatness_db, 1)} dB, coupling {number(found.coupling_db, 1)} dB",
        value=found.coupling_db,
        unit="dB",
        as_published=None,
    )


def _friction(rows: EqualizedRows) -> Finding:
    with_it, without = describe_played(rows.broad), describe_played(rows.frictionless)
    return Finding(
        what="What friction costs, all frequencies at once (ours)",
        published="",
        here=f"flatness {number(with_it.flatness_db)} dB and coupling {number(with_it.coupling_db, 1)} dB with "
        f"friction; {number(without.flatness_db)} dB and {number(without.coupling_db, 1)} dB on the twin without",
        value=with_it.error,
        unit="1",
        as_published=None,
    )


def _held_out_finding(held_out: tuple[float, float] | None) -> Finding | None:
    if held_out is None:
        return None
    error, without = held_out
    return Finding(
        what="Model of the centre on a multisine kept from it",
        published="",
        here=f"error {100 * error:.1f} %; on the twin without friction, by the same steps, {100 * without:.1f} %",
        value=error,
        unit="1",
        as_published=None,
    )


def _height_db(played: PlayedResponse) -> float:
    """Height of the resonance in dB: range of the level within `RESONANCE_HZ` along an axis, of the worst axis."""
    low, high = RESONANCE_HZ
    near = (played.frequency_hz >= low) & (played.frequency_hz <= high)
    level = 20 * np.log10(np.abs(np.einsum("lii->li", played.response[near])))
    return float(np.ptp(level, axis=0).max())


def _peaks_db(response: ComplexArray) -> FloatArray:
    """(axes (axes - 1),): largest magnitude of each off-axis channel over frequency, in dB. response: (lines, axes,
    axes)."""
    off = ~np.eye(response.shape[1], dtype=bool)
    peaks: FloatArray = 20 * np.log10(np.abs(response).max(axis=0)[off])
    return peaks
