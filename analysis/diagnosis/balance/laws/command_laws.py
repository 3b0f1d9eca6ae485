"""Laws of an actuator, static nonlinearities and slew limits, on grids of parameters that span the command's range.

Laws of the motion, such as friction, are further columns of the regression of the commanded force. The laws in this
file map the command u to the force, f = g(u) (a magnet's also depends on the position), and are tested in the force
balance solved for the acceleration (`inverse_balance`). All grids below are chosen by hand: a grid need only be so fine
that the search from its best law (`vary_parameters`) reaches the true parameters. Called by `actuator`.

Reference: Slotine and Li, Applied Nonlinear Control (1991), chapter 5 (dead zone, saturation, relay).
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from analysis.diagnosis.balance.laws.law import Formula
from analysis.diagnosis.limits import SLEW_REACHED_SHARE
from equalizer.effects.force_nonlinearity import apply_square_law
from equalizer.effects.slew_limit import limit_slew
from equalizer.signals.signal import FloatArray

DEADBAND_QUANTILES, SATURATION_QUANTILES = (0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9), (
    0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 0.95, 0.98,
)  # fmt: skip
"""Quantiles of the command's magnitude at which a dead band ends, and at which an actuator saturates."""
POWER_CURVE_QUANTILES = (0.05, 0.1, 0.2, 0.3)
"""Quantiles of the command's magnitude at which a power curve begins; zero is tried as well."""
POWER_CURVE_EXPONENTS = (0.3, 0.5, 0.7, 1.4, 2.0)
"""Exponents of the command beyond that quantile: below 1 for valves and magnets that saturate, 2 for propellers."""
SQUARE_SHARES = (-1.0, -0.75, -0.5, -0.25, 0.25, 0.5, 0.75, 1.0)
"""Shares of the force at the largest command that grow with the square of the command."""
GAP_SHARES = (0.05, 0.1, 0.2, 0.4, 0.8, 1.6, 3.2)
"""Smallest distances of a magnet from its armature, relative to the travel. Beyond the largest, the force falls by less
than half over the travel. Against a linear spring, a magnet is stable over a third of its gap only (pull-in), where the
smallest distance is twice the travel."""
REFINING_FACTORS = (0.95, 0.98, 1.02, 1.05)
"""Factors by which a coordinate search multiplies a parameter."""
REFINED_PARAMETERS = ("width", "limit", "square", "gap", "power", "rate")
"""Names of the parameters that the search varies; others are switches or scales."""
SLEW_LIMIT_COUNT = 20
"""Number of slew limits in a geometric series; the last, which limits nothing, is not tried."""
NODE_QUANTILES = (0.05, 0.15, 0.3, 0.5, 0.7, 0.85, 0.95)
"""Quantiles at which a piecewise linear function has its nodes; at those of the command's magnitude it may also
jump."""


@dataclass(frozen=True, slots=True, eq=False)
class CommandLaw:
    """A law of the actuator with fixed parameters: the force as a function of the command (with a slew limit, also of
    its past) and the position."""

    effect: str
    """Name of the effect in `equalizer.plant.effect_vocabulary`, or a new name in the same style where it has none."""
    values: dict[str, float]
    """Its fixed parameters by name, in SI units or relative."""
    columns: Callable[[FloatArray, dict[str, float]], FloatArray]
    """Maps a command (n,) and `values` to columns (n, weights): their weighted sum is the force; a single column is the
    force up to a gain."""
    position_factor: Callable[[FloatArray, dict[str, float]], FloatArray] | None = None
    """Maps positions (n,) and the values to the factor of the force (n,); None = it does not depend on the position."""
    flexible: bool = False
    """Whether it fits more shapes than the other laws, and is chosen only with a clearly smaller error."""
    scale: float = 1.0
    """Scale that converts a single column to a force."""
    formula: Callable[[dict[str, float], float], Formula] | None = None
    """From values and scale: formula that a simulation uses for the command; None where the catalogue has the effect,
    or no formula expresses the law."""

    @property
    def lag_column_count(self) -> int:
        """Number of leading columns whose time derivative is a further regressor: a short lag, to first order."""
        return 1

    def compute_columns(self, command: FloatArray, position: FloatArray) -> FloatArray:
        """Compute the columns (n, weights) at command and position (n,) each. A law with a formula gives the force in N
        (N m) after `scale_to`."""
        columns = self.scale * self.columns(command, self.values)
        return (
            columns if self.position_factor is None else columns * self.position_factor(position, self.values)[:, None]
        )

    def scale_to(self, command: FloatArray, position: FloatArray) -> "CommandLaw":
        """Scale a law that has a formula so that its force fits the command (least squares): the mass fitted with it is
        then not scaled. command, position: (n,) each."""
        if self.formula is None:
            return self
        force = self.compute_columns(command, position)[:, 0]
        return replace(self, scale=self.scale * float(force @ command) / max(float(force @ force), 1e-300))

    def as_formula(self) -> Formula | None:
        """Convert the law to a formula with its values and scale; None for a law without one."""
        return None if self.formula is None else self.formula(self.values, self.scale)


