"""`equalizer.signals.isolated_samples`: spikes and lost samples of a motion are replaced, and nothing else."""

import numpy as np
import pytest

from equalizer.signals.isolated_samples import interpolate_all, interpolate_isolated_samples, replace_isolated_samples
from equalizer.signals.recording import Recording
from equalizer.signals.signal import Signal

RATE_HZ, SAMPLES = 1000.0, 6000


def move(seed: int) -> np.ndarray:
    """Draw a motion of 1 to 30 Hz with a standard deviation near 1, (n,)."""
    random, time_s = np.random.default_rng(seed), np.arange(SAMPLES) / RATE_HZ
    lines_hz, phases = random.uniform(1, 30, 12), random.uniform(0, 2 * np.pi, 12)
    return np.cos(2 * np.pi * np.outer(time_s, lines_hz) + phases).sum(axis=1) / np.sqrt(6)


@pytest.mark.parametrize("seed", range(3))
def test_spikes_also_close_to_each_other_and_to_an_end_are_replaced(seed):
    random, motion = np.random.default_rng(seed), move(seed)
    noise = 0.01 * random.standard_normal(SAMPLES)
    spikes = np.zeros(SAMPLES)
    spikes[[3, 700, 701, 900, 908, 2000, 2014, SAMPLES - 4]] = [4.0, 5.0, -2.0, -4.0, 7.0, 9.0, 2.0, -3.0]
    spikes[random.choice(np.arange(2100, SAMPLES - 100), 10, replace=False)] = 3.0
    lost = 1200 + int(np.argmax(np.abs(motion[1200:1300])))
    readings = motion + noise + spikes
    readings[lost] = 0.0
    changed = replace_isolated_samples(readings)
    assert np.flatnonzero(changed != readings).tolist() == sorted([*np.flatnonzero(spikes).tolist(), lost])
    assert np.abs(changed - motion).max() < 0.06


def hold(readings: np.ndarray) -> np.ndarray:
    """Repeat every fortieth sample's predecessor, as a logger does for a lost sample."""
    readings = readings.copy()
    readings[40::40] = readings[39:-1:40]
    return readings


def bounce(motion: np.ndarray) -> np.ndarray:
    """Reverse a motion at limits, as a stop does: kinks in the position."""
    return np.abs(np.abs(motion) - 0.8)


@pytest.mark.parametrize("noise", [0.0, 1e-4, 1e-2])
@pytest.mark.parametrize(
    "change",
    [
        lambda motion: motion,
        bounce,
        hold,
        lambda motion: motion + 0.3 * np.sign(motion),
        lambda motion: np.round(motion / 0.02) * 0.02,
        lambda motion: np.diff(np.round(motion / 0.02) * 0.02, prepend=0.0) * RATE_HZ,
        lambda motion: np.clip(motion, -1, 1),
        lambda motion: np.where(np.arange(SAMPLES) < 4000, 0.0, motion),
    ],
    ids=["smooth", "kinks", "repeats", "steps", "quantised", "differences of quantised", "limited", "rest"],
)
def test_nothing_that_a_device_or_a_healthy_sensor_can_show_is_changed(change, noise):
    readings = change(move(7) + noise * np.random.default_rng(8).standard_normal(SAMPLES))
    np.testing.assert_array_equal(replace_isolated_samples(readings), readings)


def test_only_motions_are_changed_and_the_user_is_told():
    motion = move(3) + 0.01 * np.random.default_rng(4).standard_normal(SAMPLES)
    spiked = motion.copy()
    spiked[1000:5000:1000] += 5.0
    spiked[2500] = np.nan

    def record(quantity: str, unit: str) -> Recording:
        return Recording(
            "device",
            Signal(spiked[:, None], RATE_HZ, "force", "N", ("fx",)),
            Signal(np.stack([spiked, motion], axis=1), RATE_HZ, quantity, unit, ("x", "y")),
        )

    for quantity, unit in (("acceleration", "m/s^2"), ("force", "N")):
        unchanged = record(quantity, unit)
        assert interpolate_isolated_samples(unchanged) == (unchanged, "")
    changed, remark = interpolate_isolated_samples(record("velocity", "m/s"))
    assert "replaced by interpolated values: 4 of x (0.067 %)." in remark
    np.testing.assert_array_equal(changed.command.samples[:, 0], spiked)
    np.testing.assert_array_equal(changed.response.samples[:, 1], motion)
    assert np.isnan(changed.response.samples[2500, 0])
    assert np.nanmax(np.abs(changed.response.samples[:, 0] - motion)) < 0.06


