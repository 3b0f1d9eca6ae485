"""What moves and how fast, against courses whose derivatives are written down."""

from dataclasses import replace

import numpy as np
import pytest

from analysis.diagnosis.balance.band import compute_band_begin_hz, compute_band_end_hz
from analysis.diagnosis.balance.laws.motion_laws import make_laws
from analysis.diagnosis.balance.motion import NoMotionError, compute_motions, find_motion_signals
from analysis.diagnosis.data.observed_parts import observe_parts
from analysis.diagnosis.limits import ACCELERATION_NOISE_SHARE, HIGHEST_BAND_END_RATIO
from equalizer.signals.recording import Hold
from equalizer.signals.signal import Signal

RATE_HZ, COUNT = 1000.0, 8000
T = np.arange(COUNT) / RATE_HZ
LINES = ((0.9, 0.02, 0.3), (3.7, 0.008, 1.1), (11.3, 0.001, 2.0))
"""Hz, m, rad"""
INNER = slice(400, -400)


def exact_derivative(times, later=0.0):
    """(n, 1): the position's derivative of that order."""
    turns = [(2 * np.pi * f, a, p) for f, a, p in LINES]
    return sum(a * w**times * np.sin(w * (T + later) + p + times * np.pi / 2) for w, a, p in turns)[:, None]


def observe_motion(recording):
    return compute_motions(observe_parts([recording], len(recording.response.channels)))[0]


def relative_error(found, truth):
    return float(np.std((found - truth)[INNER]) / np.std(truth[INNER]))


@pytest.mark.parametrize(("order", "quantity"), [(0, "position"), (1, "velocity"), (2, "acceleration")])
def test_position_velocity_and_acceleration_follow_from_any_of_them(record_samples, order, quantity):
    found = observe_motion(record_samples(exact_derivative(2), exact_derivative(order), RATE_HZ, quantity))
    assert found.order == order
    assert relative_error(found.acceleration, exact_derivative(2)) < 0.01
    assert relative_error(found.velocity, exact_derivative(1)) < (0.01 if order < 2 else 0.05)
    # An integral begins anywhere, and two of them lack what is slower than the recording tells.
    assert relative_error(found.position, exact_derivative(0)) < (0.01 if order < 2 else 0.3)
    assert relative_error(found.velocity, exact_derivative(2) / 20) > 0.5


def test_a_held_command_is_centred_half_a_sample_later(record_samples):
    held = observe_motion(record_samples(exact_derivative(2), exact_derivative(0), RATE_HZ, hold=Hold.ZERO_ORDER))
    smooth = observe_motion(record_samples(exact_derivative(2), exact_derivative(0), RATE_HZ))
    truth = exact_derivative(1, 0.5 / RATE_HZ)
    assert relative_error(held.velocity, truth) < 0.2 * relative_error(smooth.velocity, truth)


def test_an_imposed_motion_is_read_when_the_force_is(record_samples):
    plain = observe_motion(record_samples(exact_derivative(2), exact_derivative(0), RATE_HZ))
    imposed = record_samples(
        exact_derivative(2), exact_derivative(0), RATE_HZ, hold=Hold.ZERO_ORDER, meta={"imposed": "position"}
    )
    assert np.array_equal(observe_motion(imposed).velocity, plain.velocity)


def test_the_band_ends_where_the_noise_of_the_motion_would_bend_the_mass(record_samples):
    random = np.random.default_rng(5)

    def end_hz(noise):
        return observe_motion(
            record_samples(
                exact_derivative(2), exact_derivative(0) + noise * random.standard_normal((COUNT, 1)), RATE_HZ
            )
        ).band_hz

    assert end_hz(0.0) == pytest.approx(HIGHEST_BAND_END_RATIO * RATE_HZ)
    ends = [end_hz(noise) for noise in (1e-6, 1e-5, 1e-3)]
    assert ends[0] > ends[1] > ends[2] > 3.0


