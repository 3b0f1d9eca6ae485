"""Draws the cases of a bank of laws: devices with a law outside the catalogue, and controls without such a law.

A turn of twenty cases has twelve with a law, four with nothing missing, three with an effect of the catalogue and one
with an additional linear mode, in random order. All laws, and all effects, are used before any is used again.
"""

from dataclasses import dataclass
from typing import Literal, cast

import numpy as np

from equalizer.signals.recording import Recording
from equalizer.signals.signal import FloatArray
from study.evaluation.challenge.bench import draw_bench
from study.evaluation.challenge.device import Device, whole_motion
from study.evaluation.challenge.draw_bank import ALL_AXES, STEPS
from study.evaluation.challenge.draw_case import EFFECTS, Case, Concealed, draw_case, make_recording, visibility
from study.evaluation.challenge.drive_plan import RATE_HZ, DrivePlan, draw_plan, multisine
from study.evaluation.challenge.extras import with_extras
from study.evaluation.challenge.laws.build_law import LawTruth, build_law
from study.evaluation.challenge.laws.concealed_laws import LAW_KINDS, LAW_OF_NAME
from study.evaluation.challenge.mechanism_kernel import Motion
from study.evaluation.challenge.nominal import as_model, draw_calibration, retune
from study.evaluation.challenge.rig import Rig
from study.evaluation.challenge.sensor import read

LawBankKind = Literal["law", "nothing", "decoy", "mode"]
"""What is concealed: a law, nothing, an effect of the catalogue, or a linear mode."""
COUNTS: dict[LawBankKind, int] = {"law": 12, "nothing": 4, "decoy": 3, "mode": 1}
"""Number of cases of each kind in a turn of twenty."""
TURN: tuple[LawBankKind, ...] = tuple(kind for kind, count in COUNTS.items() for _ in range(count))
"""Kind of each case of a turn; the turn repeats."""
LOWEST = 0.35
"""Lowest strength of a concealed law, effect or mode; the highest is 1."""
MODE = "extra_mode"
"""Effect of the kind `mode`."""
CATALOGUED = tuple(name for name in EFFECTS if name not in (*ALL_AXES, MODE, "hand_impedance"))
"""Effects of the kind `decoy`: all of the catalogue that can be identified on a single axis, except a hand."""
ONE_AXIS = 0.75
"""Fraction of the cases with one driven axis, of those whose law, if any, needs a single axis; the others have two."""
LOUD_N = 4.5
"""Level (N) of an additional test segment and of the second fresh motion: 1.5 times the highest level of the fit."""
FRESH_N, FRESH_PERIOD, FRESH_PERIODS = 2.0, 2000, 2
"""Fresh test motion, which no recording contains: nominal peak of its multisine (N), samples per period, periods."""


@dataclass(frozen=True, slots=True)
class LawDraw:
    """The draw for a number of the bank of laws."""

    number: int
    seed: int
    kind: LawBankKind
    concealed: str
    """Name of the concealed law or effect; empty for nothing."""
    strength: float
    """`LOWEST` to 1."""
    model: Concealed
    """Origin of the model, calibrated or retuned."""
    rig: Rig


@dataclass(frozen=True, slots=True, eq=False)
class Fresh:
    """Noise-free motion under commands that no recording contains, by which a found law is judged. Arrays (samples,
    axes) of the rig's axes."""

    level_n: float
    """Level of the command (N); per axis it is divided by the root of the number of axes."""
    command: FloatArray
    """N, before a law of the drive."""
    moved: Motion
    """True motion, SI units."""
    reading: FloatArray
    """m/s^2, with the law of the sensor but no other sensor effect."""
    lawful: FloatArray
    """N: force of the laws, with the change of the command by a law of the drive."""


@dataclass(frozen=True, slots=True, eq=False)
class LawCase:
    """A case of the bank of laws, its label, and fresh test motions."""

    case: Case
    truth: LawTruth | None
    """Label of the law; None where no law is concealed."""
    fresh: tuple[Fresh, ...]
    """For devices with a law: a motion at the level `FRESH_N`, then at `LOUD_N`. Empty for others."""


