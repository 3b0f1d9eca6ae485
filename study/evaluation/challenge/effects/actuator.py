"""Actuator effects between command and force.

Saturation, dead band and gain act on one axis; slew limit, lag and delay on all. The dead band subtracts: a command
above `width` is reduced by `width`. The lag has one pole. Saturation is a hard limit.
"""

from study.evaluation.challenge.actuator_kernel import DEAD, DELAY_S, GAIN, LAG_S, LIMIT, RATE
from study.evaluation.challenge.concealed_effect import ConcealedEffect, EffectContext, Values, with_amplifier
from study.evaluation.challenge.device import Device
from study.evaluation.challenge.drive_plan import LEVELS_N


def _draw_saturation(at: EffectContext) -> dict[str, float]:
    return {"limit": LEVELS_N[-1] * (1.0 - at.log_between(0.02, 0.7))}


def _build_saturation(device: Device, axis: int, values: Values) -> Device:
    return with_amplifier(device, axis, {LIMIT: values["limit"]})


def _draw_deadband(at: EffectContext) -> dict[str, float]:
    return {"width": at.log_between(0.003, 0.2)}


def _build_deadband(device: Device, axis: int, values: Values) -> Device:
    return with_amplifier(device, axis, {DEAD: values["width"]})


def _draw_slew(at: EffectContext) -> dict[str, float]:
    return {"rate": at.log_between(4000.0, 150.0)}


def _build_slew(device: Device, axis: int, values: Values) -> Device:
    return with_amplifier(device, None, {RATE: values["rate"]})


def _draw_lag(at: EffectContext) -> dict[str, float]:
    return {"time_constant": at.log_between(6e-5, 3e-3)}


def _build_lag(device: Device, axis: int, values: Values) -> Device:
    return with_amplifier(device, None, {LAG_S: values["time_constant"]})


def _draw_delay(at: EffectContext) -> dict[str, float]:
    return {"delay": at.log_between(2e-5, 4e-3)}


def _build_delay(device: Device, axis: int, values: Values) -> Device:
    return with_amplifier(device, None, {DELAY_S: values["delay"]})


def _draw_gain(at: EffectContext) -> dict[str, float]:
    return {"gain": 1.0 + at.sign() * at.log_between(0.005, 0.3)}


def _build_gain(device: Device, axis: int, values: Values) -> Device:
    return with_amplifier(device, axis, {GAIN: values["gain"]})


EFFECTS = (
    ConcealedEffect("force_saturation", "actuator", True, _draw_saturation, _build_saturation),
    ConcealedEffect("force_deadband", "actuator", True, _draw_deadband, _build_deadband),
    ConcealedEffect("slew_limit", "actuator", False, _draw_slew, _build_slew),
    ConcealedEffect("amplifier_lag", "actuator", False, _draw_lag, _build_lag),
    ConcealedEffect("transport_delay", "actuator", False, _draw_delay, _build_delay),
    ConcealedEffect("force_gain", "actuator", True, _draw_gain, _build_gain),
)
"""Name, place, whether it belongs to one axis, draw of its parameters, and how it is built."""
