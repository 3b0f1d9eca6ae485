"""Least squares on band powers by Gauss and Newton's steps, for the numbers of a hypothesis and of the model.

Chance is in each prediction, so numbers are moved far to see what they do, and each band of a segment weighs by how
much chance there is in it.
"""

from dataclasses import dataclass, replace

import numpy as np

from analysis.diagnosis.errors.band_power import BandPower
from analysis.diagnosis.errors.hypothesis import Hypothesis, Number
from analysis.diagnosis.errors.output_error import bounded_step
from analysis.diagnosis.errors.tuning import Tuning
from analysis.diagnosis.types import Mapper
from equalizer.plant.mechanical_model import MechanicalModelError
from equalizer.signals.signal import FloatArray

MOVES, WIDEST = (0.02, 0.2), 12.0
"""Least and most that a logarithm is moved by; and so many times its usual move."""
LONGEST_STEP = 0.5
"""Of a logarithm, and so many moves of what has either sign."""
MOST_BY_CHANCE = 0.8
"""Of what columns seem to know, the largest share that is taken for chance."""
LEAST_KNOWN = 1e-6
"""Information on a combination of numbers that nothing moves."""
SHARES = (1.0, 0.3, 0.1, 0.03)
"""Of a step that are tried."""
FLOOR = 0.04
"""Of the logarithm of an amplitude: no simulation foresees it better."""
TRUSTED = 2.0
"""What is off by more standard deviations pulls no harder (Huber 1964): the model may lack more than one thing."""
RESTS = 1e-4
"""Of a cost, that a step must gain to go on."""


APART = 1e-9
"""Initial difference between simulations of one hypothesis, in the logarithm of a number."""


def apart(hypothesis: Hypothesis, number: int) -> Hypothesis:
    return replace(hypothesis, point=hypothesis.point + number * APART)


@dataclass(frozen=True, slots=True, eq=False)
class View:
    """What is compared, and how."""

    power: BandPower
    tuning: Tuning
    map_: Mapper
    spread: float | FloatArray = 0.05
    """What chance does to the logarithms, standard deviation; (stretches, bands, c) or one for all."""
    by_deviations: FloatArray | None = None
    """(t, stretches, bands, c): what the model's own numbers do; None: they stay as they are."""
    ensemble: int = 1
    """Simulations over which a prediction is averaged, from numbers that differ by APART: chance in it falls."""

    def predicted(self, deviations: FloatArray, hypothesis: Hypothesis) -> FloatArray:
        """(stretches, bands, c): mean over the ensemble; NaN throughout where that is no model."""
        members = range(self.ensemble if len(hypothesis.point) else 1)
        return np.asarray(np.mean([self._member(deviations, apart(hypothesis, k)) for k in members], axis=0))

    def _member(self, deviations: FloatArray, hypothesis: Hypothesis) -> FloatArray:
        try:
            model = self.tuning.tuned(deviations)
            return self.power.predicted(self.power.measure.residuals(model, hypothesis.placed()))
        except (MechanicalModelError, np.linalg.LinAlgError):
            return np.full(self.power.measured.shape, np.nan)

    @property
    def weights(self) -> FloatArray:
        """(stretches, bands, c): none for what is sealed or drowned."""
        fit = np.array([stretch.part != "test" for stretch in self.power.stretches], dtype=np.bool_)
        known = np.isfinite(self.power.measured) & fit[:, None, None]
        return np.asarray(np.where(known, 1 / np.hypot(self.spread, FLOOR), 0.0))


@dataclass(frozen=True, slots=True, eq=False)
class Foreseen:
    """A hypothesis, with what it predicts."""

    hypothesis: Hypothesis
    deviations: FloatArray
    predicted: FloatArray
    """(stretches, bands, c)"""
    cost: float
    """Huber's mean of what is off, over the bands that are fitted to; inf for what is no model."""
    errors: FloatArray
    """(numbers,): standard errors of the point; empty before a step."""

    def off(self, view: View) -> FloatArray:
        return np.asarray(view.power.measured - self.predicted)


def foreseen(view: View, deviations: FloatArray, hypothesis: Hypothesis) -> Foreseen:
    predicted = view.predicted(deviations, hypothesis)
    weights = view.weights
    if not np.isfinite(predicted[weights > 0]).all():
        return Foreseen(hypothesis, deviations, predicted, np.inf, np.zeros(0))
    weighed = _weighed(view, view.power.measured - predicted)
    cost = (float(_huber(weighed).sum()) + float(deviations @ deviations)) / max(len(weighed), 1)
    return Foreseen(hypothesis, deviations, predicted, cost, np.zeros(0))


