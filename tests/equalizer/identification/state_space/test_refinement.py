"""The maximum-likelihood search."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import least_squares

from equalizer.identification.state_space.modal_form import ModalForm
from equalizer.identification.state_space.refinement import (
    LEAST_DAMPING,
    _compute_step,
    complete_form,
    refine_form,
    solve_input_matrices,
)
from equalizer.identification.state_space.stable_poles import compute_pole_radius
from equalizer.identification.state_space.weighted_lines import weight_lines
from tests.equalizer.identification.state_space.test_modal_form import make_modal_form

RADIUS = compute_pole_radius(0.5, 1000.0)


@pytest.fixture(scope="module")
def plant(plants, measuring):
    return measuring.small_plant(plants)


@pytest.fixture(scope="module")
def lines(measuring, plant):
    return weight_lines([measuring.noisy(plant, np.arange(5, 35, 0.2), 0.3, seed=7)], (5.0, 35.0))


def disturbed(plant, seed, size):
    form = make_modal_form(plant.A, plant.C)
    random = np.random.default_rng(seed)
    shaken = [part * (1 + size * random.standard_normal(part.shape)) for part in (form.b, form.C)]
    return ModalForm(form.a, *shaken)


def test_input_matrices_are_exact_where_poles_and_outputs_are(measuring, plant):
    exact = weight_lines([measuring.exact(plant, np.arange(5, 35, 0.2))], (5.0, 35.0))
    form = make_modal_form(plant.A, plant.C)
    B, D = solve_input_matrices(form, exact)
    assert (
        np.abs(form.compute_state_outputs(exact.z) @ B + D - exact.response).max() < 1e-9 * np.abs(exact.response).max()
    )
    assert np.abs(D).max() < 1e-8 * np.abs(exact.response).max()


def test_a_general_optimizer_finds_nothing_cheaper(plant, lines):
    """Oracle: all of a, b, C, B and D at once, by scipy, from where the search ended and from where it began."""
    start = disturbed(plant, 1, 0.02)
    found = refine_form(start, lines, RADIUS)

    def residuals(numbers):
        a, b, C, B, D = np.split(numbers, [3, 6, 24, 42])
        form = ModalForm(a, b, C.reshape(3, 6))
        errors = (
            form.compute_state_outputs(lines.z) @ B.reshape(6, 3) + D.reshape(3, 3) - lines.response
        ) * lines.weight
        return np.concatenate([errors.real.ravel(), errors.imag.ravel()])

    ours = lines.compute_cost(found.compute_response(lines.z))
    for each in (found, complete_form(start, lines)):
        numbers = np.concatenate([part.ravel() for part in (each.form.a, each.form.b, each.form.C, each.B, each.D)])
        theirs = 2 * least_squares(residuals, numbers, x_scale="jac", max_nfev=60).cost
        assert ours <= theirs * (1 + 1e-5)


def test_with_a_single_output_the_size_of_c_is_not_searched(plant, lines):
    """B takes up every change of it: steps along it would be rounding errors, and grow to 1e148."""
    single = replace(lines, response=lines.response[:, :1, :1], weight=lines.weight[:, :1, :1])
    start = disturbed(plant, 1, 0.02)
    start = replace(start, C=start.C[:1])
    found = refine_form(start, single, RADIUS)
    assert np.array_equal(found.form.C, start.C)
    assert single.compute_cost(found.compute_response(single.z)) < 1.2 * 2 * single.response.size


def test_a_step_is_taken_only_if_it_lowers_the_cost(plant, lines):
    start = disturbed(plant, 2, 0.05)
    costs = [
        lines.compute_cost(refine_form(start, lines, RADIUS, steps).compute_response(lines.z))
        for steps in (1, 2, 4, 8, 30)
    ]
    assert costs == sorted(costs, reverse=True)
    assert costs[-1] < 0.5 * lines.compute_cost(complete_form(start, lines).compute_response(lines.z))


def test_the_bound_holds_where_the_data_ask_for_a_slower_pole(measuring, plant):
    lines = weight_lines([measuring.exact(plant, np.arange(5, 35, 0.2))], (5.0, 35.0))
    radius = compute_pole_radius(0.02, 1000.0)
    assert np.abs(np.linalg.eigvals(plant.A)).max() > radius
    found = refine_form(make_modal_form(0.9 * plant.A, plant.C), lines, radius)
    assert np.abs(found.form.poles).max() <= radius * (1 + 1e-7)


def test_states_that_nothing_shows_do_not_stop_the_search(plant, lines):
    known = make_modal_form(plant.A, plant.C)
    twice = ModalForm(
        np.append(known.a, known.a[0]), np.append(known.b, known.b[0]), np.hstack([known.C, 0 * known.C[:, :2]])
    )
    found = refine_form(twice, lines, RADIUS)
    assert np.isfinite(found.B).all()
    assert lines.compute_cost(found.compute_response(lines.z)) / lines.response.size < 1.05


def test_the_least_damping_gives_a_step_where_the_data_leave_a_scale_free():
    normal_matrix, gradient = np.full((2, 2), 2.0), np.array([1.0, 1.0])
    with pytest.raises(np.linalg.LinAlgError):
        _compute_step(normal_matrix, gradient, 1e-17)
    step = _compute_step(normal_matrix, gradient, LEAST_DAMPING)
    assert normal_matrix @ step == pytest.approx(-gradient, rel=1e-2)