def draw_law(seed: int, number: int, brief: bool = False) -> LawDraw:
    """Draw the case of a number. The same seed and number give the same case. brief: periods of half the length."""
    turn, place = divmod(number, len(TURN))
    order = np.random.default_rng([seed, 41, turn]).permutation(len(TURN))
    kind = TURN[order[place]]
    random = np.random.default_rng([seed, 42, number])
    before = turn * COUNTS[kind] + sum(TURN[each] == kind for each in order[:place])
    names = tuple(each.name for each in LAW_KINDS) if kind == "law" else CATALOGUED
    which = int(np.random.default_rng([seed, 43, before // len(names)]).permutation(len(names))[before % len(names)])
    concealed = {"law": names[which], "decoy": names[which], "mode": MODE, "nothing": ""}[kind]
    two = (kind == "law" and LAW_OF_NAME[concealed].axes == 2) or random.random() > ONE_AXIS
    axes = tuple(sorted(int(axis) for axis in random.choice(3, 2 if two else 1, replace=False)))
    model = cast(Concealed, str(random.choice(["calibrated", "retuned"])))
    rig = Rig(axes, 1000 if brief else 2000, 3, 1.0, STEPS, LOUD_N)
    return LawDraw(number, seed + number, kind, concealed, float(random.uniform(LOWEST, 1.0)), model, rig)


def law_case(each: LawDraw, name: str) -> LawCase:
    """Generate the drawn case. name: device name in recording and model. Raises ValueError where the motion diverges
    with the law at any strength that is tried."""
    if each.kind != "law":
        effects = (each.concealed,) if each.concealed else ()
        strengths = each.strength if effects else None
        return LawCase(draw_case(each.seed, effects, each.model, strengths, name, each.rig), None, ())
    random, rig = np.random.default_rng([each.seed, 44]), each.rig
    bench, plan = draw_bench(random), draw_plan(random, rig)
    bare = with_extras(Device(bench, steps=rig.steps), rig.extras, each.seed)
    free = whole_motion(bare, plan.command)
    device, moved, truth = _lawful(each, bare, (free, plan), random)
    response, position = read(device.sensor, moved.acceleration, moved.position, RATE_HZ, random)
    if each.model == "calibrated":
        known, tolerance = draw_calibration(bench, random, rig.axes)
    else:
        known, tolerance = retune(bench, response, plan, rig.axes)
    model = as_model(name, known, tolerance, rig.axes)
    recording = make_recording(name, plan, response, position, rig)
    both = tuple((part.acceleration, part.position) for part in (free, moved))
    case = Case(recording, model, (), _refuse_further, visibility(bare, device, (both[0], both[1]), rig))
    return LawCase(case, truth, tuple(_make_fresh(device, rig, random, level) for level in (FRESH_N, LOUD_N)))


def _lawful(
    each: LawDraw, bare: Device, free: tuple[Motion, DrivePlan], random: np.random.Generator
) -> tuple[Device, Motion, LawTruth]:
    """Build in a law at the drawn strength, or at a half or a quarter of it where the motion would diverge or exceed
    three times that without the law. Raises ValueError where all three do. The parameters are the same for each."""
    (moved, plan), axes = free, each.rig.axes
    own = int(random.integers(len(axes)))
    places = (axes[own], axes[(own + 1) % len(axes)])
    state = random.bit_generator.state
    for strength in (each.strength, each.strength / 2, each.strength / 4):
        random.bit_generator.state = state
        device, truth = build_law(bare, LAW_OF_NAME[each.concealed], (moved, plan.command), places, strength, random)
        try:
            there = whole_motion(device, plan.command)
        except (ValueError, ZeroDivisionError):
            continue
        if np.abs(there.position).max() < 3 * np.abs(moved.position).max():
            return device, there, truth
    raise ValueError(f"the device runs away with the law '{each.concealed}', seed {each.seed}")


def _refuse_further(command: FloatArray, kind: str, added_kg: float, noise: int) -> Recording:
    """`Case.again` of a device with a law: such cases have no further experiments. Raises ValueError."""
    raise ValueError("a device with a law is not recorded again")


def _make_fresh(device: Device, rig: Rig, random: np.random.Generator, level_n: float) -> Fresh:
    """Motion of the device under a new multisine on all axes of the rig."""
    command = np.zeros((FRESH_PERIOD * FRESH_PERIODS, 3))
    for axis in rig.axes:
        command[:, axis] = np.tile(multisine(random, level_n / len(rig.axes) ** 0.5, FRESH_PERIOD), FRESH_PERIODS)
    moved, axes = whole_motion(device, command), list(rig.axes)
    driven = command if device.drive_law is None else device.drive_law(command)
    read_as = moved.acceleration if device.sensor.law is None else device.sensor.law(moved.acceleration)
    return Fresh(
        level_n, command[:, axes], Motion(*(part[:, axes] for part in moved)), read_as[:, axes],
        (moved.lawful + driven - command)[:, axes],
    )  # fmt: skip
