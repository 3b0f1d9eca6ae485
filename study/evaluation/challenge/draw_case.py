"""Draws a case of the blind test from a seed: a recording, a model that lacks some physics, and the truth.

Steps: draw bench and excitation, add nuisance effects (`extras`), draw and build in the concealed effects, simulate and
measure, make the model that a laboratory would have (`nominal`).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from equalizer.plant.effect_vocabulary import EFFECTS_BY_NAME
from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.recording import Recording, Segment
from equalizer.signals.signal import FloatArray, Signal
from study.evaluation.challenge.bench import draw_bench
from study.evaluation.challenge.concealed_effect import ConcealedEffect, EffectContext
from study.evaluation.challenge.device import Device, motion
from study.evaluation.challenge.drive_plan import AXES, RATE_HZ, DrivePlan, draw_plan
from study.evaluation.challenge.effects import actuator, decoys, friction, hand, inertia_and_drag, sensor, springs
from study.evaluation.challenge.extras import with_extras
from study.evaluation.challenge.nominal import as_model, draw_calibration, retune
from study.evaluation.challenge.rig import WHOLE, Rig
from study.evaluation.challenge.sensor import NOISE_MPS2, POSITION_NOISE_M, POSITION_STEP_M, RANGE_MPS2, read

EFFECTS: dict[str, ConcealedEffect] = {
    effect.name: effect
    for group in (friction, springs, inertia_and_drag, hand, actuator, sensor)
    for effect in group.EFFECTS
}
"""All effects of the vocabulary."""
DECOYS: dict[str, ConcealedEffect] = {effect.name: effect for effect in decoys.DECOYS}
"""Effects outside the vocabulary, which a diagnosis must not name."""

Concealed = Literal["calibrated", "retuned"]
"""How the given model was made: `calibrated` from the device without the effect, `retuned` on the recording itself."""
MotionPair = tuple[tuple[FloatArray, FloatArray], tuple[FloatArray, FloatArray]]
"""Acceleration (m/s^2) and position (m), (samples, 3) each, of a first device, then of a second."""


@dataclass(frozen=True, slots=True)
class Truth:
    """An effect that the device has and the model lacks."""

    effect: str
    place: str
    axis: str | None
    values: dict[str, float]
    """Parameters by their names in the vocabulary; all parameters of a decoy."""
    unseen: dict[str, float]
    """Parameters without a name in the vocabulary, which select the variant of the effect."""


Again = Callable[[FloatArray, str, float, int], Recording]
"""Makes a further recording of the same device: commands (samples, axes) in N, kind of excitation, added mass (kg),
noise seed."""


@dataclass(frozen=True, slots=True, eq=False)
class Case:
    """A recording with a model that lacks some physics, and the truth."""

    recording: Recording
    model: MechanicalModel
    truth: tuple[Truth, ...]
    again: Again
    """Records the same device again under other commands."""
    adds: float = 0.0
    """Detectability: change of the readings by the concealed effects over the noise, both rms, in the worst channel."""


NOISE = np.array([*NOISE_MPS2, *[float(np.hypot(POSITION_NOISE_M, POSITION_STEP_M / 12**0.5))] * 3])
"""Standard deviation of the noise of acceleration (m/s^2), then of position (m), which includes its quantization."""


def draw_case(
    seed: int,
    effects: Sequence[str] = (),
    concealed: Concealed = "calibrated",
    strength: float | Sequence[float] | None = None,
    name: str = "",
    rig: Rig = WHOLE,
) -> Case:
    """Draw a case. effects: names from EFFECTS or DECOYS; none = nothing is missing. strength: 0 (weakest) to 1, a
    single value for all or a value each; None draws it uniformly. The same arguments give the same case.

    Raises ValueError for an unknown name, a strength outside 0..1, or a hand with a re-tuned model, which would absorb
    the hand into the device.
    """
    chosen = [_find_effect(effect) for effect in effects]
    if concealed == "retuned" and any(effect.name == "hand_impedance" for effect in chosen):
        raise ValueError("a hand can be concealed from a calibrated model only: a re-tuned one contains it")
    random = np.random.default_rng([seed, len(chosen)])
    bench, plan = draw_bench(random), draw_plan(random, rig)
    bare = with_extras(Device(bench, steps=rig.steps), rig.extras, seed)
    strengths = _strengths(strength, len(chosen), random)
    free = motion(bare, plan.command)
    device, truth = _conceal(bare, free, (chosen, strengths), random, rig)
    moved = motion(device, plan.command) if chosen else free
    response, position = read(device.sensor, *moved, RATE_HZ, random)
    if concealed == "calibrated":
        known, tolerance = draw_calibration(bench, random, rig.axes)
    else:
        known, tolerance = retune(bench, response, plan, rig.axes)
    label = name or f"bench {seed}"
    model = as_model(label, known, tolerance, rig.axes)
    recording = make_recording(label, plan, response, position, rig)

    def again(command: FloatArray, kind: str, added_kg: float, noise: int) -> Recording:
        further = further_plan(command, kind, rig)
        heavier = replace(device, bench=replace(bench, mass=bench.mass + added_kg * np.eye(3)))
        readings = read(device.sensor, *motion(heavier, further.command), RATE_HZ, np.random.default_rng([seed, noise]))
        return replace(make_recording(label, further, *readings, rig), meta=describe_added_mass(added_kg))

    return Case(recording, model, truth, again, visibility(bare, device, (free, moved), rig) if chosen else 0.0)


def visibility(bare: Device, device: Device, moved: MotionPair, rig: Rig) -> float:
    """Difference between the readings of two devices over the noise, both rms, in the worst channel of acceleration or
    position. moved: the motion of each device."""
    readings = []
    for each, (acceleration, position) in zip((bare, device), moved, strict=True):
        # The same noise and lost samples for both, so that the difference of the readings is that of the devices.
        seen, _ = read(each.sensor, acceleration, position, RATE_HZ, np.random.default_rng(0))
        readings.append(np.hstack([seen[:, rig.axes], position[:, rig.axes]]))
    noise = NOISE[[*rig.axes, *(3 + axis for axis in rig.axes)]]
    power = np.mean(((readings[1] - readings[0]) / noise) ** 2, axis=0)
    return float(np.sqrt(power.max()))


def _find_effect(name: str) -> ConcealedEffect:
    """The effect or decoy with this name. Raises ValueError for an unknown name."""
    found = EFFECTS.get(name) or DECOYS.get(name)
    if found is None:
        raise ValueError(f"there is no way to conceal '{name}'; known are {', '.join((*EFFECTS, *DECOYS))}")
    return found


def _strengths(given: float | Sequence[float] | None, count: int, random: np.random.Generator) -> FloatArray:
    """(count,): the given strengths, or uniform draws. Raises ValueError for a strength outside 0..1."""
    drawn = random.random(count) if given is None else np.broadcast_to(np.asarray(given, dtype=np.float64), (count,))
    if ((drawn < 0.0) | (drawn > 1.0)).any():
        raise ValueError(f"strength is {given}; it must lie between 0 and 1")
    return drawn


def _conceal(
    device: Device,
    free: tuple[FloatArray, FloatArray],
    wanted: tuple[Sequence[ConcealedEffect], FloatArray],
    random: np.random.Generator,
    rig: Rig,
) -> tuple[Device, tuple[Truth, ...]]:
    """Draw the parameters of the effects, each for a random axis of the rig, and build them into the device. free:
    acceleration and position without the effects. wanted: the effects and their strengths."""
    (chosen, strengths), (acceleration, position) = wanted, free
    bench, truth = device.bench, []
    peak = np.minimum(np.abs(acceleration).max(axis=0), RANGE_MPS2)
    for effect, strength in zip(chosen, strengths, strict=True):
        axis = rig.axes[int(random.integers(len(rig.axes)))]
        travel = np.abs(position).max(axis=0)
        at = EffectContext(random, float(strength), bench, axis, travel, peak, rig.axes)
        values = effect.draw(at)
        device = effect.build(device, axis, values)
        truth.append(truth_of(effect, axis, values))
    return device, tuple(truth)


def further_plan(command: FloatArray, kind: str, rig: Rig) -> DrivePlan:
    """Excitation plan of a further recording, a single segment to fit. command: (samples, axes), N; kind: of
    excitation."""
    whole = np.zeros((len(command), 3))
    whole[:, rig.axes] = command
    return DrivePlan(whole, (Segment(0, len(whole), kind, float(np.abs(whole).max()), 0, "fit"),))


def describe_added_mass(added_kg: float) -> dict[str, float]:
    """Recording metadata of an added mass; empty for none."""
    return {"added_mass_kg": added_kg} if added_kg else {}


def truth_of(effect: ConcealedEffect, axis: int, values: dict[str, float]) -> Truth:
    """The label of one concealed effect."""
    known = EFFECTS_BY_NAME.get(effect.name)
    names = set(values) if known is None else {parameter.name for parameter in known.parameters}
    return Truth(
        effect.name,
        effect.place,
        AXES[axis] if effect.of_axis else None,
        {name: float(value) for name, value in values.items() if name in names},
        {name: float(value) for name, value in values.items() if name not in names},
    )


def make_recording(name: str, plan: DrivePlan, response: FloatArray, position: FloatArray, rig: Rig) -> Recording:
    """Recording of the rig's axes. response (m/s^2), position (m): (samples, 3)."""
    axes, names = list(rig.axes), tuple(AXES[axis] for axis in rig.axes)
    return Recording(
        device=name,
        command=Signal(plan.command[:, axes], RATE_HZ, "force", "N", tuple(f"f{axis}" for axis in names)),
        response=Signal(response[:, axes], RATE_HZ, "acceleration", "m/s^2", tuple(f"a{axis}" for axis in names)),
        position=Signal(position[:, axes], RATE_HZ, "position", "m", names),
        segments=plan.segments,
    )
