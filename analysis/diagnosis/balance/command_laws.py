"""Static nonlinearities of an actuator, with their parameters on grids that span the amplitudes of the command.

Laws of the motion are further columns of the regression of the commanded force. The laws in this file change that
force itself, f = g(u), so that they are tested in the balance solved for the acceleration (`inverse_balance`). All
constants below are set by hand: a grid need only be so fine that the best of its laws is refined to the true law
(`neighbours_of`).

Reference: Slotine and Li, Applied Nonlinear Control (1991), chapter 5 (dead zone, saturation, relay).
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from analysis.diagnosis.balance.law import Formula
from analysis.diagnosis.settings import SLEW_REACHED
from equalizer.effects.force_nonlinearity import square_law_force
from equalizer.effects.slew_limit import limit_slew
from equalizer.signals.signal import FloatArray

DEADBAND_QUANTILES, SATURATION_QUANTILES = (0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9), (
    0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 0.95, 0.98,
)  # fmt: skip
"""Quantiles of the command's size at which a dead band ends, and at which an actuator saturates."""
CURVE_QUANTILES = (0.05, 0.1, 0.2, 0.3)
"""Quantiles of the command's size at which a curve begins."""
POWERS = (0.3, 0.5, 0.7, 1.4, 2.0)
"""Exponents of the command beyond that point: valves and magnets that saturate, propellers."""
SQUARES = (-1.0, -0.75, -0.5, -0.25, 0.25, 0.5, 0.75, 1.0)
"""Shares of the force at the largest command that grow with the square of the command."""
GAPS = (0.05, 0.1, 0.2, 0.4, 0.8, 1.6, 3.2)
"""Smallest distances of a magnet from its armature, relative to the travel. Beyond the largest, the force falls by less
than half over the travel. Against a linear spring, a magnet is stable over a third of its gap only (pull-in), where
the smallest distance is twice the travel."""
REFINING_FACTORS = (0.95, 0.98, 1.02, 1.05)
"""Factors on a parameter in a coordinate search."""
REFINED_PARAMETERS = ("width", "limit", "square", "gap", "power", "rate")
"""Parameters on a grid; others are switches or scales."""
RATES = 20
"""Number of slew limits that are tried, in a geometric series."""
NODE_QUANTILES = (0.05, 0.15, 0.3, 0.5, 0.7, 0.85, 0.95)
"""Quantiles at which a piecewise linear function has its nodes; at those of the command's size it may jump, too."""


@dataclass(frozen=True, slots=True, eq=False)
class CommandLaw:
    """A static nonlinearity of the actuator with fixed parameters: the force as a function of command and position."""

    effect: str
    """Name of the vocabulary, or a new one in the same style for physics that it lacks."""
    values: dict[str, float]
    """Its fixed parameters by name, in SI units or relative."""
    columns: Callable[[FloatArray, dict[str, float]], FloatArray]
    """Columns (n, weights) of a command (n,): their weighted sum is the force; a single column is the force up to a
    gain."""
    factor_at: Callable[[FloatArray, dict[str, float]], FloatArray] | None = None
    """Maps positions (n,) and the values to the factor of the force (n,); None = it does not depend on the position."""
    flexible: bool = False
    """Whether it has more freedom than the other laws, and counts only with a clearly smaller error."""
    scale: float = 1.0
    """Scale that converts a single column to a force."""
    formula: Callable[[dict[str, float], float], Formula] | None = None
    """From values and scale: formula that a simulation uses for the command, where the catalogue has no such effect."""

    @property
    def sloped(self) -> int:
        """See `inverse_balance.ForceOfCommand`."""
        return 1

    def of(self, command: FloatArray, position: FloatArray) -> FloatArray:
        """(n, weights): the columns at command and position (n,) each, in the units of a force where it has a scale."""
        columns = self.scale * self.columns(command, self.values)
        return columns if self.factor_at is None else columns * self.factor_at(position, self.values)[:, None]

    def scale_to(self, command: FloatArray, position: FloatArray) -> "CommandLaw":
        """The law scaled so that its force fits the command (least squares), where it has a formula: a mass fitted with
        it then keeps its size. command, position: (n,) each."""
        if self.formula is None:
            return self
        force = self.of(command, position)[:, 0]
        return replace(self, scale=self.scale * float(force @ command) / max(float(force @ force), 1e-300))

    def as_formula(self) -> Formula | None:
        """Formula of the force with these values and scale; None where the catalogue has the effect."""
        return None if self.formula is None else self.formula(self.values, self.scale)


