"""A claim about what is missing: effects of the catalogue, each at an axis or channel, with numbers to be found."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from equalizer.effects.effect import Effect, Parameter, PlacedEffect, Values
from equalizer.signals.signal import FloatArray

Spread = Literal["one", "all", "each"]


@dataclass(frozen=True, slots=True)
class Claim:
    """One effect somewhere."""

    effect: Effect
    spread: Spread
    sites: tuple[int, ...]
    """One site; all with the same numbers; all, each with numbers of its own."""

    @property
    def groups(self) -> int:
        """How many sets of the effect's numbers there are."""
        return len(self.sites) if self.spread == "each" else 1

    @property
    def numbers(self) -> int:
        return self.groups * len(self.effect.parameters)


@dataclass(frozen=True, slots=True, eq=False)
class Hypothesis:
    """Claims that hold together, with the numbers that a fit starts from or has found."""

    claims: tuple[Claim, ...]
    point: FloatArray
    """Claim by claim, group by group: the logarithm of a number on a log scale, else the number over its step."""

    @property
    def key(self) -> tuple[tuple[str, str, tuple[int, ...]], ...]:
        return tuple((claim.effect.name, claim.spread, claim.sites) for claim in self.claims)

    def placed(self, point: FloatArray | None = None) -> tuple[PlacedEffect, ...]:
        numbers = self.point if point is None else point
        effects, first = [], 0
        for claim in self.claims:
            size = len(claim.effect.parameters)
            for group in range(claim.groups):
                values = values_of(claim.effect.parameters, numbers[first : first + size])
                sites = (claim.sites[group],) if claim.spread == "each" else claim.sites
                effects.append(PlacedEffect(claim.effect, sites, values))
                first += size
        return tuple(effects)


def parameters(claims: Sequence[Claim]) -> tuple[Parameter, ...]:
    """One per number of a point."""
    return tuple(one for claim in claims for _ in range(claim.groups) for one in claim.effect.parameters)


def claimed(claim: Claim, values: Sequence[Values]) -> Hypothesis:
    """values: one set per group."""
    return Hypothesis((claim,), np.concatenate([point_of(claim.effect.parameters, one) for one in values]))


def together(one: Hypothesis, other: Hypothesis) -> Hypothesis:
    return Hypothesis(one.claims + other.claims, np.concatenate([one.point, other.point]))


def point_of(of: Sequence[Parameter], values: Values) -> FloatArray:
    return np.array(
        [
            np.log(min(max(values[p.name], p.lower), p.upper)) if p.scale == "log" else values[p.name] / p.step
            for p in of
        ]
    )


def values_of(of: Sequence[Parameter], point: FloatArray) -> dict[str, float]:
    return {
        p.name: float(min(max(np.exp(x) if p.scale == "log" else x * p.step, p.lower), p.upper))
        for p, x in zip(of, point, strict=True)
    }


def steps(of: Sequence[Parameter]) -> FloatArray:
    """How far each number of a point is moved to see what it does."""
    return np.array([p.step if p.scale == "log" else 1.0 for p in of])
