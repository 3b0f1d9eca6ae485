"""A wanted acceleration turned into forces by one model: its band cut out, tracked from the first row on, the cap kept.

What lies outside the band is not played: a model says nothing there, and where the device is loud a little of it would
be much error. How much that is, is stated. Forces go one to one with the rows of what is wanted, from rest.
"""

from dataclasses import dataclass

import numpy as np

from equalizer.plant.identified_model import IdentifiedModel
from equalizer.signals.signal import FloatArray, Signal
from equalizer.signals.summary import Summarised, Summary
from equalizer.tracking.feedforward.band_split import BandEdges, LinearPhaseSplit
from equalizer.tracking.feedforward.periodic_inverse import check_wanted
from equalizer.tracking.lqr.constrained import CapSettings, TrackingLoss, constrained_track
from equalizer.tracking.lqr.limits import Peaks, predicted_peaks, require_within
from equalizer.tracking.lqr.padding import CAUSAL, answer, band_error, track_padded
from equalizer.tracking.lqr.tracking_problem import TrackingError, TrackingProblem, TrackingWeights, augmented

EDGE_ROOM_HZ = 1.0
"""Beyond the model's band, so that all of it is played."""
LEAKED = 3e-3
"""Share of what is wanted that filters let through from outside the band: no more than that inside is nothing."""
NO_CAP_N = 1e9
"""For forces that are checked later, when all of them are together."""
PROVED = 1e-3
"""Forces under the cap are taken whose cost is proved to be so close to the best."""


@dataclass(frozen=True, slots=True)
class FeedforwardSettings:
    weight: float = 1e-3
    cap_n: float = 3.0
    constrain: bool = False
    """Above the cap: False refuses, True solves anew under it and states the loss."""


@dataclass(frozen=True, repr=False, slots=True, eq=False)
class Feedforward(Summarised):
    forces: Signal
    """(N, m)"""
    wanted: FloatArray
    """(N, p): what is played of what was wanted, its part within the band"""
    predicted: FloatArray
    """(N, p): what the model answers"""
    error: float
    """Of predicted against wanted, relative, in the band"""
    left_out: float
    """Share of what was wanted that lies outside the band, 0 to 1, of its root mean square"""
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
    """The forces that make the model accelerate as wanted, within the band that it was identified in.

    Finite-horizon LQR tracking from rest, which equals the least squares of the block-Toeplitz response with a weight
    on the forces. wanted: (N, p), with the model's rate and output channels. Raises ForceLimitError above the cap,
    TrackingError where nothing is wanted in the band, ValueError for a signal that is not the model's.
    """
    settings = settings or FeedforwardSettings()
    check_wanted(model, wanted)
    problem = augmented(model, TrackingWeights(settings.weight))
    inside = within_band(model, wanted.samples)
    if not np.linalg.norm(inside) > LEAKED * np.linalg.norm(wanted.samples):
        low, high = model.band_hz
        raise TrackingError(f"nothing is wanted between {low:g} and {high:g} Hz, the model's band")
    forces, loss = solved_causally(problem, inside, settings)
    peaks = require_within(forces, settings.cap_n, model.sample_rate_hz)
    predicted = answer(problem, forces)
    return Feedforward(
        forces=Signal(forces, model.sample_rate_hz, "force", "N", model.input_channels),
        wanted=inside,
        predicted=predicted,
        error=band_error(inside, predicted, model.sample_rate_hz, model.band_hz),
        left_out=float(np.linalg.norm(wanted.samples - inside) / np.linalg.norm(wanted.samples)),
        peaks=peaks,
        loss=loss,
    )


def within_band(model: IdentifiedModel, wanted: FloatArray) -> FloatArray:
    """(N, p): the part of `wanted` within the model's band, without delay."""
    split = LinearPhaseSplit(edges_around(model), model.sample_rate_hz)
    bands = split.split(wanted)
    return bands.middle[bands.latency_samples : bands.latency_samples + len(wanted)]


def edges_around(model: IdentifiedModel) -> BandEdges:
    """Beside the model's band, with room; None where the band reaches to the end."""
    low, high = model.band_hz
    nyquist = model.sample_rate_hz / 2
    return BandEdges(
        low - EDGE_ROOM_HZ if low > 2 * EDGE_ROOM_HZ else None,
        high + EDGE_ROOM_HZ if high + 2 * EDGE_ROOM_HZ < nyquist else None,
    )


def solved_causally(
    problem: TrackingProblem, wanted: FloatArray, settings: FeedforwardSettings, others: FloatArray | None = None
) -> tuple[FloatArray, TrackingLoss | None]:
    """Forces (N, m) from the first row on, under the cap together with the others, (N, m), where it constrains."""
    free = track_padded(problem, wanted, CAUSAL).forces
    total = free if others is None else free + others
    if not settings.constrain or predicted_peaks(total, settings.cap_n).fits:
        return free, None
    room = (0, CAUSAL.samples(problem.sample_rate_hz)[1]), (0, 0)
    there = None if others is None else np.pad(others, room)
    capped = constrained_track(problem, np.pad(wanted, room), settings.cap_n, there, CapSettings(gap=PROVED))
    return capped.forces[: len(wanted)], capped.loss
