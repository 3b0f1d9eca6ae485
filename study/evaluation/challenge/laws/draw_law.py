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
from study.evaluation.challenge.case_settings import CaseSettings
from study.evaluation.challenge.device import Device, simulate_full_motion
from study.evaluation.challenge.draw_bank import STEPS_PER_SAMPLE, THREE_AXIS_EFFECTS
from study.evaluation.challenge.draw_case import (
    EFFECTS,
    Case,
    ModelOrigin,
    compute_detectability,
    draw_case,
    make_recording,
)
from study.evaluation.challenge.drive_plan import RATE_HZ, DrivePlan, draw_multisine, draw_plan
from study.evaluation.challenge.laws.build_law import LawTruth, build_law
from study.evaluation.challenge.laws.concealed_laws import LAW_KINDS, LAWS_BY_NAME
from study.evaluation.challenge.mechanism_kernel import Motion
from study.evaluation.challenge.nominal_models import as_model, draw_calibration, retune
from study.evaluation.challenge.nuisance_effects import add_nuisance_effects
from study.evaluation.challenge.sensor import read_sensor

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
CATALOGUED = tuple(name for name in EFFECTS if name not in (*THREE_AXIS_EFFECTS, MODE, "hand_impedance"))
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
    """`LOWEST_STRENGTHS` to 1."""
    model: ModelOrigin
    """Origin of the model, calibrated or retuned."""
    settings: CaseSettings


@dataclass(frozen=True, slots=True, eq=False)
class FreshTestMotion:
    """Noise-free motion under commands that no recording contains, by which a found law is judged. Arrays (samples,
    axes) of the driven axes."""

    level_n: float
    """Level of the command (N); per axis it is divided by the root of the number of axes."""
    command: FloatArray
    """N, before a law of the drive."""
    motion: Motion
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
    fresh_motions: tuple[FreshTestMotion, ...]
    """For devices with a law: a motion at the level `FRESH_N`, then at `LOUD_N`. Empty for others."""


def draw_law(seed: int, number: int, brief: bool = False) -> LawDraw:
    """Draw the case of a number. The same seed and number give the same case. brief: periods of half the length."""
    turn, position = divmod(number, len(TURN))
    order = np.random.default_rng([seed, 41, turn]).permutation(len(TURN))
    kind = TURN[order[position]]
    random = np.random.default_rng([seed, 42, number])
    earlier_cases = turn * COUNTS[kind] + sum(TURN[bank_kind] == kind for bank_kind in order[:position])
    names = tuple(law_kind.name for law_kind in LAW_KINDS) if kind == "law" else CATALOGUED
    name_index = int(
        np.random.default_rng([seed, 43, earlier_cases // len(names)]).permutation(len(names))[
            earlier_cases % len(names)
        ]
    )
    concealed = {"law": names[name_index], "decoy": names[name_index], "mode": MODE, "nothing": ""}[kind]
    has_two_axes = (kind == "law" and LAWS_BY_NAME[concealed].axes == 2) or random.random() > ONE_AXIS
    axes = tuple(sorted(int(axis) for axis in random.choice(3, 2 if has_two_axes else 1, replace=False)))
    model = cast(ModelOrigin, str(random.choice(["calibrated", "retuned"])))
    settings = CaseSettings(axes, 1000 if brief else 2000, 3, 1.0, STEPS_PER_SAMPLE, LOUD_N)
    return LawDraw(number, seed + number, kind, concealed, float(random.uniform(LOWEST, 1.0)), model, settings)


def generate_law_case(law_draw: LawDraw, name: str) -> LawCase:
    """Generate the drawn case. name: device name in recording and model. Raises ValueError where the motion diverges
    with the law at any strength that is tried."""
    if law_draw.kind != "law":
        effects = (law_draw.concealed,) if law_draw.concealed else ()
        strengths = law_draw.strength if effects else None
        return LawCase(draw_case(law_draw.seed, effects, law_draw.model, strengths, name, law_draw.settings), None, ())
    random, settings = np.random.default_rng([law_draw.seed, 44]), law_draw.settings
    bench, plan = draw_bench(random), draw_plan(random, settings)
    baseline = add_nuisance_effects(Device(bench, steps=settings.steps), settings.extras, law_draw.seed)
    base_motion = simulate_full_motion(baseline, plan.command)
    device, true_motion, truth = _build_law_scaled(law_draw, baseline, (base_motion, plan), random)
    response, position = read_sensor(device.sensor, true_motion.acceleration, true_motion.position, RATE_HZ, random)
    if law_draw.model == "calibrated":
        nominal, tolerance = draw_calibration(bench, random, settings.axes)
    else:
        nominal, tolerance = retune(bench, response, plan, settings.axes)
    model = as_model(name, nominal, tolerance, settings.axes)
    recording = make_recording(name, plan, response, position, settings)
    motions = tuple((part.acceleration, part.position) for part in (base_motion, true_motion))
    case = Case(
        recording,
        model,
        (),
        _refuse_repeat,
        compute_detectability(baseline, device, (motions[0], motions[1]), settings),
    )
    return LawCase(
        case, truth, tuple(_make_fresh_motion(device, settings, random, level) for level in (FRESH_N, LOUD_N))
    )


def _build_law_scaled(
    law_draw: LawDraw, baseline: Device, base_motion: tuple[Motion, DrivePlan], random: np.random.Generator
) -> tuple[Device, Motion, LawTruth]:
    """Build in a law at the drawn strength, or at a half or a quarter of it where the motion would diverge or exceed
    three times that without the law. Raises ValueError where all three do. The parameters are the same for each."""
    (motion, plan), axes = base_motion, law_draw.settings.axes
    first_index = int(random.integers(len(axes)))
    places = (axes[first_index], axes[(first_index + 1) % len(axes)])
    state = random.bit_generator.state
    for strength in (law_draw.strength, law_draw.strength / 2, law_draw.strength / 4):
        random.bit_generator.state = state
        device, truth = build_law(
            baseline, LAWS_BY_NAME[law_draw.concealed], (motion, plan.command), places, strength, random
        )
        try:
            law_motion = simulate_full_motion(device, plan.command)
        except (ValueError, ZeroDivisionError):
            continue
        if np.abs(law_motion.position).max() < 3 * np.abs(motion.position).max():
            return device, law_motion, truth
    raise ValueError(f"the device runs away with the law '{law_draw.concealed}', seed {law_draw.seed}")


def _refuse_repeat(command: FloatArray, kind: str, added_kg: float, noise: int) -> Recording:
    """`Case.record_again` of a device with a law: such cases have no further experiments. Raises ValueError."""
    raise ValueError("a device with a law is not recorded again")


def _make_fresh_motion(
    device: Device, settings: CaseSettings, random: np.random.Generator, level_n: float
) -> FreshTestMotion:
    """Motion of the device under a new multisine on all driven axes."""
    command = np.zeros((FRESH_PERIOD * FRESH_PERIODS, 3))
    for axis in settings.axes:
        command[:, axis] = np.tile(
            draw_multisine(random, level_n / len(settings.axes) ** 0.5, FRESH_PERIOD), FRESH_PERIODS
        )
    motion, axes = simulate_full_motion(device, command), list(settings.axes)
    changed_command = command if device.drive_law is None else device.drive_law(command)
    reading = motion.acceleration if device.sensor.static_law is None else device.sensor.static_law(motion.acceleration)
    return FreshTestMotion(
        level_n, command[:, axes], Motion(*(part[:, axes] for part in motion)), reading[:, axes],
        (motion.lawful + changed_command - command)[:, axes],
    )  # fmt: skip
