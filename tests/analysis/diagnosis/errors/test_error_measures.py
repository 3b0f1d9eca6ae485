"""Error measures where free simulation fails: predicted force under a controller, windows where a plant drifts."""

from dataclasses import replace

import numpy as np
import pytest

from analysis.diagnosis.data.observed_parts import observe_parts
from analysis.diagnosis.errors.choose_measure import make_measure
from analysis.diagnosis.errors.free_simulation import FreeSimulation
from equalizer.effects.catalogue import EFFECTS
from equalizer.effects.effect import PlacedEffect
from equalizer.effects.simulation.bodies import Restarts
from equalizer.plant.mechanical_model import ModelEffect
from equalizer.signals.recording import Recording
from tests.analysis.diagnosis.errors.drifting_plant import (
    DRAG,
    LEVEL,
    MASS,
    RATE_HZ,
    diagnose_plant,
    make_model,
    random_course,
    record_plant,
)


def test_a_controlled_plant_that_does_not_hold_itself_is_compared_by_forces(controlled_recording: Recording) -> None:
    chosen = make_measure([controlled_recording], make_model())
    assert chosen.measure.name == "predicted force"
    assert "command depends on the response" in chosen.remarks[0]
    assert "compared up to" in chosen.remarks[1]


@pytest.mark.slow
def test_friction_under_a_controller_is_recovered_from_forces(controlled_recording: Recording) -> None:
    findings = diagnose_plant(
        controlled_recording, "coulomb_friction", "viscous_damping", "hardening_stiffness", "transport_delay"
    )
    (effect,) = findings.diagnosis.effects
    assert findings.diagnosis.error == "predicted force"
    assert effect.effect == "coulomb_friction"
    assert effect.parameters["level"].value == pytest.approx(LEVEL, rel=0.02)
    assert findings.improved.mass[0, 0] == pytest.approx(MASS, rel=0.01)
    test = findings.diagnosis.fit.test
    assert test.after < 0.15 * test.retuned


def test_no_friction_is_found_under_a_controller_where_there_is_none() -> None:
    clean = record_plant(0.08 * random_course(12.0, 3), controlled=True, level=0.0)
    assert diagnose_plant(clean, "coulomb_friction", "cogging").diagnosis.effects == ()


def test_a_plant_that_drifts_freely_is_simulated_in_windows(drifting_recording: Recording) -> None:
    chosen = make_measure([drifting_recording], make_model())
    assert chosen.measure.name == "windows of 1 s"
    assert "free motion does not decay" in chosen.remarks[0]


def test_a_window_holds_many_readings_per_number_of_its_state_at_any_rate(drifting_recording: Recording) -> None:
    """Of a window of a single reading, the fitted state would leave nothing, with any model."""
    slow = replace(
        drifting_recording,
        command=replace(drifting_recording.command, sample_rate_hz=1.0),
        response=replace(drifting_recording.response, sample_rate_hz=1.0),
    )
    measure = make_measure([slow], make_model()).measure
    assert measure.name == "windows of 20 s"
    heavy = replace(make_model(), mass=np.array([[1e9]]), damping=np.array([[1e9]]))
    assert np.std(measure.residuals(heavy, ())[0]) > 0


@pytest.mark.slow
def test_friction_of_a_drifting_plant_is_recovered_in_windows(drifting_recording: Recording) -> None:
    findings = diagnose_plant(drifting_recording, "coulomb_friction", "viscous_damping", "hardening_stiffness")
    (effect,) = findings.diagnosis.effects
    assert effect.effect == "coulomb_friction"
    assert effect.parameters["level"].value == pytest.approx(LEVEL, rel=0.02)
    test = findings.diagnosis.fit.test
    assert test.after < 0.05 * test.retuned


def test_windows_of_the_true_plant_leave_noise_alone() -> None:
    clean = record_plant(9.0 * random_course(6.0, 7), controlled=False, level=0.0)
    measure = make_measure([clean], make_model()).measure
    true = replace(make_model(), mass=np.array([[MASS]]), damping=np.array([[DRAG]]))
    left, wrong = measure.residuals(true, ())[0], measure.residuals(make_model(), ())[0]
    # The integrator above is exact to a thousandth.
    assert np.std(left) < 0.05 * np.std(wrong)
    assert np.std(left) * measure.unit[0] < 1e-4 * np.std(clean.response.samples)


def test_a_state_is_fitted_even_where_the_windows_begin_wrong(drifting_recording: Recording) -> None:
    measure = make_measure([drifting_recording], make_model()).measure
    off = replace(measure, states=tuple(states + 0.01 for states in measure.states))
    one, other = measure.residuals(make_model(), ()), off.residuals(make_model(), ())
    assert np.allclose(one[0], other[0], atol=1e-3 * np.abs(one[0]).max())


def test_missing_samples_change_only_the_window_they_are_in(drifting_recording: Recording) -> None:
    measure = make_measure([drifting_recording], make_model()).measure
    (record,) = measure.records
    gappy = record.measured.copy()
    gappy[600:640] = np.nan
    incomplete = measure.with_records((replace(record, measured=gappy),))
    (whole,), (partial,) = measure.residuals(make_model(), ()), incomplete.residuals(make_model(), ())
    window = slice(500, 1000)
    assert np.isnan(partial[600:640]).all() and np.isfinite(np.delete(partial, np.s_[600:640], axis=0)).all()
    assert np.delete(partial, window, axis=0) == pytest.approx(np.delete(whole, window, axis=0), nan_ok=True)
    # The other samples of that window are fitted as well: less is left of them, by the few that are missing.
    present = np.isfinite(partial[window])
    ratio = np.sum(partial[window][present] ** 2) / np.sum(whole[window][present] ** 2)
    assert 0.8 < ratio <= 1