def fitted(view: View, start: Foreseen, rounds: int) -> Foreseen:
    """The start or better."""
    best = start
    for _ in range(rounds):
        if not np.isfinite(best.cost):
            return best
        better = _stepped(view, best)
        gained = best.cost - better.cost
        best = better if gained > 0 else replace(best, errors=better.errors)
        if gained < RESTS * best.cost:
            break
    return best


def own_columns(view: View, at: Foreseen) -> FloatArray:
    """(numbers, stretches, bands, c): what the hypothesis's numbers do, moved either way."""
    numbers = at.hypothesis.numbers
    jobs = [(number, way) for number in range(len(numbers)) for way in (1.0, -1.0)]

    def moved(job: tuple[int, float]) -> FloatArray:
        number, way = job
        point = at.hypothesis.point.copy()
        point[number] += way * _move(numbers[number])
        return view.predicted(at.deviations, replace(at.hypothesis, point=point))

    there: list[FloatArray] = list(view.map_(moved, jobs))  # type: ignore[arg-type]
    return np.array(
        [(up - down) / (2 * _move(number)) for number, up, down in zip(numbers, there[::2], there[1::2], strict=True)]
    ).reshape(len(numbers), *at.predicted.shape)


def _stepped(view: View, at: Foreseen) -> Foreseen:
    own = np.array([_weighed(view, column) for column in own_columns(view, at)])
    off = _weighed(view, view.power.measured - at.predicted)
    t = 0 if view.by_deviations is None else len(at.deviations)
    known = [_weighed(view, column) for column in (() if view.by_deviations is None else view.by_deviations)]
    columns = np.vstack([*known, *own])
    columns[~np.isfinite(columns).all(axis=1)] = 0.0
    trust = np.minimum(1.0, TRUSTED / np.maximum(np.abs(off), TRUSTED))
    # Of the model's own numbers little is left to learn; where they leave much, something else is missing.
    believed = columns * (trust**3 if t else trust)
    pull = believed @ off
    products = believed @ columns.T
    if t:
        pull[:t] -= at.deviations
        products[:t, :t] += np.eye(t)
    products += 1e-9 * np.diag(np.maximum(np.diagonal(products), 1e-9))
    low, high = _reach(at, t)
    step = bounded_step(products, pull, low, high)
    there = at
    for share in SHARES:
        deviations = at.deviations + share * step[:t] if t else at.deviations
        there = foreseen(view, deviations, replace(at.hypothesis, point=at.hypothesis.point + share * step[t:]))
        if there.cost < at.cost:
            break
    return replace(there, errors=_errors(view, at, products))


def _errors(view: View, at: Foreseen, products: FloatArray) -> FloatArray:
    """(numbers,): standard errors, by the information that is left without what chance put into the columns."""
    numbers = at.hypothesis.numbers
    first = len(products) - len(numbers)
    chance = _weighed(view, np.broadcast_to(np.asarray(view.spread, dtype=np.float64), at.predicted.shape))
    information = products.copy()
    for k, number in enumerate(numbers, start=first):
        by_chance = float(chance @ chance) / (2 * view.ensemble * _move(number) ** 2)
        information[k, k] -= min(by_chance, MOST_BY_CHANCE * products[k, k])
    values, vectors = np.linalg.eigh(information)
    values = np.maximum(values, max(1e-9 * float(values[-1]), LEAST_KNOWN))
    spread = (vectors**2 / values).sum(axis=1) * max(at.cost, 1.0)
    return np.asarray(np.sqrt(spread[first:]))


def _reach(at: Foreseen, t: int) -> tuple[FloatArray, FloatArray]:
    numbers = at.hypothesis.numbers
    most = np.array([LONGEST_STEP if number.parameter.scale == "log" else 2 * _move(number) for number in numbers])
    bounds = np.array([number.bounds for number in numbers]).reshape(-1, 2) - at.hypothesis.point[:, None]
    low = np.concatenate([-3.0 - at.deviations[:t], np.clip(bounds[:, 0], -most, 0.0)])
    high = np.concatenate([3.0 - at.deviations[:t], np.clip(bounds[:, 1], 0.0, most)])
    return low, high


def _move(number: Number) -> float:
    if number.parameter.scale != "log":
        return number.move
    return float(np.clip(WIDEST * number.move, *MOVES))


def _huber(off: FloatArray) -> FloatArray:
    size = np.abs(off)
    return np.asarray(np.where(size <= TRUSTED, size**2, TRUSTED * (2 * size - TRUSTED)))


def _weighed(view: View, of: FloatArray) -> FloatArray:
    weights = view.weights
    return np.asarray((of * weights)[weights > 0])
