"""Contents of a bank: the case drawn for each number, so that any part of it is a fair sample of the whole.

Of every forty: ten with nothing missing, eighteen with one effect, four with two, four outside the catalogue, and four
where the diagnosis must do without the true effect. One in eight has more concealed extras, one in eight comes from a
second physics engine.
"""

from dataclasses import dataclass
from typing import Literal, cast

import numpy as np

from study.evaluation.challenge.draw_case import DECOYS, EFFECTS, Case, Concealed, draw_case
from study.evaluation.challenge.rig import Rig
from study.evaluation.challenge.second_engine import second_engine

Kind = Literal["nothing", "single", "pair", "outside", "without"]
"""How many effects are missing in the model: none, one, two; one outside the catalogue; or one that the diagnosis is
not allowed to name."""
Bank = Literal["main", "dirty", "engine"]
"""Ordinary extras, twice as large ones, or the second engine without any."""

COUNTS: dict[tuple[Kind, Bank], int] = {
    ("nothing", "main"): 8, ("nothing", "dirty"): 1, ("nothing", "engine"): 1,
    ("single", "main"): 10, ("single", "dirty"): 4, ("single", "engine"): 4,
    ("pair", "main"): 4, ("outside", "main"): 4, ("without", "main"): 4,
}  # fmt: skip
"""Number of devices of each kind and bank in a turn of forty."""
TURN: tuple[tuple[Kind, Bank], ...] = tuple(each for each, count in COUNTS.items() for _ in range(count))
"""Kind and bank of each case of a turn; the turn repeats."""
EXTRAS: dict[Bank, float] = {"main": 1.0, "dirty": 2.0, "engine": 0.0}
"""Size of the concealed extras, relative to that of the main bank."""
LOWEST: dict[Kind, float] = {"nothing": 0.0, "single": 0.0, "pair": 0.4, "outside": 0.3, "without": 0.4}
"""Lowest strength per kind. Single effects range from undetectable to strong; the others test what is said about a
detectable effect."""
GOLDEN = 0.5 * (5**0.5 - 1)
"""Step between strengths of an effect's turns, modulo 1: multiples of the golden ratio fill a range evenly."""
SIZES = (0.72, 0.14)
"""Fractions of the bank with one and with two driven axes."""
STEPS = 80
"""Integration steps per sample: enough that the integration error is not what a diagnosis finds."""
ALL_AXES = ("sensor_misalignment", "cross_axis_sensitivity", "crossed_axes", "extra_mode")
"""Effects that need three axes to be identifiable: the others' readings, or the direction of a mode, whose reaction on
one axis is that of less mass."""
ONE_ROW = (
    frozenset(name for name in EFFECTS if "friction" in name or name == "presliding_hysteresis"),
    frozenset(("sensor_misalignment", "cross_axis_sensitivity")),
)
"""Sets of effects that share one table row: a device can have only one of each."""


@dataclass(frozen=True, slots=True)
class Draw:
    """What was drawn for one number of the bank."""

    number: int
    seed: int
    kind: Kind
    bank: Bank
    effects: tuple[str, ...]
    strengths: tuple[float, ...]
    concealed: Concealed
    rig: Rig

    @property
    def without(self) -> tuple[str, ...]:
        """Effects that the diagnosis must not consider."""
        return self.effects if self.kind == "without" else ()


def draw(seed: int, number: int, brief: bool = False) -> Draw:
    """Draw the case of one number: the same for the same seed and number, however large the bank. brief: one axis
    and short periods, for tests."""
    turn, place = divmod(number, len(TURN))
    order = np.random.default_rng([seed, 1, turn]).permutation(len(TURN))
    kind, bank = TURN[order[place]]
    random = np.random.default_rng([seed, 2, number])
    # How many of this kind came before: effects take their turns, and each one's strengths spread evenly.
    before = turn * TURN.count((kind, bank)) + sum(TURN[k] == (kind, bank) for k in order[:place])
    effects, strengths = _draw_effects(seed, kind, bank, before, random)
    axes = _draw_axes(effects, random)
    short = len(axes) < 3 or brief
    rig = Rig(axes, 1000 if brief else 2000, 3 if short else 4, EXTRAS[bank], STEPS)
    held = "hand_impedance" in effects
    concealed = cast(Concealed, "calibrated" if held else str(random.choice(["calibrated", "retuned"])))
    return Draw(number, seed + number, kind, bank, effects, strengths, concealed, rig)


def case_of(each: Draw, name: str) -> Case:
    """Generate the drawn case. name: device name in recording and model. Raises ImportError where MuJoCo is needed
    and not installed."""
    if each.bank == "engine":
        return second_engine.draw_engine_case(each.seed, each.effects, each.concealed, each.strengths, name, each.rig)
    return draw_case(each.seed, each.effects, each.concealed, each.strengths or None, name, each.rig)


def _draw_effects(
    seed: int, kind: Kind, bank: Bank, before: int, random: np.random.Generator
) -> tuple[tuple[str, ...], tuple[float, ...]]:
    lowest = LOWEST[kind]
    if kind == "nothing":
        return (), ()
    if kind == "pair":
        return _draw_pair(random), tuple(float(each) for each in random.uniform(lowest, 1.0, 2))
    names = tuple(DECOYS if kind == "outside" else second_engine.EFFECTS if bank == "engine" else EFFECTS)
    own = [seed, 3, sorted(LOWEST).index(kind), sorted(EXTRAS).index(bank)]
    order = np.random.default_rng(own).permutation(len(names))
    visit, index = divmod(before, len(names))
    which = int(order[index])
    share = (np.random.default_rng([*own, which]).random() + visit * GOLDEN) % 1.0
    return (names[which],), (float(lowest + (1.0 - lowest) * share),)


def _draw_pair(random: np.random.Generator) -> tuple[str, str]:
    while True:
        first, second = (str(name) for name in random.choice(list(EFFECTS), 2, replace=False))
        if not any({first, second} <= row for row in ONE_ROW):
            return first, second


def _draw_axes(effects: tuple[str, ...], random: np.random.Generator) -> tuple[int, ...]:
    drawn, first = random.random(), int(random.integers(3))
    if "hand_impedance" in effects:
        first = 0  # its parameters are those of x
    if drawn > sum(SIZES) or any(name in ALL_AXES for name in effects):
        return (0, 1, 2)
    if drawn > SIZES[0]:
        other = (first + int(random.integers(1, 3))) % 3
        return (min(first, other), max(first, other))
    return (first,)
