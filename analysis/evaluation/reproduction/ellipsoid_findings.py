"""Compare simulated ellipses with figure 3 of Wilson, Chan, Salisbury and Niemeyer, Multi-DOF Equalization of Haptic
Devices.

The figure shows acceleration ellipses under a sinusoidal force along one test direction. Coupling is the ratio of
off-axis to along-axis amplitude at the driven frequency (`PhasorEllipse.off_axis_ratio`), here of the simulated device.
"""

from collections.abc import Sequence

from analysis.evaluation.reproduction.document import FigureFindings, Finding
from analysis.psychophysics.ellipsoid import EllipsoidResult
from analysis.wording import format_number

MAX_COUPLING_RATIO = 1.25
"""Largest ratio of the largest to the smallest coupling that counts as "nearly the same". Chosen: the paper prints no
number."""

_DIFFERENCES = (
    "The simulated device's mount was given its modes so that the coupling follows the published one over frequency: "
    "alike up to 15 Hz, most at 25 Hz, less at 35 Hz. That it does shows that the simulation is set up as intended, "
    "nothing more.",
    "The paper scales each ellipse to itself and prints no number; neither the force nor whether a person held the "
    "handle is said. Here: the amplitude of the protocol, and a spring instead of a hand.",
    "The published definition, mean squares, counts noise and harmonics as motion. The same picture from the driven "
    "frequency alone is drawn below it, and the coupling in the table is of that kind.",
)
"""Differences from the publication, for the report."""


def make_ellipsoid_findings(ellipsoids: Sequence[EllipsoidResult]) -> FigureFindings:
    """Compare the ellipses, measured on the simulated device, with the published figure 3. ellipsoids: one per
    frequency. A comparison is left out where its frequencies are absent or have no coupling (no motion along the
    direction)."""
    coupling_by_hz = {
        ellipsoid.frequency_hz: ellipsoid.phasor.off_axis_ratio
        for ellipsoid in ellipsoids
        if ellipsoid.phasor.off_axis_ratio is not None
    }
    findings = (
        *(_describe_coupling(ellipsoid) for ellipsoid in ellipsoids),
        _compare_low_frequency_coupling(coupling_by_hz),
        _compare_high_frequency_coupling(coupling_by_hz),
    )
    return FigureFindings(
        figure=3,
        title="Which way the handle moves along a test direction",
        source="Figure 3 and section III A",
        published="Ellipses of the acceleration while a sinusoid of constant amplitude acts along one test direction, "
        "to see whether coupling could explain the thresholds. Coupling is nearly the same at 5, 10 and 15 Hz, and at "
        "35 Hz it is less than at 25 Hz.",
        findings=tuple(finding for finding in findings if finding is not None),
        differs=_DIFFERENCES,
    )


def _describe_coupling(ellipsoid: EllipsoidResult) -> Finding:
    """Describe coupling and shape of the ellipse at one frequency, without a comparison: the paper prints no number."""
    coupling, axes = ellipsoid.phasor.off_axis_ratio, ellipsoid.moments.normalised_axes
    ratio_text = "" if coupling is None else f"off the direction over along it {100 * coupling:.0f} %; "
    return Finding(
        what=f"{ellipsoid.frequency_hz:g} Hz",
        published="drawn, no number",
        here=f"{ratio_text}mean squares: axes 1 : {axes[1]:.2f}, tilt {format_number(ellipsoid.moments.tilt_deg, 0)}°",
        value=coupling,
        unit="1",
        as_published=None,
    )


def _compare_low_frequency_coupling(coupling_by_hz: dict[float, float]) -> Finding | None:
    """Test whether coupling is nearly the same at 5, 10 and 15 Hz; None for fewer than two of these frequencies.
    coupling_by_hz: by frequency in Hz, > 0."""
    low_frequency_coupling = [
        coupling_by_hz[frequency_hz] for frequency_hz in (5.0, 10.0, 15.0) if frequency_hz in coupling_by_hz
    ]
    if len(low_frequency_coupling) < 2:
        return None
    max_to_min_ratio = max(low_frequency_coupling) / min(low_frequency_coupling)
    return Finding(
        what="Coupling at 5, 10 and 15 Hz",
        published="nearly identical",
        here=f"largest over smallest {max_to_min_ratio:.2f}",
        value=max_to_min_ratio,
        unit="1",
        as_published=max_to_min_ratio <= MAX_COUPLING_RATIO,
        rule=f"largest over smallest at most {MAX_COUPLING_RATIO:g}",
    )


def _compare_high_frequency_coupling(coupling_by_hz: dict[float, float]) -> Finding | None:
    """Test whether coupling at 35 Hz is less than at 25 Hz; None where either is missing. coupling_by_hz: by frequency
    in Hz, > 0."""
    if not {25.0, 35.0} <= coupling_by_hz.keys():
        return None
    ratio = coupling_by_hz[35.0] / coupling_by_hz[25.0]
    return Finding(
        what="Coupling at 35 Hz over that at 25 Hz",
        published="less than 1",
        here=f"{ratio:.2f}",
        value=ratio,
        unit="1",
        as_published=ratio < 1,
        rule="below 1",
    )