AS_COMMANDED = CommandLaw("as_commanded", {}, lambda u, _: u[:, None])


def command_laws(command: FloatArray) -> Iterator[CommandLaw]:
    """All static nonlinearities of the actuator, over their grids of parameters. command: (n,), known throughout."""
    size = np.abs(command)
    for width in _sizes(size, DEADBAND_QUANTILES):
        for jump in (0.0, 1.0):
            yield CommandLaw("force_deadband", {"width": width, "jump": jump}, _deadband_force)
    for limit in _sizes(size, SATURATION_QUANTILES):
        yield CommandLaw(
            "force_saturation",
            {"limit": limit},
            lambda u, parameters: np.clip(u, -parameters["limit"], parameters["limit"])[:, None],
        )
    unit = float(size.max(initial=0.0)) or 1.0
    for square in SQUARES:
        yield CommandLaw("force_nonlinearity", {"square": square, "reference": unit}, _nonlinear_force)
    for width in (0.0, *_sizes(size, CURVE_QUANTILES)):
        for power in POWERS:
            values = {"width": width, "power": power}
            yield CommandLaw("actuator_curve", values, _power_force, flexible=True, formula=_power_formula)
    yield CommandLaw("actuator_asymmetry", {}, lambda u, _: np.stack([u, np.abs(u)], axis=1))


def slew_laws(commands: Sequence[FloatArray], rate_hz: float) -> Iterator[CommandLaw]:
    """Slew-rate limits: the command is followed at a limited rate, as by a positioning servo. commands: (n,) each. The
    rates range from the full stroke within the longest command to its fastest change. A rate is left out where the
    limited output hardly ever reaches the command, so that only the sign of the command would matter."""
    fastest = max(float(np.abs(np.diff(command)).max(initial=0.0)) for command in commands) * rate_hz
    slowest = float(np.ptp(np.concatenate(commands))) * rate_hz / max(len(command) for command in commands)
    for rate in np.geomspace(slowest, fastest, RATES)[:-1] if 0 < slowest < fastest else ():
        law = CommandLaw("slew_limit", {"rate": float(rate)}, partial(_compute_slewed_force, 1 / rate_hz))
        reaches_command = [
            np.abs(law.columns(command, law.values)[:, 0] - command) < rate / rate_hz for command in commands
        ]
        if np.mean(np.concatenate(reaches_command)) > SLEW_REACHED:
            yield law


def _compute_slewed_force(step_s: float, command: FloatArray, parameters: dict[str, float]) -> FloatArray:
    # The output equals the first command when the recording begins.
    return limit_slew(command, step_s, parameters["rate"], float(command[0]))[:, None]


def coil_laws(position: FloatArray) -> Iterator[CommandLaw]:
    """An electromagnet: force proportional to the square of the current over that of the distance; with a permanent
    magnet, to the current. position: (n,); the magnet may be beyond either end."""
    low, high = float(position.min()), float(position.max())
    for side, end in ((1.0, low), (-1.0, high)):
        for gap in GAPS:
            for columns in (_force_of_square, AS_COMMANDED.columns):
                factor_at = partial(_attraction_at, side, end)
                yield CommandLaw("electromagnet", {"gap": gap * (high - low)}, columns, factor_at, True)


def _attraction_at(side: float, end: float, position: FloatArray, parameters: dict[str, float]) -> FloatArray:
    """side: 1 where the position is a distance that grows, from `end` on; -1 where it falls."""
    return np.asarray((parameters["gap"] + np.maximum(side * (position - end), 0.0)) ** -2)


