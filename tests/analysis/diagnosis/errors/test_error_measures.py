"""Plants that drift or are held by a controller, with invented friction: stepped here, by equations of this file."""

from dataclasses import replace

import numpy as np
import pytest

from analysis.diagnosis.data.closed_loop import is_in_closed_loop
from analysis.diagnosis.data.force_driven import as_force_driven
from analysis.diagnosis.data.observed_parts import names_of_parts, observed_parts
from analysis.diagnosis.diagnose import DiagnosisSettings, diagnose
from analysis.diagnosis.errors.choose_measure import measure_of
from analysis.diagnosis.errors.measure_rule import choose_measure, is_self_stable
from analysis.diagnosis.forces.rigid_model import can_be_rigid, rigid_model, wants_rigid_model
from equalizer.effects.catalogue import CATALOGUE, EFFECTS
from equalizer.effects.effect import PlacedEffect
from equalizer.plant.mechanical_model import MechanicalModel, MechanicalModelError, ModelEffect, Tolerance
from equalizer.signals.joining import join
from equalizer.signals.recording import Hold, Recording, Segment
from equalizer.signals.signal import Signal

RATE_HZ, FINE = 500.0, 20
MASS, DRAG, LEVEL, NOISE = 4.0, 12.0, 3.0, 2e-6
KP, KV = 900.0, 160.0


def model(stiffness: float = 0.0, quantity: str = "position") -> MechanicalModel:
    one = [[1.0]]
    loose = Tolerance(0.1, 2.0, 1.0, None)
    return MechanicalModel("carriage", quantity, [[4.05]], [[13.0]], [[stiffness]], one, one, tolerance=loose)


def course(seconds: float, seed: int) -> np.ndarray:
    """A smooth random force or place, (n,), rms 1, with rests at its ends."""
    rng = np.random.default_rng(seed)
    t = np.arange(int(seconds * RATE_HZ)) / RATE_HZ
    waves = [np.sin(2 * np.pi * hz * t + rng.uniform(0, 6)) / hz**0.5 for hz in (0.3, 0.7, 1.1, 1.9, 3.1)]
    whole = np.sum(waves, axis=0)
    return whole / whole.std() * np.clip(np.minimum(t, t[::-1]) / 0.4, 0, 1)


def moved(drive: np.ndarray, controlled: bool, level: float = LEVEL) -> tuple[np.ndarray, np.ndarray]:
    """Position and force, (n,) each. drive: the force, or the place that a controller aims at."""
    x = v = 0.0
    positions, forces, step = np.empty(len(drive)), np.empty(len(drive)), 1 / RATE_HZ / FINE
    for k, aim in enumerate(drive):
        positions[k] = x
        force = KP * (aim - x) - KV * v if controlled else aim
        forces[k] = force
        for _ in range(FINE):
            free = v + step / MASS * (force - DRAG * v)
            # Friction takes what it can of the momentum, and no more than there is.
            v = np.sign(free) * max(abs(free) - step / MASS * level, 0.0)
            x += step * v
    return positions, forces


def recording(drive: np.ndarray, controlled: bool, level: float = LEVEL, seed: int = 1) -> Recording:
    x, force = moved(drive, controlled, level)
    x = x + NOISE * np.random.default_rng(seed).standard_normal(len(x))
    half = len(x) * 2 // 3
    roles = (Segment(0, half, "slow", role="fit"), Segment(half, len(x), "slow", role="test"))

    def signal(samples: np.ndarray, quantity: str, unit: str) -> Signal:
        return Signal(samples[:, None], RATE_HZ, quantity, unit, ("x",))

    aimed = signal(KP * drive, "force", "N") if controlled else None
    command, seen = signal(force, "force", "N"), signal(x, "position", "m")
    return Recording("carriage", command, seen, excitation=aimed, segments=roles)


@pytest.fixture(scope="module")
def held() -> Recording:
    return recording(0.08 * course(12.0, 3), controlled=True)


@pytest.fixture(scope="module")
def drifting() -> Recording:
    return recording(9.0 * course(12.0, 5), controlled=False)


def found(given: Recording, *names: str):
    others = tuple(effect.name for effect in CATALOGUE if effect.name not in names)
    return diagnose([given], model(), DiagnosisSettings(without=others), map, lambda said, share: None)


def test_a_controlled_plant_that_does_not_hold_itself_is_compared_by_forces(held: Recording) -> None:
    chosen = measure_of([held], model())
    assert chosen.measure.name == "predicted force"
    assert "command hangs on the response" in chosen.remarks[0]
    assert "compared up to" in chosen.remarks[1]


