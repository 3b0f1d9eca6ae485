"""A law of a force balance with the result of its test on blocks of samples, and the choice of these blocks.

The test compares two sums of squared force errors E over these blocks: of the chosen laws, and of the same laws without
this one. Its gain is 1 - E(with it) / E(without it); the lower bound of the gain is from a bootstrap over blocks
(Kunsch, Ann. Stat. 17:1217, 1989). `judge_laws` and `actuator` run the test.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from analysis.diagnosis.balance.blocks import Block
from analysis.diagnosis.balance.laws.free_laws import FREE_LAWS, FREE_POSITION_LAWS, FREE_SPEED_LAWS
from analysis.diagnosis.balance.laws.law import Formula, Law
from analysis.diagnosis.balance.regression import Regression
from analysis.diagnosis.limits import LEAST_JUDGED_BLOCKS, STILL_SHARE
from equalizer.effects.catalogue import EFFECTS
from equalizer.plant.effect_vocabulary import DISCOVERED_LAW
from equalizer.signals.signal import FloatArray

NO_COLUMN = -1
"""Value of `JudgedLaw.law_index` for a law of the command: it changes the force itself and has no column."""
INSIGNIFICANT_GAIN_OBJECTION = (
    "its gain on held-out data is not larger than its variation between stretches of the recording"
)
FRICTIONS = {
    "coulomb_friction", "asymmetric_friction", "stribeck_friction", "presliding_hysteresis",
    "position_dependent_friction", "drifting_friction", "condition_dependent_friction",
}  # fmt: skip
"""Laws of dry friction, whose forces are similar where the recorded motion does not vary."""
SIMULATED_AS = {"drifting_friction": "coulomb_friction"}
"""Laws without a simulation, each with the law that is simulated in its place and forms a class with it."""
FAMILIES = (
    FRICTIONS | {"quadratic_damping"},
    {"hardening_stiffness", "asymmetric_stiffness", "end_stop", "backlash", "gravity_torque"},
    FREE_SPEED_LAWS,
    FREE_POSITION_LAWS,
)  # fmt: skip
"""Families of effects with similar forces: a law may be named together with rivals of its family, which form its class
(`judge_laws`). An unlisted effect is a family of its own."""


@dataclass(frozen=True, slots=True, eq=False)
class JudgedLaw:
    """A law with its parameters, its gain on the test blocks, and the reason not to name it, if there is one."""

    law_index: int
    """Index of the law in the regression; `NO_COLUMN` for a law of the command."""
    law: Law
    values: dict[str, float]
    """Parameters of the effect by name; empty where they are not physical, or the law has none."""
    gain: float
    """Share of the squared error that the law removes when it is added to the other laws; a law of the command may
    replace these."""
    gain_low: float
    """Lower end of the 95 % bootstrap interval of the gain: the 2.5 % quantile."""
    share: float
    """Decrease of the squared error by this law, over the decrease by all laws together; for a law of the command, over
    the error of the linear balance."""
    equivalents: tuple[str, ...]
    """Rivals: effects that fit about as well in place of this law; not sought for a further law of the motion."""
    probability: float
    """Share of bootstrap draws in which no other effect in its place has a smaller error, apart from effects that
    contain it as a special case; 0 for a further law of the motion."""
    objection: str
    """Reason not to name the law, as a clause; empty where it is named."""
    stands_for: str = ""
    """Effect that was chosen but has no simulation, where `law` replaces it; else empty."""
    formula: Formula | None = None
    """Formula for the simulation of a law that is no effect of the catalogue; else None."""
    is_physical: bool = True
    """Whether its parameters have physically possible signs, and its force is not far above the recorded one."""
    confirmed_by_folds: bool = False
    """Whether the law has a gain on the held-out blocks, and a significant gain on these and the cross-validation folds
    together."""

    @property
    def simulated_as(self) -> str:
        """Name of the effect that simulates the law: an effect of the catalogue, or `DISCOVERED_LAW` for a formula."""
        return self.law.effect if self.formula is None else DISCOVERED_LAW

    @property
    def is_free(self) -> bool:
        """Whether the law is none of the catalogue but one of `free_laws`, with a formula."""
        return self.law.effect in FREE_LAWS and self.formula is not None

    @property
    def has_column(self) -> bool:
        """Whether the law is a term of the regression, rather than a law of the command."""
        return self.law_index != NO_COLUMN

    @property
    def named(self) -> bool:
        """Whether there is no reason not to name the law."""
        return not self.objection


def compute_force_ratio(regression: Regression, laws: Sequence[int], law_index: int) -> float:
    """Compute the standard deviation of a law's force over that of the recorded force, on the samples to fit. laws:
    indices, fitted together. law_index: the law among them."""
    columns, law_columns = regression.select_columns(laws), regression.column_ranges[law_index]
    weights = np.zeros(regression.columns[0].shape[1])
    weights[columns] = regression.fit_weights(columns)
    masks = [motion.mask_valid_samples(motion.fit) for motion in regression.motions]
    law_force = [
        rows[mask, law_columns] @ weights[law_columns] for rows, mask in zip(regression.columns, masks, strict=True)
    ]
    force = [motion_force[mask] for motion_force, mask in zip(regression.force, masks, strict=True)]
    return float(np.concatenate(law_force).std() / max(float(np.concatenate(force).std()), 1e-300))


def list_special_cases(effect: str) -> tuple[str, ...]:
    """List the effects that are special cases of a law; empty for a law outside the catalogue."""
    return EFFECTS[effect].simpler if effect in EFFECTS else ()


def find_family(effect: str) -> set[str]:
    """Find the family in `FAMILIES` that contains an effect; the effect alone where none does."""
    return next((family for family in FAMILIES if effect in family), {effect})


def select_test_blocks(regression: Regression) -> tuple[Block, ...]:
    """Select the blocks for tests. Held-out blocks: where there are `LEAST_JUDGED_BLOCKS` of them, with motion. Else
    the fit blocks, by cross-validation: where the held-out ones are fewer, or the motion is spread over the equivalent
    of `LEAST_JUDGED_BLOCKS` fit blocks. Else none, because a single movement cannot test a law."""
    if len(regression.test) >= LEAST_JUDGED_BLOCKS and has_held_out_motion(regression):
        return regression.test
    fit_squared_speeds = _compute_mean_square_speeds(regression, regression.fit)
    moves_often = float(fit_squared_speeds.sum()) ** 2 >= LEAST_JUDGED_BLOCKS * float(
        fit_squared_speeds @ fit_squared_speeds
    )
    return regression.fit if moves_often or len(regression.test) < LEAST_JUDGED_BLOCKS else ()


def has_held_out_motion(regression: Regression) -> bool:
    """Whether the mean square speed in the held-out blocks, at least one, is `STILL_SHARE` or more of that in the fit
    blocks."""
    fit_squared_speed, test_squared_speed = (
        _compute_mean_square_speeds(regression, blocks).mean() for blocks in (regression.fit, regression.test)
    )
    return bool(test_squared_speed >= STILL_SHARE * fit_squared_speed)


def _compute_mean_square_speeds(regression: Regression, blocks: Sequence[Block]) -> FloatArray:
    """Compute the mean square speed of the driven channel in each block, (blocks,), relative to its scale. With a given
    model, whose base has no column of the speed, it is that of the column with the same index."""
    speed_column = len(regression.motions[0].channels) + regression.base_terms.driven_channel
    return np.array([block.gram[speed_column, speed_column] / max(len(block.rows), 1) for block in blocks])
