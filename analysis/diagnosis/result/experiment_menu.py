"""Recordings that a laboratory could make next, as commands to play on paper first."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from equalizer.plant.linear_simulation import driven_axes
from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.excitation import faded, log_sweep, sine
from equalizer.signals.signal import FloatArray

LENGTH_S, LONG_S = 8.0, 40.0
USUAL_HZ, USUAL_SHARE, FASTEST_SHARE = 240.0, 0.24, 0.45
"""How far sweeps go: to the first, or such a share of the sample rate."""
ADDED_SHARE = 0.12
"""Of the grounded mass: a weight that is known and strapped on."""
_FADE_S = 0.5


@dataclass(frozen=True, slots=True, eq=False)
class Experiment:
    words: str
    """What to record; ends the sentence "record …"."""
    commands: FloatArray
    """(n, m)"""
    kind: Literal["sweep", "slow"]
    """As a recording's segment says it."""
    added: float = 0.0
    """Mass (or inertia) that is strapped on beforehand."""
    minutes: float = 1.0
    """What it costs."""


def experiment_menu(model: MechanicalModel, sample_rate_hz: float, axis: int, level: float) -> tuple[Experiment, ...]:
    """axis: where the rivals sit. level: the highest that was recorded; nothing louder is proposed."""
    usual_hz = min(USUAL_HZ, USUAL_SHARE * sample_rate_hz)
    fastest_hz = FASTEST_SHARE * sample_rate_hz
    slow_hz = 4.0 / LENGTH_S
    added = ADDED_SHARE * float(np.diagonal(driven_axes(model).T @ model.mass @ driven_axes(model)).mean())

    def along(wave: FloatArray) -> FloatArray:
        commands = np.zeros((len(wave), model.inputs))
        commands[:, axis] = faded(wave, int(_FADE_S * sample_rate_hz), int(_FADE_S * sample_rate_hz))
        return commands

    def swept(of: float, to_hz: float = usual_hz, length_s: float = LENGTH_S) -> FloatArray:
        return along(log_sweep(1.0, to_hz, of, int(length_s * sample_rate_hz), sample_rate_hz))

    def slow(of: float) -> FloatArray:
        return along(sine(slow_hz, of, int(LENGTH_S * sample_rate_hz), sample_rate_hz))

    sweep, wide = f"a sweep from 1 to {usual_hz:.0f} Hz", f"a sweep from 1 to {fastest_hz:.0f} Hz"
    weight = (
        f"{1e3 * added:.0f} g strapped to the handle"
        if not model.rotational
        else f"a known inertia of {added:.2g} kg m^2 on the lever"
    )
    return (
        Experiment(f"{sweep} at {level:.3g}, the highest level so far", swept(level), "sweep"),
        Experiment(f"{sweep} at {level / 4:.3g}, a quarter of the highest level", swept(level / 4), "sweep"),
        Experiment(f"{sweep} at {level / 20:.3g}, a twentieth of the highest level", swept(level / 20), "sweep"),
        Experiment(f"{wide} at {level:.3g}", swept(level, fastest_hz), "sweep"),
        Experiment(f"a slow sinusoid of {slow_hz:g} Hz at {level:.3g}", slow(level), "slow"),
        Experiment(
            f"a slow sinusoid of {slow_hz:g} Hz at {level / 10:.3g}, so small that it hardly moves",
            slow(level / 10),
            "slow",
        ),
        Experiment(
            f"{wide} at {level:.3g} that lasts {LONG_S:g} s", swept(level, fastest_hz, LONG_S), "sweep", minutes=1.5
        ),
        Experiment(f"{sweep} at {level:.3g} with {weight}", swept(level), "sweep", added, minutes=3.0),
    )
