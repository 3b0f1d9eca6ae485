"""Reference cases to verify a translation of a controller: ticks computed in Python, below the cap."""

from dataclasses import dataclass

import numpy as np

from equalizer.signals.signal import FloatArray
from equalizer.tracking.lqr.changing_direction import play
from equalizer.tracking.lqr.tracking_problem import TrackingError
from equalizer.tracking.realtime.realtime_controller import RealtimeController

OF_CAP = 0.9
"""Largest force of a case over the cap, because the cap is not compared."""

AFTER = 50
"""Ticks of a case after the last row of the transient, and at least so many with a force of the stream."""

NO_FORCE = 1e-12
"""Tolerance of a comparison, relative to the cap. A way whose largest force is below it counts as zero."""


@dataclass(frozen=True, slots=True, eq=False)
class ControllerCases:
    """T ticks of transient and stream, from rest."""

    rotations: FloatArray
    """(T, p, p): directions that change over time and are not only rotations: the level changes too."""
    transient_forces: FloatArray
    """(T, m)"""
    wanted: FloatArray
    """(T, p): noise"""
    low: FloatArray
    """(T, p): of what is wanted, not played"""
    high: FloatArray
    """(T, p)"""
    stream_forces: FloatArray
    """(T, m)"""

    def __len__(self) -> int:
        return len(self.wanted)


def controller_cases(controller: RealtimeController, seed: int = 1) -> ControllerCases:
    """Compute reference inputs and forces: as many ticks as the transient has rows, or the stream's preview takes, and
    some after its end. Raises TrackingError where one of the two ways gives no force at all: nothing could be
    compared."""
    draw, p = np.random.default_rng(seed), controller.problem.outputs
    ticks = max(len(controller.transient), len(controller.tracker)) + AFTER
    rotations = np.cumsum(draw.standard_normal((ticks, p, p)), axis=0)
    rotations *= _cap_factor(play(controller.transient, rotations).forces, controller.cap_n, "transient")
    wanted = draw.standard_normal((ticks, p))
    wanted *= _cap_factor(controller.simulate_stream(wanted)[1].forces, controller.cap_n, "stream")
    bands, tracked = controller.simulate_stream(wanted)
    transient_forces = play(controller.transient, rotations).forces
    return ControllerCases(rotations, transient_forces, wanted, bands.low, bands.high, tracked.forces)


def _cap_factor(forces: FloatArray, cap_n: float, way: str) -> float:
    longest = float(np.linalg.norm(forces, axis=1).max())
    if not longest >= NO_FORCE * cap_n:
        raise TrackingError(
            f"the {way} comes to no force: there is nothing to play; give a transient with content in the model's band"
        )
    return OF_CAP * cap_n / longest