def test_within_its_band_a_noisy_motion_keeps_its_acceleration(record_samples):
    """The control: differences of the same samples are all noise."""
    read = exact_derivative(0) + 1e-5 * np.random.default_rng(6).standard_normal((COUNT, 1))
    found = observe_motion(record_samples(exact_derivative(2), read, RATE_HZ))
    assert relative_error(found.acceleration, exact_derivative(2)) < 0.12
    assert (
        relative_error(np.gradient(np.gradient(read, 1 / RATE_HZ, axis=0), 1 / RATE_HZ, axis=0), exact_derivative(2))
        > 0.3
    )


def test_samples_near_the_ends_are_not_fitted_to(record_samples):
    found = observe_motion(record_samples(exact_derivative(2), exact_derivative(0), RATE_HZ))
    kept = found.mask_valid_samples(np.ones(COUNT, dtype=bool))
    assert kept.any() and not kept[0] and not kept[-1]
    assert len(kept) == len(found.decimate(found.force))


def test_gaps_are_bridged_and_never_fitted_to(record_samples):
    read = exact_derivative(0)
    read[3000:3010] = np.nan
    found = observe_motion(record_samples(exact_derivative(2), read, RATE_HZ))
    assert np.isfinite(found.acceleration).all()
    assert not (found.fit | found.test)[3000:3010].any()


def test_without_a_clock_there_is_no_acceleration(record_samples):
    found = observe_motion(record_samples(exact_derivative(2), exact_derivative(0), 1.0, meta={"time": "unknown"}))
    assert np.isinf(found.band_hz) and found.step == 1 and not found.acceleration.any()
    assert np.array_equal(np.sign(found.velocity[INNER]), np.sign(np.gradient(exact_derivative(0), axis=0)[INNER]))


def test_without_a_clock_no_law_asks_how_fast_it_moves(record_samples):
    damping = {"quadratic_damping", "drifting_damping", "viscoelastic_relaxation"}

    def effects(meta):
        return {
            law.effect
            for law in make_laws(
                [observe_motion(record_samples(exact_derivative(2), exact_derivative(0), 1.0, meta=meta))], False
            )
        }

    assert damping <= effects({})
    assert not damping & effects({"time": "unknown"})


def test_a_motion_is_of_the_lowest_derivative_and_moves(record_samples):
    both = record_samples(exact_derivative(2), exact_derivative(2), RATE_HZ, "acceleration")
    position = Signal(np.hstack([exact_derivative(0), np.ones((COUNT, 1))]), RATE_HZ, "position", "m", ("x", "y"))
    assert find_motion_signals([replace(both, position=position)])[0].channels == ("x",)
    assert find_motion_signals([both])[0].quantities == ("acceleration",)
    still = record_samples(exact_derivative(2), np.ones((COUNT, 1)), RATE_HZ)
    with pytest.raises(NoMotionError, match="no response is a position, velocity or acceleration"):
        observe_motion(still)


def test_conditions_count_in_their_own_spread_and_constant_ones_not(record_samples):
    warm = np.column_stack([np.linspace(290.0, 310.0, COUNT), np.full(COUNT, 5.0)])
    condition = Signal(warm, RATE_HZ, ("temperature", "pressure"), ("K", "Pa"), ("t", "p"))
    found = observe_motion(
        record_samples(exact_derivative(2), exact_derivative(0), RATE_HZ, condition=condition)
    ).condition
    assert found.shape == (COUNT, 1)
    assert (found.mean(), found.std()) == (pytest.approx(0.0, abs=1e-9), pytest.approx(1.0))


def test_an_axis_that_rests_in_one_of_several_recordings_is_a_motion_of_all(record_samples):
    both = np.hstack([exact_derivative(0), exact_derivative(1)])
    first = record_samples(exact_derivative(2), both, RATE_HZ)
    second = record_samples(exact_derivative(2), both * [1.0, 0.0], RATE_HZ)
    for recordings in ((first, second), (second, first)):
        assert [signal.samples.shape for signal in find_motion_signals(recordings)] == [both.shape] * 2
    assert find_motion_signals([second, second])[0].samples.shape == (len(both), 1)