def test_friction_under_a_controller_is_recovered_from_forces(held: Recording) -> None:
    findings = found(held, "coulomb_friction", "viscous_damping", "hardening_stiffness", "transport_delay")
    (effect,) = findings.diagnosis.effects
    assert findings.diagnosis.error == "predicted force"
    assert effect.effect == "coulomb_friction"
    assert effect.parameters["level"].value == pytest.approx(LEVEL, rel=0.02)
    assert findings.improved.mass[0, 0] == pytest.approx(MASS, rel=0.01)
    test = findings.diagnosis.fit.test
    assert test.after < 0.15 * test.retuned


def test_no_friction_is_found_under_a_controller_where_there_is_none() -> None:
    clean = recording(0.08 * course(12.0, 3), controlled=True, level=0.0)
    assert found(clean, "coulomb_friction", "cogging").diagnosis.effects == ()


def test_a_plant_that_drifts_freely_is_simulated_in_windows(drifting: Recording) -> None:
    chosen = measure_of([drifting], model())
    assert chosen.measure.name == "windows of 1 s"
    assert "integrates freely" in chosen.remarks[0]


def test_a_window_holds_many_readings_per_number_of_its_state_at_any_rate(drifting: Recording) -> None:
    """Of a window of a single reading, the fitted state would leave nothing, whatever the model."""
    slow = replace(
        drifting,
        command=replace(drifting.command, sample_rate_hz=1.0),
        response=replace(drifting.response, sample_rate_hz=1.0),
    )
    measure = measure_of([slow], model()).measure
    assert measure.name == "windows of 20 s"
    heavy = replace(model(), mass=np.array([[1e9]]), damping=np.array([[1e9]]))
    assert np.std(measure.residuals(heavy, ())[0]) > 0


def test_friction_of_a_drifting_plant_is_recovered_in_windows(drifting: Recording) -> None:
    findings = found(drifting, "coulomb_friction", "viscous_damping", "hardening_stiffness")
    (effect,) = findings.diagnosis.effects
    assert effect.effect == "coulomb_friction"
    assert effect.parameters["level"].value == pytest.approx(LEVEL, rel=0.02)
    test = findings.diagnosis.fit.test
    assert test.after < 0.05 * test.retuned


def test_windows_of_the_true_plant_leave_noise_alone() -> None:
    clean = recording(9.0 * course(6.0, 7), controlled=False, level=0.0)
    measure = measure_of([clean], model()).measure
    true = replace(model(), mass=np.array([[MASS]]), damping=np.array([[DRAG]]))
    left, wrong = measure.residuals(true, ())[0], measure.residuals(model(), ())[0]
    # The integrator above is exact to a thousandth.
    assert np.std(left) < 0.05 * np.std(wrong)
    assert np.std(left) * measure.unit[0] < 1e-4 * np.std(clean.response.samples)


def test_a_state_is_fitted_even_where_the_windows_begin_wrong(drifting: Recording) -> None:
    measure = measure_of([drifting], model()).measure
    off = replace(measure, states=tuple(states + 0.01 for states in measure.states))
    one, other = measure.residuals(model(), ()), off.residuals(model(), ())
    assert np.allclose(one[0], other[0], atol=1e-3 * np.abs(one[0]).max())


def test_what_decisions_see_does_not_hang_on_sealed_samples(held: Recording, drifting: Recording) -> None:
    for item in (held, drifting):
        spoiled = np.array(item.response.samples)
        spoiled[item.segments[1].start :] += 0.5
        other = replace(item, response=replace(item.response, samples=spoiled))
        first, second = (measure_of([each], model()).measure for each in (item, other))
        second = replace(second, unit=first.unit, noise=first.noise)
        if first.name == "predicted force":
            second = replace(second, band_hz=first.band_hz)
        else:
            second = replace(second, states=first.states)
        seen = first.shorten().records[0].fit
        (one_left,), (other_left,) = (each.shorten().residuals(model(), ()) for each in (first, second))
        assert np.allclose(one_left[seen], other_left[seen])


def test_sensors_are_not_told_by_forces(held: Recording) -> None:
    measure = measure_of([held], model()).measure
    assert not measure.can_observe(EFFECTS["sensor_gain"])
    assert measure.can_observe(EFFECTS["coulomb_friction"])
    assert measure.can_observe(EFFECTS["force_saturation"])


