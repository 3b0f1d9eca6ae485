"""Concealed effects of the actuator, between the commanded force u and the exerted force F (N).

    saturation   F = clip(u, -limit, limit)                            one axis      limit in N
    dead band    F = u - width sign(u) where |u| > width, else 0       one axis      width in N
    gain         F = gain u                                            one axis      1
    slew limit   |dF/dt| <= rate                                       all axes      rate in N/s
    lag          time_constant dF/dt + F = u                           all axes      time_constant in s
    delay        F(t) = u(t - delay)                                   all axes      delay in s

Each range goes from an effect that hardly shows in the recordings of the challenge to a gross fault; the strength (0 to
1) interpolates geometrically. The ranges were chosen by hand for commands with peaks of 0.5 to 3 N (`LEVELS_N`).
`actuator_kernel.drive_actuators` computes the force.
"""

from study.evaluation.challenge.actuator_kernel import DEAD_BAND, DELAY_S, FORCE_LIMIT, GAIN, LAG_S, SLEW_RATE
from study.evaluation.challenge.concealed_effect import ConcealedEffect, EffectContext, Values, replace_amplifier_cells
from study.evaluation.challenge.device import Device
from study.evaluation.challenge.drive_plan import LEVELS_N


def _draw_saturation(context: EffectContext) -> dict[str, float]:
    """Draw the limit (N) that cuts 2 % to 70 % off the largest of `LEVELS_N`."""
    return {"limit": LEVELS_N[-1] * (1.0 - context.interpolate_log(0.02, 0.7))}


def _build_saturation(device: Device, axis: int, values: Values) -> Device:
    """Build in the saturation of the force at an axis."""
    return replace_amplifier_cells(device, axis, {FORCE_LIMIT: values["limit"]})


def _draw_deadband(context: EffectContext) -> dict[str, float]:
    """Draw the half width (N) of the dead band, 0.003 to 0.2."""
    return {"width": context.interpolate_log(0.003, 0.2)}


def _build_deadband(device: Device, axis: int, values: Values) -> Device:
    """Build in the dead band of the command at an axis."""
    return replace_amplifier_cells(device, axis, {DEAD_BAND: values["width"]})


def _draw_slew(context: EffectContext) -> dict[str, float]:
    """Draw the slew rate (N/s), 4000 (weakest) down to 150."""
    return {"rate": context.interpolate_log(4000.0, 150.0)}


def _build_slew(device: Device, axis: int, values: Values) -> Device:
    """Build in the slew limit at all axes; `axis` is not used."""
    return replace_amplifier_cells(device, None, {SLEW_RATE: values["rate"]})


def _draw_lag(context: EffectContext) -> dict[str, float]:
    """Draw the time constant (s), 0.06 ms to 3 ms."""
    return {"time_constant": context.interpolate_log(6e-5, 3e-3)}


def _build_lag(device: Device, axis: int, values: Values) -> Device:
    """Build in the lag at all axes; `axis` is not used."""
    return replace_amplifier_cells(device, None, {LAG_S: values["time_constant"]})


def _draw_delay(context: EffectContext) -> dict[str, float]:
    """Draw the delay (s), 0.02 ms to 4 ms."""
    return {"delay": context.interpolate_log(2e-5, 4e-3)}


def _build_delay(device: Device, axis: int, values: Values) -> Device:
    """Build in the delay at all axes; `axis` is not used."""
    return replace_amplifier_cells(device, None, {DELAY_S: values["delay"]})


def _draw_gain(context: EffectContext) -> dict[str, float]:
    """Draw the gain: 0.995 (weakest) to 0.7, or 1.005 to 1.3, with equal probability."""
    return {"gain": 1.0 + context.draw_sign() * context.interpolate_log(0.005, 0.3)}


def _build_gain(device: Device, axis: int, values: Values) -> Device:
    """Build in the gain at an axis."""
    return replace_amplifier_cells(device, axis, {GAIN: values["gain"]})


EFFECTS = (
    ConcealedEffect("force_saturation", "actuator", True, _draw_saturation, _build_saturation),
    ConcealedEffect("force_deadband", "actuator", True, _draw_deadband, _build_deadband),
    ConcealedEffect("slew_limit", "actuator", False, _draw_slew, _build_slew),
    ConcealedEffect("amplifier_lag", "actuator", False, _draw_lag, _build_lag),
    ConcealedEffect("transport_delay", "actuator", False, _draw_delay, _build_delay),
    ConcealedEffect("force_gain", "actuator", True, _draw_gain, _build_gain),
)
"""The effects of the actuator: name, place, whether it acts on one axis (else on all), functions that draw its
parameters and build it in."""
