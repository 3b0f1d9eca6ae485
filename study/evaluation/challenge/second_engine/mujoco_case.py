"""Cases with concealed effects whose motion is simulated by MuJoCo instead of hapteq's own integrator.

Parameters are drawn as in `challenge.draw_case`; `mujoco_bench` simulates the motion, `challenge.sensor` the readings.
"""

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
from study.evaluation.challenge.nominal_models import draw_calibration, make_model, retune
from study.evaluation.challenge.second_engine.mujoco_bench import (
    MujocoBench,
    linearise,
    make_baseline_bench,
    replace_delay,
    simulate_motion,
)
from study.evaluation.challenge.sensor import RANGE_MPS2, read_sensor

BuildEffect = Callable[[MujocoBench, int, Values], MujocoBench]
"""build(bench, axis, values): a new bench with an effect."""


def draw_mujoco_case(
    seed: int, effects: Sequence[str], origin: ModelOrigin, strength: Sequence[float], name: str, settings: CaseSettings
) -> Case:
    """Draw a case as `challenge.draw_case.draw_case` does, with the motion from MuJoCo and no nuisance effects. Raises
    ValueError for an effect that is neither in `BUILDERS` nor in `SENSOR_EFFECTS`, and where the motion diverges. The
    last element of the seed, 2, is arbitrary: it makes the random sequence independent of that of `draw_case`."""
    if unknown_effects := set(effects) - set(BUILDERS) - set(SENSOR_EFFECTS):
        raise ValueError(f"the second engine cannot conceal {', '.join(sorted(unknown_effects))}")
    random = np.random.default_rng([seed, len(effects), 2])
    drawn_bench, plan = draw_bench(random), draw_plan(random, settings)
    baseline = make_baseline_bench(drawn_bench)
    bench = linearise(baseline)
    base_motion = simulate_motion(baseline, plan.command)
    true_bench, measured, truth = baseline, Device(bench), []
    peak = np.minimum(np.abs(base_motion[0]).max(axis=0), RANGE_MPS2)
    for effect, level in zip((EFFECTS[effect_name] for effect_name in effects), strength, strict=True):
        axis = settings.axes[int(random.integers(len(settings.axes)))]
        context = EffectContext(random, level, bench, axis, np.abs(base_motion[1]).max(axis=0), peak, settings.axes)
        values = effect.draw(context)
        if effect.name in SENSOR_EFFECTS:
            measured = effect.build(measured, axis, values)
        else:
            true_bench = BUILDERS[effect.name](true_bench, axis, values)
        if effect.name == "transport_delay":
            values = {"delay": true_bench.delay_s}
        truth.append(make_truth(effect, axis, values))
    motion = simulate_motion(true_bench, plan.command) if true_bench is not baseline else base_motion
    response, position = read_sensor(measured.sensor, *motion, RATE_HZ, random)
    if origin == "calibrated":
        nominal, tolerance = draw_calibration(bench, random, settings.axes)
    else:
        nominal, tolerance = retune(bench, response, plan, settings.axes)
    recording = make_recording(name, plan, response, position, settings)

    def rerecord(command: FloatArray, kind: str, added_kg: float, noise_seed: int) -> Recording:  # `RecordAgain`
        repeat_plan = make_further_plan(command, kind, settings)
        loaded_bench = replace(true_bench, mass_kg=true_bench.mass_kg + added_kg)
        measured_motion = simulate_motion(loaded_bench, repeat_plan.command)
        readings = read_sensor(measured.sensor, *measured_motion, RATE_HZ, np.random.default_rng([seed, noise_seed]))
        return replace(make_recording(name, repeat_plan, *readings, settings), meta=describe_added_mass(added_kg))

    detectability = compute_detectability(Device(bench), measured, (base_motion, motion), settings) if effects else 0.0
    return Case(recording, make_model(name, nominal, tolerance, settings.axes), tuple(truth), rerecord, detectability)


