"""What happens to the force on its way from the command.

Saturation, dead band and gain sit on one axis; slew limit, lag and delay in all. The dead band subtracts: a command of
more than `width` comes through less by `width`. The lag is one pole. Saturation is a hard limit.
"""

from study.evaluation.challenge.actuator_kernel import DEAD, DELAY_S, GAIN, LAG_S, LIMIT, RATE
from study.evaluation.challenge.device import Device
from study.evaluation.challenge.drive_plan import LEVELS_N
from study.evaluation.challenge.hidden import Circumstances, HiddenEffect, Values, with_amplifier


def _draw_saturation(at: Circumstances) -> dict[str, float]:
    return {"limit": LEVELS_N[-1] * (1.0 - at.between(0.02, 0.7))}


def _saturation(device: Device, axis: int, values: Values) -> Device:
    return with_amplifier(device, axis, {LIMIT: values["limit"]})


def _draw_deadband(at: Circumstances) -> dict[str, float]:
    return {"width": at.between(0.003, 0.2)}


def _deadband(device: Device, axis: int, values: Values) -> Device:
    return with_amplifier(device, axis, {DEAD: values["width"]})


def _draw_slew(at: Circumstances) -> dict[str, float]:
    return {"rate": at.between(4000.0, 150.0)}


def _slew(device: Device, axis: int, values: Values) -> Device:
    return with_amplifier(device, None, {RATE: values["rate"]})


def _draw_lag(at: Circumstances) -> dict[str, float]:
    return {"time_constant": at.between(6e-5, 3e-3)}


def _lag(device: Device, axis: int, values: Values) -> Device:
    return with_amplifier(device, None, {LAG_S: values["time_constant"]})


def _draw_delay(at: Circumstances) -> dict[str, float]:
    return {"delay": at.between(2e-5, 4e-3)}


def _delay(device: Device, axis: int, values: Values) -> Device:
    return with_amplifier(device, None, {DELAY_S: values["delay"]})


def _draw_gain(at: Circumstances) -> dict[str, float]:
    return {"gain": 1.0 + at.sign() * at.between(0.005, 0.3)}


def _gain(device: Device, axis: int, values: Values) -> Device:
    return with_amplifier(device, axis, {GAIN: values["gain"]})


EFFECTS = (
    HiddenEffect("force_saturation", "actuator", True, _draw_saturation, _saturation),
    HiddenEffect("force_deadband", "actuator", True, _draw_deadband, _deadband),
    HiddenEffect("slew_limit", "actuator", False, _draw_slew, _slew),
    HiddenEffect("amplifier_lag", "actuator", False, _draw_lag, _lag),
    HiddenEffect("transport_delay", "actuator", False, _draw_delay, _delay),
    HiddenEffect("force_gain", "actuator", True, _draw_gain, _gain),
)
