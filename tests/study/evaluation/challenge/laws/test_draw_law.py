"""Devices with laws of no catalogue: drawn again alike, as large as was drawn, and doing what their formula says."""

import numpy as np
import pytest

from study.evaluation.challenge.device import Device
from study.evaluation.challenge.law_kernel import compute_law_force
from study.evaluation.challenge.laws.build_law import build_law
from study.evaluation.challenge.laws.concealed_laws import LAW_KINDS, PeakValues
from study.evaluation.challenge.laws.draw_law import CASES_PER_TURN, TURN_KINDS, draw_law, generate_law_case
from study.evaluation.challenge.mechanism_kernel import Motion

SEED = 7
PEAKS = PeakValues(0.01, 0.2, 20.0)


@pytest.fixture(scope="module")
def found():
    """The first device of one axis with a force of its own."""
    number = next(n for n in range(len(TURN_KINDS)) if _simple(draw_law(SEED, n, brief=True)))
    return number, generate_law_case(draw_law(SEED, number, brief=True), "first")


def _simple(drawn):
    kind = next((kind for kind in LAW_KINDS if kind.name == drawn.concealed), None)
    return kind is not None and kind.code >= 0 and len(drawn.settings.axes) == 1 and not kind.memory


@pytest.mark.slow
def test_the_same_number_is_the_same_device(found):
    number, case = found
    again = generate_law_case(draw_law(SEED, number, brief=True), "first")
    assert again.truth == case.truth
    assert np.array_equal(again.case.recording.response.samples, case.case.recording.response.samples)


def test_a_turn_holds_what_it_says():
    kinds = [draw_law(SEED, number).kind for number in range(len(TURN_KINDS))]
    assert {kind: kinds.count(kind) for kind in CASES_PER_TURN} == CASES_PER_TURN


def test_every_law_takes_its_turn():
    laws = [draw_law(SEED, number).concealed for number in range(3 * len(TURN_KINDS))]
    assert {kind.name for kind in LAW_KINDS} <= set(laws)


@pytest.mark.slow
def test_the_law_shows_and_fresh_motion_carries_its_force(found):
    _, case = found
    assert case.case.detectability > 1
    quiet, loud = (float(np.sqrt(np.mean(each.law_force**2))) for each in case.fresh_motions)
    assert 0 < quiet < loud


@pytest.mark.parametrize("kind", [kind for kind in LAW_KINDS if kind.code >= 0], ids=lambda kind: kind.name)
def test_a_force_hangs_on_the_variables_that_are_said(kind):
    """And on no others: each is moved alone."""
    random = np.random.default_rng(3)
    first, second = kind.draw(random, PEAKS)
    row = np.array([kind.code, 0, 1, 1.0, first, second, 1.0])
    state = {"x": 0.008, "y": 0.004, "vx": 0.15, "vy": 0.05, "fx": 1.0, "t": 0.37, "kept": 0.001}
    moves = {"x": -0.0011, "y": 0.001, "vx": -0.07, "vy": 0.02, "fx": 0.4, "t": 0.11}

    def force(at):
        q, v, u = (np.array([at[a], at.get(b, 0.0), 0.0]) for a, b in (("x", "y"), ("vx", "vy"), ("fx", "fy")))
        return compute_law_force(row, q, v, u, at["kept"], at["t"])

    needed = {name for name, by in moves.items() if force({**state, name: state[name] + by}) != force(state)}
    if kind.name == "drag beyond a place":  # a step: nothing between the two places
        needed |= {"x"}
    assert needed == set(kind.variables[0].split())


@pytest.mark.parametrize("kind", [kind for kind in LAW_KINDS if kind.change is not None], ids=lambda kind: kind.name)
def test_what_changes_commands_and_readings_leaves_none_alone_at_zero(kind):
    first, second = kind.draw(np.random.default_rng(4), PEAKS)
    zero, some = np.zeros(5), np.linspace(-3.0, 3.0, 5)
    assert np.array_equal(kind.change(zero, some, first, second), zero)
    assert np.abs(kind.change(some, some, first, second)).max() > 0


@pytest.mark.parametrize("name", ["amplifier of two gains", "crooked sensor"])
@pytest.mark.parametrize("seed", range(4))
def test_the_labels_numbers_in_its_formula_are_the_change(bench, name, seed):
    (kind,) = (kind for kind in LAW_KINDS if kind.name == name)
    samples = np.random.default_rng(1).normal(0.0, 2.0, (500, 3))
    moved = Motion(samples, 0.001 * samples, 0.1 * samples, 0.0 * samples)
    device, truth = build_law(Device(bench), kind, (moved, samples), (0, 1), 0.5, np.random.default_rng(seed))
    become = device.drive_law if kind.acts_on[0] == "command" else device.sensor.static_law
    of, k, s = samples[:, 0], truth.numbers["k"], truth.numbers["s"]
    assert k > 0
    np.testing.assert_allclose(become(samples)[:, 0], of + s * k * (np.abs(of) if name[0] == "a" else of**2))
