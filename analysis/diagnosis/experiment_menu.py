"""Recordings that a laboratory could make next, as commands to play on paper first."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from equalizer.plant.linear_simulation import driven_axes
from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.excitation import faded, log_sweep, sine
from equalizer.signals.signal import FloatArray

LENGTH_S = 8.0
ADDED_SHARE = 0.12
"""Of the grounded mass: a weight that is known and strapped on."""
_FADE_S = 0.5


@dataclass(frozen=True, slots=True, eq=False)
class Experiment:
    words: str
    """What to record; ends the sentence "record …"."""
    commands: FloatArray
    """(n, m)"""
    change: Callable[[MechanicalModel], MechanicalModel] | None = None
    """What is done to the device beforehand."""
    minutes: float = 1.0
    """What it costs."""


def experiment_menu(model: MechanicalModel, sample_rate_hz: float, axis: int, level: float) -> tuple[Experiment, ...]:
    """axis: where the rivals sit. level: the highest that was recorded; nothing louder is proposed."""
    n, m = int(LENGTH_S * sample_rate_hz), model.inputs
    highest_hz = min(240.0, 0.24 * sample_rate_hz)
    # Half a period and four: slow and fast, in shares of the band that a record of this length can hold.
    slow_hz = 4.0 / LENGTH_S

    def along(wave: FloatArray) -> FloatArray:
        commands = np.zeros((n, m))
        commands[:, axis] = faded(wave, int(_FADE_S * sample_rate_hz), int(_FADE_S * sample_rate_hz))
        return commands

    def swept(of: float) -> FloatArray:
        return along(log_sweep(1.0, highest_hz, of, n, sample_rate_hz))

    def slow(of: float) -> FloatArray:
        return along(sine(slow_hz, of, n, sample_rate_hz))

    mass = ADDED_SHARE * float(np.diagonal(driven_axes(model).T @ model.mass @ driven_axes(model)).mean())
    sweep = f"a sweep from 1 to {highest_hz:.0f} Hz"
    return (
        Experiment(f"{sweep} at {level:.3g}, the highest level so far", swept(level)),
        Experiment(f"{sweep} at {level / 4:.3g}, a quarter of the highest level", swept(level / 4)),
        Experiment(f"{sweep} at {level / 20:.3g}, a twentieth of the highest level", swept(level / 20)),
        Experiment(f"a slow sinusoid of {slow_hz:g} Hz at {level:.3g}", slow(level)),
        Experiment(
            f"a slow sinusoid of {slow_hz:g} Hz at {level / 10:.3g}, so small that it hardly moves", slow(level / 10)
        ),
        Experiment(
            f"{sweep} at {level:.3g} with {1e3 * mass:.0f} g strapped to the handle"
            if not model.rotational
            else f"{sweep} at {level:.3g} with a known inertia of {mass:.2g} kg m^2 on the lever",
            swept(level),
            lambda bare: heavier(bare, mass),
            minutes=3.0,
        ),
    )


def heavier(model: MechanicalModel, added: float) -> MechanicalModel:
    """With as much more mass (or inertia) along every driven axis."""
    axes = driven_axes(model)
    return replace(model, mass=model.mass + added * axes @ axes.T)