def _power_formula(parameters: dict[str, float], scale: float) -> Formula:
    """Formula of `_power_force`: scale sgn(f) max(|f| - width, 0)^power of a command f."""
    if not parameters["width"]:
        return Formula(f"{scale:.6g}*sign(f)*abs(f)**p0", (parameters["power"],))
    return Formula(f"{scale:.6g}*sign(f)*maximum(abs(f) - p0, 0)**p1", (parameters["width"], parameters["power"]))


def _force_of_square(command: FloatArray, parameters: dict[str, float]) -> FloatArray:
    return command[:, None] ** 2


def neighbours_of(law: CommandLaw) -> Iterator[CommandLaw]:
    """The law with each of its `REFINED_PARAMETERS` that is not zero multiplied by each of the `REFINING_FACTORS`."""
    for name in REFINED_PARAMETERS:
        value = law.values.get(name, 0.0)
        for factor in REFINING_FACTORS if value else ():
            if name != "square" or abs(factor * value) <= 1:
                yield replace(law, values={**law.values, name: factor * value})


def _nonlinear_force(command: FloatArray, parameters: dict[str, float]) -> FloatArray:
    return square_law_force(command, parameters["square"], parameters["reference"])[:, None]


def _power_force(command: FloatArray, parameters: dict[str, float]) -> FloatArray:
    excess = np.maximum(np.abs(command) - parameters["width"], 0.0)
    return np.asarray(np.sign(command) * excess ** parameters["power"])[:, None]


def _sizes(size: FloatArray, shares: Sequence[float]) -> list[float]:
    """Quantiles of the command's size (n,) above zero and below its largest, ascending and each once."""
    quantiles = np.unique(np.quantile(size, shares))
    return [float(value) for value in quantiles if 0 < value < size.max()]


def _deadband_force(command: FloatArray, parameters: dict[str, float]) -> FloatArray:
    width = parameters["width"]
    passed = command - np.clip(command, -width, width)
    return np.asarray(passed + parameters["jump"] * width * np.sign(passed))[:, None]


@dataclass(frozen=True, slots=True, eq=False)
class PiecewiseCommandLaw:
    """A sum of simple functions that approximates every law of a kind: where this sum fits no better than the command
    itself, the laws of that kind need not be tried."""

    columns: Callable[[FloatArray, FloatArray], FloatArray]
    """(n, k) of command and position (n,) each; the command itself first."""
    sloped: int
    """See `inverse_balance.ForceOfCommand`."""

    def of(self, command: FloatArray, position: FloatArray) -> FloatArray:
        """(n, k): the columns at command and position (n,) each."""
        return self.columns(command, position)


def piecewise_curve(command: FloatArray) -> PiecewiseCommandLaw:
    """A piecewise linear function of the command with jumps, separate for each sign. command: (n,), whose range the
    nodes span."""
    bends = np.unique(np.quantile(np.abs(command), NODE_QUANTILES))

    def columns(u: FloatArray, position: FloatArray) -> FloatArray:
        sides = (np.maximum(u, 0.0), np.maximum(-u, 0.0))
        hinges = [np.maximum(side - bend, 0.0) for side in sides for bend in bends]
        jumps = [np.where(side > bend, 1.0, 0.0) for side in sides for bend in bends]
        return np.stack([u, sides[0], *hinges, *jumps], axis=1)

    return PiecewiseCommandLaw(columns, 2 + 2 * len(bends))


def piecewise_pull(position: FloatArray) -> PiecewiseCommandLaw:
    """The command and its square, each with a gain that is piecewise linear in the position. position: (n,), whose
    range the nodes span."""
    bends = np.unique(np.quantile(position, NODE_QUANTILES))

    def columns(u: FloatArray, x: FloatArray) -> FloatArray:
        gains = [np.ones_like(x), x - bends[0], *(np.maximum(x - bend, 0.0) for bend in bends)]
        return np.stack([force * gain for force in (u, u**2) for gain in gains], axis=1)

    return PiecewiseCommandLaw(columns, 4 + 2 * len(bends))
