"""Compensation of discovered laws in a feedforward.

A discovered law is a formula that a diagnosis found because no effect of the catalogue explains the recordings. A law
of the force is cancelled along the planned motion: -law(x, v, a) is added to the command. A law of the command (a
static map g of a single command) is inverted: the command u with g(u) = intended force is sent. Laws of a sensor, and
laws with memory of the command, are not compensated; `explain_law_not_compensated` gives the reason.
"""

from collections.abc import Mapping
from itertools import chain, takewhile

import numpy as np

from equalizer.effects.discovered_law import DERIVATIVE_PREFIXES, derive_axis_letters
from equalizer.effects.law_entry import find_law_letter
from equalizer.laws.evaluate import evaluate
from equalizer.laws.law import Law
from equalizer.laws.parse import MEMORY_OPERATORS
from equalizer.laws.tree import Apply, Node, Number, Variable, format_formula, iterate_nodes
from equalizer.signals.signal import FloatArray
from equalizer.tracking.compensation.known_forces import ForceLaw
from equalizer.tracking.feedforward.planned_motion import PlannedMotion

TABLE_SIZE = 2001
"""Number of commands in the table by which a command map is inverted; also samples of the cycle in
`compute_describing_function`. Chosen."""
FIRST_RANGE_RATIO = 2.0
"""First range of that table, as a multiple of the largest intended force: enough for gains of 0.5 or more."""
_MOST_DOUBLINGS = 3
"""Largest number of times that the range is doubled where the map does not reach the intended force: enough for gains
down to 1/16. A map that needs more is near saturation, where its commands would reach the force cap and leave no
force for the compensation of other effects."""
_DEADBAND_TOLERANCE = 1e-9
"""Force, relative to the largest force of the table, below which a command counts as within a dead band."""
_TESTED_RANGES = tuple(10.0**decade for decade in range(-6, 5))
"""Ranges ± of commands, in the command's unit, within which a map is tested for monotonicity."""
EVALUATION_RATE_HZ = 1000.0
"""Sample rate (Hz) at which a law without memory is evaluated; the result does not depend on it."""
NOT_OF_MOTION_ALONE = (
    "it depends on a command, which its compensation would change, on the time or on a measured condition"
)
HAS_MEMORY = "it has memory of earlier commands, so no map of the present command inverts it"
NOT_OF_OWN_COMMAND_ALONE = "it is not a map of the command of its own axis alone"
NOT_INVERTIBLE = "the force does not rise with the command, so the map has no inverse"
SENSOR_ERROR = "it is an error of the sensor: a force against it would turn that error into a real motion of the handle"
"""Reasons why a law is not compensated, as clauses after "because"."""


def explain_law_not_compensated(law: Law, inputs: tuple[str, ...]) -> str:
    """Explain why a law is not compensated, as a clause after "because"; empty for a compensated law. inputs: channels
    of the commands."""
    motion_signals = {prefix + letter for letter in derive_axis_letters(inputs) for prefix in DERIVATIVE_PREFIXES}
    if law.acts_on == "response":
        return SENSOR_ERROR
    if law.acts_on == "force":
        return "" if set(law.variables) <= motion_signals else NOT_OF_MOTION_ALONE
    if any(isinstance(node, Apply) and node.name in MEMORY_OPERATORS for node in iterate_nodes(law.tree)):
        return HAS_MEMORY
    if len(law.variables) != 1 or law.variables[0] not in (f"f{find_law_letter(law, inputs)}", law.axis):
        return NOT_OF_OWN_COMMAND_ALONE
    tables = (_tabulate(law, command_range)[1] for command_range in _TESTED_RANGES)
    return "" if any(_is_rising(forces) and (np.diff(forces) > 0).any() for forces in tables) else NOT_INVERTIBLE


def compute_compensating_force(
    law: Law, axis_letters: tuple[str, ...], motion: PlannedMotion, rate_hz: float, slip_mps: float
) -> FloatArray:
    """Compute the force (N,), in the unit of the command, that is added to the command and cancels the force of the law
    along a motion. axis_letters: letters of the axes, in the order of the motion's columns; slip_mps: speed (m/s) below
    which a change of sign of a velocity is smoothed, because a force that jumps cannot be played; rate_hz: sample rate
    of the motion."""
    signals = {
        prefix + letter: motion_samples[:, axis]
        for axis, letter in enumerate(axis_letters)
        for prefix, motion_samples in zip(
            DERIVATIVE_PREFIXES, (motion.position, motion.velocity, motion.acceleration), strict=True
        )
    }
    return -evaluate(_smooth_signs(law, slip_mps), signals, rate_hz)