def test_what_decisions_see_does_not_hang_on_sealed_samples(
    controlled_recording: Recording, drifting_recording: Recording
) -> None:
    for item in (controlled_recording, drifting_recording):
        spoiled = np.array(item.response.samples)
        spoiled[item.segments[1].start :] += 0.5
        other = replace(item, response=replace(item.response, samples=spoiled))
        first, second = (make_measure([each], make_model()).measure for each in (item, other))
        second = replace(second, unit=first.unit, noise=first.noise)
        if first.name == "predicted force":
            second = replace(second, band_hz=first.band_hz)
        else:
            second = replace(second, states=first.states)
        seen = first.shorten().records[0].fit
        (one_left,), (other_left,) = (each.shorten().residuals(make_model(), ()) for each in (first, second))
        assert np.allclose(one_left[seen], other_left[seen])


def test_sensors_are_not_told_by_forces(controlled_recording: Recording) -> None:
    measure = make_measure([controlled_recording], make_model()).measure
    assert not measure.can_observe(EFFECTS["sensor_gain"])
    assert measure.can_observe(EFFECTS["coulomb_friction"])
    assert measure.can_observe(EFFECTS["force_saturation"])


def test_a_weaker_actuator_does_not_make_errors_smaller(controlled_recording: Recording) -> None:
    measure = make_measure([controlled_recording], make_model()).measure
    weak = (PlacedEffect(EFFECTS["force_gain"], (0,), {"gain": 0.5}),)
    one, other = (np.std(measure.residuals(make_model(), effects)[0]) for effects in ((), weak))
    assert other > one


def test_what_a_beginning_in_motion_left_behind_is_left_out_where_it_dies_out_soon(
    drifting_recording: Recording,
) -> None:
    late = replace(
        drifting_recording,
        command=drifting_recording.command.select_samples(900, 5900),
        response=drifting_recording.response.select_samples(900, 5900),
        segments=(),
    )
    stiff = replace(make_model(stiffness=400.0), damping=np.array([[60.0]]))
    chosen = make_measure([late], stiff)
    assert chosen.measure.name == "free simulation"
    first = np.flatnonzero(chosen.measure.records[0].fit)[0]
    assert 0.3 * RATE_HZ < first < 2.0 * RATE_HZ


@pytest.mark.parametrize("which", ["controlled_recording", "drifting_recording"])
def test_what_the_models_own_file_names_is_part_of_every_prediction(which: str, request: pytest.FixtureRequest) -> None:
    one = request.getfixturevalue(which)
    rubbing = replace(make_model(), effects=(ModelEffect("coulomb_friction", None, {"level": LEVEL}),))
    chosen = make_measure([one], rubbing)
    placed = (PlacedEffect(EFFECTS["coulomb_friction"], (0,), {"level": LEVEL}),)
    (beside,) = make_measure([one], make_model()).measure.residuals(make_model(), placed)
    assert np.array_equal(chosen.measure.residuals(rubbing, ())[0], beside)
    assert (
        "are part of every simulation: dry friction." in chosen.remarks[-2 if which == "controlled_recording" else -1]
    )


def test_a_shortened_simulation_keeps_the_restarts_of_the_records_that_it_keeps(drifting_recording: Recording) -> None:
    record = observe_parts([drifting_recording], 1)[0]
    unused = replace(record, fit=np.zeros_like(record.fit), choose=np.zeros_like(record.choose))
    restarts = tuple(Restarts(np.array([sample]), np.zeros((1, 2))) for sample in (10, 20, 30))
    measure = FreeSimulation((record, unused, record), np.ones(1), np.ones(1), restarts=restarts)
    short = measure.shorten()
    assert len(short.records) == 2
    assert short.restarts == (restarts[0], restarts[2])
    assert all(
        np.isfinite(residual[kept.fit]).all()
        for residual, kept in zip(short.residuals(make_model(), ()), short.records, strict=True)
    )
    assert replace(measure, restarts=()).shorten().restarts == ()


@pytest.mark.parametrize(("place", "lost_samples"), [(0.0, 0), (9.81, 0), (0.0, 3)])
def test_a_reading_that_never_changes_says_nothing_of_the_noise_of_others(
    drifting_recording: Recording, place: float, lost_samples: int
) -> None:
    read = drifting_recording.response
    noise = 0.01 * read.samples.std() * np.random.default_rng(3).standard_normal(read.samples.shape)
    moving = replace(drifting_recording, response=replace(read, samples=read.samples + noise))
    rest = np.full_like(noise, place)
    rest[:lost_samples] = np.nan
    resting = replace(drifting_recording, response=replace(read, samples=rest))
    alone, both = (make_measure(each, make_model(400.0)).measure for each in ([moving], [moving, resting]))
    assert isinstance(alone, FreeSimulation) and isinstance(both, FreeSimulation)
    assert alone.noise == pytest.approx(noise.std(), rel=0.1)
    assert both.noise == pytest.approx(alone.noise / np.sqrt(2), rel=0.01)
