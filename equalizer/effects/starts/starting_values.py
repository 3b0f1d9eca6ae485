"""What several effects' starting values have in common: the missing force as a sum of laws of the motion."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from equalizer.effects.starts.evidence import Evidence
from equalizer.signals.signal import FloatArray

SLOW = 0.02
"""Share of the rms velocity below which the direction of sliding is not known."""


@dataclass(frozen=True, slots=True, eq=False)
class Moving:
    """The samples that count, at one axis; all (n,)."""

    time_s: FloatArray
    position: FloatArray
    velocity: FloatArray
    acceleration: FloatArray
    force: FloatArray
    """That is missing."""

    def where(self, keep: npt.NDArray[np.bool_]) -> "Moving":
        return Moving(*(getattr(self, name)[keep] for name in self.__dataclass_fields__))


@dataclass(frozen=True, slots=True, eq=False)
class Fitted:
    """The missing force by laws of the motion."""

    strengths: FloatArray
    """(k,): how much of each law."""
    explained: float
    """Share of the missing force's power that they add to what a linear model explains."""


def moving(evidence: Evidence, axis: int) -> Moving:
    time_s = np.arange(len(evidence.command)) / evidence.sample_rate_hz
    acceleration = np.gradient(evidence.axis_velocity[:, axis], 1 / evidence.sample_rate_hz)
    every = Moving(
        time_s, evidence.axis_position[:, axis], evidence.axis_velocity[:, axis], acceleration,
        evidence.axis_force[:, axis],
    )  # fmt: skip
    return every.where(evidence.used > 0)


def sliding(evidence: Evidence, axis: int) -> Moving:
    """Only where the axis surely moves."""
    of = moving(evidence, axis)
    return of.where(np.abs(of.velocity) > SLOW * np.sqrt(np.mean(of.velocity**2)))


def linear_part(of: Moving, constant: bool = True) -> FloatArray:
    """(n, 3 or 4): what a re-tuned model got wrong of its mass, damping, stiffness and place of rest."""
    shapes = [of.position, of.velocity, of.acceleration]
    return np.column_stack([*shapes, np.ones_like(of.position)] if constant else shapes)


class Beside:
    """Fits laws beside nuisances, quickly for many trials of one law."""

    def __init__(self, force: FloatArray, nuisances: FloatArray) -> None:
        """force: (n,); nuisances: (n, k)"""
        scale = np.linalg.norm(nuisances, axis=0)
        left, sizes, _ = np.linalg.svd(nuisances / np.where(scale > 0, scale, 1.0), full_matrices=False)
        self._known = left[:, sizes > 1e-9 * max(float(sizes.max(initial=0.0)), np.finfo(float).tiny)]
        self.force = self._without(force)
        """(n,): what the nuisances leave of it."""
        self._power = max(float(self.force @ self.force), np.finfo(float).tiny)

    def _without(self, shapes: FloatArray) -> FloatArray:
        return np.asarray(shapes - self._known @ (self._known.T @ shapes))

    def fit(self, *laws: FloatArray) -> Fitted:
        """laws: (n,) each, of strength 1."""
        shapes = self._without(np.column_stack(laws))
        size = np.linalg.norm(shapes, axis=0)
        shapes = shapes / np.where(size > 0, size, 1.0)
        seen = shapes.T @ self.force
        strengths = np.asarray(np.linalg.lstsq(shapes.T @ shapes, seen, rcond=1e-9)[0], dtype=np.float64)
        return Fitted(strengths / np.where(size > 0, size, 1.0), float(seen @ strengths) / self._power)


def beside_linear(of: Moving, constant: bool = True) -> Beside:
    return Beside(of.force, linear_part(of, constant))


def best_of(
    beside: Beside, trials: Sequence[float], laws: Callable[[float], tuple[FloatArray, ...]]
) -> tuple[float, Fitted]:
    """The trial whose laws explain most."""
    fits = [(trial, beside.fit(*laws(trial))) for trial in trials]
    return max(fits, key=lambda item: item[1].explained)


def own(matrix: FloatArray, direction: FloatArray) -> float:
    """A mass, damping or stiffness along a direction (n,)."""
    return float(direction @ matrix @ direction)
