"""How much cheaper stored solutions are. Ratios of the quickest runs, with another try where the machine was busy."""

import timeit

import numpy as np
import pytest

from equalizer.tracking.lqr.changing_direction import make_rotatable_transient, play
from equalizer.tracking.lqr.lqr import compute_stored_gains, track
from equalizer.tracking.lqr.riccati import compute_backward_gains
from equalizer.tracking.lqr.rotation import compute_rotation_basis

SAMPLES, TRIES = 500, 5


def quickest(action, number=1, repeat=10) -> float:
    return min(timeit.repeat(action, number=number, repeat=repeat)) / number


def in_one_of_some_tries(reached) -> bool:
    return any(reached() for _ in range(TRIES))


@pytest.fixture(scope="module")
def half_a_second(problem_of):
    return problem_of(26, 0), np.random.default_rng(0).standard_normal((SAMPLES, 3))


def test_stored_gains_are_ten_times_faster_than_the_compiled_recursion(half_a_second):
    problem, wanted = half_a_second
    gains = compute_stored_gains(problem, SAMPLES)

    def reached() -> bool:
        anew = quickest(lambda: track(compute_stored_gains(problem, SAMPLES), wanted))
        plainly = quickest(lambda: compute_backward_gains(problem, SAMPLES), repeat=2)
        stored = quickest(lambda: track(gains, wanted), repeat=50)
        return anew >= 10 * stored and plainly >= 100 * stored

    assert in_one_of_some_tries(reached)


def test_a_rotation_is_five_hundred_times_faster(half_a_second, random_rotation):
    problem, wanted = half_a_second
    basis, R = compute_rotation_basis(compute_stored_gains(problem, SAMPLES), wanted), random_rotation(0)

    def reached() -> bool:
        anew = quickest(lambda: track(compute_stored_gains(problem, SAMPLES), wanted))
        plainly = quickest(lambda: compute_backward_gains(problem, SAMPLES), repeat=2)
        rotated = quickest(lambda: basis.compute_forces(R), number=200, repeat=50)
        return anew >= 500 * rotated and plainly >= 5000 * rotated

    assert in_one_of_some_tries(reached)


def test_a_tick_that_turns_takes_less_than_a_microsecond(half_a_second, random_rotation):
    problem, wanted = half_a_second
    transient = make_rotatable_transient(compute_stored_gains(problem, SAMPLES), wanted)
    turns = np.array([random_rotation(k) for k in range(SAMPLES)])
    assert in_one_of_some_tries(lambda: quickest(lambda: play(transient, turns)) <= SAMPLES * 1e-6)
