import numpy as np
import pytest

from analysis.diagnosis.data.observed_parts import observe_parts
from analysis.diagnosis.errors.free_simulation import FreeSimulation
from analysis.diagnosis.errors.hypothesis import NO_EFFECTS
from analysis.diagnosis.errors.output_error import evaluate_fit, gather_evidence
from analysis.diagnosis.errors.tuning import make_tuning
from analysis.diagnosis.result.curves.signature_bins import compute_law_bin_means
from analysis.diagnosis.result.curves.signature_curves import CurveNames, compute_signature
from equalizer.effects.catalogue import CATALOGUE
from equalizer.effects.effect import PlacedEffect
from equalizer.effects.simulation.simulator import simulate_response
from equalizer.signals.recording import Hold

BY_NAME = {effect.name: effect for effect in CATALOGUE}
NAMES = CurveNames(("x",), ("ax",), "m/s^2")


@pytest.fixture
def make_signature(diagnosed):
    def of(name, values, axes=1, there=True):
        placed = PlacedEffect(BY_NAME[name], tuple(range(axes)), values)
        recording = diagnosed.recorded(axes, (placed,) if there else ())
        model = diagnosed.device(axes)
        seen = observe_parts([recording], axes)[0]
        noise = np.repeat(diagnosed.NOISE, axes)
        measure, tuning = FreeSimulation((seen,), noise, noise), make_tuning(model, recording.command.channels)
        without = evaluate_fit(measure, tuning, np.zeros(len(tuning.names)), NO_EFFECTS)
        names = CurveNames(tuple("xyz"[:axes]), recording.response.channels, "m/s^2")
        complete = simulate_response(
            model, recording.command.samples, recording.sample_rate_hz, (placed,), recording.hold
        ).response
        return compute_signature(gather_evidence(measure, tuning, without)[0], complete, placed, names, Hold.ZERO_ORDER)

    return of


def law_at_the_dots(curve):
    order = np.argsort(curve.law_abscissa)
    return np.interp(curve.measured_abscissa, curve.law_abscissa[order], curve.law[order])


@pytest.mark.parametrize(
    ("name", "values", "along", "of", "apart"),
    [
        ("coulomb_friction", {"level": 0.2}, "velocity of x (m/s)", "missing force (N)", 0.25),
        ("viscous_damping", {"damping": 2.0}, "velocity of x (m/s)", "missing force (N)", 0.05),
        ("added_mass", {"mass": 0.05}, "acceleration of x (m/s^2)", "missing force (N)", 0.1),
        ("hardening_stiffness", {"k3": 2e7}, "position of x (m)", "missing force (N)", 0.2),
        ("constant_force", {"force": 0.2}, "position of x (m)", "missing force (N)", 0.1),
        ("force_saturation", {"limit": 1.0}, "command of x (N)", "missing force (N)", 0.15),
        ("force_gain", {"gain": 1.1}, "command of x (N)", "missing force (N)", 0.1),
        ("sensor_gain", {"gain": 1.1}, "predicted ax (m/s^2)", "error of ax (m/s^2)", 0.1),
        ("sensor_clipping", {"limit": 4.0}, "predicted ax (m/s^2)", "error of ax (m/s^2)", 0.15),
        ("sensor_offset", {"offset": 0.3}, "time (s)", "error of ax (m/s^2)", 0.1),
    ],
)
def test_the_fitted_law_lies_on_what_is_missing(make_signature, name, values, along, of, apart):
    one = make_signature(name, values)
    assert (one.abscissa_label, one.ordinate_label, one.axis) == (
        along,
        of,
        "ax" if along.startswith(("predicted", "time")) else "x",
    )
    away = np.sqrt(np.mean((one.measured - law_at_the_dots(one)) ** 2))
    assert away < apart * np.sqrt(np.mean(one.measured**2))


def test_of_a_lag_the_spectrum_is_shown_and_the_law_follows_it_above_the_noise(make_signature):
    one = make_signature("amplifier_lag", {"time_constant": 2e-3})
    assert one.abscissa_label == "frequency (Hz)"
    loud = one.law > 5 * np.median(one.measured[-5:])
    assert loud.sum() >= 10
    assert np.abs(np.log(one.measured[loud] / one.law[loud])).max() < 0.2


def test_of_clocks_that_run_apart_the_growth_is_shown(make_signature):
    one = make_signature("clock_drift", {"ppm": 400.0, "interpolated": 0.0})
    assert one.ordinate_label == "rms error of ax (m/s^2)"
    assert one.measured[-1] > 2 * one.measured[0]


def test_of_a_turned_sensor_the_channel_that_reads_another_is_shown(make_signature):
    one = make_signature("sensor_misalignment", {"degrees": 8.0, "about_x": 0.0, "about_y": 0.0, "about_z": 8.0}, 3)
    assert one.abscissa_label != f"predicted {one.axis} (m/s^2)"
    assert one.axis in ("ax", "ay")


def test_where_nothing_is_missing_the_dots_stay_far_from_a_law_that_is_claimed(make_signature):
    one = make_signature("coulomb_friction", {"level": 0.2}, there=False)
    assert np.abs(law_at_the_dots(one)).mean() > 0.15
    assert np.abs(one.measured).max() < 0.02


def test_a_law_whose_model_runs_away_has_the_curve_of_what_is_finite():
    at = np.append(np.linspace(-1, 1, 500), [np.inf, -np.inf])
    places, means = compute_law_bin_means(at, at**3)
    assert np.isfinite(places).all() and len(places) > 10
    np.testing.assert_allclose(means, places**3, atol=0.01)
    assert [len(each) for each in compute_law_bin_means(at[-2:], at[-2:])] == [0, 0]
