"""Draw a case of the blind test from a seed: a recording, a model that lacks some physics, and the truth.

Steps: draw bench and excitation, add nuisance effects (`nuisance_effects`), draw and build in the concealed effects,
simulate and measure, make the model that a laboratory would have (`nominal_models`). Begin at `draw_case`."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from equalizer.plant.effect_vocabulary import EFFECTS_BY_NAME
from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.recording import Recording, Segment
from equalizer.signals.signal import FloatArray, Signal
from study.evaluation.challenge.bench import draw_bench
from study.evaluation.challenge.case_settings import DEFAULT_SETTINGS, CaseSettings
from study.evaluation.challenge.concealed_effect import ConcealedEffect, EffectContext
from study.evaluation.challenge.device import Device, simulate_motion
from study.evaluation.challenge.drive_plan import AXES, RATE_HZ, DrivePlan, draw_plan
from study.evaluation.challenge.effects import actuator, decoys, friction, hand, inertia_and_drag, sensor, springs
from study.evaluation.challenge.nominal_models import draw_calibration, make_model, retune
from study.evaluation.challenge.nuisance_effects import add_nuisance_effects
from study.evaluation.challenge.sensor import NOISE_MPS2, POSITION_NOISE_M, POSITION_STEP_M, RANGE_MPS2, read_sensor

EFFECTS: dict[str, ConcealedEffect] = {
    effect.name: effect
    for group in (friction, springs, inertia_and_drag, hand, actuator, sensor)
    for effect in group.EFFECTS
}
"""All effects of the vocabulary (`equalizer.plant.effect_vocabulary`) by name."""
DECOYS: dict[str, ConcealedEffect] = {effect.name: effect for effect in decoys.DECOYS}
"""Effects outside the vocabulary by name, for which a diagnosis has no name."""

ModelOrigin = Literal["calibrated", "retuned"]
"""How the given model was made: `calibrated` from the device without the effect, `retuned` on the recording itself."""
MotionPair = tuple[tuple[FloatArray, FloatArray], tuple[FloatArray, FloatArray]]
"""Acceleration (m/s^2) and position (m), (samples, 3) each, of a first device, then of a second."""


@dataclass(frozen=True, slots=True)
class Truth:
    """Label of an effect that the device has and the model lacks."""

    effect: str
    """Name of the effect or decoy."""
    place: str
    """Place at which it acts (`concealed_effect.Place`)."""
    axis: str | None
    """Axis at which it acts, x, y or z; None for an effect on all axes."""
    values: dict[str, float]
    """Parameters by their names in the vocabulary; all parameters of a decoy."""
    unseen: dict[str, float]
    """Parameters without a name in the vocabulary, which select the variant of the effect."""


RecordAgain = Callable[[FloatArray, str, float, int], Recording]
"""Makes a further recording of the same device: commands (samples, axes) in N, kind of excitation, added mass (kg),
noise seed."""


@dataclass(frozen=True, slots=True, eq=False)
class Case:
    """A recording with a model that lacks some physics, and the truth, which is empty where no effect is concealed (a
    concealed law has a label of its own, `laws.draw_law.LawCase`)."""

    recording: Recording
    model: MechanicalModel
    truth: tuple[Truth, ...]
    record_again: RecordAgain
    """Records the same device again under other commands; raises ValueError for a device with a concealed law."""
    detectability: float = 0.0
    """Detectability: change of the readings by the concealed effects over the noise, both rms, in the worst channel."""


NOISE_STD = np.array([*NOISE_MPS2, *[float(np.hypot(POSITION_NOISE_M, POSITION_STEP_M / 12**0.5))] * 3])
"""(6,): standard deviation of the noise of acceleration (m/s^2), then of position (m), x y z each. Position includes
its quantization: a step s has the standard deviation s / sqrt(12)."""


def draw_case(
    seed: int,
    effects: Sequence[str] = (),
    origin: ModelOrigin = "calibrated",
    strength: float | Sequence[float] | None = None,
    name: str = "",
    settings: CaseSettings = DEFAULT_SETTINGS,
) -> Case:
    """Draw a case. effects: names from EFFECTS or DECOYS; none: only nuisance effects are missing. strength: 0
    (weakest) to 1, a single value for all or a value each; None draws it uniformly. name: of the device; empty for one
    with the seed. The same arguments give the same case.

    Raises ValueError for an unknown name, a strength outside 0..1, a wrong number of strengths, a hand with a re-tuned
    model, which would absorb the hand into the device, or a motion that diverges.
    """
    chosen_effects = [_find_effect(effect) for effect in effects]
    if origin == "retuned" and any(effect.name == "hand_impedance" for effect in chosen_effects):
        raise ValueError("a hand can be concealed from a calibrated model only: a re-tuned one contains it")
    random = np.random.default_rng([seed, len(chosen_effects)])
    bench, plan = draw_bench(random), draw_plan(random, settings)
    baseline = add_nuisance_effects(Device(bench, steps=settings.steps), settings.extras, seed)
    strengths = _draw_strengths(strength, len(chosen_effects), random)
    base_motion = simulate_motion(baseline, plan.command)
    device, truth = _conceal_effects(baseline, base_motion, (chosen_effects, strengths), random, settings)
    true_motion = simulate_motion(device, plan.command) if chosen_effects else base_motion
    response, position = read_sensor(device.sensor, *true_motion, RATE_HZ, random)
    if origin == "calibrated":
        nominal, tolerance = draw_calibration(bench, random, settings.axes)
    else:
        nominal, tolerance = retune(bench, response, plan, settings.axes)
    device_name = name or f"bench {seed}"
    model = make_model(device_name, nominal, tolerance, settings.axes)
    recording = make_recording(device_name, plan, response, position, settings)

    def record_again(command: FloatArray, kind: str, added_kg: float, noise_seed: int) -> Recording:  # `RecordAgain`
        drive = make_further_plan(command, kind, settings)
        heavier = replace(device, bench=replace(device.bench, mass=device.bench.mass + added_kg * np.eye(3)))
        readings = read_sensor(
            device.sensor, *simulate_motion(heavier, drive.command), RATE_HZ, np.random.default_rng([seed, noise_seed])
        )
        return replace(make_recording(device_name, drive, *readings, settings), meta=describe_added_mass(added_kg))

    return Case(
        recording, model, truth, record_again,
        compute_detectability(baseline, device, (base_motion, true_motion), settings) if chosen_effects else 0.0,
    )  # fmt: skip


def compute_detectability(baseline: Device, device: Device, motions: MotionPair, settings: CaseSettings) -> float:
    """Compute the difference between the readings of two devices over the noise, both rms, in the channel of
    acceleration or position where it is largest. motions: acceleration and position of each device. Position is taken
    without its sensor."""
    readings = []
    for measured_device, (acceleration, position) in zip((baseline, device), motions, strict=True):
        # The same noise and lost samples for both, so that the difference of the readings is that of the devices.
        acceleration_reading, _ = read_sensor(
            measured_device.sensor, acceleration, position, RATE_HZ, np.random.default_rng(0)
        )
        readings.append(np.hstack([acceleration_reading[:, settings.axes], position[:, settings.axes]]))
    noise_std = NOISE_STD[[*settings.axes, *(3 + axis for axis in settings.axes)]]
    power = np.mean(((readings[1] - readings[0]) / noise_std) ** 2, axis=0)
    return float(np.sqrt(power.max()))


def _find_effect(name: str) -> ConcealedEffect:
    """Find the effect or decoy with this name. Raises ValueError for an unknown name."""
    effect = EFFECTS.get(name) or DECOYS.get(name)
    if effect is None:
        raise ValueError(f"there is no way to conceal '{name}'; known are {', '.join((*EFFECTS, *DECOYS))}")
    return effect


def _draw_strengths(requested: float | Sequence[float] | None, count: int, random: np.random.Generator) -> FloatArray:
    """Return the given strengths or uniform draws, (count,). Raises ValueError for a strength outside 0..1, or for
    another number of strengths than 1 and count."""
    strengths = (
        random.random(count)
        if requested is None
        else np.broadcast_to(np.asarray(requested, dtype=np.float64), (count,))
    )
    if ((strengths < 0.0) | (strengths > 1.0)).any():
        raise ValueError(f"strength is {requested}; it must lie between 0 and 1")
    return strengths


def _conceal_effects(
    device: Device,
    base_motion: tuple[FloatArray, FloatArray],
    effects_and_strengths: tuple[Sequence[ConcealedEffect], FloatArray],
    random: np.random.Generator,
    settings: CaseSettings,
) -> tuple[Device, tuple[Truth, ...]]:
    """Draw the parameters of the effects, each for a random driven axis, and build them into the device. base_motion:
    acceleration (m/s^2) and position (m) without the effects, (samples, 3) each. effects_and_strengths: the effects and
    their strengths."""
    (effects, strengths), (acceleration, position) = effects_and_strengths, base_motion
    bench, truth = device.bench, []
    peak_mps2 = np.minimum(np.abs(acceleration).max(axis=0), RANGE_MPS2)
    for effect, strength in zip(effects, strengths, strict=True):
        axis = settings.axes[int(random.integers(len(settings.axes)))]
        travel_m = np.abs(position).max(axis=0)
        context = EffectContext(random, float(strength), bench, axis, travel_m, peak_mps2, settings.axes)
        values = effect.draw(context)
        device = effect.build(device, axis, values)
        truth.append(make_truth(effect, axis, values))
    return device, tuple(truth)


def make_further_plan(command: FloatArray, kind: str, settings: CaseSettings) -> DrivePlan:
    """Make the excitation plan of a further recording, a single segment to fit. command: (samples, driven axes), N;
    kind: of excitation."""
    full_command = np.zeros((len(command), 3))
    full_command[:, settings.axes] = command
    return DrivePlan(full_command, (Segment(0, len(full_command), kind, float(np.abs(full_command).max()), 0, "fit"),))


def describe_added_mass(added_kg: float) -> dict[str, float]:
    """Make the recording's metadata of an added mass (kg); empty for none."""
    return {"added_mass_kg": added_kg} if added_kg else {}


