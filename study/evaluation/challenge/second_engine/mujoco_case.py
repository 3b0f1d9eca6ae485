"""Concealed-physics cases simulated by MuJoCo. Parameters are drawn as for the other bench; the physics is the
engine's."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from equalizer.signals.recording import Recording
from equalizer.signals.signal import FloatArray
from study.evaluation.challenge.bench import draw_bench
from study.evaluation.challenge.case_settings import CaseSettings
from study.evaluation.challenge.concealed_effect import EffectContext, Values
from study.evaluation.challenge.device import Device
from study.evaluation.challenge.draw_case import (
    EFFECTS,
    Case,
    ModelOrigin,
    compute_detectability,
    describe_added_mass,
    make_further_plan,
    make_recording,
    make_truth,
)
from study.evaluation.challenge.drive_plan import RATE_HZ, draw_plan
from study.evaluation.challenge.nominal_models import as_model, draw_calibration, retune
from study.evaluation.challenge.second_engine.mujoco_bench import (
    MujocoBench,
    linearise,
    make_baseline_bench,
    simulate_motion,
    with_delay,
)
from study.evaluation.challenge.sensor import RANGE_MPS2, read_sensor

Build = Callable[[MujocoBench, int, Values], MujocoBench]
"""build(bench, axis, values): the bench with an effect."""


def draw_mujoco_case(
    seed: int, effects: Sequence[str], origin: ModelOrigin, strength: Sequence[float], name: str, settings: CaseSettings
) -> Case:
    """Draw a case as `draw_case` does, moved by MuJoCo. Raises ValueError for an effect that the engine cannot
    express."""
    if unknown := set(effects) - set(BUILDERS) - set(SENSOR_EFFECTS):
        raise ValueError(f"the second engine cannot conceal {', '.join(sorted(unknown))}")
    random = np.random.default_rng([seed, len(effects), 2])
    drawn_bench, plan = draw_bench(random), draw_plan(random, settings)
    baseline = make_baseline_bench(drawn_bench)
    bench = linearise(baseline)
    base_motion = simulate_motion(baseline, plan.command)
    device, measured, truth = baseline, Device(bench), []
    peak = np.minimum(np.abs(base_motion[0]).max(axis=0), RANGE_MPS2)
    for effect, level in zip((EFFECTS[effect_name] for effect_name in effects), strength, strict=True):
        axis = settings.axes[int(random.integers(len(settings.axes)))]
        context = EffectContext(random, level, bench, axis, np.abs(base_motion[1]).max(axis=0), peak, settings.axes)
        values = effect.draw(context)
        if effect.name in SENSOR_EFFECTS:
            measured = effect.build(measured, axis, values)
        else:
            device = BUILDERS[effect.name](device, axis, values)
        if effect.name == "transport_delay":
            values = {"delay": device.delay_s}
        truth.append(make_truth(effect, axis, values))
    motion = simulate_motion(device, plan.command) if device is not baseline else base_motion
    response, position = read_sensor(measured.sensor, *motion, RATE_HZ, random)
    if origin == "calibrated":
        nominal, tolerance = draw_calibration(bench, random, settings.axes)
    else:
        nominal, tolerance = retune(bench, response, plan, settings.axes)
    recording = make_recording(name, plan, response, position, settings)

    def record_again(command: FloatArray, kind: str, added_kg: float, noise: int) -> Recording:
        repeat_plan = make_further_plan(command, kind, settings)
        heavier = replace(device, mass_kg=device.mass_kg + added_kg)
        measured_motion = simulate_motion(heavier, repeat_plan.command)
        readings = read_sensor(measured.sensor, *measured_motion, RATE_HZ, np.random.default_rng([seed, noise]))
        return replace(make_recording(name, repeat_plan, *readings, settings), meta=describe_added_mass(added_kg))

    detectability = compute_detectability(Device(bench), measured, (base_motion, motion), settings) if effects else 0.0
    return Case(recording, as_model(name, nominal, tolerance, settings.axes), tuple(truth), record_again, detectability)


def _add_on_axis(table: FloatArray, axis: int, value: float) -> FloatArray:
    new_table = table.copy()
    new_table[axis] += value
    return new_table


def _build_stop(bench: MujocoBench, axis: int, values: Values) -> MujocoBench:
    position, far_m = values["position"], 1.0
    low, high = (-far_m, position) if position > 0.0 else (position, far_m)
    if values["opposite"]:
        low, high = -abs(position), abs(position)
    return replace(bench, stop=(axis, low, high, values["stiffness"]))


def _build_mode(bench: MujocoBench, axis: int, values: Values) -> MujocoBench:
    unit = np.roll((1.0, values["tilt_next"], values["tilt_after_next"]), axis)
    unit /= np.linalg.norm(unit)
    # An oscillator also moves along the other directions: the mass that it adds to the handle there is subtracted where
    # possible.
    subtracted_kg = values["mass"] * (1.0 - unit**2)
    attached = bench.oscillators.with_oscillator(values["frequency"], values["mass"], values["damping_ratio"], unit)
    return replace(bench, oscillators=attached, mass_kg=bench.mass_kg - subtracted_kg)


def _build_hand(bench: MujocoBench, axis: int, values: Values) -> MujocoBench:
    def axis_values(name: str) -> FloatArray:
        return values[name] * np.array([1.0, values[f"{name}_y"], values[f"{name}_z"]])

    return replace(
        bench,
        mass_kg=bench.mass_kg + axis_values("mass"),
        damping=bench.damping + axis_values("damping"),
        stiffness=bench.stiffness + axis_values("stiffness"),
    )


BUILDERS: dict[str, Build] = {
    "coulomb_friction": lambda b, axis, v: replace(b, friction_n=_add_on_axis(b.friction_n, axis, v["level"])),
    "viscous_damping": lambda b, axis, v: replace(b, damping=_add_on_axis(b.damping, axis, v["damping"])),
    "added_mass": lambda b, axis, v: replace(b, mass_kg=_add_on_axis(b.mass_kg, axis, v["mass"])),
    "constant_force": lambda b, axis, v: replace(b, force_n=_add_on_axis(b.force_n, axis, v["force"])),
    "end_stop": _build_stop,
    "backlash": lambda b, axis, v: replace(b, play=(axis, v)),
    "extra_mode": _build_mode,
    "hand_impedance": _build_hand,
    "force_gain": lambda b, axis, v: replace(b, gain=_add_on_axis(b.gain, axis, v["gain"] - 1.0)),
    "force_saturation": lambda b, axis, v: replace(b, limit_n=_add_on_axis(b.limit_n, axis, v["limit"])),
    "amplifier_lag": lambda b, axis, v: replace(b, lag_s=v["time_constant"]),
    "transport_delay": lambda b, axis, v: with_delay(b, v["delay"]),
}
"""Effects that this engine simulates."""
SENSOR_EFFECTS = ("sensor_lag", "sensor_gain")
"""Effects after the engine, in the same sensor chain."""