IDEAL_ACTUATOR = CommandLaw("as_commanded", {}, lambda u, _: u[:, None])
"""The ideal actuator, whose force is the command: the law to which the others are compared."""


def make_command_laws(command: FloatArray) -> Iterator[CommandLaw]:
    """Make the static nonlinearities that depend on the command alone, over their grids. command: (n,), finite."""
    magnitude = np.abs(command)
    for width in _compute_distinct_quantiles(magnitude, DEADBAND_QUANTILES):
        for jump in (0.0, 1.0):
            yield CommandLaw("force_deadband", {"width": width, "jump": jump}, _compute_deadband_force)
    for limit in _compute_distinct_quantiles(magnitude, SATURATION_QUANTILES):
        yield CommandLaw(
            "force_saturation",
            {"limit": limit},
            lambda u, parameters: np.clip(u, -parameters["limit"], parameters["limit"])[:, None],
        )
    largest_command = float(magnitude.max(initial=0.0)) or 1.0
    for square in SQUARE_SHARES:
        yield CommandLaw(
            "force_nonlinearity", {"square": square, "reference": largest_command}, _compute_square_law_force
        )
    for width in (0.0, *_compute_distinct_quantiles(magnitude, POWER_CURVE_QUANTILES)):
        for power in POWER_CURVE_EXPONENTS:
            values = {"width": width, "power": power}
            yield CommandLaw(
                "actuator_curve", values, _compute_power_law_force, flexible=True, formula=_make_power_formula
            )
    yield CommandLaw("actuator_asymmetry", {}, lambda u, _: np.stack([u, np.abs(u)], axis=1))


def make_slew_laws(commands: Sequence[FloatArray], rate_hz: float) -> Iterator[CommandLaw]:
    """Make slew-rate limits: the output follows the command at a limited rate, as of a servo. commands: (n,) each. The
    rates range from the full stroke within the longest command up to, but without, the fastest change of any command;
    none unless the first is above zero and below the second. A rate is left out where the limited output rarely reaches
    the command (`SLEW_REACHED_SHARE`), because the force would then depend on the command's sign only."""
    fastest_rate = max(float(np.abs(np.diff(command)).max(initial=0.0)) for command in commands) * rate_hz
    slowest_rate = float(np.ptp(np.concatenate(commands))) * rate_hz / max(len(command) for command in commands)
    for rate in (
        np.geomspace(slowest_rate, fastest_rate, SLEW_LIMIT_COUNT)[:-1] if 0 < slowest_rate < fastest_rate else ()
    ):
        law = CommandLaw("slew_limit", {"rate": float(rate)}, partial(_compute_slewed_force, 1 / rate_hz))
        reaches_command = [
            np.abs(law.columns(command, law.values)[:, 0] - command) < rate / rate_hz for command in commands
        ]
        if np.mean(np.concatenate(reaches_command)) > SLEW_REACHED_SHARE:
            yield law


def _compute_slewed_force(step_s: float, command: FloatArray, parameters: dict[str, float]) -> FloatArray:
    """Compute (n, 1): the command (n,) after a slew-rate limit. step_s: sampling interval."""
    # The output equals the first command when the recording begins.
    return limit_slew(command, step_s, parameters["rate"], float(command[0]))[:, None]


def make_electromagnet_laws(position: FloatArray) -> Iterator[CommandLaw]:
    """Make the laws of an electromagnet: force proportional to the square of the current (with a permanent magnet, to
    the current) over that of the distance. position: (n,); the magnet may be beyond either end."""
    low, high = float(position.min()), float(position.max())
    for direction, nearest_position in ((1.0, low), (-1.0, high)):
        for gap in GAP_SHARES:
            for columns in (_square_command, IDEAL_ACTUATOR.columns):
                position_factor = partial(_compute_attraction_factor, direction, nearest_position)
                yield CommandLaw("electromagnet", {"gap": gap * (high - low)}, columns, position_factor, True)


def _compute_attraction_factor(
    direction: float, nearest_position: float, position: FloatArray, parameters: dict[str, float]
) -> FloatArray:
    """Compute (n,): 1 / distance² from the magnet, which is `gap` beyond `nearest_position`. direction: 1 where the
    distance grows with the position (n,), -1 where it falls."""
    return np.asarray((parameters["gap"] + np.maximum(direction * (position - nearest_position), 0.0)) ** -2)


