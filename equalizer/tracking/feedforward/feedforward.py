"""Feedforward forces for a wanted acceleration: band-limited, tracked by a model from the first row on, under a cap.

The part of the wanted acceleration outside the band is not played, because the model is not valid there; its share is
stated. There is one row of forces per row of the wanted acceleration, from rest.
"""

from dataclasses import dataclass

import numpy as np

from equalizer.plant.identified_model import IdentifiedModel
from equalizer.signals.signal import FloatArray, Signal
from equalizer.signals.summary import Summarised, Summary
from equalizer.tracking.feedforward.band_split import BandEdges, LinearPhaseSplit
from equalizer.tracking.feedforward.periodic_inverse import check_wanted
from equalizer.tracking.lqr.constrained import CapSettings, TrackingLoss, track_under_cap
from equalizer.tracking.lqr.limits import Peaks, force_peaks, require_under_cap
from equalizer.tracking.lqr.padding import CAUSAL, band_error, simulate_from_rest, track_padded
from equalizer.tracking.lqr.tracking_problem import (
    TrackingError,
    TrackingProblem,
    TrackingWeights,
    make_tracking_problem,
)

EDGE_ROOM_HZ = 1.0
"""Margin beyond the model's band, so that the whole band is played."""
LEAKED = 3e-3
"""Share of a signal that filters leak from outside the band: less than that inside the band counts as nothing."""
NO_CAP_N = 1e9
"""A cap that never acts, for forces whose sum is checked later."""
PROVED = 1e-3
"""Relative duality gap to which forces under the cap are solved."""


@dataclass(frozen=True, slots=True)
class FeedforwardSettings:
    """Weight of the forces (R = weight I, of |u|²), and cap on the norm of the force vector."""

    weight: float = 1e-3
    cap_n: float = 3.0
    constrain: bool = False
    """Above the cap: False refuses; True solves again under the cap and states the loss."""


@dataclass(frozen=True, repr=False, slots=True, eq=False)
class Feedforward(Summarised):
    """Forces for a wanted acceleration, and the model's prediction of what they achieve."""

    forces: Signal
    """(N, m)"""
    wanted: FloatArray
    """(N, p): the part of the wanted acceleration within the band, which is played."""
    predicted: FloatArray
    """(N, p): the model's response."""
    error: float
    """Relative rms error of predicted against wanted acceleration, in the band."""
    left_out: float
    """Rms share of the wanted acceleration that is outside the band, 0 to 1."""
    peaks: Peaks
    loss: TrackingLoss | None = None

    def summary(self) -> Summary:
        highest_n = float(np.abs(self.forces.samples).max(initial=0.0))
        return Summary(
            "Forces for wanted accelerations",
            (
                ("length", f"{len(self.wanted)} samples at {self.forces.sample_rate_hz:g} Hz"),
                ("predicted error in the band", f"{100 * self.error:.3g} %"),
                ("outside the band, not played", f"{100 * self.left_out:.3g} %"),
                ("highest force", f"{highest_n:.3g} N"),
            ),
        )


def feedforward(model: IdentifiedModel, wanted: Signal, settings: FeedforwardSettings | None = None) -> Feedforward:
    """Solve for the forces for which the model accelerates as wanted, within its band.

    Finite-horizon LQR tracking from rest, which equals the least squares of the block-Toeplitz response with a weight
    on the forces. wanted: (N, p), with the model's rate and output channels. Raises ForceLimitError above the cap,
    TrackingError where nothing is wanted in the band, ValueError for a signal that is not the model's.
    """
    settings = settings or FeedforwardSettings()
    check_wanted(model, wanted)
    problem = make_tracking_problem(model, TrackingWeights(settings.weight))
    inside = extract_band(model, wanted.samples)
    if not np.linalg.norm(inside) > LEAKED * np.linalg.norm(wanted.samples):
        low, high = model.band_hz
        raise TrackingError(
            f"nothing is wanted between {low:g} and {high:g} Hz, the model's band; "
            "give a trajectory within it, or a model of its band"
        )
    forces, loss = solve_causally(problem, inside, settings)
    peaks = require_under_cap(forces, settings.cap_n, model.sample_rate_hz)
    predicted = simulate_from_rest(problem, forces)
    return Feedforward(
        forces=Signal(forces, model.sample_rate_hz, "force", "N", model.input_channels),
        wanted=inside,
        predicted=predicted,
        error=band_error(inside, predicted, model.sample_rate_hz, model.band_hz),
        left_out=float(np.linalg.norm(wanted.samples - inside) / np.linalg.norm(wanted.samples)),
        peaks=peaks,
        loss=loss,
    )


def extract_band(model: IdentifiedModel, wanted: FloatArray) -> FloatArray:
    """(N, p): the part of `wanted` within the model's band, without delay."""
    split = LinearPhaseSplit(band_edges(model), model.sample_rate_hz)
    bands = split.split(wanted)
    return bands.middle[bands.latency_samples : bands.latency_samples + len(wanted)]


def band_edges(model: IdentifiedModel) -> BandEdges:
    """Edges of a model's band with a margin; None where the band reaches zero or half the sample rate."""
    low, high = model.band_hz
    nyquist = model.sample_rate_hz / 2
    return BandEdges(
        low - EDGE_ROOM_HZ if low > 2 * EDGE_ROOM_HZ else None,
        high + EDGE_ROOM_HZ if high + 2 * EDGE_ROOM_HZ < nyquist else None,
    )


def solve_causally(
    problem: TrackingProblem, wanted: FloatArray, settings: FeedforwardSettings, others: FloatArray | None = None
) -> tuple[FloatArray, TrackingLoss | None]:
    """Forces (N, m) from the first row on; where the settings constrain, their sum with others (N, m) is under the
    cap."""
    free = track_padded(problem, wanted, CAUSAL).forces
    total = free if others is None else free + others
    if not settings.constrain or force_peaks(total, settings.cap_n).fits:
        return free, None
    room = (0, CAUSAL.samples(problem.sample_rate_hz)[1]), (0, 0)
    there = None if others is None else np.pad(others, room)
    capped = track_under_cap(problem, np.pad(wanted, room), settings.cap_n, there, CapSettings(gap=PROVED))
    return capped.forces[: len(wanted)], capped.loss
