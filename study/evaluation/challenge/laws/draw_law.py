"""Draw and generate the cases of a bank of laws: devices with a law outside the catalogue, and controls without one.

A turn of twenty cases has twelve with a law, four with nothing missing, three with an effect of the catalogue and one
with an additional linear mode, in random order. All laws, and all of `DECOY_EFFECTS`, are used before any is used
again. All numbers were chosen.
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
from study.evaluation.challenge.nominal_models import draw_calibration, make_model, retune
from study.evaluation.challenge.nuisance_effects import add_nuisance_effects
from study.evaluation.challenge.sensor import read_sensor

LawBankKind = Literal["law", "nothing", "decoy", "mode"]
"""What is concealed: a law, nothing, an effect of the catalogue, or a linear mode."""
CASES_PER_TURN: dict[LawBankKind, int] = {"law": 12, "nothing": 4, "decoy": 3, "mode": 1}
"""Number of cases of each kind in a turn of twenty."""
TURN_KINDS: tuple[LawBankKind, ...] = tuple(kind for kind, count in CASES_PER_TURN.items() for _ in range(count))
"""Kind of each case of a turn, before it is shuffled."""
LOWEST_STRENGTH = 0.35
"""Lowest drawn strength of a concealed law, effect or mode; the highest is 1. `_build_stable_law` may reduce it."""
MODE_EFFECT = "extra_mode"
"""Effect of the kind `mode`."""
DECOY_EFFECTS = tuple(name for name in EFFECTS if name not in (*THREE_AXIS_EFFECTS, MODE_EFFECT, "hand_impedance"))
"""Effects of the kind `decoy`: all of the catalogue that can be identified on a single axis, except a hand."""
SINGLE_AXIS_FRACTION = 0.75
"""Fraction of the cases with one driven axis, of those whose law, if any, needs a single axis; the others have two."""
LOUD_N = 4.5
"""Level (N) of an additional test segment and of the second fresh motion: 1.5 times the highest level of the fit."""
FRESH_LEVEL_N, FRESH_PERIOD_SAMPLES, FRESH_PERIODS = 2.0, 2000, 2
"""Fresh test motion, which no recording contains: nominal peak of its multisine (N), samples per period, periods."""


@dataclass(frozen=True, slots=True)
class LawDraw:
    """Drawn settings of one case of the bank of laws."""

    number: int
    """Number of the case, from 0."""
    seed: int
    """Seed of its device: seed of the bank + number."""
    kind: LawBankKind
    """Kind of what is concealed."""
    concealed: str
    """Name of the concealed law or effect; empty for nothing."""
    strength: float
    """`LOWEST_STRENGTH` to 1; without meaning where nothing is concealed."""
    model: ModelOrigin
    """Origin of the model, calibrated or retuned."""
    settings: CaseSettings
    """Driven axes, recording, nuisance effects and integration steps."""


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
    law_force: FloatArray
    """N: force of the laws, plus the change of the command by a law of the drive."""


@dataclass(frozen=True, slots=True, eq=False)
class LawCase:
    """A case of the bank of laws, its label, and fresh test motions."""

    case: Case
    truth: LawTruth | None
    """Label of the law; None where no law is concealed."""
    fresh_motions: tuple[FreshTestMotion, ...]
    """For devices with a law: a motion at the level `FRESH_LEVEL_N`, then at `LOUD_N`. Empty for others."""


def draw_law(seed: int, case_number: int, brief: bool = False) -> LawDraw:
    """Draw the settings of the case with this number, from 0. The same seed and number give the same case. brief:
    periods of 1000 samples in place of 2000."""
    # 41 to 43, and 44 below: arbitrary fixed numbers that make the random sequences of a seed independent.
    turn_number, turn_index = divmod(case_number, len(TURN_KINDS))
    kind_order = np.random.default_rng([seed, 41, turn_number]).permutation(len(TURN_KINDS))
    kind = TURN_KINDS[kind_order[turn_index]]
    random = np.random.default_rng([seed, 42, case_number])
    earlier_case_count = turn_number * CASES_PER_TURN[kind] + sum(
        TURN_KINDS[kind_index] == kind for kind_index in kind_order[:turn_index]
    )
    concealed_names = tuple(law_kind.name for law_kind in LAW_KINDS) if kind == "law" else DECOY_EFFECTS
    name_index = int(
        np.random.default_rng([seed, 43, earlier_case_count // len(concealed_names)]).permutation(len(concealed_names))[
            earlier_case_count % len(concealed_names)
        ]
    )
    concealed = {
        "law": concealed_names[name_index],
        "decoy": concealed_names[name_index],
        "mode": MODE_EFFECT,
        "nothing": "",
    }[kind]
    has_two_axes = (kind == "law" and LAWS_BY_NAME[concealed].axes == 2) or random.random() > SINGLE_AXIS_FRACTION
    axes = tuple(sorted(int(axis) for axis in random.choice(3, 2 if has_two_axes else 1, replace=False)))
    model = cast(ModelOrigin, str(random.choice(["calibrated", "retuned"])))
    # Three periods of each multisine, nuisance effects at factor 1.
    settings = CaseSettings(axes, 1000 if brief else 2000, 3, 1.0, STEPS_PER_SAMPLE, LOUD_N)
    return LawDraw(
        case_number, seed + case_number, kind, concealed, float(random.uniform(LOWEST_STRENGTH, 1.0)), model, settings
    )


def generate_law_case(law_draw: LawDraw, name: str) -> LawCase:
    """Generate the drawn case. name: device name in recording and model. Raises ValueError where the motion diverges,
    or with a law is too large at each strength that `_build_stable_law` tries."""
    if law_draw.kind != "law":
        effects = (law_draw.concealed,) if law_draw.concealed else ()
        strength = law_draw.strength if effects else None
        return LawCase(draw_case(law_draw.seed, effects, law_draw.model, strength, name, law_draw.settings), None, ())
    random, settings = np.random.default_rng([law_draw.seed, 44]), law_draw.settings
    bench, plan = draw_bench(random), draw_plan(random, settings)
    baseline = add_nuisance_effects(Device(bench, steps=settings.steps), settings.extras, law_draw.seed)
    base_motion = simulate_full_motion(baseline, plan.command)
    device, true_motion, truth = _build_stable_law(law_draw, baseline, (base_motion, plan), random)
    response, position = read_sensor(device.sensor, true_motion.acceleration, true_motion.position, RATE_HZ, random)
    if law_draw.model == "calibrated":
        nominal, tolerance = draw_calibration(bench, random, settings.axes)
    else:
        nominal, tolerance = retune(bench, response, plan, settings.axes)
    model = make_model(name, nominal, tolerance, settings.axes)
    recording = make_recording(name, plan, response, position, settings)
    motion_pairs = tuple(
        (simulated_motion.acceleration, simulated_motion.position) for simulated_motion in (base_motion, true_motion)
    )
    case = Case(
        recording,
        model,
        (),
        _refuse_further_recording,
        compute_detectability(baseline, device, (motion_pairs[0], motion_pairs[1]), settings),
    )
    return LawCase(
        case, truth, tuple(_make_fresh_motion(device, settings, random, level_n) for level_n in (FRESH_LEVEL_N, LOUD_N))
    )


def _build_stable_law(
    law_draw: LawDraw, baseline: Device, base_motion: tuple[Motion, DrivePlan], random: np.random.Generator
) -> tuple[Device, Motion, LawTruth]:
    """Add a law to the device at the drawn strength, or at a half or a quarter of it where the motion would diverge, or
    reach three times the largest position without the law. Returns the device, its motion and the label. Raises
    ValueError where it does at all three strengths; the parameters a and b are the same for each. base_motion: motion
    without the law, and its plan."""
    (motion, plan), axes = base_motion, law_draw.settings.axes
    axis_index = int(random.integers(len(axes)))
    axis_pair = (axes[axis_index], axes[(axis_index + 1) % len(axes)])
    random_state = random.bit_generator.state
    for strength in (law_draw.strength, law_draw.strength / 2, law_draw.strength / 4):
        random.bit_generator.state = random_state
        device, truth = build_law(
            baseline, LAWS_BY_NAME[law_draw.concealed], (motion, plan.command), axis_pair, strength, random
        )
        try:
            law_motion = simulate_full_motion(device, plan.command)
        except (ValueError, ZeroDivisionError):
            continue
        if np.abs(law_motion.position).max() < 3 * np.abs(motion.position).max():
            return device, law_motion, truth
    raise ValueError(f"the device runs away with the law '{law_draw.concealed}', seed {law_draw.seed}")


def _refuse_further_recording(command: FloatArray, kind: str, added_kg: float, noise_seed: int) -> Recording:
    """Refuse a further recording of a device with a law, as `Case.record_again`: such cases have no further
    experiments. Always raises ValueError."""
    raise ValueError("a device with a law is not recorded again")


def _make_fresh_motion(
    device: Device, settings: CaseSettings, random: np.random.Generator, level_n: float
) -> FreshTestMotion:
    """Simulate the device under a new multisine on all driven axes. level_n: peak per axis times the root of the number
    of axes (N)."""
    command = np.zeros((FRESH_PERIOD_SAMPLES * FRESH_PERIODS, 3))
    for axis in settings.axes:
        command[:, axis] = np.tile(
            draw_multisine(random, level_n / len(settings.axes) ** 0.5, FRESH_PERIOD_SAMPLES), FRESH_PERIODS
        )
    motion, axes = simulate_full_motion(device, command), list(settings.axes)
    changed_command = command if device.drive_law is None else device.drive_law(command)
    reading = motion.acceleration if device.sensor.static_law is None else device.sensor.static_law(motion.acceleration)
    return FreshTestMotion(
        level_n, command[:, axes], Motion(*(motion_array[:, axes] for motion_array in motion)), reading[:, axes],
        (motion.law_force + changed_command - command)[:, axes],
    )  # fmt: skip