def test_a_weaker_actuator_does_not_make_errors_smaller(held: Recording) -> None:
    measure = measure_of([held], model()).measure
    weak = (PlacedEffect(EFFECTS["force_gain"], (0,), {"gain": 0.5}),)
    one, other = (np.std(measure.residuals(model(), effects)[0]) for effects in ((), weak))
    assert other > one


def test_the_rule_keeps_free_simulation_for_plants_that_hold_themselves(held: Recording, drifting: Recording) -> None:
    for each in (held, drifting):
        assert choose_measure(observed_parts([each], 1), model(stiffness=400.0)).measure == "free simulation"


def test_the_rule_takes_forces_where_a_model_grows_within_a_window(drifting: Recording) -> None:
    choice = choose_measure(observed_parts([drifting], 1), model(stiffness=-400.0))
    assert choice.measure == "predicted force"
    assert "held by a controller" in choice.why
    felt = replace(drifting, response=replace(drifting.response, quantity="acceleration", unit="m/s^2"))
    choice = choose_measure(observed_parts([felt], 1), model(stiffness=-400.0, quantity="acceleration"))
    assert choice.measure == "windows"


def test_the_rule_takes_windows_where_a_recording_begins_in_motion(drifting: Recording) -> None:
    moving = replace(drifting, response=replace(drifting.response, samples=drifting.response.samples + 0.3))
    choice = choose_measure(observed_parts([moving], 1), model(stiffness=400.0))
    assert choice.measure == "free simulation"
    late = replace(
        drifting, command=drifting.command.part(900, 4900), response=drifting.response.part(900, 4900), segments=()
    )
    choice = choose_measure(observed_parts([late], 1), model(stiffness=400.0))
    assert choice.measure == "windows"
    assert "does not begin at rest" in choice.why


def test_the_rule_takes_windows_under_a_controller_where_accelerations_alone_were_measured(held: Recording) -> None:
    felt = replace(held, response=replace(held.response, quantity="acceleration", unit="m/s^2"))
    choice = choose_measure(observed_parts([felt], 1), model(quantity="acceleration"))
    assert choice.measure == "windows"


def test_what_holds_itself_comes_to_rest_within_a_third_of_the_recording() -> None:
    assert is_self_stable(model(400.0), 10.0)
    assert not is_self_stable(model(400.0), 0.5)
    assert not is_self_stable(model(0.0), 10.0)


def test_feedback_is_seen_by_the_excitation_beside_the_command(held: Recording) -> None:
    assert is_in_closed_loop(held)
    assert not is_in_closed_loop(replace(held, excitation=held.command))


def test_feedback_is_seen_without_an_excitation_where_responses_make_the_command() -> None:
    rng = np.random.default_rng(2)
    n = 4000
    push, x = rng.standard_normal(n), np.zeros(n)
    u = np.empty(n)
    for k in range(n):
        u[k] = -3.0 * x[k] - 0.5 * x[k - 1] + 0.01 * push[k]
        if k + 1 < n:
            x[k + 1] = 0.9 * x[k] + 0.1 * u[k] + 0.2 * rng.standard_normal()
    looped = _plain(u, x)
    assert is_in_closed_loop(looped)
    assert not is_in_closed_loop(replace(looped, hold=Hold.BAND_LIMITED))


def test_a_free_command_is_not_taken_for_feedback(drifting: Recording) -> None:
    rng = np.random.default_rng(3)
    u = rng.standard_normal(4000)
    x = np.convolve(u, 0.9 ** np.arange(60))[: len(u)]
    assert not is_in_closed_loop(_plain(u, np.append(0.0, x[:-1])))
    assert not is_in_closed_loop(drifting)


def _plain(u: np.ndarray, x: np.ndarray) -> Recording:
    command = Signal(u[:, None], RATE_HZ, "force", "N", ("x",))
    return Recording("loop", command, Signal(x[:, None], RATE_HZ, "position", "m", ("x",)))


def test_parts_made_one_after_another_are_compared_apart(held: Recording) -> None:
    n = len(held)
    both = join([held, held], {"parts": [{"start": 0, "stop": n}, {"start": n, "stop": 2 * n}]})
    one, two = measure_of([both], model()).measure, measure_of([held], model()).measure
    assert len(one.records) == 2
    assert np.allclose(one.residuals(model(), ())[1], two.residuals(model(), ())[0], atol=1e-6)
    assert names_of_parts([both, held], ("a", "b")) == ("a, part 1", "a, part 2", "b")


