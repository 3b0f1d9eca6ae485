"""Feedforward forces for a wanted acceleration, by finite-horizon linear-quadratic tracking with an identified model.

The wanted acceleration is first limited to the model's band, because the model is not valid outside it; the share that
is not played is stated. There is one row of forces per row of the wanted acceleration, from rest. Forces above a cap
are refused, or solved again under the cap with the loss stated (`constrained`).
"""

from dataclasses import dataclass

import numpy as np

from equalizer.plant.identified_model import IdentifiedModel
from equalizer.signals.signal import FloatArray, Signal
from equalizer.signals.summary import Summary, SummaryDisplay
from equalizer.tracking.feedforward.band_split import BandEdges, LinearPhaseSplit
from equalizer.tracking.feedforward.periodic_inverse import check_reference
from equalizer.tracking.lqr.constrained import CapSettings, TrackingLoss, track_under_cap
from equalizer.tracking.lqr.limits import ForcePeaks, find_force_peaks, require_under_cap
from equalizer.tracking.lqr.padding import CAUSAL, band_error, simulate_from_rest, track_padded
from equalizer.tracking.lqr.tracking_problem import (
    TrackingError,
    TrackingProblem,
    TrackingWeights,
    make_tracking_problem,
)

EDGE_ROOM_HZ = 1.0
"""Margin of the crossovers beyond the model's band, so that the whole band is played."""
LEAKAGE_SHARE = 3e-3
"""Leakage of the filters from outside the band, relative to the rms of a signal. A signal with a smaller share inside
the band has no content there."""
NO_CAP_N = 1e9
"""A cap (N) without effect, for forces of which only the sum is checked later."""
DUALITY_GAP = 1e-3
"""Relative duality gap at which the iteration for forces under the cap ends."""


@dataclass(frozen=True, slots=True)
class FeedforwardSettings:
    """Weight of the forces, and cap on the norm of the force vector."""

    weight: float = 1e-3
    """R = weight I, of |u|² against the squared tracking error, (m/s² per N)²."""
    cap_n: float = 3.0
    constrain: bool = False
    """Where forces exceed the cap: False raises ForceLimitError; True solves again under the cap and states the
    loss."""


@dataclass(frozen=True, repr=False, slots=True, eq=False)
class Feedforward(SummaryDisplay):
    """Forces for a wanted acceleration, and the model's prediction of what they achieve."""

    forces: Signal
    """(N, m), N."""
    reference: FloatArray
    """(N, p), m/s²: the part of the wanted acceleration within the band, which is played."""
    predicted: FloatArray
    """(N, p), m/s²: the model's response to the forces, from rest."""
    error: float
    """Relative rms error of predicted against wanted acceleration, in the band."""
    out_of_band_share: float
    """Rms of the part outside the band over rms of the wanted acceleration."""
    peaks: ForcePeaks
    loss: TrackingLoss | None = None
    """Tracking loss due to the cap; None where forces did not have to be constrained."""

    def summary(self) -> Summary:
        """Length, predicted error, share that is not played, and highest force of an axis."""
        highest_n = float(np.abs(self.forces.samples).max(initial=0.0))
        return Summary(
            "Forces for wanted accelerations",
            (
                ("length", f"{len(self.reference)} samples at {self.forces.sample_rate_hz:g} Hz"),
                ("predicted error in the band", f"{100 * self.error:.3g} %"),
                ("outside the band, not played", f"{100 * self.out_of_band_share:.3g} %"),
                ("highest force", f"{highest_n:.3g} N"),
            ),
        )


def feedforward(model: IdentifiedModel, reference: Signal, settings: FeedforwardSettings | None = None) -> Feedforward:
    """Compute forces to which the model responds with the wanted acceleration, within its band.

    Finite-horizon LQR tracking from rest, which equals least squares with the block-Toeplitz matrix of the impulse
    response and a weight on the forces. reference: (N, p). Raises ForceLimitError for forces above the cap,
    TrackingError where nothing is wanted in the band, ValueError where sample rate, number of channels or unit are not
    the model's."""
    settings = settings or FeedforwardSettings()
    check_reference(model, reference)
    problem = make_tracking_problem(model, TrackingWeights(settings.weight))
    in_band_reference = extract_band(model, reference.samples)
    if not np.linalg.norm(in_band_reference) > LEAKAGE_SHARE * np.linalg.norm(reference.samples):
        low, high = model.band_hz
        raise TrackingError(
            f"nothing is wanted between {low:g} and {high:g} Hz, the model's band; "
            "give a trajectory within it, or a model of its band"
        )
    forces, loss = solve_causally(problem, in_band_reference, settings)
    peaks = require_under_cap(forces, settings.cap_n, model.sample_rate_hz)
    predicted = simulate_from_rest(problem, forces)
    return Feedforward(
        forces=Signal(forces, model.sample_rate_hz, "force", "N", model.input_channels),
        reference=in_band_reference,
        predicted=predicted,
        error=band_error(in_band_reference, predicted, model.sample_rate_hz, model.band_hz),
        out_of_band_share=float(
            np.linalg.norm(reference.samples - in_band_reference) / np.linalg.norm(reference.samples)
        ),
        peaks=peaks,
        loss=loss,
    )


def extract_band(model: IdentifiedModel, reference: FloatArray) -> FloatArray:
    """(N, p): the part of `reference` within the model's band, without delay."""
    split = LinearPhaseSplit(band_edges(model), model.sample_rate_hz)
    bands = split.split(reference)
    return bands.middle[bands.latency_samples : bands.latency_samples + len(reference)]


def band_edges(model: IdentifiedModel) -> BandEdges:
    """Edges of a model's band with a margin; None where the band reaches zero or half the sample rate."""
    low, high = model.band_hz
    nyquist = model.sample_rate_hz / 2
    return BandEdges(
        low - EDGE_ROOM_HZ if low > 2 * EDGE_ROOM_HZ else None,
        high + EDGE_ROOM_HZ if high + 2 * EDGE_ROOM_HZ < nyquist else None,
    )


def solve_causally(
    problem: TrackingProblem,
    reference: FloatArray,
    settings: FeedforwardSettings,
    other_forces: FloatArray | None = None,
) -> tuple[FloatArray, TrackingLoss | None]:
    """Forces (N, m), N, from the first row on, and the loss due to the cap (None without). With `settings.constrain`,
    the sum of the forces with other_forces (N, m) is under the cap."""
    unconstrained = track_padded(problem, reference, CAUSAL).forces
    total = unconstrained if other_forces is None else unconstrained + other_forces
    if not settings.constrain or find_force_peaks(total, settings.cap_n).is_under_cap:
        return unconstrained, None
    padding = (0, CAUSAL.samples(problem.sample_rate_hz)[1]), (0, 0)
    padded_others = None if other_forces is None else np.pad(other_forces, padding)
    capped = track_under_cap(
        problem, np.pad(reference, padding), settings.cap_n, padded_others, CapSettings(gap=DUALITY_GAP)
    )
    return capped.forces[: len(reference)], capped.loss
