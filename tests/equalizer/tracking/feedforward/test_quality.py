"""Flatness, coupling and direction of what is delivered."""

import numpy as np
import pytest

from equalizer.tracking.feedforward.quality import measure_quality


def test_perfect_is_nothing_off_in_any_sense():
    found = measure_quality(np.tile(np.eye(3, dtype=complex), (5, 1, 1)))
    assert (found.flatness_db, found.coupling_db, found.axis_error_deg) == (0.0, -np.inf, 0.0)


def test_the_worst_line_counts_for_each_by_itself():
    delivered = np.tile(np.eye(3, dtype=complex), (3, 1, 1))
    delivered[0, 1, 1] = 1.1
    delivered[1, 0, 2] = 0.1j
    delivered[2, 2, 0] = -0.05
    found = measure_quality(delivered)
    assert found.flatness_db == pytest.approx(20 * np.log10(1.1))
    assert found.coupling_db == pytest.approx(-20.0)
    # In quadrature nothing turns the long axis; in phase it turns by the arc tangent.
    assert found.axis_error_deg == pytest.approx(np.degrees(np.arctan(0.05)))


def test_too_little_is_as_bad_as_too_much():
    too_little = measure_quality(0.5 * np.eye(3, dtype=complex)[None])
    assert too_little.flatness_db == pytest.approx(20 * np.log10(2.0))


def test_a_phase_of_its_own_is_no_error_of_direction():
    assert measure_quality(np.exp(1j) * np.eye(3)[None]).axis_error_deg == pytest.approx(0.0, abs=1e-6)
