"""Compensation of discovered laws in a feedforward: a force is subtracted along the planned motion, a monotone command
map is inverted."""

from collections.abc import Mapping

import numpy as np

from equalizer.laws.evaluate import evaluate
from equalizer.laws.law import Law
from equalizer.laws.parse import MEMORY
from equalizer.laws.tree import Apply, Node, Number, Variable, format_formula, nodes
from equalizer.signals.signal import FloatArray
from equalizer.tracking.compensation.known_forces import Law as ForceAgainst
from equalizer.tracking.feedforward.planned_motion import PlannedMotion

MOTION = ("", "v", "a")
TABLE, REACH = 2001, 2.0
"""Samples of a command map's table, and its range over the largest intended force."""
PLAYED = 1000.0
"""Sample rate (Hz) at which a law without memory is evaluated; any value gives the same result."""
COMMANDS = "it hangs on the command, which a compensation would change"
REMEMBERS = "it remembers what was commanded, so no command by itself undoes it"
SEVERAL = "it hangs on several commands or on the time"
FOLDED = "several commands give the same force, so it cannot be undone"
SENSED = "it is the sensor's: a force against it would make the handle do what the sensor gets wrong"


def reason_law_not_compensated(law: Law, letters: tuple[str, ...]) -> str:
    """Why a law is not compensated; empty for a law that is. letters: of the axes, in their order."""
    known = {prefix + letter for letter in letters for prefix in MOTION}
    if law.acts_on == "response":
        return SENSED
    if law.acts_on == "force":
        return "" if set(law.variables) <= known else COMMANDS
    if any(isinstance(node, Apply) and node.name in MEMORY for node in nodes(law.tree)):
        return REMEMBERS
    if len(law.variables) != 1 or law.variables[0] not in (f"f{law.axis[-1:]}", law.axis):
        return SEVERAL
    span = np.linspace(-1.0, 1.0, TABLE)
    values = evaluate(law, {law.variables[0]: span}, PLAYED)
    return "" if np.isfinite(values).all() and (np.diff(values) > 0).any() else FOLDED


def compute_compensating_force(
    law: Law, letters: tuple[str, ...], motion: PlannedMotion, rate_hz: float, slip: float
) -> FloatArray:
    """(N,): force to be added to the command to cancel the law's force. slip: the speed below which a change of sign is
    smoothed, m/s."""
    columns = {
        prefix + letter: column[:, axis]
        for axis, letter in enumerate(letters)
        for prefix, column in zip(MOTION, (motion.position, motion.velocity, motion.acceleration), strict=True)
    }
    return -evaluate(_smooth_signs(law, slip), columns, rate_hz)


def single_axis_law(law: Law, letters: tuple[str, ...], axis: int) -> ForceAgainst:
    """The law along a sinusoid of this axis while the others rest, as `equivalent_impedance` takes it."""

    def against(parameters: Mapping[str, float], x: FloatArray, v: FloatArray, slip: float) -> FloatArray:
        wave = float(np.sqrt(np.mean(v**2) / np.mean(x**2)))
        still = np.zeros((len(x), len(letters)))
        motion = PlannedMotion(still, still.copy(), still.copy())
        motion.position[:, axis], motion.velocity[:, axis], motion.acceleration[:, axis] = x, v, -(wave**2) * x
        # The samples are two cycles, so that memory has settled in the second.
        return compute_compensating_force(law, letters, motion, len(x) / 2 * wave / (2 * np.pi), slip)

    return against


def linear_share(law: Law, amplitude: float) -> float:
    """Describing function of a command map: share of a sinusoid's fundamental that passes."""
    wave = np.sin(2 * np.pi * (np.arange(TABLE) + 0.5) / TABLE)
    passed = evaluate(law, {law.variables[0]: amplitude * wave}, PLAYED)
    return float(2 * np.mean(passed * wave) / amplitude)


def invert_command_map(law: Law, meant: FloatArray) -> FloatArray:
    """(N,): commands that the map turns into the intended forces (N,); the nearest where none does. Raises ValueError
    where the map is not monotone there."""
    span = REACH * max(float(np.abs(meant).max()), np.finfo(np.float64).tiny)
    commands = np.linspace(-span, span, TABLE)
    forces = evaluate(law, {law.variables[0]: commands}, PLAYED)
    if not (np.isfinite(forces).all() and (np.diff(forces) >= 0).all()):
        raise ValueError(
            f"the command map {law.text} goes up and down, so it cannot be undone; leave it out of what is compensated"
        )
    return np.asarray(np.interp(meant, forces, commands))


def _smooth_signs(law: Law, slip: float) -> Law:
    """Replace signs of velocities by tanh over `slip`, as for friction."""
    tree = _smooth_node(law.tree, slip)
    return Law(format_formula(tree, None, None), law.numbers, law.units, law.acts_on, law.axis)


def _smooth_node(node: Node, slip: float) -> Node:
    match node:
        case Apply("sign", (Variable(name) as velocity,)) if name.startswith("v") and slip > 0:
            return Apply("tanh", (Apply("/", (velocity, Number(slip))),))
        case Apply(name, parts):
            return Apply(name, tuple(_smooth_node(part, slip) for part in parts))
    return node
