"""Error measures where free simulation fails: predicted force under a controller, windows where a plant drifts."""

from dataclasses import replace

import numpy as np
import pytest

from analysis.diagnosis.errors.choose_measure import measure_of
from equalizer.effects.catalogue import EFFECTS
from equalizer.effects.effect import PlacedEffect
from equalizer.plant.mechanical_model import ModelEffect
from equalizer.signals.recording import Recording
from tests.analysis.diagnosis.errors.drifting_plant import (
    DRAG,
    LEVEL,
    MASS,
    RATE_HZ,
    course,
    found,
    model,
    recording,
)


def test_a_controlled_plant_that_does_not_hold_itself_is_compared_by_forces(held: Recording) -> None:
    chosen = measure_of([held], model())
    assert chosen.measure.name == "predicted force"
    assert "command depends on the response" in chosen.remarks[0]
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
    """Of a window of a single reading, the fitted state would leave nothing, with any model."""
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


def test_what_a_beginning_in_motion_left_behind_is_left_out_where_it_dies_out_soon(drifting: Recording) -> None:
    late = replace(
        drifting, command=drifting.command.part(900, 5900), response=drifting.response.part(900, 5900), segments=()
    )
    stiff = replace(model(stiffness=400.0), damping=np.array([[60.0]]))
    chosen = measure_of([late], stiff)
    assert chosen.measure.name == "free simulation"
    first = np.flatnonzero(chosen.measure.records[0].fit)[0]
    assert 0.3 * RATE_HZ < first < 2.0 * RATE_HZ


@pytest.mark.parametrize("which", ["held", "drifting"])
def test_what_the_models_own_file_names_is_part_of_every_prediction(which: str, request: pytest.FixtureRequest) -> None:
    one = request.getfixturevalue(which)
    rubbing = replace(model(), effects=(ModelEffect("coulomb_friction", None, {"level": LEVEL}),))
    chosen = measure_of([one], rubbing)
    placed = (PlacedEffect(EFFECTS["coulomb_friction"], (0,), {"level": LEVEL}),)
    (beside,) = measure_of([one], model()).measure.residuals(model(), placed)
    assert np.array_equal(chosen.measure.residuals(rubbing, ())[0], beside)
    assert "are part of every simulation: dry friction." in chosen.remarks[-2 if which == "held" else -1]
