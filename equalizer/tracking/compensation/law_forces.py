"""What a feedforward can do about a law without a name: a force is taken off along the planned motion, a command map
that is one to one is inverted."""

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
"""Places at which a command map is known, over so many times the largest force that is meant."""
PLAYED = 1000.0
"""Stands for the rate of a law that remembers nothing, Hz."""
COMMANDS = "it hangs on the command, which a compensation would change"
REMEMBERS = "it remembers what was commanded, so no command by itself undoes it"
SEVERAL = "it hangs on several commands or on the time"
FOLDED = "several commands give the same force, so it cannot be undone"
SENSED = "it is the sensor's: a force against it would make the handle do what the sensor gets wrong"


def why_law_stays(law: Law, letters: tuple[str, ...]) -> str:
    """Empty for a law that is compensated. letters: of the axes, in their order."""
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


def force_against(law: Law, letters: tuple[str, ...], motion: PlannedMotion, rate_hz: float, slip: float) -> FloatArray:
    """(N,): what must be added to the command so that the law's force is taken off. slip: the speed below which a
    change of sign is smoothed, m/s."""
    columns = {
        prefix + letter: column[:, axis]
        for axis, letter in enumerate(letters)
        for prefix, column in zip(MOTION, (motion.position, motion.velocity, motion.acceleration), strict=True)
    }
    return -evaluate(_smooth(law, slip), columns, rate_hz)


def along_own_axis(law: Law, letters: tuple[str, ...], axis: int) -> ForceAgainst:
    """Along a sinusoid of this axis while the others rest, as `equivalent_impedance` asks."""

    def against(of: Mapping[str, float], x: FloatArray, v: FloatArray, slip: float) -> FloatArray:
        wave = float(np.sqrt(np.mean(v**2) / np.mean(x**2)))
        still = np.zeros((len(x), len(letters)))
        motion = PlannedMotion(still, still.copy(), still.copy())
        motion.position[:, axis], motion.velocity[:, axis], motion.acceleration[:, axis] = x, v, -(wave**2) * x
        # Two cycles are given.
        return force_against(law, letters, motion, len(x) / 2 * wave / (2 * np.pi), slip)

    return against


def linear_share(law: Law, amplitude: float) -> float:
    """What a command map lets through of a sinusoid's fundamental."""
    wave = np.sin(2 * np.pi * (np.arange(TABLE) + 0.5) / TABLE)
    passed = evaluate(law, {law.variables[0]: amplitude * wave}, PLAYED)
    return float(2 * np.mean(passed * wave) / amplitude)


def undone(law: Law, meant: FloatArray) -> FloatArray:
    """(N,): commands that the map turns into the forces that are meant; the nearest where none does. Raises ValueError
    where the map goes up and down there."""
    span = REACH * max(float(np.abs(meant).max()), np.finfo(np.float64).tiny)
    commands = np.linspace(-span, span, TABLE)
    forces = evaluate(law, {law.variables[0]: commands}, PLAYED)
    if not (np.isfinite(forces).all() and (np.diff(forces) >= 0).all()):
        raise ValueError(f"the command map {law.text} goes up and down, so it cannot be undone")
    return np.asarray(np.interp(meant, forces, commands))


def _smooth(law: Law, slip: float) -> Law:
    """Signs of a velocity change over `slip` on either side, as friction's does."""
    tree = _smoothed(law.tree, slip)
    return Law(format_formula(tree, None, None), law.numbers, law.units, law.acts_on, law.axis)


def _smoothed(node: Node, slip: float) -> Node:
    match node:
        case Apply("sign", (Variable(name) as velocity,)) if name.startswith("v") and slip > 0:
            return Apply("tanh", (Apply("/", (velocity, Number(slip))),))
        case Apply(name, parts):
            return Apply(name, tuple(_smoothed(part, slip) for part in parts))
    return node
