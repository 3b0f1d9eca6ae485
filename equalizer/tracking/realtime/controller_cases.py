"""Reference cases to verify a translation of a controller into another language: inputs and forces of T ticks.

The forces are computed by this package, for both parts of the controller (`make_realtime_controller`): the transient,
with directions that change at each tick, and the stream, with noise as wanted acceleration. All forces are below the
cap.
"""

from dataclasses import dataclass

import numpy as np

from equalizer.signals.signal import FloatArray
from equalizer.tracking.lqr.changing_direction import play
from equalizer.tracking.lqr.tracking_problem import TrackingError
from equalizer.tracking.realtime.realtime_controller import RealtimeController

CAP_SHARE = 0.9
"""Largest force of a case relative to the cap: below 1, because the action of the cap is not compared."""

TICKS_AFTER = 50
"""Least number of ticks after the last row of the transient, and after the first M ticks of a stream with a preview of
M samples."""

NO_FORCE = 1e-12
"""Tolerance of a comparison, relative to the cap. Cases with a smaller largest force cannot be compared."""


@dataclass(frozen=True, slots=True, eq=False)
class ControllerCases:
    """Inputs and forces of T ticks of transient and stream, each from rest. Accelerations in m/s², forces in N."""

    rotations: FloatArray
    """(T, p, p): directions of the transient, a random walk of matrices that also change the level."""
    transient_forces: FloatArray
    """(T, m): forces of the transient in these directions."""
    wanted: FloatArray
    """(T, p): wanted acceleration of the stream, white noise."""
    low: FloatArray
    """(T, p): low band of `wanted`, which is not played."""
    high: FloatArray
    """(T, p): high band of `wanted`, which is not played."""
    stream_forces: FloatArray
    """(T, m): forces of the stream for the middle band."""

    def __len__(self) -> int:
        return len(self.wanted)


def controller_cases(controller: RealtimeController, seed: int = 1) -> ControllerCases:
    """Compute reference inputs and forces for as many ticks as the transient has rows or the preview has samples, and
    `TICKS_AFTER` more. Raises TrackingError where transient or stream give no force, so that nothing could be
    compared."""
    random, p = np.random.default_rng(seed), controller.problem.outputs
    ticks = max(len(controller.transient), len(controller.tracker)) + TICKS_AFTER
    rotations = np.cumsum(random.standard_normal((ticks, p, p)), axis=0)
    rotations *= _cap_factor(play(controller.transient, rotations).forces, controller.cap_n, "transient")
    reference = random.standard_normal((ticks, p))
    reference *= _cap_factor(controller.simulate_stream(reference)[1].forces, controller.cap_n, "stream")
    bands, track = controller.simulate_stream(reference)
    transient_forces = play(controller.transient, rotations).forces
    return ControllerCases(rotations, transient_forces, reference, bands.low, bands.high, track.forces)


def _cap_factor(forces: FloatArray, cap_n: float, part: str) -> float:
    """Factor that scales the largest norm of forces (T, m) to `CAP_SHARE` of the cap. part: transient or stream, for
    the error. Raises TrackingError for forces of zero."""
    longest = float(np.linalg.norm(forces, axis=1).max())
    if not longest >= NO_FORCE * cap_n:
        raise TrackingError(
            f"the {part} comes to no force: there is nothing to play; give a transient with content in the model's band"
        )
    return CAP_SHARE * cap_n / longest
