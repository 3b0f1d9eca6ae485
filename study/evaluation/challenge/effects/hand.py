"""Concealed effects of a hand on the handle.

Hand impedance: mass (kg), damping (N s/m) and stiffness (N/m) to the ground along x, in other proportions along y and z
(factors `mass_y` and so on). At strength 1 they have the size of a light grip, at 0 a hundredth of it.
Time-varying grip: the damping between handle and ground is multiplied by 1 + depth sin(2 pi rate t + phase); whether
the stiffness varies in the same way is drawn.
"""

from dataclasses import replace

import numpy as np

from equalizer.signals.signal import FloatArray
from study.evaluation.challenge.concealed_effect import ConcealedEffect, EffectContext, Values
from study.evaluation.challenge.device import Device
from study.evaluation.challenge.mechanism_kernel import DAMPING_DEPTH, RATE, STIFFNESS_DEPTH, TURN


def _draw_hand(at: EffectContext) -> dict[str, float]:
    """Along x at strength 1: 0.04 to 0.09 kg, 2.5 to 6 N s/m, 100 to 300 N/m, log-uniform."""
    tight = at.log_between(0.01, 1.0)
    drawn = {
        "mass": tight * at.draw_log_uniform(0.04, 0.09),
        "damping": tight * at.draw_log_uniform(2.5, 6.0),
        "stiffness": tight * at.draw_log_uniform(100.0, 300.0),
    }
    parts = {f"{name}_{axis}": float(at.random.uniform(0.3, 1.2)) for name in drawn for axis in "yz"}
    return drawn | parts


def _build_hand(device: Device, axis: int, values: Values) -> Device:
    def on_handle(name: str, ground: FloatArray) -> FloatArray:
        """Matrix (3, 3) of the bench plus the hand's diagonal matrix."""
        return ground + values[name] * np.diag((1.0, values[f"{name}_y"], values[f"{name}_z"]))

    bench = replace(
        device.bench,
        mass=on_handle("mass", device.bench.mass),
        damping=on_handle("damping", device.bench.damping),
        stiffness=on_handle("stiffness", device.bench.stiffness),
    )
    return replace(device, bench=bench)


def _draw_grip(at: EffectContext) -> dict[str, float]:
    """Rate (Hz), depth 0.02 to 0.8, phase (rad); stiffness_share: 0 or 1, whether the stiffness varies too."""
    return {
        "rate_hz": at.draw_log_uniform(0.03, 0.5),
        "depth": at.log_between(0.02, 0.8),
        "phase": at.random.uniform(0, 2 * np.pi),
        "stiffness_share": float(at.random.integers(2)),
    }


def _build_grip(device: Device, axis: int, values: Values) -> Device:
    varying = np.zeros((3, 5))
    varying[:, RATE], varying[:, TURN] = values["rate_hz"], values["phase"]
    varying[:, DAMPING_DEPTH] = values["depth"] * np.diag(device.bench.damping)
    varying[:, STIFFNESS_DEPTH] = values["stiffness_share"] * values["depth"] * np.diag(device.bench.stiffness)
    return replace(device, varying=varying)


EFFECTS = (
    ConcealedEffect("hand_impedance", "hand", False, _draw_hand, _build_hand),
    ConcealedEffect("time_varying_grip", "hand", False, _draw_grip, _build_grip),
)
"""Each: name, place, whether it acts on one axis (else on all), how its parameters are drawn, how it is built."""
