"""Feedforward forces for a reference acceleration, by finite-horizon linear-quadratic tracking with an identified
model.

The reference is first limited to the model's band, because the model is not valid outside it; the result states the
share outside. There is one row of forces per row of the reference, from rest. Forces above a cap are refused, or solved
again under the cap with the loss stated (`lqr.constrained`). Called by `workspace.feedforward_at_place` (a single
model) and `bands.narrow_and_wide_models` (the middle band of two models); exported as `equalizer.equalize`. Sizes: N
rows (samples), m inputs, p outputs.
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
from equalizer.tracking.lqr.lqr import require_stable
from equalizer.tracking.lqr.padding import CAUSAL, compute_band_error, simulate_from_rest, track_padded
from equalizer.tracking.lqr.tracking_problem import (
    TrackingError,
    TrackingProblem,
    TrackingWeights,
    make_tracking_problem,
    require_trajectory,
)

BAND_MARGIN_HZ = 1.0
"""Margin (Hz) of the crossovers beyond the model's band, so that the whole band is played. Chosen by hand."""
LEAKAGE_SHARE = 3e-3
"""Leakage of the filters from outside the band, relative to the rms of a signal. A signal with at most this share
inside the band is treated as one without content there. Chosen by hand."""
NO_CAP_N = 1e9
"""A cap (N) without effect, for forces of which only the sum is checked later."""
DUALITY_GAP = 1e-3
"""Relative duality gap at which the iteration for forces under the cap ends: the cost is then within 0.1 % of the
minimum. Chosen by hand."""


@dataclass(frozen=True, slots=True)
class FeedforwardSettings:
    """Weight of the forces, cap on the norm of the force vector, and what to do above the cap."""

    weight: float = 1e-3
    """R = weight I, of |u|² against the squared tracking error, (m/s² per N)². Default chosen by hand."""
    cap_n: float = 3.0
    """Largest norm of the force vector of a row, N. Default chosen."""
    constrain: bool = False
    """Where forces exceed the cap: False raises ForceLimitError; True solves again under the cap and states the
    loss."""


@dataclass(frozen=True, repr=False, slots=True, eq=False)
class Feedforward(SummaryDisplay):
    """Forces for a reference acceleration, and the model's prediction of the response to them; result of
    `compute_feedforward_forces`, and of `bands.narrow_and_wide_models` for two models."""

    forces: Signal
    """(N, m), N."""
    reference: FloatArray
    """(N, p), m/s²: the part of the reference acceleration within the band (of two models: within all their bands),
    which is played."""
    predicted: FloatArray
    """(N, p), m/s²: the model's response to the forces, from rest; of two models, that of the narrow one."""
    error: float
    """Rms error of the predicted acceleration in the band (of two models: of the narrow one), relative to the rms of
    the reference acceleration in that band."""
    out_of_band_share: float
    """Rms of the part that is not in `reference`, over the rms of the whole reference acceleration."""
    peaks: ForcePeaks
    """Largest force and its row, against the cap."""
    loss: TrackingLoss | None = None
    """Tracking loss due to the cap; None where forces did not have to be constrained."""

    def summary(self) -> Summary:
        """Summarise length, predicted error, share that is not played, and largest force of a single axis."""
        largest_component_n = float(np.abs(self.forces.samples).max(initial=0.0))
        return Summary(
            "Forces for a reference acceleration",
            (
                ("length", f"{len(self.reference)} samples at {self.forces.sample_rate_hz:g} Hz"),
                ("predicted error in the band", f"{100 * self.error:.3g} %"),
                ("outside the band, not played", f"{100 * self.out_of_band_share:.3g} %"),
                ("largest force of an axis", f"{largest_component_n:.3g} N"),
            ),
        )


