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
from study.evaluation.challenge.concealed_effect import ConcealedEffect, replace_amplifier_cells
from study.evaluation.challenge.drive_plan import LEVELS_N

EFFECTS = (
    ConcealedEffect(
        "force_saturation", "actuator", True,
        lambda context: {"limit": LEVELS_N[-1] * (1.0 - context.interpolate_log(0.02, 0.7))},
        lambda device, axis, values: replace_amplifier_cells(device, axis, {FORCE_LIMIT: values["limit"]}),
    ),
    ConcealedEffect(
        "force_deadband", "actuator", True,
        lambda context: {"width": context.interpolate_log(0.003, 0.2)},
        lambda device, axis, values: replace_amplifier_cells(device, axis, {DEAD_BAND: values["width"]}),
    ),
    ConcealedEffect(
        "slew_limit", "actuator", False,
        lambda context: {"rate": context.interpolate_log(4000.0, 150.0)},
        lambda device, axis, values: replace_amplifier_cells(device, None, {SLEW_RATE: values["rate"]}),
    ),
    ConcealedEffect(
        "amplifier_lag", "actuator", False,
        lambda context: {"time_constant": context.interpolate_log(6e-5, 3e-3)},
        lambda device, axis, values: replace_amplifier_cells(device, None, {LAG_S: values["time_constant"]}),
    ),
    ConcealedEffect(
        "transport_delay", "actuator", False,
        lambda context: {"delay": context.interpolate_log(2e-5, 4e-3)},
        lambda device, axis, values: replace_amplifier_cells(device, None, {DELAY_S: values["delay"]}),
    ),
    ConcealedEffect(
        "force_gain", "actuator", True,
        lambda context: {"gain": 1.0 + context.draw_sign() * context.interpolate_log(0.005, 0.3)},
        lambda device, axis, values: replace_amplifier_cells(device, axis, {GAIN: values["gain"]}),
    ),
)  # fmt: skip
"""The effects of the actuator: name, place, whether it acts on one axis (else on all), functions that draw its
parameters and build it in."""
