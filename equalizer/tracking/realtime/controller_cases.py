"""What a translation of a controller is compared with: ticks that Python played, below the cap."""

from dataclasses import dataclass

import numpy as np

from equalizer.signals.signal import FloatArray
from equalizer.tracking.lqr.turning import play
from equalizer.tracking.realtime.realtime_controller import RealtimeController

OF_CAP = 0.9
"""The largest force of a case: the cap is no part of what is compared."""


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
    """As many ticks as the transient has rows and some after its end."""
    draw, p = np.random.default_rng(seed), controller.problem.outputs
    ticks = len(controller.transient) + 50
    rotations = np.cumsum(draw.standard_normal((ticks, p, p)), axis=0)
    rotations *= OF_CAP * controller.cap_n / _longest(play(controller.transient, rotations).forces)
    wanted = draw.standard_normal((ticks, p))
    wanted *= OF_CAP * controller.cap_n / _longest(controller.streamed(wanted)[1].forces)
    bands, tracked = controller.streamed(wanted)
    transient_forces = play(controller.transient, rotations).forces
    return ControllerCases(rotations, transient_forces, wanted, bands.low, bands.high, tracked.forces)


def _longest(forces: FloatArray) -> float:
    return float(np.linalg.norm(forces, axis=1).max())
