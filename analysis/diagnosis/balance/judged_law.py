"""A law with the result of its test: its gain on held-out blocks, with a bound from bootstrap over blocks."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from analysis.diagnosis.balance.law import Formula, Law
from analysis.diagnosis.balance.regression import Regression
from equalizer.effects.catalogue import EFFECTS
from equalizer.plant.effect_vocabulary import DISCOVERED_LAW

NO_COLUMN = -1
"""Index in a regression of a law that changes the force itself."""
DRY_FRICTIONS = {
    "coulomb_friction", "asymmetric_friction", "stribeck_friction", "presliding_hysteresis",
    "position_dependent_friction", "drifting_friction", "condition_dependent_friction",
}  # fmt: skip
"""Laws of dry friction, which act alike where a recording moves in a single way."""
FAMILIES = (
    DRY_FRICTIONS | {"quadratic_damping"},
    {"hardening_stiffness", "asymmetric_stiffness", "end_stop", "backlash", "gravity_torque"},
)  # fmt: skip
"""Effects that act alike. Where a law and its equally good rivals are of one family, it is named with them as its
class; where a rival is of another family, nothing is named. An effect that is not listed is a family of its own."""


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
    def has_column(self) -> bool:
        """Whether it is a term of the regression, not a change of the force itself."""
        return self.place != NO_COLUMN

    @property
    def named(self) -> bool:
        return not self.why_not


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


def family_of(effect: str) -> set[str]:
    """Effects that may form a class with this one, itself included; it alone where it is in none of `FAMILIES`."""
    return next((family for family in FAMILIES if effect in family), {effect})
