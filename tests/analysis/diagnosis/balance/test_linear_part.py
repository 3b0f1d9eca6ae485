"""What is linear beside one body per command is part of the first model, and neither hides a law nor poses as one."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.interpolate import interp1d

RATE_HZ, SECONDS, LATE_S = 200.0, 15.0, 0.02
MASS, DAMPING, STIFFNESS, LEVEL = 0.1, 0.8, 20.0, 0.6
FAR_MASS, JOINT, JOINT_DAMPING = 0.06, 30.0, 0.05


def _make_force(seed=3, top_hz=5.0):
    """(n,) of lines up to top_hz, and the same at any time."""
    rng = np.random.default_rng(seed)
    hz = np.arange(0.2, top_hz, 0.21)
    phase = rng.uniform(0, 2 * np.pi, len(hz))
    times_s = np.arange(0, SECONDS, 1 / RATE_HZ)

    def at(t):
        return 2.5 * np.sin(2 * np.pi * np.multiply.outer(t, hz) + phase).sum(axis=-1) / np.sqrt(len(hz) / 2)

    return times_s, at


def _solve_motion(times_s, slopes, size):
    fine = np.arange(0, times_s[-1] + 1e-3, 1e-3)
    found = solve_ivp(
        slopes, (0, fine[-1]), np.zeros(size), t_eval=fine, method="LSODA", max_step=2e-3, rtol=1e-7, atol=1e-9
    )
    return interp1d(found.t, found.y, axis=1, fill_value="extrapolate")(times_s).T


@pytest.fixture(scope="module")
def late_axis():
    """Rubs, and hears of its force late."""
    times_s, at = _make_force()

    def slopes(t, state):
        q, v = state
        return [v, (at(t - LATE_S) - DAMPING * v - STIFFNESS * q - LEVEL * np.tanh(v / 1e-3)) / MASS]

    return at(times_s)[:, None], _solve_motion(times_s, slopes, 2)[:, :1]


@pytest.fixture(scope="module")
def two_bodies():
    """The first rubs and is driven; the second hangs on it by a spring."""
    times_s, at = _make_force(5)

    def slopes(t, state):
        q, far, v, far_v = state
        joint = JOINT * (q - far) + JOINT_DAMPING * (v - far_v)
        own = at(t) - joint - DAMPING * v - LEVEL * np.tanh(v / 1e-3)
        return [v, far_v, own / MASS, (joint - 0.02 * far_v) / FAR_MASS]

    return at(times_s)[:, None], _solve_motion(times_s, slopes, 4)[:, :2]


@pytest.fixture(scope="module")
def balances_of_both(two_bodies, record_samples, find_balance):
    """Both motions measured, the driven one first: the recording, and the balances of it."""
    recording = record_samples(*two_bodies, RATE_HZ)
    return recording, find_balance(recording)


@pytest.mark.slow
def test_a_late_command_is_seen_and_its_friction_named(late_axis, record_samples, find_balance):
    force, motion = late_axis

    (balance,) = find_balance(record_samples(force, motion, RATE_HZ))

    beside = balance.search.regression.base_terms
    assert beside.delay_s == pytest.approx(LATE_S, abs=0.002)
    assert balance.named[0].law.effect == "coulomb_friction"
    assert balance.named[0].values["level"] == pytest.approx(LEVEL, rel=0.05)


@pytest.mark.slow
def test_a_command_in_time_is_not_shifted(balances_of_both):
    _, (balance,) = balances_of_both

    assert abs(balance.search.regression.base_terms.delay_s) < 1 / RATE_HZ


@pytest.mark.parametrize("order", [(0, 1), pytest.param((1, 0), marks=pytest.mark.slow)])
def test_of_two_measured_motions_the_driven_one_is_found_and_its_friction_named(
    two_bodies, record_samples, find_balance, balances_of_both, order
):
    force, motion = two_bodies

    in_order = order == (0, 1)
    (balance,) = balances_of_both[1] if in_order else find_balance(record_samples(force, motion[:, order], RATE_HZ))

    driven = order.index(0)
    assert balance.search.regression.base_terms.driven_channel == driven
    assert (balance.named[0].law.effect, balance.named[0].law.channel) == ("coulomb_friction", driven)
    assert balance.named[0].values["level"] == pytest.approx(LEVEL, rel=0.1)


@pytest.mark.slow
def test_a_body_that_is_not_measured_does_not_hide_friction(two_bodies, record_samples, find_balance):
    force, motion = two_bodies

    (balance,) = find_balance(record_samples(force, motion[:, :1], RATE_HZ))

    assert balance.named[0].law.effect == "coulomb_friction"
    assert balance.named[0].values["level"] == pytest.approx(LEVEL, rel=0.1)
    assert not any(law.named for law in balance.laws if law.law.is_linear)


def test_what_is_left_of_a_command_drives_one_body(balances_of_both):
    from analysis.diagnosis.first_model.model_from_balance import build_first_model
    from analysis.diagnosis.first_model.reduced_recordings import is_reduction_needed, reduce_recordings

    recording, balances = balances_of_both

    (reduced,) = reduce_recordings((recording,), balances)
    model = build_first_model(balances, reduced, "one body")

    assert is_reduction_needed(balances)
    assert reduced.response.channels == ("x",)
    assert reduced.command.samples.shape == recording.command.samples.shape
    assert model is not None
    assert model.mass[0, 0] == pytest.approx(MASS, rel=0.1)


@pytest.mark.slow
def test_where_only_accelerations_were_measured_a_hardening_spring_is_found(record_samples, find_balance):
    mass, damping, stiffness, cubic, rate_hz = 0.1, 1.0, 2000.0, 6e6, 500.0
    times_s, at = np.arange(0, 16, 1 / rate_hz), _make_force(9, 25.0)[1]

    def slopes(t, state):
        q, v = state
        return [v, (3 * at(t) - damping * v - stiffness * q - cubic * q**3) / mass]

    found = solve_ivp(
        slopes, (0, 16), np.zeros(2), t_eval=times_s, method="LSODA", max_step=1e-3, rtol=1e-7, atol=1e-10
    ).y
    seen = np.array([slopes(t, state)[1] for t, state in zip(times_s, found.T, strict=True)])
    seen += 0.01 * seen.std() * np.random.default_rng(1).standard_normal(len(seen))

    (balance,) = find_balance(record_samples(3 * at(times_s)[:, None], seen[:, None], rate_hz, "acceleration"))

    strongest = next(each for each in balance.laws if not each.law.is_linear)
    assert strongest.law.effect == "hardening_stiffness"
    assert strongest.values["k3"] == pytest.approx(cubic, rel=0.35)