def compute_feedforward_forces(
    model: IdentifiedModel, reference: Signal, settings: FeedforwardSettings | None = None
) -> Feedforward:
    """Compute forces to which the model responds with the reference acceleration, within its band.

    Finite-horizon LQR tracking from rest, which equals least squares with the block-Toeplitz matrix of the impulse
    response and a weight on the forces. reference: (N, p), m/s²; settings: None = defaults. Raises ForceLimitError for
    forces above the cap (with `constrain` off), TrackingError where the reference has no content in the band or the cap
    cannot be kept, or for an unstable model, an invalid weight or a reference with values that are not finite,
    ValueError for an invalid cap, where sample rate, channels or units are not the model's, and for a model whose
    commands are not in N.
    """
    settings = settings or FeedforwardSettings()
    check_reference(model, reference)
    tracking_problem = make_tracking_problem(model, TrackingWeights(settings.weight))
    in_band_reference = extract_band(model, require_trajectory(tracking_problem, reference.samples))
    if not np.linalg.norm(in_band_reference) > LEAKAGE_SHARE * np.linalg.norm(reference.samples):
        low_hz, high_hz = model.band_hz
        raise TrackingError(
            f"the reference has no content from {low_hz:g} to {high_hz:g} Hz, the model's band; "
            "give a trajectory within it, or a model of its band"
        )
    forces, loss = solve_causally(tracking_problem, in_band_reference, settings)
    peaks = require_under_cap(forces, settings.cap_n, model.sample_rate_hz)
    predicted = simulate_from_rest(tracking_problem, forces)
    return Feedforward(
        forces=Signal(forces, model.sample_rate_hz, "force", "N", model.input_channels),
        reference=in_band_reference,
        predicted=predicted,
        error=compute_band_error(in_band_reference, predicted, model.sample_rate_hz, model.band_hz),
        out_of_band_share=float(
            np.linalg.norm(reference.samples - in_band_reference) / np.linalg.norm(reference.samples)
        ),
        peaks=peaks,
        loss=loss,
    )


def extract_band(model: IdentifiedModel, reference: FloatArray) -> FloatArray:
    """Extract the part of `reference` (N, p) within the model's band, (N, p), by linear-phase filters whose delay is
    removed."""
    split = LinearPhaseSplit(compute_band_edges(model), model.sample_rate_hz)
    bands = split.split(reference)
    return bands.middle[bands.latency_samples : bands.latency_samples + len(reference)]


def compute_band_edges(model: IdentifiedModel) -> BandEdges:
    """Compute the edges (Hz) of a model's band, each `BAND_MARGIN_HZ` further out; None where the band ends within
    twice the margin of zero or of half the sample rate."""
    low_hz, high_hz = model.band_hz
    nyquist_hz = model.sample_rate_hz / 2
    return BandEdges(
        low_hz - BAND_MARGIN_HZ if low_hz > 2 * BAND_MARGIN_HZ else None,
        high_hz + BAND_MARGIN_HZ if high_hz + 2 * BAND_MARGIN_HZ < nyquist_hz else None,
    )


def solve_causally(
    problem: TrackingProblem,
    reference: FloatArray,
    settings: FeedforwardSettings,
    other_forces: FloatArray | None = None,
) -> tuple[FloatArray, TrackingLoss | None]:
    """Solve for forces (N, m), in newtons, that are zero before the first row; and the loss due to the cap, None where
    the forces did not have to be constrained. With `settings.constrain`, the sum of the forces and other_forces (N, m)
    is kept under the cap; otherwise the cap is not applied here. reference: (N, p), m/s². Raises TrackingError for an
    unstable model, and as `track_padded` and `track_under_cap`."""
    require_stable(problem, "its motion would grow without a force; identify it again")
    unconstrained_forces = track_padded(problem, reference, CAUSAL).forces
    total_forces = unconstrained_forces if other_forces is None else unconstrained_forces + other_forces
    if not settings.constrain or find_force_peaks(total_forces, settings.cap_n).is_under_cap:
        return unconstrained_forces, None
    padding = (0, CAUSAL.count_rows(problem.sample_rate_hz)[1]), (0, 0)
    padded_other_forces = None if other_forces is None else np.pad(other_forces, padding)
    capped_track = track_under_cap(
        problem, np.pad(reference, padding), settings.cap_n, padded_other_forces, CapSettings(gap=DUALITY_GAP)
    )
    return capped_track.forces[: len(reference)], capped_track.loss
