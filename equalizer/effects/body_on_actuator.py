"""Well-damped oscillator on the actuator: a body on a soft support, such as a finger, a case or a wrist.

A body of mass m and position q is coupled to the axis (position x, velocity v) by a damper c and a spring k:
F = -(c (v - q') + k (x - q)), m q'' = -F. It adds a coordinate to the model. `extra_mode` is the lightly damped case.
"""

import numpy as np

from equalizer.effects.effect import Effect, Parameter, Structure, Values
from equalizer.effects.starts.attached_oscillator import (
    attach_oscillator,
    estimate_missing_force_spectra,
    find_likely_oscillators,
)
from equalizer.effects.starts.evidence import Evidence
from equalizer.plant.linear_simulation import compute_driven_axes
from equalizer.plant.mechanical_model import MechanicalModel

DAMPING_RATIOS = (0.1, 0.3, 0.8, 2.0)
"""Damping ratios that are tried for starting values, from light to overdamped. Chosen."""


def _add_body(model: MechanicalModel, axis: int, values: Values) -> MechanicalModel:
    """Attach the body with its damper and its spring to a driven axis of the model."""
    direction = compute_driven_axes(model)[:, axis]
    return attach_oscillator(model, direction, values["mass"], values["damping"], values["stiffness"])


def _find_starting_values(evidence: Evidence, axis: int) -> tuple[Values, ...]:
    """Find starting values from at most two oscillators that explain most of the missing force, tried at 50 natural
    frequencies from 2 Hz to 0.4 of the sample rate (chosen): k = m w², c = 2 ratio m w, w = 2 pi natural_hz."""
    missing_spectra = estimate_missing_force_spectra(evidence, axis)
    natural_hz = np.geomspace(2.0, 0.4 * evidence.sample_rate_hz, 50).tolist()
    starting_values = []
    for oscillator in find_likely_oscillators(missing_spectra, axis, natural_hz, DAMPING_RATIOS)[:2]:
        natural_rad_s = 2 * np.pi * oscillator.natural_hz
        damping, stiffness = (
            2 * oscillator.damping_ratio * oscillator.mass * natural_rad_s,
            oscillator.mass * natural_rad_s**2,
        )
        starting_values.append({"mass": oscillator.mass, "damping": damping, "stiffness": stiffness})
    return tuple(starting_values)


EFFECT = Effect(
    name="body_on_actuator",
    equation="F = -(damping (v - q') + stiffness (x - q)), mass q'' = -F",
    source="Den Hartog, Mechanical Vibrations, chapter 3; well damped",
    signature="the device is heavier than the model at low frequencies and not at high ones, at every level; nothing "
    "appears at silent lines",
    parameters=(
        Parameter("mass", 1e-9, 1e6, none=0.0),
        Parameter("damping", 1e-9, 1e6, none=None, step=0.03),
        Parameter("stiffness", 1e-6, 1e12, none=None, step=0.03),
    ),
    action=Structure(_add_body),
    starts=_find_starting_values,
    # An extra mode is the special case of one axis and light damping.
    simpler=("extra_mode",),
)