@pytest.mark.parametrize(("order", "quantity"), [(0, "position"), (2, "acceleration")])
@pytest.mark.parametrize("rest", [0.0, 9.81, "noise"])
def test_axes_that_are_driven_in_turn_have_the_band_of_each(record_samples, order, quantity, rest):
    noise = 0.03 * exact_derivative(order).std() * np.random.default_rng(7).standard_normal((COUNT, 2))
    read = exact_derivative(order) + noise[:, :1]
    idle = noise[:, 1:] if rest == "noise" else np.full((COUNT, 1), rest)
    alone = observe_motion(record_samples(exact_derivative(2), read, RATE_HZ, quantity))
    pairs = [np.hstack(columns) for columns in ((read, idle, idle), (idle, read, idle), (idle, idle, read))]
    in_turn = compute_motions(
        observe_parts([record_samples(exact_derivative(2), pair, RATE_HZ, quantity) for pair in pairs], 3)
    )
    assert (in_turn[0].band_hz, in_turn[0].lowest_hz) == (alone.band_hz, alone.lowest_hz)


def test_gravity_in_a_measured_acceleration_moves_nothing(record_samples):
    level, tilted = (
        observe_motion(record_samples(exact_derivative(2), exact_derivative(2) + offset, RATE_HZ, "acceleration"))
        for offset in (0.0, 9.81)
    )
    assert tilted.position == pytest.approx(level.position, abs=1e-9)
    assert tilted.velocity == pytest.approx(level.velocity, abs=1e-9)
    assert tilted.decimate(tilted.acceleration) == pytest.approx(level.decimate(level.acceleration), abs=1e-9)


@pytest.mark.parametrize("noise_share", [0.01, 0.03, 0.1])
def test_the_band_of_a_noisy_acceleration_begins_where_its_double_integral_is_noise(noise_share):
    random, lines_hz, t = np.random.default_rng(3), np.arange(5.0, 20.0, 0.5), np.arange(40_000) / RATE_HZ
    acceleration = np.cos(2 * np.pi * np.outer(t, lines_hz) + random.uniform(0, 2 * np.pi, len(lines_hz))).sum(axis=1)
    noise_rms = noise_share * acceleration.std()
    frequency_hz = np.fft.rfftfreq(4096, 1 / RATE_HZ)[1:]
    noise_power = frequency_hz[0] * noise_rms**2 / (RATE_HZ / 2) * frequency_hz**-4.0
    largest_noise_power = ACCELERATION_NOISE_SHARE * np.sum(0.5 * lines_hz**-4.0)
    is_usable = np.cumsum(noise_power[::-1])[::-1] <= largest_noise_power
    noisy = acceleration + noise_rms * random.normal(size=len(t))
    assert compute_band_begin_hz([noisy[:, None]], RATE_HZ) == frequency_hz[np.flatnonzero(is_usable)[0]]


@pytest.mark.parametrize("order", [0, 1, 2])
def test_parts_far_shorter_than_the_longest_leave_the_band_of_all_as_it_is(order):
    noise = 0.003 * exact_derivative(order).std() * np.random.default_rng(7).standard_normal((COUNT, 1))
    long = exact_derivative(order) + noise
    parts = [long, *(long[start : start + 300] for start in (0, 2000, 4000))]
    assert compute_band_end_hz(parts, RATE_HZ, order) == compute_band_end_hz([long], RATE_HZ, order)
    assert compute_band_begin_hz(parts, RATE_HZ) == compute_band_begin_hz([long], RATE_HZ)
    assert compute_band_begin_hz([long, long[:1000]], RATE_HZ) == pytest.approx(4 * RATE_HZ / 1000)
    assert compute_band_begin_hz([long, *parts[1:] * 10], RATE_HZ) == pytest.approx(4 * RATE_HZ / 300)


def test_a_part_with_too_few_cycles_for_integrals_of_its_acceleration_has_no_valid_sample(record_samples):
    recordings = [
        record_samples(exact_derivative(2)[:count], exact_derivative(2)[:count], RATE_HZ, "acceleration")
        for count in (COUNT, COUNT // 2, 600)
    ]
    valid_counts = [
        motion.mask_valid_samples(motion.fit | motion.test).sum()
        for motion in compute_motions(observe_parts(recordings, 1))
    ]
    assert [count > 0 for count in valid_counts] == [True, True, False]
