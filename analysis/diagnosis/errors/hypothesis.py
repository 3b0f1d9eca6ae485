"""Hypotheses about missing physics: effects, each at an axis or channel, with the free parameters that a fit varies.

A hypothesis is a list of claims (effect and sites) and a point: one coordinate per free parameter. A coordinate is the
logarithm of a parameter on a log scale, else the parameter over its unit, so that a fit can step along it. Hypotheses
are immutable: the functions below make new ones. `output_error` fits them.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from equalizer.effects.effect import AxisForce, Effect, JointForce, Parameter, PlacedEffect, Values
from equalizer.signals.signal import FloatArray

Spread = Literal["one", "all", "each"]
"""How the sites of an effect share parameters: a single site; all with the same values; each with its own."""


@dataclass(frozen=True, slots=True)
class Claim:
    """An effect at one or several sites (axes or channels)."""

    effect: Effect
    spread: Spread
    sites: tuple[int, ...]
    """Numbers of the axes or channels, from 0."""

    @property
    def group_count(self) -> int:
        """Number of sets of the effect's parameters."""
        return len(self.sites) if self.spread == "each" else 1


@dataclass(frozen=True, slots=True)
class FreeParameter:
    """A free parameter of a hypothesis, as a coordinate that a fit can step along."""

    parameter: Parameter
    unit: float
    """Change of the value per unit of the coordinate where it is not logarithmic."""

    def to_value(self, coordinate: float) -> float:
        """Convert a coordinate to the parameter's value, within its limits."""
        p = self.parameter
        # exp overflows a double above 709; values as large as exp(700) are clipped to the upper limit.
        value = float(np.exp(min(coordinate, 700.0))) if p.scale == "log" else coordinate * self.unit
        return min(max(value, p.lower), p.upper)

    def to_coordinate(self, value: float) -> float:
        """Convert a value, limited to its range, to a coordinate: the logarithm on a log scale, else over `unit`."""
        p = self.parameter
        clipped = min(max(value, p.lower), p.upper)
        return float(np.log(clipped)) if p.scale == "log" else clipped / self.unit

    @property
    def difference_step(self) -> float:
        """Step of finite differences, in the coordinate: 1 on a linear scale, else the parameter's own step."""
        return 1.0 if self.parameter.scale == "linear" else self.parameter.step

    @property
    def bounds(self) -> tuple[float, float]:
        """Lower and upper limit of the coordinate."""
        return self.to_coordinate(self.parameter.lower), self.to_coordinate(self.parameter.upper)


@dataclass(frozen=True, slots=True, eq=False)
class Hypothesis:
    """Claims that hold at the same time, with the parameters that a fit starts from or has found."""

    claims: tuple[Claim, ...]
    starts: tuple[Values, ...]
    """Per group of each claim, values by parameter name: those of fixed parameters, and the magnitudes that are the
    units of parameters of either sign; other values are not used."""
    point: FloatArray
    """(k,): coordinates of the free parameters, claim by claim, group by group (`FreeParameter.to_coordinate`)."""

    @property
    def key(self) -> tuple[tuple[str, str, tuple[int, ...]], ...]:
        """Effect, spread and sites of each claim: the same for hypotheses that differ in parameters alone."""
        return tuple((claim.effect.name, claim.spread, claim.sites) for claim in self.claims)

    @property
    def parameters(self) -> tuple[FreeParameter, ...]:
        """The free parameters, one per coordinate of the point."""
        parameters_by_group = [claim.effect.parameters for claim in self.claims for _ in range(claim.group_count)]
        return tuple(
            FreeParameter(p, _compute_coordinate_unit(p, start))
            for group_parameters, start in zip(parameters_by_group, self.starts, strict=True)
            for p in group_parameters
            if not p.fixed
        )

    def list_placed_effects(self, point: FloatArray | None = None) -> tuple[PlacedEffect, ...]:
        """List the effects with their values, one per claim and group, as a simulation takes them. point: (k,)
        coordinates; None = the hypothesis's own."""
        free_parameters = list(self.parameters)
        coordinates = list(self.point if point is None else point)
        effects: list[PlacedEffect] = []
        starts = iter(self.starts)
        for claim in self.claims:
            for group in range(claim.group_count):
                values = dict(next(starts))
                for p in claim.effect.parameters:
                    if not p.fixed:
                        values[p.name] = free_parameters.pop(0).to_value(float(coordinates.pop(0)))
                sites = (claim.sites[group],) if claim.spread == "each" else claim.sites
                effects.append(PlacedEffect(claim.effect, sites, values))
        return tuple(effects)

    def list_effects_of(self, claim_index: int) -> tuple[PlacedEffect, ...]:
        """List the placed effects of one claim, one per group, with the values at the hypothesis's own point."""
        first_group = sum(claim.group_count for claim in self.claims[:claim_index])
        return self.list_placed_effects()[first_group : first_group + self.claims[claim_index].group_count]


