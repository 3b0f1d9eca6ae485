"""Real-time feedforward controllers of an identified model, as arrays of gains that `export_controller` writes as C.

Both are linear-quadratic trackers that give a force vector per tick. Transient: a table of accelerations that is known
beforehand, rotated into any direction while it is played (`changing_direction`). Stream: accelerations that arrive
while they are played, split into bands by causal filters; the model's band is tracked with limited preview (`preview`).
Neither uses a measured signal as feedback. Called by `study.workflows.equalizer.controller`; `controller_cases`
computes test cases of the C code from it.
"""

from dataclasses import dataclass

import numpy as np

from equalizer.plant.identified_model import IdentifiedModel
from equalizer.signals.signal import FloatArray
from equalizer.tracking.feedforward.band_split import Bands, CausalSplit
from equalizer.tracking.feedforward.feedforward import compute_band_edges
from equalizer.tracking.lqr.changing_direction import TurningTransient, make_rotatable_transient
from equalizer.tracking.lqr.lqr import TrackResult, compute_stored_gains
from equalizer.tracking.lqr.padding import CAUSAL
from equalizer.tracking.lqr.preview import (
    PreviewLoss,
    PreviewTracker,
    compute_preview_loss,
    make_preview_tracker,
    track_stream,
)
from equalizer.tracking.lqr.tracking_problem import (
    TrackingError,
    TrackingProblem,
    TrackingWeights,
    make_tracking_problem,
)

TRANSIENT_S, TRANSIENT_DECAY_S = 0.2, 0.04
"""Duration and decay time constant (s) of the default transient, a decaying oscillation as after contact with a stiff
surface; the duration is five time constants."""


@dataclass(frozen=True, slots=True)
class RealtimeSettings:
    """Settings of both controllers. Raises TrackingError for a preview that is negative, a force limit that is not
    above zero, and either that is not finite."""

    weight: float = 1e-3
    """Weight of |force|² against |acceleration error|² in the quadratic cost, (m/s² per N)². Default as in
    `FeedforwardSettings`; chosen."""
    preview_s: float = 0.2
    """Preview (s): how far ahead of its playback a stream is known. Its delay is one sample less, and at least 0.
    Default chosen."""
    cap_n: float = 3.0
    """Limit of the norm of the force vector, N. Default as in `FeedforwardSettings`; chosen."""

    def __post_init__(self) -> None:
        if not (np.isfinite(self.preview_s) and self.preview_s >= 0):
            raise TrackingError(f"the preview is {self.preview_s:g} s; give 0 or more")
        if not (np.isfinite(self.cap_n) and self.cap_n > 0):
            raise TrackingError(f"the cap is {self.cap_n:g} N; give more than 0")


@dataclass(frozen=True, slots=True, eq=False)
class RealtimeController:
    """Both controllers of a model: `transient`, and `tracker` with the filters `split` for streams."""

    tracker: PreviewTracker
    """Preview tracker of the middle band of a stream."""
    split: CausalSplit
    """Causal filters at the edges of the model's band."""
    transient: TurningTransient
    """Controller of the transient, for any direction."""
    loss: PreviewLoss
    """Tracking loss of a stream by limited preview, predicted by the model; without the loss by the causal filters."""
    cap_n: float
    """Limit (N) of the norm of the force vector, which the C code applies."""

    @property
    def problem(self) -> TrackingProblem:
        """Model matrices and cost, common to both controllers."""
        return self.tracker.problem

    def simulate_stream(self, reference: FloatArray) -> tuple[Bands, TrackResult]:
        """Simulate the tracking of a stream from rest: the bands of the stream, and the forces for the middle band.

        reference: (N, p), m/s². Row k of the forces is played at the tick at which row k of `reference` arrives; it
        tracks row k - M + 1, with a preview of M rows. The force limit `cap_n` is not applied. The final state is that
        after the end of the delayed stream: by this delay later than the last row of the forces.
        """
        bands = self.split.split(reference)
        delay_rows = len(self.tracker) - 1
        tracked_stream = track_stream(self.tracker, np.pad(bands.middle, ((delay_rows, 0), (0, 0))))
        return bands, TrackResult(
            tracked_stream.forces[: len(reference)],
            tracked_stream.predicted[: len(reference)],
            tracked_stream.final_state,
        )


def make_realtime_controller(
    model: IdentifiedModel, transient: FloatArray | None = None, settings: RealtimeSettings | None = None
) -> RealtimeController:
    """Make both controllers of a model. transient: accelerations (N, p), m/s², before rotation; None =
    `make_default_transient`. Rows of zeros are appended to it, during which the device comes to rest. Raises
    TrackingError for a model without states or without stationary gains, a weight that is negative or not finite, and a
    transient that is not finite or has another number of columns than the model has outputs."""
    settings = settings or RealtimeSettings()
    if not model.order:
        raise TrackingError("the model has no states: its answer is a constant gain, which needs no controller")
    problem = make_tracking_problem(model, TrackingWeights(settings.weight))
    reference = make_default_transient(model) if transient is None else transient
    _, rest_samples = CAUSAL.count_rows(model.sample_rate_hz)
    padded_transient = np.pad(np.asarray(reference, dtype=np.float64), ((0, rest_samples), (0, 0)))
    preview_samples = max(1, round(settings.preview_s * model.sample_rate_hz))
    return RealtimeController(
        make_preview_tracker(problem, preview_samples),
        CausalSplit(compute_band_edges(model), model.sample_rate_hz),
        make_rotatable_transient(compute_stored_gains(problem, len(padded_transient)), padded_transient),
        compute_preview_loss(problem, preview_samples),
        settings.cap_n,
    )


def make_default_transient(model: IdentifiedModel) -> FloatArray:
    """Make the default transient, accelerations (N, p) in m/s²: exp(-t / TRANSIENT_DECAY_S) sin(2 pi f t) at the last
    output, zero at the others; f is the centre of the model's band."""
    low_hz, high_hz = model.band_hz
    time_s = np.arange(round(TRANSIENT_S * model.sample_rate_hz)) / model.sample_rate_hz
    acceleration = np.zeros((len(time_s), model.C.shape[0]))
    center_hz = (low_hz + high_hz) / 2
    acceleration[:, -1] = np.exp(-time_s / TRANSIENT_DECAY_S) * np.sin(2 * np.pi * center_hz * time_s)
    return acceleration
