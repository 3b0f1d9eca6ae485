"""Real-time form of the linear-quadratic tracker of a model: arrays for a control loop in another language.

There are two controllers, each with one force vector per tick. Transient: a table of accelerations that is known
beforehand, rotated into any direction while it is played (`changing_direction`). Stream: accelerations that arrive
while they are played, split into bands by causal filters; the model's band is tracked with limited preview (`preview`).
Neither feeds back a measured signal.
"""

from dataclasses import dataclass

import numpy as np

from equalizer.plant.identified_model import IdentifiedModel
from equalizer.signals.signal import FloatArray
from equalizer.tracking.feedforward.band_split import Bands, CausalSplit
from equalizer.tracking.feedforward.feedforward import band_edges
from equalizer.tracking.lqr.changing_direction import TurningTransient, make_rotatable_transient
from equalizer.tracking.lqr.lqr import TrackResult, stored_gains
from equalizer.tracking.lqr.padding import CAUSAL
from equalizer.tracking.lqr.preview import PreviewLoss, PreviewTracker, preview_loss, preview_tracker, stream
from equalizer.tracking.lqr.tracking_problem import (
    TrackingError,
    TrackingProblem,
    TrackingWeights,
    make_tracking_problem,
)

TAP_S, TAP_DECAY_S = 0.2, 0.04
"""Length and decay time constant of the default transient, a decaying oscillation as after contact with a stiff
surface; the length is five time constants."""


@dataclass(frozen=True, slots=True)
class RealtimeSettings:
    """Settings of both controllers. Raises TrackingError for a negative preview, and for a cap that is not above
    zero."""

    weight: float = 1e-3
    """Weight of |force|² against |error|², (m/s² per N)²."""
    preview_s: float = 0.2
    """Duration for which a stream is known in advance: it is played with a delay of the preview, less one sample."""
    cap_n: float = 3.0
    """Limit of the norm of the force vector, N."""

    def __post_init__(self) -> None:
        if not (np.isfinite(self.preview_s) and self.preview_s >= 0):
            raise TrackingError(f"the preview is {self.preview_s:g} s; give 0 or more")
        if not (np.isfinite(self.cap_n) and self.cap_n > 0):
            raise TrackingError(f"the cap is {self.cap_n:g} N; give more than 0")


@dataclass(frozen=True, slots=True, eq=False)
class RealtimeController:
    """Both controllers of a model: `transient`, and `tracker` with `split` for streams."""

    tracker: PreviewTracker
    split: CausalSplit
    transient: TurningTransient
    loss: PreviewLoss
    """Tracking loss of the stream by limited preview, predicted by the model; without the loss of the causal split."""
    cap_n: float

    @property
    def problem(self) -> TrackingProblem:
        """Model matrices and cost, common to both controllers."""
        return self.tracker.problem

    def simulate_stream(self, reference: FloatArray) -> tuple[Bands, TrackResult]:
        """Simulate a stream of reference (N, p), m/s², from rest: its bands, and the forces for the middle band.

        Row k of the forces belongs to the tick at which row k of `reference` arrives; the acceleration played at this
        tick is that of an earlier row, by the preview less one sample. The cap is not applied here.
        """
        bands = self.split.split(reference)
        delay_rows = len(self.tracker) - 1
        track = stream(self.tracker, np.pad(bands.middle, ((delay_rows, 0), (0, 0))))
        return bands, TrackResult(track.forces[: len(reference)], track.predicted[: len(reference)], track.final_state)


def realtime_controller(
    model: IdentifiedModel, transient: FloatArray | None = None, settings: RealtimeSettings | None = None
) -> RealtimeController:
    """Make both controllers. transient: (N, p), m/s², before rotation; None = `tap`. Zeros are appended to it, in which
    the device comes to rest.

    Raises TrackingError for a model without states or without stationary gains, a negative weight, and a transient with
    another number of columns than the model has outputs.
    """
    settings = settings or RealtimeSettings()
    if not model.order:
        raise TrackingError("the model has no states: its answer is a constant gain, which needs no controller")
    problem = make_tracking_problem(model, TrackingWeights(settings.weight))
    reference = tap(model) if transient is None else transient
    _, rows_after = CAUSAL.samples(model.sample_rate_hz)
    padded_transient = np.pad(np.asarray(reference, dtype=np.float64), ((0, rows_after), (0, 0)))
    preview = max(1, round(settings.preview_s * model.sample_rate_hz))
    return RealtimeController(
        preview_tracker(problem, preview),
        CausalSplit(band_edges(model), model.sample_rate_hz),
        make_rotatable_transient(stored_gains(problem, len(padded_transient)), padded_transient),
        preview_loss(problem, preview),
        settings.cap_n,
    )


def tap(model: IdentifiedModel) -> FloatArray:
    """(N, p), m/s²: the default transient, exp(-t / TAP_DECAY_S) sin(2 pi f t) along the last output, with f in the
    middle of the model's band."""
    low_hz, high_hz = model.band_hz
    time_s = np.arange(round(TAP_S * model.sample_rate_hz)) / model.sample_rate_hz
    acceleration = np.zeros((len(time_s), model.C.shape[0]))
    middle_hz = (low_hz + high_hz) / 2
    acceleration[:, -1] = np.exp(-time_s / TAP_DECAY_S) * np.sin(2 * np.pi * middle_hz * time_s)
    return acceleration
