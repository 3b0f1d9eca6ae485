"""Small nuisance effects of the simulated devices of the challenge, as real devices have them and models do not.

A device gets four, drawn from seven; the labels of the cases do not name them. A diagnosis must not report them, nor be
misled by them. At factor 1 they change the readings by about a tenth of the noise; the factor scales each size. The
sizes in the functions below are those at factor 1, drawn uniformly; their ranges were chosen by hand.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from study.evaluation.challenge.concealed_effect import replace_cells, replace_sensor
from study.evaluation.challenge.device import Device
from study.evaluation.challenge.friction_kernel import BRISTLE_STIFFNESS, LEVEL_NEGATIVE, LEVEL_POSITIVE
from study.evaluation.challenge.handle_force_kernel import (
    COGGING_AMPLITUDE,
    COGGING_PHASE,
    COGGING_PITCH,
    CUBIC_STIFFNESS,
    QUADRATIC_DAMPING,
)

NuisanceEffect = Callable[[Device, float, np.random.Generator], Device]
"""effect(device, factor, random): the device with this effect added, of a random size times the factor."""
EFFECTS_PER_DEVICE = 4
"""Number of nuisance effects per device. Chosen by hand."""


def add_nuisance_effects(device: Device, factor: float, seed: int) -> Device:
    """Add `EFFECTS_PER_DEVICE` different nuisance effects to a device, their sizes times `factor`; returns the new
    device. The same seed gives the same effects; with factor 0 the device is unchanged."""
    if factor == 0.0:
        return device
    # 977, an arbitrary fixed number, makes this random sequence independent of the others of the same seed.
    random = np.random.default_rng([seed, 977])
    for index in random.choice(len(NUISANCE_EFFECTS), EFFECTS_PER_DEVICE, replace=False):
        device = NUISANCE_EFFECTS[index](device, factor, random)
    return device


def _add_dry_friction(device: Device, factor: float, random: np.random.Generator) -> Device:
    """Set dry friction of 25 to 100 µN per axis, the same in both directions, with a bristle of 3e5 N/m (not scaled by
    factor)."""
    friction_n = factor * random.uniform(0.25e-4, 1e-4, 3)
    cells = {BRISTLE_STIFFNESS: np.full(3, 3e5), LEVEL_POSITIVE: friction_n, LEVEL_NEGATIVE: friction_n}
    return replace(device, friction=replace_cells(device.friction, slice(None), cells))


def _add_cogging(device: Device, factor: float, random: np.random.Generator) -> Device:
    """Set a cogging force of 50 to 200 µN per axis, with a pitch of 0.7 to 3 mm and any phase (both not scaled
    by factor)."""
    column_values = {
        COGGING_AMPLITUDE: factor * random.uniform(0.5e-4, 2e-4, 3),
        COGGING_PITCH: random.uniform(7e-4, 3e-3, 3),
        COGGING_PHASE: random.uniform(0.0, 2 * np.pi, 3),
    }
    return replace(device, forces=replace_cells(device.forces, slice(None), column_values))


def _add_cubic_stiffness(device: Device, factor: float, random: np.random.Generator) -> Device:
    """Set a cubic stiffness of up to 40 N/m³ of either sign per axis (hardening or softening)."""
    cells = {CUBIC_STIFFNESS: factor * random.uniform(-40.0, 40.0, 3)}
    return replace(device, forces=replace_cells(device.forces, slice(None), cells))


def _add_quadratic_damping(device: Device, factor: float, random: np.random.Generator) -> Device:
    """Set a quadratic damping of 0 to 0.004 N s²/m² per axis."""
    cells = {QUADRATIC_DAMPING: factor * random.uniform(0.0, 0.004, 3)}
    return replace(device, forces=replace_cells(device.forces, slice(None), cells))


def _shift_mode_frequencies(device: Device, factor: float, random: np.random.Generator) -> Device:
    """Change the frequency of each structural mode by up to 0.04 %, up or down."""
    oscillators = device.bench.oscillators
    frequency_ratios = 1.0 + factor * random.uniform(-4e-4, 4e-4, oscillators.frequency_hz.shape)
    return replace(
        device,
        bench=replace(
            device.bench, oscillators=replace(oscillators, frequency_hz=frequency_ratios * oscillators.frequency_hz)
        ),
    )


def _add_cross_axis_sensitivity(device: Device, factor: float, random: np.random.Generator) -> Device:
    """Add a cross-axis sensitivity of the accelerometer of up to 0.3 %, of either sign."""
    sensitivity_matrix = device.sensor.orientation + factor * random.uniform(-3e-3, 3e-3, (3, 3)) * (1.0 - np.eye(3))
    return replace_sensor(device, {"orientation": sensitivity_matrix})


def _add_hum(device: Device, factor: float, random: np.random.Generator) -> Device:
    """Set the mains hum in the acceleration: sine and cosine amplitudes of up to 0.004 m/s² per channel."""
    return replace_sensor(device, {"hum_mps2": factor * random.uniform(-0.004, 0.004, (2, 3))})


NUISANCE_EFFECTS: tuple[NuisanceEffect, ...] = (
    _add_dry_friction,
    _add_cogging,
    _add_cubic_stiffness,
    _add_quadratic_damping,
    _shift_mode_frequencies,
    _add_cross_axis_sensitivity,
    _add_hum,
)
"""All nuisance effects, of which `EFFECTS_PER_DEVICE` are drawn. The order matters: the seed draws indices."""
