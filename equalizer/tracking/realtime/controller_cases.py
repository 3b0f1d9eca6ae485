"""Reference cases to verify a translation of a controller into another language: inputs and forces of T ticks.

The forces are computed by this package, for both parts of the controller (`make_realtime_controller`): the transient,
with directions that change at each tick, and the stream, with noise as reference acceleration. All forces are below the
cap.
"""

from dataclasses import dataclass

import numpy as np

from equalizer.signals.signal import FloatArray
from equalizer.tracking.lqr.changing_direction import play
from equalizer.tracking.lqr.tracking_problem import TrackingError
from equalizer.tracking.realtime.realtime_controller import RealtimeController

CAP_SHARE = 0.9
"""Largest force of a case relative to the cap: below 1, because the action of the cap is not compared. Chosen."""

TICKS_AFTER = 50
"""Least number of ticks after the last row of the transient, and after the first M ticks of a stream with a preview of
M samples. Chosen."""

RELATIVE_TOLERANCE = 1e-12
"""Tolerance of a comparison, relative to the cap. Cases with a smaller largest force cannot be compared. Chosen above
rounding errors."""


@dataclass(frozen=True, slots=True, eq=False)
class ControllerCases:
    """Inputs and forces of T ticks of transient and stream, each from rest. Accelerations in m/s², forces in N."""

    rotations: FloatArray
    """(T, p, p): directions of the transient, a random walk of matrices that also change the level."""
    transient_forces: FloatArray
    """(T, m): forces of the transient in these directions."""
    reference: FloatArray
    """(T, p): reference acceleration of the stream, white noise."""
    low: FloatArray
    """(T, p): low band of `reference`, which is not played."""
    high: FloatArray
    """(T, p): high band of `reference`, which is not played."""
    stream_forces: FloatArray
    """(T, m): forces of the stream for the middle band."""

    def __len__(self) -> int:
        return len(self.reference)


def compute_controller_cases(controller: RealtimeController, seed: int = 1) -> ControllerCases:
    """Compute reference inputs and forces for as many ticks as the transient has rows or the tracker has gains, and
    `TICKS_AFTER` more. Raises TrackingError where transient or stream give no force, so that nothing could be
    compared."""
    generator, p = np.random.default_rng(seed), controller.problem.outputs
    tick_count = max(len(controller.transient), len(controller.tracker)) + TICKS_AFTER
    rotations = np.cumsum(generator.standard_normal((tick_count, p, p)), axis=0)
    rotations *= _compute_cap_factor(play(controller.transient, rotations).forces, controller.cap_n, "transient")
    reference = generator.standard_normal((tick_count, p))
    reference *= _compute_cap_factor(controller.simulate_stream(reference)[1].forces, controller.cap_n, "stream")
    bands, stream_result = controller.simulate_stream(reference)
    transient_forces = play(controller.transient, rotations).forces
    return ControllerCases(rotations, transient_forces, reference, bands.low, bands.high, stream_result.forces)


def _compute_cap_factor(forces: FloatArray, cap_n: float, part: str) -> float:
    """Factor that scales the largest norm of forces (T, m) to `CAP_SHARE` of the cap. part: transient or stream, for
    the error. Raises TrackingError for forces below `RELATIVE_TOLERANCE` of the cap."""
    peak_n = float(np.linalg.norm(forces, axis=1).max())
    if not peak_n >= RELATIVE_TOLERANCE * cap_n:
        raise TrackingError(
            f"the {part} comes to no force: there is nothing to play; give a transient with content in the model's band"
        )
    return CAP_SHARE * cap_n / peak_n
