"""Composition of a bank of concealed effects: draws the case of each number, stratified in blocks of forty cases.

A block of forty cases has ten with nothing missing, eighteen with one effect, four with two, four with an effect
outside the catalogue, and four where the diagnosis may not name the true effect. Five of the forty have larger nuisance
effects, and five come from a second physics engine. The order within a block is random. All counts and shares are
chosen.

The random streams of a bank's seed have the keys 1 (order of a block), 2 (a case) and 3 (order of the effects, and
first strength of each).
"""

from dataclasses import dataclass
from typing import Literal, cast

import numpy as np

from study.evaluation.challenge.case_settings import CaseSettings
from study.evaluation.challenge.draw_case import DECOYS, EFFECTS, Case, ModelOrigin, draw_case
from study.evaluation.challenge.second_engine import mujoco_access

CaseKind = Literal["nothing", "single", "pair", "outside", "without"]
"""How many effects are missing in the model: none, one or two; an effect outside the catalogue; or an effect that the
diagnosis may not name."""
BankPart = Literal["main", "dirty", "engine"]
"""Part of a bank: nuisance effects (`nuisance_effects`) of ordinary size (main), of twice that size (dirty), or the
second physics engine without nuisance effects (engine)."""

CASE_COUNTS: dict[tuple[CaseKind, BankPart], int] = {
    ("nothing", "main"): 8, ("nothing", "dirty"): 1, ("nothing", "engine"): 1,
    ("single", "main"): 10, ("single", "dirty"): 4, ("single", "engine"): 4,
    ("pair", "main"): 4, ("outside", "main"): 4, ("without", "main"): 4,
}  # fmt: skip
"""Number of cases of each kind and part of the bank in a block of forty."""
CASE_BLOCK: tuple[tuple[CaseKind, BankPart], ...] = tuple(
    kind_and_bank for kind_and_bank, count in CASE_COUNTS.items() for _ in range(count)
)
"""Kind and part of the bank of each case of a block, before randomisation of the order."""
NUISANCE_SIZES: dict[BankPart, float] = {"main": 1.0, "dirty": 2.0, "engine": 0.0}
"""Size of the nuisance effects by part of the bank, relative to the main part."""
LOWEST_STRENGTHS: dict[CaseKind, float] = {"nothing": 0.0, "single": 0.0, "pair": 0.4, "outside": 0.3, "without": 0.4}
"""Lowest strength (0 to 1) per kind. Single effects range from undetectable to strong; the other kinds test the answer
to a detectable effect and begin at a higher strength."""
GOLDEN_STEP = 0.5 * (5**0.5 - 1)
"""Step between the successive strengths of an effect, modulo 1: multiples of the golden ratio 0.618 fill a range
evenly."""
AXIS_COUNT_SHARES = (0.72, 0.14)
"""Fractions of the cases with one and with two driven axes; the others have three, as have all with an effect of
`THREE_AXIS_EFFECTS`."""
STEPS_PER_SAMPLE = 80
"""Integration steps per sample, so many that a diagnosis cannot detect the integration error."""
THREE_AXIS_EFFECTS = ("sensor_misalignment", "cross_axis_sensitivity", "crossed_axes", "extra_mode")
"""Effects that can be identified with three axes only: they need the readings of the other axes, or the direction of a
mode, whose reaction on a single axis equals that of a smaller mass."""
EXCLUSIVE_EFFECTS = (
    frozenset(name for name in EFFECTS if "friction" in name or name == "presliding_hysteresis"),
    frozenset(("sensor_misalignment", "cross_axis_sensitivity")),
)
"""Sets of effects that use the same parameters of the simulated device, which can have only one effect of each set."""


@dataclass(frozen=True, slots=True)
class CaseDraw:
    """The drawn design of a case: concealed effects, origin of the model, driven axes and size of the recording."""

    number: int
    """Number in the bank, from 0."""
    seed: int
    """Seed of the simulation: the bank's seed plus the number."""
    kind: CaseKind
    bank: BankPart
    effects: tuple[str, ...]
    """Names of the concealed effects."""
    strengths: tuple[float, ...]
    """Strength of each effect, 0 to 1."""
    concealed: ModelOrigin
    """Origin of the model, calibrated or retuned."""
    settings: CaseSettings

    @property
    def excluded_effects(self) -> tuple[str, ...]:
        """Effects that the diagnosis must not consider."""
        return self.effects if self.kind == "without" else ()


