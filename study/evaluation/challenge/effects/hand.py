"""Concealed effects of a hand on the handle.

Hand impedance: mass (kg), damping (N s/m) and stiffness (N/m) to the ground along x, in other proportions along y and z
(factors `mass_y` and so on). At strength 1 they have the size of a light grip, at 0 a hundredth of it.
Time-varying grip: the damping between handle and ground is multiplied by 1 + depth sin(2 pi rate t + phase) on each
axis; whether the stiffness varies in the same way is drawn. All ranges were chosen by hand.
"""

from dataclasses import replace

import numpy as np

from equalizer.signals.signal import FloatArray
from study.evaluation.challenge.concealed_effect import ConcealedEffect, EffectContext, Values
from study.evaluation.challenge.device import Device
from study.evaluation.challenge.mechanism_kernel import DAMPING_DEPTH, MODULATION_HZ, PHASE, STIFFNESS_DEPTH


def _draw_hand(context: EffectContext) -> dict[str, float]:
    """Draw the impedance: at strength 1, along x, 0.04 to 0.09 kg, 2.5 to 6 N s/m and 100 to 300 N/m, log-uniform; the
    factors of y and z 0.3 to 1.2, uniform."""
    grip_strength = context.interpolate_log(0.01, 1.0)
    x_values = {
        "mass": grip_strength * context.draw_log_uniform(0.04, 0.09),
        "damping": grip_strength * context.draw_log_uniform(2.5, 6.0),
        "stiffness": grip_strength * context.draw_log_uniform(100.0, 300.0),
    }
    yz_factors = {f"{name}_{axis}": float(context.random.uniform(0.3, 1.2)) for name in x_values for axis in "yz"}
    return x_values | yz_factors


def _build_hand(device: Device, axis: int, values: Values) -> Device:
    """Add mass, damping and stiffness of the hand to the device on all axes; `axis` is not used."""

    def add_hand(name: str, bench_matrix: FloatArray) -> FloatArray:
        """Add the hand's diagonal matrix to a matrix (3, 3) of the bench."""
        return bench_matrix + values[name] * np.diag((1.0, values[f"{name}_y"], values[f"{name}_z"]))

    bench = replace(
        device.bench,
        mass=add_hand("mass", device.bench.mass),
        damping=add_hand("damping", device.bench.damping),
        stiffness=add_hand("stiffness", device.bench.stiffness),
    )
    return replace(device, bench=bench)


def _build_grip(device: Device, axis: int, values: Values) -> Device:
    """Modulate damping and, if drawn, stiffness of the device on all axes; `axis` is not used."""
    modulation = np.zeros((3, 5))
    modulation[:, MODULATION_HZ], modulation[:, PHASE] = values["rate_hz"], values["phase"]
    modulation[:, DAMPING_DEPTH] = values["depth"] * np.diag(device.bench.damping)
    modulation[:, STIFFNESS_DEPTH] = values["stiffness_share"] * values["depth"] * np.diag(device.bench.stiffness)
    return replace(device, modulation=modulation)


EFFECTS = (
    ConcealedEffect("hand_impedance", "hand", False, _draw_hand, _build_hand),
    ConcealedEffect(
        "time_varying_grip", "hand", False,
        lambda context: {
            "rate_hz": context.draw_log_uniform(0.03, 0.5),
            "depth": context.interpolate_log(0.02, 0.8),
            "phase": context.random.uniform(0, 2 * np.pi),
            "stiffness_share": float(context.random.integers(2)),
        },
        _build_grip,
    ),
)  # fmt: skip
"""The effects of the hand: name, place, whether it acts on one axis (else on all), functions that draw its parameters
and build it in."""
