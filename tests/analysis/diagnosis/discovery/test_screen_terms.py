"""The screen of terms: bounds of the model's own parameters, and slopes of a frequency over a long recording."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import lsq_linear

from analysis.diagnosis.discovery.fit_sum import fit_sum
from analysis.diagnosis.discovery.grammar import Term, measure_axes
from analysis.diagnosis.discovery.matched_filter import View, build_views
from analysis.diagnosis.discovery.periodic_terms import find_periodic_terms
from analysis.diagnosis.discovery.screen_terms import (
    build_normal_equations,
    solve_all_blocks,
    solve_bounded_least_squares,
)
from analysis.diagnosis.errors.hypothesis import NO_EFFECTS
from analysis.diagnosis.errors.output_error import evaluate_fit
from analysis.diagnosis.limits import RETUNING_BOUND
from equalizer.effects.simulation.simulator import simulate_mechanism
from equalizer.signals.recording import Recording
from equalizer.signals.signal import FloatArray, Signal
from tests.diagnosed import NOISE, RATE_HZ, device
from tests.lawful import arena_of, law, recorded


@pytest.mark.parametrize("seed", range(5))
def test_a_batch_is_solved_within_its_bounds_as_a_peer_solves_each(seed):
    rng = np.random.default_rng(seed)
    columns, wanted = rng.standard_normal((7, 60, 4)), rng.standard_normal((7, 60))
    low, high = np.array([-0.05, -np.inf, -np.inf, -np.inf]), np.array([0.05, np.inf, np.inf, np.inf])
    squares, right = np.einsum("tsk,tsl->tkl", columns, columns), np.einsum("tsk,ts->tk", columns, wanted)
    found = solve_bounded_least_squares(squares, right, low, high)
    for a, b, own in zip(columns, wanted, found, strict=True):
        assert own == pytest.approx(lsq_linear(a, b, (low, high), method="bvls", tol=1e-14).x, abs=1e-9)
    assert np.isclose(np.abs(found[:, 0]), 0.05).any()
    free = solve_bounded_least_squares(squares, right, np.full(4, -np.inf), np.full(4, np.inf))
    assert free == pytest.approx(np.linalg.solve(squares, right[:, :, None])[:, :, 0])


def test_a_barred_weight_is_zero_and_the_others_as_without_it():
    rng = np.random.default_rng(7)
    a, b = rng.standard_normal((40, 3)), rng.standard_normal(40)
    squares = (a.T @ a)[None]
    squares[0, 1, 1] = np.inf
    found = solve_bounded_least_squares(squares, (a.T @ b)[None], np.full(3, -np.inf), np.full(3, np.inf))[0]
    assert found[1] == pytest.approx(0, abs=1e-12)
    assert found[[0, 2]] == pytest.approx(np.linalg.lstsq(a[:, [0, 2]], b, rcond=None)[0])


@pytest.fixture(scope="module")
def pumped_view() -> View:
    context, known = arena_of(recorded((law("p0*x*sin(2*pi*p1*t)", 60.0, 3.371),), 1))
    whole = known.retuned.fitted
    fitted = evaluate_fit(context.measure, context.tuning, whole.deviations, whole.hypothesis)
    return build_views(context.measure, context.tuning, fitted)[0]


def test_the_models_numbers_stay_within_the_bounds_of_re_tuning(pumped_view):
    """A residual that half of the mass gone would explain, and more."""
    mass = pumped_view.parameter_columns[0]
    gone = replace(pumped_view, residual=-50 * mass)
    moved = solve_all_blocks(build_normal_equations(gone)).weights[0] - gone.to_calibration[0]
    assert moved == pytest.approx(-RETUNING_BOUND)


@pytest.mark.parametrize("off_hz", [0.02, -0.02])
def test_a_frequency_is_found_from_a_start_that_is_out_of_phase_at_the_end(pumped_view, off_hz):
    term = Term("x*sin(2*pi*p0*t + p1)", (3.371 + off_hz, 0.0), ((2.0, 5.0), (-20.0, 20.0)), (), (1,))
    found = fit_sum(build_normal_equations(pumped_view), (term,))
    assert found is not None
    assert found.terms[0].numbers[0] == pytest.approx(3.371, abs=2e-4)


def test_pitches_start_within_the_travel_of_a_motion_far_from_zero():
    t = np.arange(4000) / 500.0
    x = 0.3 + 0.01 * np.sin(2 * np.pi * 0.7 * t)
    pitch = 0.004
    columns = {"x": x, "vx": np.gradient(x, 1 / 500.0), "fx": np.cos(3.0 * t)}
    (axis,) = measure_axes(columns, 1)
    terms = find_periodic_terms(columns, axis, 0.5 * np.sin(2 * np.pi * x / pitch), 500.0)
    in_position = [term for term in terms if "x/p0" in term.shape]
    for term in in_position:
        assert term.bounds[0][0] <= term.numbers[0] <= term.bounds[0][1] <= np.ptp(x)
    assert min(abs(term.numbers[0] / pitch - 1) for term in in_position) < 0.05


def test_the_fourth_axis_is_tuned_with_the_others_and_not_searched(axes=4):
    """Its signals have no letter in the grammar; a diagnosis of such a device once ended with an IndexError."""
    random = np.random.default_rng(3)
    command = random.standard_normal((4000, axes))
    played = simulate_mechanism(device(axes), command, RATE_HZ, ())

    def signal(samples: FloatArray, quantity: str, unit: str, letter: str, rms: float = 0.0) -> Signal:
        names = tuple(f"{letter}{number}" for number in range(axes))
        return Signal(samples + rms * random.standard_normal(samples.shape), RATE_HZ, quantity, unit, names)

    recording = Recording(
        "four",
        signal(command, "force", "N", "f"),
        signal(played.response, "acceleration", "m/s^2", "a", NOISE[0]),
        signal(played.position, "position", "m", "q", NOISE[1]),
    )
    context, known = arena_of(recording, device(axes))
    fitted = evaluate_fit(context.measure, context.tuning, known.retuned.fitted.deviations, NO_EFFECTS)
    views = build_views(context.measure, context.tuning, fitted)
    assert [(view.output, view.acts_on, view.axis) for view in views] == [
        *((axis, "force", axis) for axis in range(3)),
        *((3 + channel, "response", channel) for channel in range(3)),
    ]
    coupled_mass = context.tuning.names.index("mass f0 f3")
    assert np.abs(views[0].parameter_columns[coupled_mass]).max() > 0
