"""Blocks of two poles."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from equalizer.identification.state_space.modal_form import ModalForm, build_form_from_poles


def make_modal_form(A, C):
    poles, vectors = np.linalg.eig(A)
    return build_form_from_poles(poles, C @ vectors)


@given(seed=st.integers(0, 10_000), order=st.sampled_from([2, 4, 8]))
@settings(max_examples=30, deadline=None)
def test_a_model_in_blocks_keeps_its_poles_and_what_its_outputs_see(seed, order):
    random = np.random.default_rng(seed)
    A, C = random.standard_normal((order, order)), random.standard_normal((2, order))
    form = make_modal_form(A, C)
    np.testing.assert_allclose(np.sort_complex(form.poles), np.sort_complex(np.linalg.eigvals(A)), atol=1e-9)
    # Same A and C up to a change of states: what one sees of any state over time spans the same space.
    observed, in_blocks = (
        np.vstack([out @ np.linalg.matrix_power(step, k) for k in range(order)])
        for step, out in ((A, C), (form.state_matrix, form.C))
    )
    left = observed - in_blocks @ np.linalg.lstsq(in_blocks, observed, rcond=None)[0]
    assert np.abs(left).max() < 1e-5 * np.abs(observed).max()


@pytest.mark.parametrize("b", [[-0.1, 0.02], [0.0, -0.3]])
def test_both_sides_of_the_resolvent_agree_with_a_dense_solution(b):
    random = np.random.default_rng(1)
    form = ModalForm(np.array([0.5, -0.2]), np.array(b), random.standard_normal((3, 4)))
    B, z = random.standard_normal((4, 2)), np.exp(1j * np.array([0.1, 1.0, 2.0]))
    inverse = np.linalg.inv(z[:, None, None] * np.eye(4) - form.state_matrix)
    np.testing.assert_allclose(form.compute_state_outputs(z), form.C @ inverse, atol=1e-12)
    np.testing.assert_allclose(form.compute_state_responses(z, B), inverse @ B, atol=1e-12)


def test_poles_that_form_no_pairs_are_refused():
    with pytest.raises(ValueError, match="3 poles, 1 of them real, do not form pairs; choose an even order"):
        build_form_from_poles(np.array([0.5, 0.2 + 0.1j, 0.2 - 0.1j]), np.ones((1, 3), complex))
