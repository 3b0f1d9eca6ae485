"""Nonlinear laws of the actuator are found where the balance is solved for the acceleration."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from analysis.diagnosis.balance import actuator, actuator_equivalents
from analysis.diagnosis.balance.judge_laws import Balance
from analysis.diagnosis.balance.judged_law import NO_COLUMN, JudgedLaw
from analysis.diagnosis.balance.laws.command_laws import IDEAL_ACTUATOR, vary_parameters


@pytest.fixture(scope="module")
def find_laws(axis_module, find_balance):
    """Of an axis behind an actuator: what it is commanded is recorded, what it gives moves the axis."""

    def laws(given, physics=None, seed=1, level=5.0):
        axis = physics or axis_module.Physics()
        command = axis_module.random_course(seed, 2000, 250.0) * level
        entered = given(command)
        count, random = len(command), np.random.default_rng([seed, 9])
        position, _ = axis_module.simulate_axis(
            axis.numbers(), entered, np.zeros(2), 3e-6 * random.standard_normal(count), 250.0
        )
        return find_balance(axis_module.make_recording(command[:, None], position[:, None], 250.0))[0]

    return laws


@pytest.fixture(scope="module")
def dead_band(find_laws):
    """Of 1.5 N."""
    return find_laws(lambda u: u - np.clip(u, -1.5, 1.5))


def laws_by_name(balance):
    return {law.law.effect: law for law in balance.named}


@pytest.mark.slow
def test_a_dead_band_is_recovered_with_its_width(dead_band):
    law = laws_by_name(dead_band)["force_deadband"]
    assert law.values["width"] == pytest.approx(1.5, rel=0.1)
    assert law.gain > 0.8
    assert law.equivalents == ()
    assert set(laws_by_name(dead_band)) == {"force_deadband"}


@pytest.mark.slow
def test_a_limit_of_the_force_is_recovered(find_laws):
    balance = find_laws(lambda u: np.clip(u, -4.0, 4.0))
    assert laws_by_name(balance)["force_saturation"].values["limit"] == pytest.approx(4.0, rel=0.1)


@pytest.fixture(scope="module")
def rubbing_dead_band(find_laws, axis_module):
    """Of 1.5 N, beside a dry friction of 0.5 N."""
    return find_laws(lambda u: u - np.clip(u, -1.5, 1.5), replace(axis_module.Physics(), coulomb=0.5))


@pytest.mark.slow
def test_a_dead_band_leaves_the_dry_friction_beside_it(rubbing_dead_band):
    balance = rubbing_dead_band
    assert set(laws_by_name(balance)) == {"force_deadband", "coulomb_friction"}
    assert laws_by_name(balance)["coulomb_friction"].values["level"] == pytest.approx(0.5, rel=0.2)


@pytest.mark.slow
def test_the_error_before_is_that_of_the_force_as_commanded(dead_band):
    assert dead_band.error < 0.5 * dead_band.linear_error


@pytest.mark.slow
@pytest.mark.parametrize(
    "physics",
    [{"coulomb": 0.8}, {"coulomb": 0.4, "stiction": 0.6, "cubic": 2e5}],
)
def test_a_linear_actuator_has_no_deadband_saturation_or_nonlinearity(find_laws, axis_module, physics):
    balance = find_laws(lambda u: u, replace(axis_module.Physics(), **physics))
    assert not {"force_deadband", "force_saturation", "force_nonlinearity"} & set(laws_by_name(balance))


@pytest.mark.slow
@pytest.mark.parametrize("square", [-0.5, 0.4])
def test_a_gain_that_changes_with_the_command_is_recovered_with_its_size(find_laws, square):
    balance = find_laws(lambda u: u * (1 - square + square * np.abs(u) / np.abs(u).max()))
    assert set(laws_by_name(balance)) == {"force_nonlinearity"}
    assert laws_by_name(balance)["force_nonlinearity"].values["square"] == pytest.approx(square, rel=0.15)


@pytest.mark.slow
def test_a_gain_that_grows_with_the_square_of_the_command_grows_with_its_size(find_laws):
    law = laws_by_name(find_laws(lambda u: u * (1 + 0.02 * u**2)))["force_nonlinearity"]
    assert 0 < law.values["square"] <= 1


def simulate_speed(given, drag, seed=3, rate_hz=50.0, count=6000):
    """Speed of a mass of 1 with a damping of 1 and a drag, driven in random steps; both (n, 1)."""
    random = np.random.default_rng(seed)
    command = np.repeat(random.uniform(-1.0, 1.0, count // 50), 50)
    speed, v = np.empty(count), 0.0
    for k, push in enumerate(given(command)):
        speed[k] = v
        for _ in range(10):
            v += (push - v - drag * v * abs(v)) / (10 * rate_hz)
    return command[:, None], (speed + 1e-3 * random.standard_normal(count))[:, None]


@pytest.fixture(scope="module")
def find_speed_balance(find_balance):
    from equalizer.signals.recording import Hold, Recording
    from equalizer.signals.signal import Signal

    def found(given, drag):
        command, speed = simulate_speed(given, drag)
        return find_balance(
            Recording(
                "invented",
                Signal(command, 50.0, "force", "N", ("fx",)),
                Signal(speed, 50.0, "velocity", "m/s", ("x",)),
                hold=Hold.ZERO_ORDER,
            )
        )[0]

    return found


@pytest.mark.slow
def test_a_gain_that_falls_with_the_command_is_no_drag(find_speed_balance):
    balance = find_speed_balance(lambda u: u * (1 - 0.5 * np.abs(u)), 0.0)
    assert laws_by_name(balance)["force_nonlinearity"].values["square"] == pytest.approx(-1, abs=0.2)
    assert "quadratic_damping" not in laws_by_name(balance)


@pytest.mark.slow
def test_a_drag_is_none_of_the_actuator(find_speed_balance):
    assert set(laws_by_name(find_speed_balance(lambda u: u, 2.0))) == {"quadratic_damping"}


def record_noisy_speed(curve, drag, seed=3, rate_hz=10.0, count=4000):
    """Of a motor with a time constant of 1 s, through steps of 5 s, with a noise of a fifth of it. curve: power of the
    command, with a dead band of 0.04 where it is no straight line."""
    from equalizer.signals.recording import Hold, Recording
    from equalizer.signals.signal import Signal

    random = np.random.default_rng(seed)
    command = np.repeat(random.uniform(-1.0, 1.0, count // 50), 50)
    width = 0.0 if curve == 1.0 else 0.04
    given = 10 * np.sign(command) * np.maximum(np.abs(command) - width, 0.0) ** curve
    speed, v = np.empty(count), 0.0
    for k, push in enumerate(given):
        speed[k] = v
        for _ in range(10):
            v += (push - v - drag * v * abs(v)) / (10 * rate_hz)
    speed += 0.2 * speed.std() * random.standard_normal(count)
    signals = (
        Signal(command[:, None], rate_hz, "force", "N", ("fx",)),
        Signal(speed[:, None], rate_hz, "velocity", "m/s", ("x",)),
    )
    return Recording("invented", *signals, hold=Hold.ZERO_ORDER)


@pytest.mark.parametrize(
    ("curve", "drag", "drags"), [(0.55, 0.0, False), pytest.param(1.0, 0.1, True, marks=pytest.mark.slow)]
)
def test_a_drag_is_named_only_where_no_curve_of_the_command_does_as_well(find_balance, curve, drag, drags):
    """Though noise hides which of both leaves less by far."""
    balance = find_balance(record_noisy_speed(curve, drag))[0]
    assert ("quadratic_damping" in laws_by_name(balance)) == drags


@pytest.mark.slow
@pytest.mark.parametrize("lag_s", [0.06, pytest.param(0.01, marks=pytest.mark.slow)])
def test_a_valve_whose_speed_falls_behind_its_command_is_no_drag(find_balance, lag_s):
    """lag_s: of the speed behind the valve; below the sample period, no inertia shows."""
    from equalizer.signals.recording import Recording
    from equalizer.signals.signal import Signal

    random = np.random.default_rng(2)
    command = np.repeat(random.uniform(0.0, 1.0, 40), 100)
    given, speed = np.maximum(command - 0.1, 0.0) ** 0.6, np.zeros(len(command))
    for k in range(1, len(speed)):
        speed[k] = speed[k - 1] + (given[k - 1] - speed[k - 1]) * (1 - np.exp(-0.02 / lag_s))
    read = speed + 3e-3 * random.standard_normal(len(speed))
    signals = (
        Signal(command[:, None], 50.0, "force", "N", ("u",)),
        Signal(read[:, None], 50.0, "velocity", "m/s", ("v",)),
    )
    balance = find_balance(Recording("invented", *signals))[0]
    assert not {"quadratic_damping", "coulomb_friction", "stribeck_friction"} & set(laws_by_name(balance))


def record_pulled_mass(law, seed, count=2500, rate_hz=250.0):
    """Recording of a mass of 0.1 kg on a spring, pulled by law(current, position), in random steps of the current."""
    from tests.analysis.diagnosis.balance.invented_axis import make_recording

    random = np.random.default_rng([seed, 5])
    current = np.repeat(random.uniform(0.3, 1.0, count // 25), 25)
    position, x, v = np.empty(count), 0.0, 0.0
    for k, given in enumerate(current):
        position[k] = x
        for _ in range(10):
            v += (law(given, x) - 20.0 * x - 3.0 * v) / 0.1 / (10 * rate_hz)
            x += v / (10 * rate_hz)
    noise = 3e-8 * random.standard_normal(count)
    return make_recording(current[:, None], (position + noise)[:, None], rate_hz)


@pytest.mark.slow
@pytest.mark.parametrize("power", [1, pytest.param(2, marks=pytest.mark.slow)])
def test_the_pull_of_a_coil_is_the_first_candidate_and_laws_of_the_motion_do_not_take_its_part(find_balance, power):
    shot = record_pulled_mass(lambda i, x: 2.9e-6 * i**power / (0.01 - x) ** 2, 1)
    balance = find_balance(shot)[0]
    first = balance.laws[0]
    assert first.law.effect == "electromagnet"
    assert not balance.named
    assert first.values["gap"] == pytest.approx(0.01 - shot.response.samples.max(), rel=0.3)


@pytest.mark.slow
@pytest.mark.parametrize(
    "law", [lambda i, x: 0.05 * i - 1e6 * x**3, pytest.param(lambda i, x: 0.03 * i**2, marks=pytest.mark.slow)]
)
def test_what_pulls_alike_everywhere_is_no_coil(find_balance, law):
    balance = find_balance(record_pulled_mass(law, 2))[0]
    assert "electromagnet" not in {each.law.effect for each in (*balance.laws, *balance.further_laws)}


def test_a_law_of_the_command_is_tried_in_order_and_never_twice():
    law = replace(IDEAL_ACTUATOR, values={"power": 2.0, "width": 0.0, "limit": 3.0})
    tried = [tuple(each.values.values()) for each in vary_parameters(law)]
    assert tried == [(2.0, 0.0, 3.0 * f) for f in (0.95, 0.98, 1.02, 1.05)] + [
        (2.0 * f, 0.0, 3.0) for f in (0.95, 0.98, 1.02, 1.05)
    ]


@pytest.mark.slow
@pytest.mark.parametrize("inertia", [True, False])
def test_laws_behind_a_dead_band_in_doubt_are_not_named(rubbing_dead_band, monkeypatch, inertia):
    balance = rubbing_dead_band
    monkeypatch.setattr(actuator_equivalents, "_has_inertia", lambda regression, laws: inertia)
    doubted = actuator_equivalents.withdraw_ambiguous_names(balance)
    assert set(laws_by_name(doubted)) == ({"force_deadband", "coulomb_friction"} if inertia else set())
    assert len(doubted.laws) == len(balance.laws)


@pytest.mark.parametrize(
    ("one_body_error", "target", "is_named"), [(0.19, None, True), (0.21, None, False), (0.21, 0, True)]
)
def test_a_law_of_the_command_is_named_only_if_it_halves_the_error_of_one_body(
    monkeypatch, one_body_error, target, is_named
):
    """Else modes explain the same, and neither it nor the law of the motion that it makes unnecessary is named."""
    base_terms = SimpleNamespace(laws=(), driven_channel=0)
    search = SimpleNamespace(regression=SimpleNamespace(base_terms=base_terms))
    rubbing, curved = (
        JudgedLaw(place, SimpleNamespace(effect=effect, is_linear=False), {}, 0.9, 0.8, 0.9, (), 1.0, "")
        for place, effect in ((4, "coulomb_friction"), (NO_COLUMN, "force_nonlinearity"))
    )
    balance = Balance(search, None, (rubbing,), (), 0.4, 0.2, 0.2, True)
    passed = replace(balance, laws=())
    errors = {id(balance): 0.4, id(passed): one_body_error}
    balances = iter((balance, passed))
    fit = actuator.ActuatorFit(IDEAL_ACTUATOR, curved, needs_no_motion_law=True)
    monkeypatch.setattr(actuator, "search_with_linear_part", lambda *_: search)
    monkeypatch.setattr(actuator, "judge_laws", lambda _: next(balances))
    monkeypatch.setattr(actuator, "find_command_law", lambda *_: fit)
    monkeypatch.setattr(actuator_equivalents, "_compute_one_body_error", lambda each: errors[id(each)])
    found = actuator.find_balance([], actuator.DrivenAxis(0, False, target), frozenset(), lambda: True)
    assert [law.law.effect for law in found.named] == (["force_nonlinearity"] if is_named else [])
    assert [law.law.effect for law in found.laws] == ["force_nonlinearity", "coulomb_friction"][: 1 + (not is_named)]


def test_the_error_of_one_body_is_that_without_its_modes(axis_module, find_balance):
    physics = replace(axis_module.Physics(), second_mass=0.1, second_hz=5.0)
    (balance,) = find_balance(axis_module.record_axis(physics, rate_hz=250.0))
    assert balance.error < 0.1
    assert actuator_equivalents._compute_one_body_error(balance) > 0.1