def draw_case_plan(seed: int, number: int, short_periods: bool = False) -> CaseDraw:
    """Draw the design of a case. The same seed and number give the same case in a bank of any size. short_periods: 1000
    samples per period in place of 2000. The model is calibrated or retuned with equal probability, but always
    calibrated with a concealed hand. A multisine has three periods with short periods or fewer than three axes, else
    four."""
    block_number, position_in_block = divmod(number, len(CASE_BLOCK))
    block_order = np.random.default_rng([seed, 1, block_number]).permutation(len(CASE_BLOCK))
    kind, bank = CASE_BLOCK[block_order[position_in_block]]
    random = np.random.default_rng([seed, 2, number])
    # Number of earlier cases of this kind and bank: all effects are used in turn, each with evenly spread strengths.
    earlier_cases = block_number * CASE_BLOCK.count((kind, bank)) + sum(
        CASE_BLOCK[case_index] == (kind, bank) for case_index in block_order[:position_in_block]
    )
    effects, strengths = _draw_effects(seed, kind, bank, earlier_cases, random)
    axes = _draw_axes(effects, random)
    has_three_periods = len(axes) < 3 or short_periods
    settings = CaseSettings(
        axes, 1000 if short_periods else 2000, 3 if has_three_periods else 4, NUISANCE_SIZES[bank], STEPS_PER_SAMPLE
    )
    has_hand = "hand_impedance" in effects
    origin = cast(ModelOrigin, "calibrated" if has_hand else str(random.choice(["calibrated", "retuned"])))
    return CaseDraw(number, seed + number, kind, bank, effects, strengths, origin, settings)


def generate_case(case_draw: CaseDraw, name: str) -> Case:
    """Simulate the drawn case. name: device name in recording and model. Raises ImportError where MuJoCo is needed and
    not installed."""
    if case_draw.bank == "engine":
        return mujoco_access.draw_engine_case(
            case_draw.seed, case_draw.effects, case_draw.concealed, case_draw.strengths, name, case_draw.settings
        )
    return draw_case(
        case_draw.seed, case_draw.effects, case_draw.concealed, case_draw.strengths or None, name, case_draw.settings
    )


def _draw_effects(
    seed: int, kind: CaseKind, bank: BankPart, earlier_cases: int, random: np.random.Generator
) -> tuple[tuple[str, ...], tuple[float, ...]]:
    """Draw effects and strengths of a case. earlier_cases: number of earlier cases of the same kind and bank. The cases
    pass through all effects in the same random order; the strength of an effect advances by `GOLDEN_STEP` at each
    pass. Pairs are drawn independently."""
    lowest_strength = LOWEST_STRENGTHS[kind]
    if kind == "nothing":
        return (), ()
    if kind == "pair":
        return _draw_pair(random), tuple(float(value) for value in random.uniform(lowest_strength, 1.0, 2))
    effect_names = tuple(DECOYS if kind == "outside" else mujoco_access.MUJOCO_EFFECTS if bank == "engine" else EFFECTS)
    stream_seed = [seed, 3, sorted(LOWEST_STRENGTHS).index(kind), sorted(NUISANCE_SIZES).index(bank)]
    effect_order = np.random.default_rng(stream_seed).permutation(len(effect_names))
    pass_number, order_position = divmod(earlier_cases, len(effect_names))
    effect_index = int(effect_order[order_position])
    strength_share = (np.random.default_rng([*stream_seed, effect_index]).random() + pass_number * GOLDEN_STEP) % 1.0
    return (effect_names[effect_index],), (float(lowest_strength + (1.0 - lowest_strength) * strength_share),)


def _draw_pair(random: np.random.Generator) -> tuple[str, str]:
    """Draw two different effects that a device can have together."""
    while True:
        first, second = (str(name) for name in random.choice(list(EFFECTS), 2, replace=False))
        if not any({first, second} <= names for names in EXCLUSIVE_EFFECTS):
            return first, second


def _draw_axes(effects: tuple[str, ...], random: np.random.Generator) -> tuple[int, ...]:
    """Draw the driven axes of a case, in ascending order; three where an effect needs them."""
    axis_count_draw, first_axis = random.random(), int(random.integers(3))
    if "hand_impedance" in effects:
        first_axis = 0  # its parameters `mass`, `damping` and `stiffness` are those of x
    if axis_count_draw > sum(AXIS_COUNT_SHARES) or any(name in THREE_AXIS_EFFECTS for name in effects):
        return (0, 1, 2)
    if axis_count_draw > AXIS_COUNT_SHARES[0]:
        second_axis = (first_axis + int(random.integers(1, 3))) % 3
        return (min(first_axis, second_axis), max(first_axis, second_axis))
    return (first_axis,)