def make_single_axis_law(law: Law, axis_letters: tuple[str, ...], axis: int) -> ForceLaw:
    """Make a function of a sinusoid along a single axis, with the other axes at rest, from a law, for
    `compute_equivalent_impedance`. axis: index of the axis in `axis_letters`. The parameters are ignored: the law
    contains its own."""

    def compute_opposing_force(
        parameters: Mapping[str, float], x: FloatArray, v: FloatArray, slip_mps: float
    ) -> FloatArray:
        """Compute the force (N,) against the law for a sinusoidal position x (N,) and velocity v (N,), over two
        cycles."""
        # For a sinusoid, rms velocity over rms position is the angular frequency (rad/s).
        omega_rad_s = float(np.sqrt(np.mean(v**2) / np.mean(x**2)))
        zero_motion = np.zeros((len(x), len(axis_letters)))
        motion = PlannedMotion(zero_motion, zero_motion.copy(), zero_motion.copy())
        motion.position[:, axis], motion.velocity[:, axis], motion.acceleration[:, axis] = x, v, -(omega_rad_s**2) * x
        # `compute_equivalent_impedance` passes two cycles: the number of samples over the duration 2 (2 pi / omega) is
        # the sample rate (Hz).
        return compute_compensating_force(law, axis_letters, motion, len(x) / 2 * omega_rad_s / (2 * np.pi), slip_mps)

    return compute_opposing_force


def compute_describing_function(law: Law, amplitude: float) -> float:
    """Compute the describing function N(A) of a command map g for the command A sin(p): the gain of the fundamental,

        N(A) = 1 / (pi A) integral over 0 to 2 pi of g(A sin p) sin p dp

    amplitude: A, in the command's unit (Gelb and Vander Velde, Multiple-Input Describing Functions, 1968, chapter 2).
    """
    wave = np.sin(2 * np.pi * (np.arange(TABLE_SIZE) + 0.5) / TABLE_SIZE)
    force = evaluate(law, {law.variables[0]: amplitude * wave}, EVALUATION_RATE_HZ)
    return float(2 * np.mean(force * wave) / amplitude)


def invert_command_map(law: Law, intended_forces: FloatArray, slip_n: float) -> FloatArray:
    """Compute the commands (N,) that a command map turns into the intended forces (N,). slip_n: force below which the
    command crosses a dead band smoothly, because a command that jumps cannot be played; 0 if all intended
    forces are 0.

    By linear interpolation in a table, whose range is doubled until the map reaches all intended forces. Where the map
    does not reach them (saturation), the command is that of the nearest force in the first range. Raises ValueError
    where the map decreases or is not finite somewhere in the first range.
    """
    commands, forces = _tabulate_to(law, intended_forces)
    table_commands = np.interp(intended_forces, forces, commands)
    deadband_commands = commands[np.abs(forces) <= _DEADBAND_TOLERANCE * np.abs(forces).max()]
    if len(deadband_commands) < 2 or slip_n <= 0:
        return np.asarray(table_commands)
    # At zero force, the command is the value in the dead band nearest to zero; with rising force it approaches the edge
    # of the dead band.
    rest_command = float(np.clip(0.0, deadband_commands[0], deadband_commands[-1]))
    deadband_edge = np.where(intended_forces > 0, deadband_commands[-1], deadband_commands[0])
    outside_deadband = np.where(intended_forces == 0, 0.0, table_commands - deadband_edge)
    return np.asarray(
        rest_command + np.abs(deadband_edge - rest_command) * np.tanh(intended_forces / slip_n) + outside_deadband
    )


def _tabulate_to(law: Law, intended_forces: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Tabulate commands and forces, (TABLE_SIZE,) each, over the smallest of the doubled ranges in which the map
    reaches the intended forces; over the first range where it reaches them in none. Raises ValueError where the map
    decreases or is not finite in the first range."""
    first_range = FIRST_RANGE_RATIO * max(float(np.abs(intended_forces).max()), np.finfo(np.float64).tiny)
    tables = (_tabulate(law, first_range * 2**doubling) for doubling in range(_MOST_DOUBLINGS + 1))
    first_table = next(tables)
    if not _is_rising(first_table[1]):
        raise ValueError(
            f"the command map {law.text} decreases somewhere, so it has no inverse; leave it out of what is compensated"
        )
    for commands, forces in takewhile(lambda table: _is_rising(table[1]), chain((first_table,), tables)):
        if forces[0] <= intended_forces.min() and intended_forces.max() <= forces[-1]:
            return commands, forces
    return first_table


def _tabulate(law: Law, command_range: float) -> tuple[FloatArray, FloatArray]:
    """Tabulate commands from -command_range to command_range, and the forces into which the map turns them,
    (TABLE_SIZE,) each."""
    commands = np.linspace(-command_range, command_range, TABLE_SIZE)
    return commands, evaluate(law, {law.variables[0]: commands}, EVALUATION_RATE_HZ)


def _is_rising(forces: FloatArray) -> bool:
    """Whether forces (TABLE_SIZE,) are finite and never decrease."""
    return bool(np.isfinite(forces).all() and (np.diff(forces) >= 0).all())


def _smooth_signs(law: Law, slip_mps: float) -> Law:
    """Replace sign(v) in the law by tanh(v / slip_mps) for each velocity v, as in `known_forces`; unchanged where
    slip_mps is 0."""
    tree = _smooth_node(law.tree, slip_mps)
    return Law(format_formula(tree, None, None), law.numbers, law.units, law.acts_on, law.axis)


def _smooth_node(node: Node, slip_mps: float) -> Node:
    """Make the replacements of `_smooth_signs` in an expression tree."""
    match node:
        case Apply("sign", (Variable(name) as velocity,)) if name.startswith("v") and slip_mps > 0:
            return Apply("tanh", (Apply("/", (velocity, Number(slip_mps))),))
        case Apply(name, arguments):
            return Apply(name, tuple(_smooth_node(argument, slip_mps) for argument in arguments))
    return node
