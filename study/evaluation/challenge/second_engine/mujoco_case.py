"""Concealed-physics cases simulated by MuJoCo. Parameters are drawn as for the other bench; the physics is the
engine's."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from equalizer.signals.recording import Recording
from equalizer.signals.signal import FloatArray
from study.evaluation.challenge.bench import draw_bench
from study.evaluation.challenge.concealed_effect import EffectContext, Values
from study.evaluation.challenge.device import Device
from study.evaluation.challenge.draw_case import (
    EFFECTS,
    Case,
    Concealed,
    describe_added_mass,
    further_plan,
    make_recording,
    truth_of,
    visibility,
)
from study.evaluation.challenge.drive_plan import RATE_HZ, draw_plan
from study.evaluation.challenge.nominal import as_model, draw_calibration, retune
from study.evaluation.challenge.rig import Rig
from study.evaluation.challenge.second_engine.mujoco_bench import MujocoBench, bare, linear, simulate_motion, with_delay
from study.evaluation.challenge.sensor import RANGE_MPS2, read

Build = Callable[[MujocoBench, int, Values], MujocoBench]
"""build(bench, axis, values): the bench with an effect."""


def draw_mujoco_case(
    seed: int, effects: Sequence[str], concealed: Concealed, strength: Sequence[float], name: str, rig: Rig
) -> Case:
    """Draw a case as `draw_case` does, moved by MuJoCo. Raises ValueError for an effect that the engine cannot
    express."""
    if unknown := set(effects) - set(BUILDERS) - set(IN_THE_SENSOR):
        raise ValueError(f"the second engine cannot conceal {', '.join(sorted(unknown))}")
    random = np.random.default_rng([seed, len(effects), 2])
    drawn, plan = draw_bench(random), draw_plan(random, rig)
    free = bare(drawn)
    bench = linear(free)
    still = simulate_motion(free, plan.command)
    device, sensing, truth = free, Device(bench), []
    peak = np.minimum(np.abs(still[0]).max(axis=0), RANGE_MPS2)
    for effect, strong in zip((EFFECTS[each] for each in effects), strength, strict=True):
        axis = rig.axes[int(random.integers(len(rig.axes)))]
        at = EffectContext(random, strong, bench, axis, np.abs(still[1]).max(axis=0), peak, rig.axes)
        values = effect.draw(at)
        if effect.name in IN_THE_SENSOR:
            sensing = effect.build(sensing, axis, values)
        else:
            device = BUILDERS[effect.name](device, axis, values)
        if effect.name == "transport_delay":
            values = {"delay": device.delay_s}
        truth.append(truth_of(effect, axis, values))
    motion = simulate_motion(device, plan.command) if device is not free else still
    response, position = read(sensing.sensor, *motion, RATE_HZ, random)
    if concealed == "calibrated":
        known, tolerance = draw_calibration(bench, random, rig.axes)
    else:
        known, tolerance = retune(bench, response, plan, rig.axes)
    recording = make_recording(name, plan, response, position, rig)

    def again(command: FloatArray, kind: str, added_kg: float, noise: int) -> Recording:
        further = further_plan(command, kind, rig)
        heavier = replace(device, mass_kg=device.mass_kg + added_kg)
        measured_motion = simulate_motion(heavier, further.command)
        readings = read(sensing.sensor, *measured_motion, RATE_HZ, np.random.default_rng([seed, noise]))
        return replace(make_recording(name, further, *readings, rig), meta=describe_added_mass(added_kg))

    adds = visibility(Device(bench), sensing, (still, motion), rig) if effects else 0.0
    return Case(recording, as_model(name, known, tolerance, rig.axes), tuple(truth), again, adds)


def _set_axis(of: FloatArray, axis: int, value: float) -> FloatArray:
    changed = of.copy()
    changed[axis] += value
    return changed


def _stop(bench: MujocoBench, axis: int, values: Values) -> MujocoBench:
    place, far = values["position"], 1.0
    low, high = (-far, place) if place > 0.0 else (place, far)
    if values["opposite"]:
        low, high = -abs(place), abs(place)
    return replace(bench, stop=(axis, low, high, values["stiffness"]))


def _mode(bench: MujocoBench, axis: int, values: Values) -> MujocoBench:
    along = np.roll((1.0, values["tilt_next"], values["tilt_after_next"]), axis)
    along /= np.linalg.norm(along)
    # An oscillator also moves along the other directions: the mass that it adds to the handle there is subtracted where
    # possible.
    own = values["mass"] * (1.0 - along**2)
    riders = bench.riders.and_one(values["frequency"], values["mass"], values["damping_ratio"], along)
    return replace(bench, riders=riders, mass_kg=bench.mass_kg - own)


def _hand(bench: MujocoBench, axis: int, values: Values) -> MujocoBench:
    def more(name: str) -> FloatArray:
        return values[name] * np.array([1.0, values[f"{name}_y"], values[f"{name}_z"]])

    return replace(
        bench,
        mass_kg=bench.mass_kg + more("mass"),
        damping=bench.damping + more("damping"),
        stiffness=bench.stiffness + more("stiffness"),
    )


BUILDERS: dict[str, Build] = {
    "coulomb_friction": lambda b, axis, v: replace(b, friction_n=_set_axis(b.friction_n, axis, v["level"])),
    "viscous_damping": lambda b, axis, v: replace(b, damping=_set_axis(b.damping, axis, v["damping"])),
    "added_mass": lambda b, axis, v: replace(b, mass_kg=_set_axis(b.mass_kg, axis, v["mass"])),
    "constant_force": lambda b, axis, v: replace(b, force_n=_set_axis(b.force_n, axis, v["force"])),
    "end_stop": _stop,
    "backlash": lambda b, axis, v: replace(b, play=(axis, v)),
    "extra_mode": _mode,
    "hand_impedance": _hand,
    "force_gain": lambda b, axis, v: replace(b, gain=_set_axis(b.gain, axis, v["gain"] - 1.0)),
    "force_saturation": lambda b, axis, v: replace(b, limit_n=_set_axis(b.limit_n, axis, v["limit"])),
    "amplifier_lag": lambda b, axis, v: replace(b, lag_s=v["time_constant"]),
    "transport_delay": lambda b, axis, v: with_delay(b, v["delay"]),
}
"""Effects that this engine simulates."""
IN_THE_SENSOR = ("sensor_lag", "sensor_gain")
"""Effects after the engine, in the same sensor chain."""
