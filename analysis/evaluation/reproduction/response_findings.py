"""Findings on the published figures 4 and 1, from the simulated device's transfer functions; on 1 also from thresholds.

Figure 4 shows the transfer functions from every force to every acceleration, figure 1 the frequency bands that follow
from the onset of coupling and from the limit of direction perception.
"""

from collections.abc import Sequence

import numpy as np

from analysis.evaluation.reproduction.document import FigureFindings, Finding
from analysis.evaluation.reproduction.study_findings import LIMIT_RULE
from analysis.wording import format_signed
from equalizer.identification.frequency_response.coupling_onset import CouplingOnset
from equalizer.identification.frequency_response.frequency_bands import FrequencyBand
from equalizer.identification.frequency_response.frequency_response import FrequencyResponse
from equalizer.identification.frequency_response.resonances import COUPLING, Resonance

TOLERANCE = 0.2
"""Largest relative difference of two frequencies that count as near each other. Chosen: the paper states them as
"about"."""
SLOPE_HZ = (4.5, 9.0)
"""Range (Hz) below the resonance near 11 Hz in which the slope along the axes is measured. Chosen."""
LARGE_RATIO = 3.0
"""Ratio of the gain to its median from 15 to 60 Hz, a range between the published resonances, above which a resonance
counts as large. Chosen."""

_GEOMETRY = (
    "Link lengths, inertias, friction and modes of the omega.3 are not public. The simulated device is of its size; "
    "a mode near 11 Hz, modes from 80 Hz on and friction that dominates below 10 Hz were put in because the paper "
    "reports them. Their heights, widths and couplings are ours, and the curves must not be compared point by point "
    "with the published ones."
)


def make_response_findings(
    response: FrequencyResponse, resonances: Sequence[Resonance], onset: CouplingOnset
) -> FigureFindings:
    """Make the findings on figure 4. response: transfer functions estimated from sweeps over the whole frequency range.
    resonances, onset: found in these. Slope and lowest line are left out without enough reliable lines."""
    findings = (
        _find_low_resonance(resonances),
        _find_large_resonances(response, resonances),
        _find_onset(onset),
        _find_slope(response),
        _find_lowest_line(response),
    )
    return FigureFindings(
        figure=4,
        title="Transfer functions from every force to every acceleration",
        source="Figure 4 and section III B",
        published="Swept sines of 30 s from 1 to 500 Hz, one axis after the other and repeated, an accelerometer on "
        "the handle, a weak spring of about 3.5 Hz instead of a hand. The paper sees a resonance near 11 Hz that "
        "couples the axes, large resonances and coupling from about 80 Hz, a slope below 10 Hz that it attributes to "
        "friction and damping, and too little energy below 3.5 Hz. It sets the onset of coupling at about 10 Hz.",
        findings=tuple(finding for finding in findings if finding is not None),
        differs=(
            _GEOMETRY,
            "The paper reads the onset off its curves; here a rule finds it, with an interval that accounts for "
            "noise alone.",
        ),
        remarks=response.remarks,
    )


def make_band_findings(bands: Sequence[FrequencyBand], limit_hz: float | None, used_limit_hz: float) -> FigureFindings:
    """Make the findings on figure 1. limit_hz: limit of direction perception from the thresholds of figure 2, None
    where they give none. used_limit_hz: the limit that was drawn."""
    published = {"low": "up to about 10 Hz", "middle": "about 10 to 35 Hz", "high": "from 35 Hz on"}
    edges_hz = {"low": (None, 10.0), "middle": (10.0, 35.0), "high": (35.0, None)}
    findings = [_find_band_edges(band, published[band.name], edges_hz[band.name]) for band in bands]
    findings.append(_find_direction_limit(limit_hz))
    limit_remarks: tuple[str, ...] = ()
    if limit_hz is None:
        limit_remarks = (
            f"These thresholds give no limit of direction, so the published {used_limit_hz:g} Hz are drawn.",
        )
    return FigureFindings(
        figure=1,
        title="Which way of driving the device suits which frequencies",
        source="Figure 1 and section III",
        published="A drawing without measured values: rigid-body control below, equalization of all axes together in "
        "the middle, axis by axis above. The middle band reaches from the onset of coupling, about 10 Hz, to the limit "
        "of direction, 35 Hz; the model is then fitted from 5 Hz on, to be on the safe side.",
        findings=tuple(findings),
        differs=(
            "The lower edge comes from the simulated device's transfer functions (figure 4), the upper one from the "
            "simulated participants' thresholds (figure 2), which are tested at five frequencies only. Both were set "
            "up to resemble the published ones.",
            *limit_remarks,
        ),
    )


def _is_within_tolerance(value: float, published: float) -> bool:
    """Whether a value differs from the published one by at most the share `TOLERANCE` of it."""
    return abs(value - published) <= TOLERANCE * published


def _find_low_resonance(resonances: Sequence[Resonance]) -> Finding:
    """Judge whether there is a resonance near 11 Hz that couples the axes; the most prominent one counts."""
    candidates = [resonance for resonance in resonances if _is_within_tolerance(resonance.frequency_hz, 11.0)]
    strongest = max(candidates, key=lambda candidate: candidate.prominence_db, default=None)
    is_coupling = strongest is not None and COUPLING in strongest.seen_in
    text = "none was found"
    if strongest is not None:
        interval_text = "{:.2f} to {:.2f} Hz".format(*strongest.frequency_interval_hz)
        text = (
            f"{strongest.frequency_hz:.2f} Hz ({interval_text}), "
            f"{'couples the axes' if is_coupling else 'without coupling'}"
        )
    return Finding(
        what="Lowest resonance",
        published="near 11 Hz, couples the axes",
        here=text,
        value=None if strongest is None else strongest.frequency_hz,
        unit="Hz",
        as_published=is_coupling,
        rule=f"within {TOLERANCE:.0%} of 11 Hz, and a peak of what goes off axis",
    )


