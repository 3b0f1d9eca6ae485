"""Dead band of an actuator: no force for small commands; larger ones are reduced by its width, or start with a jump.

    F = 0 where |u| <= width,  else F = u - (1 - jump) width sgn(u)        u, F, width in N; jump from 0 to 1

With jump = 1 the force equals the command beyond the band; with jump = 0 it grows from zero there. An entry of
`equalizer.effects.catalogue`.
"""

import numpy as np

from equalizer.effects.effect import Effect, OnCommand, Parameter, Values
from equalizer.effects.starts.command_starts import find_command_parameter, make_force_level_grid
from equalizer.effects.starts.evidence import Evidence
from equalizer.signals.signal import FloatArray


def _apply_deadband(commands: FloatArray, step_s: float, values: Values) -> FloatArray:
    """Compute the force (n,) for commands (n,), both in N. A missing jump is 0."""
    width = values["width"]
    jump = values.get("jump", 0.0) * width * np.sign(commands) * (np.abs(commands) > width)
    return np.asarray(commands - np.clip(commands, -width, width) + jump)


def _find_starting_values(evidence: Evidence, axis: int) -> tuple[Values, ...]:
    """Find the likeliest width without a jump (0) and with a full one (1), each by search over a grid of widths from
    0.1 % to 99.5 % of the strongest command; a jump for which no width explains enough of the missing force is left
    out."""
    force_levels = make_force_level_grid(evidence, axis)
    widths = [force_levels[0] / 30, force_levels[0] / 10, force_levels[0] / 3, *force_levels] if force_levels else []
    starting_values = []
    for jump in (0.0, 1.0):

        def apply_trial_deadband(commands: FloatArray, step_s: float, width: float, jump: float = jump) -> FloatArray:
            """Compute the force (n,) for a trial width in N."""
            return _apply_deadband(commands, step_s, {"width": width, "jump": jump})

        width = find_command_parameter(evidence, axis, apply_trial_deadband, widths, True)
        starting_values += [] if width is None else [{"width": width, "jump": jump}]
    return tuple(starting_values)


def _remove_jump(values: Values) -> tuple[Values, ...]:
    """Convert to the dead band without a jump that gives the same force beyond the band: the two differ only for
    commands between both widths. Empty for a jump of 0 or 1."""
    jump = values.get("jump", 0.0)
    return ({"width": values["width"] * (1 - jump), "jump": 0.0},) if 0.0 < jump < 1.0 else ()


EFFECT = Effect(
    name="force_deadband",
    equation="F = 0 where |u| <= width, else u - (1 - jump) width sgn(u)",
    source="Tao and Kokotovic, IEEE Trans. Autom. Control 39 (1994) 59: dead zones of actuators",
    signature="the missing force flips its sign with the command, not with the motion, and does not grow with it; its "
    "odd harmonics fall as the level rises",
    parameters=(
        Parameter("width", 1e-6, 1e4, none=0.0),
        Parameter("jump", 0.0, 1.0, none=None, scale="linear", step=0.05),
    ),
    action=OnCommand(_apply_deadband),
    starts=_find_starting_values,
    sites=("one", "all"),
    near_equivalents=_remove_jump,
)
