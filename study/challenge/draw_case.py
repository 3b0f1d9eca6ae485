"""Concealed-physics cases: a recording, a model that lacks something, and what it lacks. All from one seed."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from equalizer.plant.effect_vocabulary import EFFECTS_BY_NAME
from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.recording import Recording
from equalizer.signals.signal import FloatArray, Signal
from study.challenge.bench import Bench, draw_bench
from study.challenge.device import Device, motion, record
from study.challenge.drive_plan import AXES, RATE_HZ, DrivePlan, draw_plan
from study.challenge.effects import actuator, decoys, friction, hand, inertia_and_drag, sensor, springs
from study.challenge.hidden import Circumstances, HiddenEffect
from study.challenge.nominal import as_model, calibrated, retuned
from study.challenge.sensor import RANGE_MPS2

EFFECTS: dict[str, HiddenEffect] = {
    effect.name: effect
    for group in (friction, springs, inertia_and_drag, hand, actuator, sensor)
    for effect in group.EFFECTS
}
"""The whole vocabulary."""
DECOYS: dict[str, HiddenEffect] = {effect.name: effect for effect in decoys.DECOYS}
"""Outside of it."""

Concealed = Literal["calibrated", "retuned"]


@dataclass(frozen=True, slots=True)
class Truth:
    """One effect that the device has and the model lacks."""

    effect: str
    place: str
    axis: str | None
    values: dict[str, float]
    """By the vocabulary's names; of a decoy, its own."""
    unseen: dict[str, float]
    """Numbers that the vocabulary has no name for: which of several readings of the effect was drawn."""


@dataclass(frozen=True, slots=True, eq=False)
class Case:
    recording: Recording
    model: MechanicalModel
    truth: tuple[Truth, ...]


def draw_case(
    seed: int,
    effects: Sequence[str] = (),
    concealed: Concealed = "calibrated",
    strength: float | Sequence[float] | None = None,
    name: str = "",
) -> Case:
    """effects: names, of the vocabulary or of DECOYS; none = nothing is missing. strength: 0 (weakest) to 1, for all
    or one each; None draws it evenly. The same arguments give the same case.

    Raises ValueError for an unknown name, a strength outside 0..1, or a hand behind a re-tuned model, which would
    take it for the device's own.
    """
    hidden = [_known(effect) for effect in effects]
    if concealed == "retuned" and any(effect.name == "hand_impedance" for effect in hidden):
        raise ValueError("a hand can be concealed from a calibrated model only: a re-tuned one contains it")
    random = np.random.default_rng([seed, len(hidden)])
    bench, plan = draw_bench(random), draw_plan(random)
    strengths = _strengths(strength, len(hidden), random)
    device, truth = _concealed(bench, plan, hidden, strengths, random)
    response, position = record(device, plan.command, random)
    if concealed == "calibrated":
        known, tolerance = calibrated(bench, random)
    else:
        known, tolerance = retuned(bench, response, plan)
    label = name or f"bench {seed}"
    return Case(_recording(label, plan, response, position), as_model(label, known, tolerance), truth)


def _known(name: str) -> HiddenEffect:
    found = EFFECTS.get(name) or DECOYS.get(name)
    if found is None:
        raise ValueError(f"nobody knows how to conceal '{name}'; known are {', '.join((*EFFECTS, *DECOYS))}")
    return found


def _strengths(given: float | Sequence[float] | None, count: int, random: np.random.Generator) -> FloatArray:
    drawn = random.random(count) if given is None else np.broadcast_to(np.asarray(given, dtype=np.float64), (count,))
    if ((drawn < 0.0) | (drawn > 1.0)).any():
        raise ValueError(f"strength is {given}; it must lie between 0 and 1")
    return drawn


def _concealed(
    bench: Bench,
    plan: DrivePlan,
    hidden: Sequence[HiddenEffect],
    strengths: FloatArray,
    random: np.random.Generator,
) -> tuple[Device, tuple[Truth, ...]]:
    device, truth = Device(bench), []
    if not hidden:
        return device, ()
    acceleration, position = motion(device, plan.command)
    peak = np.minimum(np.abs(acceleration).max(axis=0), RANGE_MPS2)
    for effect, strength in zip(hidden, strengths, strict=True):
        axis = int(random.integers(3))
        at = Circumstances(random, float(strength), bench, axis, np.abs(position).max(axis=0), peak)
        values = effect.draw(at)
        device = effect.build(device, axis, values)
        truth.append(_truth(effect, axis, values))
    return device, tuple(truth)


def _truth(effect: HiddenEffect, axis: int, values: dict[str, float]) -> Truth:
    known = EFFECTS_BY_NAME.get(effect.name)
    names = set(values) if known is None else {parameter.name for parameter in known.parameters}
    return Truth(
        effect.name,
        effect.place,
        AXES[axis] if effect.of_axis else None,
        {name: float(value) for name, value in values.items() if name in names},
        {name: float(value) for name, value in values.items() if name not in names},
    )


def _recording(name: str, plan: DrivePlan, response: FloatArray, position: FloatArray) -> Recording:
    return Recording(
        device=name,
        command=Signal(plan.command, RATE_HZ, "force", "N", tuple(f"f{axis}" for axis in AXES)),
        response=Signal(response, RATE_HZ, "acceleration", "m/s^2", tuple(f"a{axis}" for axis in AXES)),
        position=Signal(position, RATE_HZ, "position", "m", AXES),
        segments=plan.segments,
    )
