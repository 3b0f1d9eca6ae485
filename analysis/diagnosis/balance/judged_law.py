"""A law with the result of its test: its gain on held-out blocks, with a bound from bootstrap over blocks."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from analysis.diagnosis.balance.law import Formula, Law
from analysis.diagnosis.balance.regression import Regression
from analysis.diagnosis.settings import BOOTSTRAP_DRAWS, BOOTSTRAP_LEVEL, BOOTSTRAP_SEED
from equalizer.effects.catalogue import EFFECTS
from equalizer.plant.effect_vocabulary import DISCOVERED_LAW
from equalizer.signals.signal import FloatArray

NO_COLUMN = -1
"""Index in a regression of a law that changes the force itself."""


@dataclass(frozen=True, slots=True, eq=False)
class JudgedLaw:
    """A law with its parameters, its gain, and the reason where it is not named."""

    place: int
    """Index of the law in the regression."""
    law: Law
    values: dict[str, float]
    gain: float
    """Share of the held-out error power that it explains beside the other laws."""
    gain_low: float
    """Lower confidence bound of the gain, at 97.5 %."""
    share: float
    """The law's share of the gain of all laws together."""
    alike: tuple[str, ...]
    """Effects that fit as well in its place (class)."""
    probability: float
    """Share of bootstrap draws in which none of them has a smaller error."""
    why_not: str
    """Reason not to name it; empty where it is to be named."""
    stands_for: str = ""
    """The law that was chosen, where it has no simulation and this one is fitted in its place."""

    formula: Formula | None = None
    """Formula of a law that no catalogue effect simulates."""
    possible: bool = True
    """Whether its parameters have physically possible signs and sizes."""
    agreed: bool = False
    """Whether its gain, over the held-out blocks and the folds that it was chosen by, is significant."""

    @property
    def played_as(self) -> str:
        """The effect of the catalogue, or a law without a name, that simulations play."""
        return self.law.effect if self.formula is None else DISCOVERED_LAW

    @property
    def named(self) -> bool:
        return not self.why_not


def gain_with_bound(without: FloatArray, with_it: FloatArray) -> tuple[float, float]:
    """Share of the error power that a law takes, and its lower bound by bootstrap over blocks. Inputs: (blocks,)."""
    drawn = bootstrap_draws(len(without))
    shares = 1 - with_it[drawn].sum(axis=1) / np.maximum(without[drawn].sum(axis=1), 1e-300)
    return float(1 - with_it.sum() / max(float(without.sum()), 1e-300)), float(np.quantile(shares, BOOTSTRAP_LEVEL))


def agrees_with_folds(held: Sequence[FloatArray], folds: Sequence[FloatArray]) -> bool:
    """Whether a law has a gain on the held-out blocks, and a significant one on these and the folds together. Each:
    errors without the law, and with it, (blocks,)."""
    _, low = gain_with_bound(*(np.concatenate(each) for each in zip(held, folds, strict=True)))
    return low > 0 and gain_with_bound(*held)[0] > 0


def bootstrap_draws(blocks: int) -> npt.NDArray[np.int64]:
    """(`BOOTSTRAP_DRAWS`, blocks): indices of blocks drawn with replacement, always the same for a number of blocks."""
    return np.random.default_rng(BOOTSTRAP_SEED).integers(blocks, size=(BOOTSTRAP_DRAWS, blocks))


def force_ratio(regression: Regression, laws: Sequence[int], number: int) -> float:
    """Standard deviation of a law's own force over that of the recorded force."""
    columns, place = regression.columns_of(laws), regression.places[number]
    weights = np.zeros(regression.columns[0].shape[1])
    weights[columns] = regression.weights(columns)
    kept = [motion.valid_samples(motion.fit) for motion in regression.motions]
    own = [c[mask, place] @ weights[place] for c, mask in zip(regression.columns, kept, strict=True)]
    force = [f[mask] for f, mask in zip(regression.force, kept, strict=True)]
    return float(np.concatenate(own).std() / max(float(np.concatenate(force).std()), 1e-300))


def special_cases(effect: str) -> tuple[str, ...]:
    """Effects that a law contains as special cases: it always fits better than these."""
    return EFFECTS[effect].simpler if effect in EFFECTS else ()