def test_a_recording_for_the_test_spares_the_others(held: Recording) -> None:
    fitted = replace(held, segments=(Segment(0, len(held), "slow", role="fit"),))
    tested = replace(held, segments=(Segment(0, len(held), "slow", role="test"),))
    one, other = observed_parts([fitted, tested], 1)
    assert not one.test.any() and (one.fit | one.choose).all()
    assert other.test.all() and not (other.fit | other.choose).any()
    (alone,) = observed_parts([tested], 1)
    assert alone.fit.any() and alone.choose.any() and alone.test.any()


def test_an_imposed_motion_is_turned_round(held: Recording) -> None:
    x, force = held.response, held.command
    speed = Signal(np.gradient(x.samples, 1 / RATE_HZ, axis=0), RATE_HZ, "velocity", "m/s", ("x",))
    turned = as_force_driven(Recording("rack", speed, force, x, segments=held.segments))
    assert turned.command is force and turned.response is speed
    assert as_force_driven(held) is held
    chosen = measure_of([turned], model(quantity="velocity"))
    assert chosen.measure.name == "predicted force"
    assert "imposed" in chosen.remarks[0]


def test_a_rigid_model_is_fitted_to_the_forces_under_a_controller() -> None:
    clean = recording(0.08 * course(12.0, 3), controlled=True, level=0.0)
    assert wants_rigid_model([clean])
    fitted = rigid_model([clean], "fitted")
    assert fitted.mass[0, 0] == pytest.approx(MASS, rel=0.01)
    assert fitted.damping[0, 0] == pytest.approx(DRAG, rel=0.03)
    assert fitted.stiffness[0, 0] == 0.0


def test_friction_is_named_beside_a_model_that_was_fitted_first(held: Recording) -> None:
    others = tuple(each.name for each in CATALOGUE if each.name not in ("coulomb_friction", "transport_delay"))
    fitted = rigid_model([held], "fitted")
    assert fitted.damping[0, 0] > 1.5 * DRAG
    findings = diagnose([held], fitted, DiagnosisSettings(without=others), map, lambda said, share: None)
    assert [effect.effect for effect in findings.diagnosis.effects] == ["coulomb_friction"]
    assert findings.named[0].values["level"] == pytest.approx(LEVEL, rel=0.05)


def test_no_rigid_model_is_asked_of_accelerations_alone(held: Recording) -> None:
    felt = replace(held, response=replace(held.response, quantity="acceleration", unit="m/s^2"))
    assert not can_be_rigid([felt])
    with pytest.raises(MechanicalModelError, match="neither positions nor velocities"):
        rigid_model([felt], "fitted")


def test_what_a_beginning_in_motion_left_behind_is_left_out_where_it_dies_out_soon(drifting: Recording) -> None:
    late = replace(
        drifting, command=drifting.command.part(900, 5900), response=drifting.response.part(900, 5900), segments=()
    )
    stiff = replace(model(stiffness=400.0), damping=np.array([[60.0]]))
    chosen = measure_of([late], stiff)
    assert chosen.measure.name == "free simulation"
    first = np.flatnonzero(chosen.measure.records[0].fit)[0]
    assert 0.3 * RATE_HZ < first < 2.0 * RATE_HZ


def test_decisions_are_made_by_the_first_periods_of_many(drifting: Recording) -> None:
    repeated = replace(drifting, segments=(Segment(0, 6000, "multisine", 1.0, 500, "fit"),))
    (record,) = observed_parts([repeated], 1)
    assert np.flatnonzero(record.fit | record.choose)[-1] < 4 * 500


@pytest.mark.parametrize("which", ["held", "drifting"])
def test_what_the_models_own_file_names_is_part_of_every_prediction(which: str, request: pytest.FixtureRequest) -> None:
    one = request.getfixturevalue(which)
    rubbing = replace(model(), effects=(ModelEffect("coulomb_friction", None, {"level": LEVEL}),))
    chosen = measure_of([one], rubbing)
    placed = (PlacedEffect(EFFECTS["coulomb_friction"], (0,), {"level": LEVEL}),)
    (beside,) = measure_of([one], model()).measure.residuals(model(), placed)
    assert np.array_equal(chosen.measure.residuals(rubbing, ())[0], beside)
    assert "are part of every simulation: dry friction." in chosen.remarks[-2 if which == "held" else -1]
