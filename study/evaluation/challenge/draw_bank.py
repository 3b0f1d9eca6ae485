"""Composition of a bank of concealed effects: draws the case of each number, stratified in turns of forty cases.

A turn of forty cases has ten with nothing missing, eighteen with one effect, four with two, four with an effect outside
the catalogue, and four where the diagnosis may not name the true effect. Five of the forty have larger nuisance effects
(`extras`), and five come from a second physics engine. The order within a turn is random.
"""

from dataclasses import dataclass
from typing import Literal, cast

import numpy as np

from study.evaluation.challenge.draw_case import DECOYS, EFFECTS, Case, Concealed, draw_case
from study.evaluation.challenge.rig import Rig
from study.evaluation.challenge.second_engine import second_engine

Kind = Literal["nothing", "single", "pair", "outside", "without"]
"""How many effects are missing in the model: none, one or two; an effect outside the catalogue; or an effect that the
diagnosis may not name."""
Bank = Literal["main", "dirty", "engine"]
"""Nuisance effects (`extras`) of ordinary size, of twice that size, or the second engine without nuisance effects."""

COUNTS: dict[tuple[Kind, Bank], int] = {
    ("nothing", "main"): 8, ("nothing", "dirty"): 1, ("nothing", "engine"): 1,
    ("single", "main"): 10, ("single", "dirty"): 4, ("single", "engine"): 4,
    ("pair", "main"): 4, ("outside", "main"): 4, ("without", "main"): 4,
}  # fmt: skip
"""Number of cases of each kind and bank in a turn of forty."""
TURN: tuple[tuple[Kind, Bank], ...] = tuple(each for each, count in COUNTS.items() for _ in range(count))
"""Kind and bank of each case of a turn; the turn repeats."""
EXTRAS: dict[Bank, float] = {"main": 1.0, "dirty": 2.0, "engine": 0.0}
"""Size of the nuisance effects, relative to the main bank."""
LOWEST: dict[Kind, float] = {"nothing": 0.0, "single": 0.0, "pair": 0.4, "outside": 0.3, "without": 0.4}
"""Lowest strength per kind. Single effects range from undetectable to strong; the other kinds test the answer to a
detectable effect and begin at a higher strength."""
GOLDEN = 0.5 * (5**0.5 - 1)
"""Step between the successive strengths of an effect, modulo 1: multiples of the golden ratio fill a range evenly."""
SIZES = (0.72, 0.14)
"""Fractions of the cases with one and with two driven axes; the others have three."""
STEPS = 80
"""Integration steps per sample: so many that a diagnosis does not find the integration error."""
ALL_AXES = ("sensor_misalignment", "cross_axis_sensitivity", "crossed_axes", "extra_mode")
"""Effects that can be identified with three axes only: they need the readings of the other axes, or the direction of a
mode, whose reaction on a single axis equals that of a smaller mass."""
ONE_ROW = (
    frozenset(name for name in EFFECTS if "friction" in name or name == "presliding_hysteresis"),
    frozenset(("sensor_misalignment", "cross_axis_sensitivity")),
)
"""Sets of effects that use the same table row of a device, which can have only one effect of each set."""


@dataclass(frozen=True, slots=True)
class Draw:
    """The draw for a number of the bank: what is concealed, the origin of the model, and the size of the bench."""

    number: int
    seed: int
    kind: Kind
    bank: Bank
    effects: tuple[str, ...]
    strengths: tuple[float, ...]
    """Strength of each effect, 0 to 1."""
    concealed: Concealed
    """Origin of the model, calibrated or retuned."""
    rig: Rig

    @property
    def without(self) -> tuple[str, ...]:
        """Effects that the diagnosis must not consider."""
        return self.effects if self.kind == "without" else ()


def draw(seed: int, number: int, brief: bool = False) -> Draw:
    """Draw the case of a number. The same seed and number give the same case in a bank of any size. brief: short
    periods, and three of them, for tests."""
    turn, place = divmod(number, len(TURN))
    order = np.random.default_rng([seed, 1, turn]).permutation(len(TURN))
    kind, bank = TURN[order[place]]
    random = np.random.default_rng([seed, 2, number])
    # Number of earlier cases of this kind and bank: all effects are used in turn, each with evenly spread strengths.
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
    """Effects and strengths of a case. before: number of earlier cases of the same kind and bank. Each visit of all
    effects has the same random order; the strength of an effect advances by `GOLDEN` from visit to visit."""
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
    """Two different effects that a device can have together."""
    while True:
        first, second = (str(name) for name in random.choice(list(EFFECTS), 2, replace=False))
        if not any({first, second} <= row for row in ONE_ROW):
            return first, second


def _draw_axes(effects: tuple[str, ...], random: np.random.Generator) -> tuple[int, ...]:
    """Driven axes of a case, in ascending order."""
    drawn, first = random.random(), int(random.integers(3))
    if "hand_impedance" in effects:
        first = 0  # its parameters `mass`, `damping` and `stiffness` are those of x
    if drawn > sum(SIZES) or any(name in ALL_AXES for name in effects):
        return (0, 1, 2)
    if drawn > SIZES[0]:
        other = (first + int(random.integers(1, 3))) % 3
        return (min(first, other), max(first, other))
    return (first,)