def _make_power_formula(parameters: dict[str, float], scale: float) -> Formula:
    """Make the formula of `_compute_power_law_force`: scale sgn(f) max(|f| - width, 0)^power of a command f."""
    if not parameters["width"]:
        return Formula(f"{scale:.6g}*sign(f)*abs(f)**p0", (parameters["power"],))
    return Formula(f"{scale:.6g}*sign(f)*maximum(abs(f) - p0, 0)**p1", (parameters["width"], parameters["power"]))


def _square_command(command: FloatArray, parameters: dict[str, float]) -> FloatArray:
    """Compute (n, 1): the square of the command (n,). parameters: not used."""
    return command[:, None] ** 2


def vary_parameters(law: CommandLaw) -> Iterator[CommandLaw]:
    """Make copies of the law, each with one of its `REFINED_PARAMETERS` multiplied by one of the `REFINING_FACTORS`;
    without parameters that are zero and values of `square` beyond +-1."""
    for name in REFINED_PARAMETERS:
        value = law.values.get(name, 0.0)
        for factor in REFINING_FACTORS if value else ():
            if name != "square" or abs(factor * value) <= 1:
                yield replace(law, values={**law.values, name: factor * value})


def _compute_square_law_force(command: FloatArray, parameters: dict[str, float]) -> FloatArray:
    """Compute (n, 1): the force of which the share `square` grows with the square of the command (n,)."""
    return apply_square_law(command, parameters["square"], parameters["reference"])[:, None]


def _compute_power_law_force(command: FloatArray, parameters: dict[str, float]) -> FloatArray:
    """Compute (n, 1): sgn(u) max(|u| - width, 0)^power of the command u (n,)."""
    excess = np.maximum(np.abs(command) - parameters["width"], 0.0)
    return np.asarray(np.sign(command) * excess ** parameters["power"])[:, None]


def _compute_distinct_quantiles(magnitude: FloatArray, shares: Sequence[float]) -> list[float]:
    """Compute the different quantiles of the command's magnitude (n,) between zero and its maximum, ascending."""
    quantiles = np.unique(np.quantile(magnitude, shares))
    return [float(value) for value in quantiles if 0 < value < magnitude.max()]


def _compute_deadband_force(command: FloatArray, parameters: dict[str, float]) -> FloatArray:
    """Compute (n, 1): the force beyond a dead band of +-width, with a jump of `jump` widths at its ends."""
    width = parameters["width"]
    excess = command - np.clip(command, -width, width)
    return np.asarray(excess + parameters["jump"] * width * np.sign(excess))[:, None]


@dataclass(frozen=True, slots=True, eq=False)
class PiecewiseCommandLaw:
    """A sum of functions that approximates the laws of a kind: where this sum fits no better than the command itself,
    none of these laws need be tried."""

    columns: Callable[[FloatArray, FloatArray], FloatArray]
    """(n, k) of command and position (n,) each; the command itself first."""
    lag_column_count: int
    """Number of leading columns whose time derivative is a further regressor."""

    def compute_columns(self, command: FloatArray, position: FloatArray) -> FloatArray:
        """Compute the columns (n, k) at command and position (n,) each."""
        return self.columns(command, position)


def make_piecewise_curve(command: FloatArray) -> PiecewiseCommandLaw:
    """Make a piecewise linear function of the command with jumps, separate for each sign. command: (n,), from whose
    quantiles the nodes are taken."""
    nodes = np.unique(np.quantile(np.abs(command), NODE_QUANTILES))

    def compute_columns(u: FloatArray, position: FloatArray) -> FloatArray:
        """Compute (n, 2 + 4 nodes): command, positive part, hinges and jumps. position: not used."""
        one_sided_commands = (np.maximum(u, 0.0), np.maximum(-u, 0.0))
        hinges = [np.maximum(one_sided - node, 0.0) for one_sided in one_sided_commands for node in nodes]
        jumps = [np.where(one_sided > node, 1.0, 0.0) for one_sided in one_sided_commands for node in nodes]
        return np.stack([u, one_sided_commands[0], *hinges, *jumps], axis=1)

    return PiecewiseCommandLaw(compute_columns, 2 + 2 * len(nodes))


def make_piecewise_attraction(position: FloatArray) -> PiecewiseCommandLaw:
    """Make the sum of the command and its square, each with a gain piecewise linear in the position. position: (n,),
    from whose quantiles the nodes are taken."""
    nodes = np.unique(np.quantile(position, NODE_QUANTILES))

    def compute_columns(u: FloatArray, x: FloatArray) -> FloatArray:
        """Compute (n, 4 + 2 nodes): command, then its square, each times the gains."""
        gains = [np.ones_like(x), x - nodes[0], *(np.maximum(x - node, 0.0) for node in nodes)]
        return np.stack([force * gain for force in (u, u**2) for gain in gains], axis=1)

    return PiecewiseCommandLaw(compute_columns, 4 + 2 * len(nodes))
