"""What a translation of a controller is compared with: ticks that Python played, below the cap."""

from dataclasses import dataclass

import numpy as np

from equalizer.signals.signal import FloatArray
from equalizer.tracking.lqr.tracking_problem import TrackingError
from equalizer.tracking.lqr.turning import play
from equalizer.tracking.realtime.realtime_controller import RealtimeController

OF_CAP = 0.9
"""The largest force of a case: the cap is no part of what is compared."""

NO_FORCE = 1e-12
"""Of the cap: what a comparison allows as a difference. A way whose largest force is below it is none."""


@dataclass(frozen=True, slots=True, eq=False)
class ControllerCases:
    """T ticks of each of the two ways, from rest."""

    rotations: FloatArray
    """(T, p, p): one that wanders, and no rotation alone: the level changes with it."""
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
    """As many ticks as the transient has rows and some after its end.

    Raises TrackingError where a way gives no force at all: nothing could be compared.
    """
    draw, p = np.random.default_rng(seed), controller.problem.outputs
    ticks = len(controller.transient) + 50
    rotations = np.cumsum(draw.standard_normal((ticks, p, p)), axis=0)
    rotations *= _to_cap(play(controller.transient, rotations).forces, controller.cap_n, "transient")
    wanted = draw.standard_normal((ticks, p))
    wanted *= _to_cap(controller.streamed(wanted)[1].forces, controller.cap_n, "stream")
    bands, tracked = controller.streamed(wanted)
    transient_forces = play(controller.transient, rotations).forces
    return ControllerCases(rotations, transient_forces, wanted, bands.low, bands.high, tracked.forces)


def _to_cap(forces: FloatArray, cap_n: float, way: str) -> float:
    longest = float(np.linalg.norm(forces, axis=1).max())
    if not longest >= NO_FORCE * cap_n:
        raise TrackingError(f"the {way} comes to no force: there is nothing to play")
    return OF_CAP * cap_n / longest