def test_of_several_recordings_each_is_reported_by_its_name():
    motion = move(3) + 0.01 * np.random.default_rng(4).standard_normal(SAMPLES)
    spiked = motion.copy()
    spiked[1000:5000:1000] += 5.0
    force = Signal(motion[:, None], RATE_HZ, "force", "N", ("fx",))
    clean, noisy = (
        Recording("device", force, Signal(samples[:, None], RATE_HZ, "position", "m", ("x",)))
        for samples in (motion, spiked)
    )
    assert interpolate_all([noisy])[1][0].startswith("Isolated samples")
    for names, prefix in (((), "recording 2: Isolated"), (("a", "b"), "b: Isolated")):
        changed, remarks = interpolate_all([clean, noisy], names)
        assert changed[0] is clean and len(remarks) == 1 and remarks[0].startswith(prefix)


def test_flicker_of_one_of_several_encoders_at_rest_is_not_changed():
    """Steps of a position computed from three encoders are often much smaller than those of one of them."""
    random, counts = np.random.default_rng(5), np.round(20 * np.stack([move(seed) for seed in (1, 2, 3)], axis=1))
    counts[:3000] = 4
    counts[:3000, 0] += random.random(3000) < 0.01
    readings = counts @ [1e-4, 0.73e-4, -0.41e-4]
    np.testing.assert_array_equal(replace_isolated_samples(readings), readings)


@pytest.mark.parametrize("length", [2, 3])
def test_short_slips_are_not_changed(length):
    readings = 0.01 * np.random.default_rng(2).standard_normal(SAMPLES)
    for start in range(50, SAMPLES - 50, 97):
        readings[start : start + length] += np.sin(np.pi * (np.arange(length) + 0.5) / length)
    np.testing.assert_array_equal(replace_isolated_samples(readings), readings)


@pytest.mark.parametrize("after", [1, 2, 3])
def test_a_step_close_to_the_end_is_not_changed(after):
    readings = np.zeros(SAMPLES)
    readings[500:3000], readings[-after:] = move(3)[500:3000], 2.0
    np.testing.assert_array_equal(replace_isolated_samples(readings), readings)


def test_the_response_to_a_jump_of_the_command_is_not_changed():
    """A body on a spring, 30 Hz and critically damped, sampled at 100 Hz: after a step of the force it moves for two
    samples."""
    time_s, jumps = np.arange(SAMPLES) / 100, np.zeros(SAMPLES)
    jumps[100::400] = 1.0
    velocity = np.convolve(jumps, time_s * np.exp(-2 * np.pi * 30 * time_s))[:SAMPLES]
    velocity += 1e-3 * velocity.std() * np.random.default_rng(1).standard_normal(SAMPLES)
    recording = Recording(
        "device",
        Signal(np.cumsum(jumps)[:, None], 100.0, "force", "N", ("fx",)),
        Signal(velocity[:, None], 100.0, "velocity", "m/s", ("x",)),
    )
    assert not np.array_equal(replace_isolated_samples(velocity), velocity)
    assert interpolate_isolated_samples(recording) == (recording, "")


def test_samples_without_a_time_axis_are_not_changed():
    readings = move(3) + 0.01 * np.random.default_rng(4).standard_normal(SAMPLES)
    readings[1000:5000:1000] += 5.0
    signals = [Signal(readings[:, None], 1.0, *each, ("x",)) for each in (("force", "N"), ("position", "m"))]
    recording = Recording("device", *signals, meta={"time": "unknown"})
    assert interpolate_isolated_samples(recording) == (recording, "")