def has_motion_forces(hypothesis: Hypothesis) -> bool:
    """Whether the hypothesis contains a force that depends on the motion."""
    return any(isinstance(claim.effect.action, (AxisForce, JointForce)) for claim in hypothesis.claims)


def remove_claim(hypothesis: Hypothesis, claim_index: int) -> Hypothesis:
    """Remove the claim of this index, with its starts and parameters."""
    group_start = sum(claim.group_count for claim in hypothesis.claims[:claim_index])
    group_stop = group_start + hypothesis.claims[claim_index].group_count
    coordinate_counts = [
        sum(not p.fixed for p in claim.effect.parameters) * claim.group_count for claim in hypothesis.claims
    ]
    coordinate_start = sum(coordinate_counts[:claim_index])
    return Hypothesis(
        hypothesis.claims[:claim_index] + hypothesis.claims[claim_index + 1 :],
        hypothesis.starts[:group_start] + hypothesis.starts[group_stop:],
        np.delete(hypothesis.point, slice(coordinate_start, coordinate_start + coordinate_counts[claim_index])),
    )


def move_point(hypothesis: Hypothesis, step: FloatArray, along_values: bool) -> Hypothesis:
    """Move the coordinates of a hypothesis by a step (k,). along_values: logarithmic coordinates move by ln(1 + step),
    so that values change in proportion to the step, and drop to no less than a tenth; the result is clipped to the
    bounds. Where a parameter of the model compensates for that of the effect (two masses), the cost has a valley that
    is straight in the values only."""
    if not along_values:
        return replace(hypothesis, point=hypothesis.point + step)
    is_logarithmic = np.array(
        [free_parameter.parameter.scale == "log" for free_parameter in hypothesis.parameters], dtype=np.bool_
    )
    increments = np.where(is_logarithmic, np.log1p(np.maximum(step, -0.9)), step)
    lower_bounds, upper_bounds = (
        np.array([free_parameter.bounds for free_parameter in hypothesis.parameters]).reshape(-1, 2).T
    )
    return replace(hypothesis, point=np.clip(hypothesis.point + increments, lower_bounds, upper_bounds))


def make_claim_hypothesis(claim: Claim, values: Sequence[Values]) -> Hypothesis:
    """Make the hypothesis of one claim, its point at the given values. values: parameter values by name, per group."""
    free_parameters = [(p, group_values) for group_values in values for p in claim.effect.parameters if not p.fixed]
    point = np.array(
        [
            FreeParameter(p, _compute_coordinate_unit(p, group_values)).to_coordinate(group_values[p.name])
            for p, group_values in free_parameters
        ]
    )
    return Hypothesis((claim,), tuple(dict(group_values) for group_values in values), point)


def combine_hypotheses(leading: Hypothesis, added: Hypothesis) -> Hypothesis:
    """Combine the claims, starts and coordinates of two hypotheses; those of `leading` come first."""
    return Hypothesis(
        leading.claims + added.claims, leading.starts + added.starts, np.concatenate([leading.point, added.point])
    )


NO_EFFECTS = Hypothesis((), (), np.zeros(0))
"""The model alone."""


def generate_near_equivalents(hypothesis: Hypothesis) -> Iterator[Hypothesis]:
    """Generate variants of the hypothesis in which one effect at a time has other values with almost the same response
    (`Effect.near_equivalents`)."""
    parameters, first_coordinate = hypothesis.parameters, 0
    for placed_effect in hypothesis.list_placed_effects():
        coordinate_stop = first_coordinate + sum(not p.fixed for p in placed_effect.effect.parameters)
        for alternative in placed_effect.effect.near_equivalents(placed_effect.values):
            point = hypothesis.point.copy()
            point[first_coordinate:coordinate_stop] = [
                free_parameter.to_coordinate(alternative[free_parameter.parameter.name])
                for free_parameter in parameters[first_coordinate:coordinate_stop]
            ]
            yield replace(hypothesis, point=point)
        first_coordinate = coordinate_stop


def _compute_coordinate_unit(p: Parameter, start: Values) -> float:
    """Compute the unit of a coordinate that is not logarithmic: the magnitude of the start where either sign is
    possible (1 where it is 0), else the parameter's own step."""
    if p.scale == "signed":
        return abs(start[p.name]) or 1.0
    return p.step
