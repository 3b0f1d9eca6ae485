"""Real-time form of a model's tracker, as arrays for a loop in another language: two ways to get a force each tick.

`transient`: a table of accelerations that is known beforehand, turned into any direction while it is played (stored
gains and rotation basis). `stream`: accelerations that arrive while they are played, split causally into bands, the
model's own band tracked with limited preview. Neither feeds a measured signal back.
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
"""Length and decay time of the default transient, a tap as contacts with a stiff surface cause: five time constants."""


@dataclass(frozen=True, slots=True)
class RealtimeSettings:
    """Settings of the two controllers. Raises TrackingError for values that no loop can run."""

    weight: float = 1e-3
    """Weight of |force|² against |error|², (m/s² per N)²."""
    preview_s: float = 0.2
    """How long ahead a stream is known. It is played later by this time, less a tick."""
    cap_n: float = 3.0
    """Limit of the force vector's length, N."""

    def __post_init__(self) -> None:
        if not (np.isfinite(self.preview_s) and self.preview_s >= 0):
            raise TrackingError(f"the preview is {self.preview_s:g} s; give 0 or more")
        if not (np.isfinite(self.cap_n) and self.cap_n > 0):
            raise TrackingError(f"the cap is {self.cap_n:g} N; give more than 0")


@dataclass(frozen=True, slots=True, eq=False)
class RealtimeController:
    """Both controllers of a model, as plain arrays: `transient`, and `tracker` with `split` for streams."""

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

    def simulate_stream(self, wanted: FloatArray) -> tuple[Bands, TrackResult]:
        """Simulate a stream of wanted (N, p) from rest: its bands, and the forces for the middle one.

        Row k belongs to the tick at which row k of `wanted` arrives; the row that is played then arrived earlier by
        the preview less a sample. The cap is not applied here.
        """
        bands = self.split.split(wanted)
        late = len(self.tracker) - 1
        tracked = stream(self.tracker, np.pad(bands.middle, ((late, 0), (0, 0))))
        return bands, TrackResult(tracked.forces[: len(wanted)], tracked.predicted[: len(wanted)], tracked.final_state)


def realtime_controller(
    model: IdentifiedModel, transient: FloatArray | None = None, settings: RealtimeSettings | None = None
) -> RealtimeController:
    """Make both controllers. transient: (N, p), m/s², before it is rotated; None = a tap along the last output. Samples
    in which the device comes to rest are appended.

    Raises TrackingError for a model without states or without stationary gains, and for settings that no loop can run.
    """
    settings = settings or RealtimeSettings()
    if not model.order:
        raise TrackingError("the model has no states: its answer is a constant gain, which needs no controller")
    problem = make_tracking_problem(model, TrackingWeights(settings.weight))
    wanted = tap(model) if transient is None else transient
    _, after = CAUSAL.samples(model.sample_rate_hz)
    played = np.pad(np.asarray(wanted, dtype=np.float64), ((0, after), (0, 0)))
    preview = max(1, round(settings.preview_s * model.sample_rate_hz))
    return RealtimeController(
        preview_tracker(problem, preview),
        CausalSplit(band_edges(model), model.sample_rate_hz),
        make_rotatable_transient(stored_gains(problem, len(played)), played),
        preview_loss(problem, preview),
        settings.cap_n,
    )


def tap(model: IdentifiedModel) -> FloatArray:
    """(N, p): a decaying oscillation in the middle of the model's band, 1 m/s², along the last output."""
    low_hz, high_hz = model.band_hz
    time_s = np.arange(round(TAP_S * model.sample_rate_hz)) / model.sample_rate_hz
    wanted = np.zeros((len(time_s), model.C.shape[0]))
    middle_hz = (low_hz + high_hz) / 2
    wanted[:, -1] = np.exp(-time_s / TAP_DECAY_S) * np.sin(2 * np.pi * middle_hz * time_s)
    return wanted