def make_truth(effect: ConcealedEffect, axis: int, values: dict[str, float]) -> Truth:
    """Make the label of one concealed effect. axis: 0 to 2; values: its drawn parameters."""
    vocabulary_entry = EFFECTS_BY_NAME.get(effect.name)
    vocabulary_names = (
        set(values) if vocabulary_entry is None else {parameter.name for parameter in vocabulary_entry.parameters}
    )
    return Truth(
        effect.name,
        effect.place,
        AXES[axis] if effect.is_single_axis else None,
        {name: float(value) for name, value in values.items() if name in vocabulary_names},
        {name: float(value) for name, value in values.items() if name not in vocabulary_names},
    )


def make_recording(
    name: str, plan: DrivePlan, response: FloatArray, position: FloatArray, settings: CaseSettings
) -> Recording:
    """Make the recording of the driven axes. response (m/s^2), position (m): (samples, 3), of all axes."""
    axes, axis_names = list(settings.axes), tuple(AXES[axis] for axis in settings.axes)
    return Recording(
        device=name,
        command=Signal(plan.command[:, axes], RATE_HZ, "force", "N", tuple(f"f{axis}" for axis in axis_names)),
        response=Signal(response[:, axes], RATE_HZ, "acceleration", "m/s^2", tuple(f"a{axis}" for axis in axis_names)),
        position=Signal(position[:, axes], RATE_HZ, "position", "m", axis_names),
        segments=plan.segments,
    )