def _find_large_resonances(response: FrequencyResponse, resonances: Sequence[Resonance]) -> Finding:
    """Judge whether the first large resonance (`LARGE_RATIO`) is near 80 Hz. Gain: largest singular value of the
    response matrix; none counts as large where the middle range has no reliable line."""
    gain = np.linalg.norm(response.response, ord=2, axis=(1, 2))
    is_middle = (response.frequency_hz >= 15) & (response.frequency_hz <= 60) & response.reliable
    middle_gain = float(np.median(gain[is_middle])) if is_middle.any() else np.inf

    def compute_height(resonance: Resonance) -> float:
        """Compute the median gain within 2 % of the resonance's frequency (chosen); 0 without a line there."""
        is_at_resonance = np.abs(response.frequency_hz - resonance.frequency_hz) <= 0.02 * resonance.frequency_hz
        return float(np.median(gain[is_at_resonance])) if is_at_resonance.any() else 0.0

    large_resonances = [resonance for resonance in resonances if compute_height(resonance) > LARGE_RATIO * middle_gain]
    lowest_hz = min((large_resonance.frequency_hz for large_resonance in large_resonances), default=None)
    return Finding(
        what="Large resonances",
        published="from about 80 Hz on",
        here="none" if lowest_hz is None else f"from {lowest_hz:.1f} Hz on, {len(large_resonances)} of them",
        value=lowest_hz,
        unit="Hz",
        as_published=lowest_hz is not None and _is_within_tolerance(lowest_hz, 80.0),
        rule=f"the first that rises to {LARGE_RATIO:g} times the middle band's level lies within {TOLERANCE:.0%} "
        "of 80 Hz",
    )


def _find_onset(onset: CouplingOnset) -> Finding:
    """Judge whether coupling begins near 10 Hz."""
    text = "no coupling was found"
    if onset.frequency_hz is not None:
        interval_text = "" if onset.interval_hz is None else " (95 %: {:.2f} to {:.2f} Hz)".format(*onset.interval_hz)
        text = f"{onset.frequency_hz:.2f} Hz{interval_text}; {onset.rule}"
    return Finding(
        what="Onset of coupling",
        published="about 10 Hz",
        here=text,
        value=onset.frequency_hz,
        unit="Hz",
        as_published=onset.frequency_hz is not None and _is_within_tolerance(onset.frequency_hz, 10.0),
        rule=f"within {TOLERANCE:.0%} of 10 Hz",
    )


def _find_slope(response: FrequencyResponse) -> Finding | None:
    """Judge whether the mean gain along the axes rises, by a line fit within `SLOPE_HZ`: by more than 1 dB per octave
    (chosen). None with fewer than 3 reliable lines."""
    lines = response.select_band(*SLOPE_HZ)
    lines = lines.select_lines(lines.reliable)
    if len(lines) < 3:
        return None
    diagonal_gain = np.abs(np.einsum("lii->li", lines.response)).mean(axis=1)
    slope_db = float(np.polyfit(np.log2(lines.frequency_hz), 20 * np.log10(diagonal_gain), 1)[0])
    low_hz, high_hz = SLOPE_HZ
    return Finding(
        what=f"Slope along the axes, {low_hz:g} to {high_hz:g} Hz",
        published="rises: friction and damping rule below 10 Hz",
        here=f"{format_signed(slope_db, 1)} dB per octave (a free mass: 0)",
        value=slope_db,
        unit="dB",
        as_published=slope_db > 1.0,
        rule="rises by more than 1 dB per octave",
    )


def _find_lowest_line(response: FrequencyResponse) -> Finding | None:
    """Judge whether the lowest reliable line is near 3.5 Hz; None without any reliable line."""
    if not response.reliable.any():
        return None
    lowest_hz = float(response.frequency_hz[response.reliable][0])
    return Finding(
        what="Lowest line that is used",
        published="below 3.5 Hz there is too little energy",
        here=f"{lowest_hz:.2f} Hz",
        value=lowest_hz,
        unit="Hz",
        as_published=_is_within_tolerance(lowest_hz, 3.5),
        rule=f"within {TOLERANCE:.0%} of 3.5 Hz",
    )


def _find_band_edges(band: FrequencyBand, published: str, edges_hz: tuple[float | None, float | None]) -> Finding:
    """Judge whether a band's edges are near the published ones. edges_hz: published, in Hz; None = not compared."""
    low_hz, high_hz = edges_hz
    as_published = (low_hz is None or _is_within_tolerance(band.low_hz, low_hz)) and (
        high_hz is None or _is_within_tolerance(band.high_hz, high_hz)
    )
    return Finding(
        what=f"{band.name.capitalize()} band: {band.method}",
        published=published,
        here=f"{band.low_hz:.3g} to {band.high_hz:.3g} Hz",
        value=band.high_hz if band.name == "low" else band.low_hz,
        unit="Hz",
        as_published=as_published,
        rule=f"edges within {TOLERANCE:.0%}",
    )


def _find_direction_limit(limit_hz: float | None) -> Finding:
    """Judge whether the limit of direction perception is near 35 Hz; limit_hz: None where none was found."""
    return Finding(
        what="Limit of direction",
        published="35 Hz",
        here=f"{'none found' if limit_hz is None else f'{limit_hz:g} Hz'}; {LIMIT_RULE}",
        value=limit_hz,
        unit="Hz",
        as_published=limit_hz is not None and _is_within_tolerance(limit_hz, 35.0),
        rule=f"within {TOLERANCE:.0%} of 35 Hz",
    )
