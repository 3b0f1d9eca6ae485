"""Valid readings raise no fault: the simulated omega.3 at all that is played on it, with and without a hand."""

from dataclasses import replace

import numpy as np
import pytest

from equalizer.signals.signal import FloatArray
from study.devices.device import Fault
from study.devices.drive.runner import CompiledRunner
from study.devices.governor.governor import Governor
from study.devices.rigs_by_name import RIGS_BY_NAME

FREQUENCIES_HZ = (1, 2, 3, 5, 10, 15, 25, 35, 45, 80, 134, 250, 500)
LEVELS_N = (0.0, 0.05, 0.3, 0.6, 0.8, 1.2, 2.0, 3.0)


def hold(rigs, rng, seconds: float, frequency_hz: float, level_n: float) -> tuple[Fault, int]:
    """One stimulus in a random direction on a new device, with or without hand and damper. Its fault and its ticks."""
    limits = replace(rigs.LIMITS, slew_n_per_s=2e4, longest_hold_s=600.0, watchdog_s=5.0)
    settings = replace(
        rigs.SETTINGS,
        limits=limits,
        hand_on_handle=bool(rng.random() < 0.5),
        spring_damping_n_s_per_m=float(rng.choice([0.0, 0.0, 0.5, 2.0])),
        place_m=tuple(rng.choice([0.0, 0.03]) * rng.uniform(-1.0, 1.0, size=3)),
    )
    governor, runner = omega(rng, settings)
    wave = np.sin(2 * np.pi * frequency_hz * np.arange(1000) / 1000)[:, None] * direction(rng) * level_n
    fades = {"fade_in_s": float(rng.choice([0.0, 0.1, 0.5])), "fade_out_s": 0.1}
    governor.begin_hold(replace(rigs.sine(), loop=rigs.force(wave), **fades))
    for _ in range(round(seconds)):
        governor.restart_watchdog()
        runner.run(1000)
    governor.request_release()
    runner.run(1000)
    return governor.fault, governor.ticks


def sweep(rigs, rng, seconds: float, level_n: float) -> tuple[Fault, int]:
    """1 to 500 Hz, as recordings play it."""
    limits = replace(rigs.LIMITS, slew_n_per_s=2e4)
    governor, runner = omega(rng, replace(rigs.SETTINGS, limits=limits, hand_on_handle=bool(rng.random() < 0.5)))
    t = np.arange(round(seconds * 1000)) / 1000
    rate = np.log(500.0) / seconds
    wave = np.sin(2 * np.pi * np.expm1(rate * t) / rate)[:, None] * direction(rng) * level_n
    governor.begin_play(rigs.force(wave * np.minimum(1.0, t / 0.1)[:, None]))
    while governor.moving:
        governor.restart_watchdog()
        runner.run(100)
    return governor.fault, governor.ticks


def omega(rng, settings) -> tuple[Governor, CompiledRunner]:
    rig = RIGS_BY_NAME["simulated"](settings, int(rng.integers(1 << 30)))
    governor = Governor(rig.info, settings)
    return governor, CompiledRunner(rig, governor, 5000)


def direction(rng) -> FloatArray:
    vector = rng.normal(size=3)
    return vector / np.linalg.norm(vector)


def play_all(rigs, ticks: int, seconds: float) -> int:
    """Every frequency and level in turn, and a sweep now and then, until so many ticks are over."""
    done = seed = 0
    while done < ticks:
        rng = np.random.default_rng(seed)
        pair = seed % (len(FREQUENCIES_HZ) * len(LEVELS_N))
        frequency_hz, level_n = FREQUENCIES_HZ[pair % len(FREQUENCIES_HZ)], LEVELS_N[pair // len(FREQUENCIES_HZ)]
        plays = [hold(rigs, rng, seconds, frequency_hz, level_n)]
        if seed % 20 == 19:
            plays.append(sweep(rigs, rng, 10 * seconds, float(rng.choice([0.3, 1.0, 3.0]))))
        for fault, ran in plays:
            assert fault is Fault.NONE, f"seed {seed}: {fault} at {frequency_hz} Hz and {level_n} N"
            done += ran
        seed += 1
    return seed


@pytest.mark.parametrize(("lean_m", "frequency_hz", "level_n"), [(0.006, 10, 0.0), (0.0099, 40, 0.1), (0.02, 10, 0.0)])
def test_a_hand_resting_on_the_spring_raises_no_fault(rigs, lean_m, frequency_hz, level_n):
    """Dry friction holds it: the encoders say the same for seconds, while the spring pulls with up to 1.5 N."""
    limits = replace(rigs.LIMITS, longest_hold_s=60.0, watchdog_s=5.0)
    rig = RIGS_BY_NAME["simulated"](replace(rigs.SETTINGS, place_m=(lean_m, 0.0, 0.0)), 3)
    governor = Governor(rig.info, replace(rigs.SETTINGS, limits=limits, spring_damping_n_s_per_m=0.0))
    runner = CompiledRunner(rig, governor, 5000)
    wave = np.sin(2 * np.pi * frequency_hz * np.arange(1000) / 1000)[:, None] * np.array([0.0, 0.7, 0.7]) * level_n
    governor.begin_hold(replace(rigs.sine(), loop=rigs.force(wave)))
    for _ in range(15):
        governor.restart_watchdog()
        runner.run(1000)
    assert governor.fault is Fault.NONE
    assert governor.moving


def test_no_valid_reading_ends_a_trial(rigs):
    assert play_all(rigs, 200_000, seconds=1.0) >= len(FREQUENCIES_HZ) * len(LEVELS_N)


@pytest.mark.parametrize("seed", range(20))
def test_no_sweep_to_half_the_rate_ends_a_recording(rigs, seed):
    """Near it the samples of a sine rise and fall slowly, while the handle stands still."""
    rng = np.random.default_rng(7000 + seed)
    fault, ran = sweep(rigs, rng, 10.0, float(rng.choice([0.3, 1.0, 2.0, 3.0])))
    assert fault is Fault.NONE
    assert ran > 10_000


@pytest.mark.slow
def test_no_valid_reading_ends_a_trial_in_ten_million_ticks(rigs):
    assert play_all(rigs, 10_000_000, seconds=8.0) >= 5 * len(FREQUENCIES_HZ) * len(LEVELS_N)
