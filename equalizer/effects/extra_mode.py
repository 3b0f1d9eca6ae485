"""Extra mode: a lightly damped oscillator on the axis, where the model assumes a rigid part.

    q'' + 2 z w (q' - s') + w² (q - s) = 0,   F = -m q''        w = 2 pi f

s is the motion of the axis, q that of the attached mass m, f its natural frequency, z its damping ratio. The direction
of the oscillator may be tilted towards the other axes (`tilt_next`, `tilt_after_next`).
"""

import numpy as np

from equalizer.effects.effect import Effect, Parameter, Structure, Values
from equalizer.effects.starts.attached_oscillator import (
    AttachedOscillator,
    likely_oscillators,
    missing_force_spectra,
    subtract_oscillator,
    with_oscillator,
)
from equalizer.effects.starts.evidence import Evidence
from equalizer.plant.linear_simulation import compute_driven_axes
from equalizer.plant.mechanical_model import MechanicalModel

LOWEST_HZ, STARTS = 2.0, 2
"""Lowest natural frequency (Hz) that is tried, and largest number of modes for which starting values are returned."""
RATIOS = (0.01, 0.04, 0.12)
"""Damping ratios of the coarse search."""
FINE_FREQUENCIES, FINE_DAMPING = np.linspace(0.96, 1.04, 9), np.geomspace(0.4, 2.5, 5)
"""Factors of the finer search: natural frequencies and damping ratios relative to the best of the coarse search."""
TILTS = ("tilt_next", "tilt_after_next")
"""Parameter names: components of the oscillator's direction along the next two axes, relative to its own axis."""


def _change(model: MechanicalModel, axis: int, values: Values) -> MechanicalModel:
    """The model with the oscillator attached along the tilted direction, a unit vector in the coordinates."""
    axes, m = compute_driven_axes(model), model.inputs
    direction = axes[:, axis].copy()
    for offset, tilt in enumerate(TILTS[: m - 1], start=1):
        direction += values.get(tilt, 0.0) * axes[:, (axis + offset) % m]
    direction /= np.linalg.norm(direction)
    mass, natural_rad_s = values["mass"], 2 * np.pi * values["frequency"]
    return with_oscillator(
        model, direction, mass, 2 * values["damping_ratio"] * mass * natural_rad_s, mass * natural_rad_s**2
    )


def _starts(evidence: Evidence, axis: int) -> tuple[Values, ...]:
    """Oscillators that explain most of the missing force, by a coarse and a fine grid search each."""
    missing, starts = missing_force_spectra(evidence, axis), []
    natural_hz = np.geomspace(LOWEST_HZ, 0.4 * evidence.sample_rate_hz, 90).tolist()
    for _ in range(STARTS):
        coarse = likely_oscillators(missing, axis, natural_hz, RATIOS)[:1]
        for oscillator in coarse:
            refined = likely_oscillators(
                missing,
                axis,
                (oscillator.natural_hz * FINE_FREQUENCIES).tolist(),
                (oscillator.damping_ratio * FINE_DAMPING).tolist(),
            )
            starts.append(_mode_values(refined[0], axis, evidence.model.inputs))
            # The next mode is searched for in the missing force without this mode.
            missing = subtract_oscillator(missing, refined[0])
    return tuple(starts)


def _mode_values(oscillator: AttachedOscillator, axis: int, m: int) -> Values:
    """Parameters of an oscillator that was fitted at an axis. m: number of driven axes."""
    tilts = [float(np.clip(oscillator.by_axis[(axis + offset) % m], -1, 1)) if offset < m else 0.0 for offset in (1, 2)]
    # Along a direction (1, t1, t2) the own axis feels only mass / (1 + t1² + t2²), which is what was fitted.
    mass = oscillator.mass * (1 + tilts[0] ** 2 + tilts[1] ** 2)
    values = {"frequency": oscillator.natural_hz, "mass": mass, "damping_ratio": oscillator.damping_ratio}
    return values | dict(zip(TILTS, tilts, strict=True))


EFFECT = Effect(
    name="extra_mode",
    equation="q'' + 2 damping_ratio w (q' - s') + w^2 (q - s) = 0, F = -mass q'', w = 2 pi frequency, s the axis",
    source="Den Hartog, Mechanical Vibrations, chapter 3",
    signature="the missing force over the acceleration has a resonance at one frequency, at every level; nothing "
    "appears at silent lines",
    parameters=(
        Parameter("frequency", 1e-3, 1e6, none=None, step=0.003),
        Parameter("mass", 1e-9, 1e6, none=0.0),
        Parameter("damping_ratio", 1e-4, 0.7, none=None, step=0.03),
        Parameter("tilt_next", -1.0, 1.0, none=None, scale="linear", step=0.02),
        Parameter("tilt_after_next", -1.0, 1.0, none=None, scale="linear", step=0.02),
    ),
    action=Structure(_change),
    starts=_starts,
)