def _add_on_axis(table: FloatArray, axis: int, value: float) -> FloatArray:
    """Add a value to one axis in a copy of the table (3,)."""
    new_table = table.copy()
    new_table[axis] += value
    return new_table


def _build_end_stop(bench: MujocoBench, axis: int, values: Values) -> MujocoBench:
    """Set one end stop, with the other end at 1 m, which `simulate_motion` does not let a motion reach; or, where
    `opposite` is set, two at equal distances."""
    position_m, distant_stop_m = values["position"], 1.0
    lower_m, upper_m = (-distant_stop_m, position_m) if position_m > 0.0 else (position_m, distant_stop_m)
    if values["opposite"]:
        lower_m, upper_m = -abs(position_m), abs(position_m)
    return replace(bench, stop=(axis, lower_m, upper_m, values["stiffness"]))


def _build_extra_mode(bench: MujocoBench, axis: int, values: Values) -> MujocoBench:
    """Attach an oscillator to the handle."""
    unit_direction = np.roll((1.0, values["tilt_next"], values["tilt_after_next"]), axis)
    unit_direction /= np.linalg.norm(unit_direction)
    # In MuJoCo, an oscillator moves with the handle perpendicular to its direction: the mass that it adds there is
    # subtracted from the diagonal; the off-diagonal elements cannot be.
    subtracted_kg = values["mass"] * (1.0 - unit_direction**2)
    extended_oscillators = bench.oscillators.append_oscillator(
        values["frequency"], values["mass"], values["damping_ratio"], unit_direction
    )
    return replace(bench, oscillators=extended_oscillators, mass_kg=bench.mass_kg - subtracted_kg)


def _build_hand_impedance(bench: MujocoBench, axis: int, values: Values) -> MujocoBench:
    """Add mass, damping and stiffness of a hand to all axes; `axis` is not used."""

    def expand_to_axes(name: str) -> FloatArray:
        """Compute the values (3,) of a parameter: of x, and of y and z, which are stated as factors of it."""
        return values[name] * np.array([1.0, values[f"{name}_y"], values[f"{name}_z"]])

    return replace(
        bench,
        mass_kg=bench.mass_kg + expand_to_axes("mass"),
        damping=bench.damping + expand_to_axes("damping"),
        stiffness=bench.stiffness + expand_to_axes("stiffness"),
    )


BUILDERS: dict[str, BuildEffect] = {
    "coulomb_friction": lambda bench, axis, values: replace(
        bench, friction_n=_add_on_axis(bench.friction_n, axis, values["level"])
    ),
    "viscous_damping": lambda bench, axis, values: replace(
        bench, damping=_add_on_axis(bench.damping, axis, values["damping"])
    ),
    "added_mass": lambda bench, axis, values: replace(bench, mass_kg=_add_on_axis(bench.mass_kg, axis, values["mass"])),
    "constant_force": lambda bench, axis, values: replace(
        bench, force_n=_add_on_axis(bench.force_n, axis, values["force"])
    ),
    "end_stop": _build_end_stop,
    "backlash": lambda bench, axis, values: replace(bench, play=(axis, values)),
    "extra_mode": _build_extra_mode,
    "hand_impedance": _build_hand_impedance,
    "force_gain": lambda bench, axis, values: replace(bench, gain=_add_on_axis(bench.gain, axis, values["gain"] - 1.0)),
    "force_saturation": lambda bench, axis, values: replace(
        bench, limit_n=_add_on_axis(bench.limit_n, axis, values["limit"])
    ),
    "amplifier_lag": lambda bench, axis, values: replace(bench, lag_s=values["time_constant"]),
    "transport_delay": lambda bench, axis, values: replace_delay(bench, values["delay"]),
}
"""Effects that MuJoCo simulates, by name."""
SENSOR_EFFECTS = ("sensor_lag", "sensor_gain")
"""Effects of the sensor, which are built into `challenge.sensor` as for other cases."""
