"""An actuator that does not answer small commands, and larger ones with that much less."""

import numpy as np

from equalizer.effects.command_starts import grid_of_peaks, likeliest_value
from equalizer.effects.effect import Effect, OnCommand, Parameter, Values
from equalizer.effects.evidence import Evidence
from equalizer.signals.signal import FloatArray


def _beyond(commands: FloatArray, step_s: float, of: Values) -> FloatArray:
    return np.asarray(commands - np.clip(commands, -of["width"], of["width"]))


def _starts(evidence: Evidence, axis: int) -> tuple[Values, ...]:
    peaks = grid_of_peaks(evidence, axis)
    grid = [peaks[0] / 30, peaks[0] / 10, peaks[0] / 3, *peaks] if peaks else []
    width = likeliest_value(evidence, axis, lambda u, step_s, value: -np.clip(u, -value, value) + u, grid, True)
    return () if width is None else ({"width": width},)


EFFECT = Effect(
    name="force_deadband",
    equation="F = u - max(-width, min(u, width))",
    source="Tao and Kokotovic, IEEE Trans. Autom. Control 39 (1994) 59: dead zones of actuators",
    signature="the missing force flips its sign with the command, not with the motion, and does not grow with it; its "
    "odd harmonics fall as the level rises",
    parameters=(Parameter("width", 1e-6, 1e4, none=0.0),),
    acts=OnCommand(_beyond),
    starts=_starts,
    sites=("one", "all"),
)
