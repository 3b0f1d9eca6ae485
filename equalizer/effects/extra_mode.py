"""Extra mode: an oscillator (mass, spring, damper) on the axis, where the model assumes a rigid part.

    q'' + 2 z w (q' - s') + w² (q - s) = 0,   F = -m q''        w = 2 pi f

s is the motion of the axis, q that of the attached mass m, f its natural frequency, z its damping ratio. The direction
of the oscillator may be tilted towards the other axes (`tilt_next`, `tilt_after_next`). An entry of
`equalizer.effects.catalogue`.
"""

import numpy as np

from equalizer.effects.effect import Effect, Parameter, Structure, Values
from equalizer.effects.starts.attached_oscillator import (
    AttachedOscillator,
    attach_oscillator,
    estimate_missing_force_spectra,
    find_likely_oscillators,
    subtract_oscillator,
)
from equalizer.effects.starts.evidence import Evidence
from equalizer.plant.linear_simulation import compute_driven_axes
from equalizer.plant.mechanical_model import MechanicalModel

LOWEST_NATURAL_HZ, MAX_MODES = 2.0, 2
"""Lowest natural frequency (Hz) that is tried, and largest number of modes for which starting values are returned.
Chosen, as are the grids below."""
DAMPING_RATIOS = (0.01, 0.04, 0.12)
"""Damping ratios of the coarse search."""
FREQUENCY_FACTORS, DAMPING_FACTORS = np.linspace(0.96, 1.04, 9), np.geomspace(0.4, 2.5, 5)
"""Factors of the finer search: natural frequencies and damping ratios relative to the best of the coarse search."""
TILT_NAMES = ("tilt_next", "tilt_after_next")
"""Parameter names: components of the oscillator's direction along the next two axes, relative to its own axis."""


def _attach_oscillator(model: MechanicalModel, axis: int, values: Values) -> MechanicalModel:
    """Attach the oscillator to the model along the direction of the axis, tilted towards the other axes; the
    direction is scaled to a unit vector in the coordinates. A missing tilt is 0."""
    axes, m = compute_driven_axes(model), model.inputs
    direction = axes[:, axis].copy()
    for offset, tilt_name in enumerate(TILT_NAMES[: m - 1], start=1):
        direction += values.get(tilt_name, 0.0) * axes[:, (axis + offset) % m]
    direction /= np.linalg.norm(direction)
    mass, natural_rad_s = values["mass"], 2 * np.pi * values["frequency"]
    return attach_oscillator(
        model, direction, mass, 2 * values["damping_ratio"] * mass * natural_rad_s, mass * natural_rad_s**2
    )


def _find_starting_values(evidence: Evidence, axis: int) -> tuple[Values, ...]:
    """Find up to `MAX_MODES` oscillators that explain most of the missing force, each by a coarse and a fine grid
    search over natural frequency (coarse: 90 values up to 0.4 of the sample rate, chosen) and damping ratio."""
    missing_force, starting_values = estimate_missing_force_spectra(evidence, axis), []
    natural_hz = np.geomspace(LOWEST_NATURAL_HZ, 0.4 * evidence.sample_rate_hz, 90).tolist()
    for _ in range(MAX_MODES):
        coarse_fits = find_likely_oscillators(missing_force, axis, natural_hz, DAMPING_RATIOS)[:1]
        for oscillator in coarse_fits:
            refined_fits = find_likely_oscillators(
                missing_force,
                axis,
                (oscillator.natural_hz * FREQUENCY_FACTORS).tolist(),
                (oscillator.damping_ratio * DAMPING_FACTORS).tolist(),
            )
            starting_values.append(_convert_to_parameters(refined_fits[0], axis, evidence.model.inputs))
            # The next mode is searched for in the missing force without this mode.
            missing_force = subtract_oscillator(missing_force, refined_fits[0])
    return tuple(starting_values)


def _convert_to_parameters(oscillator: AttachedOscillator, axis: int, m: int) -> Values:
    """Convert to the effect's parameters an oscillator that was fitted at an axis. m: number of driven axes; tilts
    towards axes beyond them are 0, the others limited to -1 to 1."""
    tilts = [float(np.clip(oscillator.by_axis[(axis + offset) % m], -1, 1)) if offset < m else 0.0 for offset in (1, 2)]
    # Along a direction (1, t1, t2) the axis itself bears only mass / (1 + t1² + t2²), which is what was fitted.
    mass = oscillator.mass * (1 + tilts[0] ** 2 + tilts[1] ** 2)
    values = {"frequency": oscillator.natural_hz, "mass": mass, "damping_ratio": oscillator.damping_ratio}
    return values | dict(zip(TILT_NAMES, tilts, strict=True))


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
    action=Structure(_attach_oscillator),
    starts=_find_starting_values,
)
