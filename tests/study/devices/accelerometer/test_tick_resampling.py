"""Samples by a board's clock on the ticks by the host's: drift, offset, late arrivals, gaps, restarts, aliasing."""

import numpy as np
import pytest

from equalizer.signals.lockin import estimate_phasors
from study.devices.accelerometer.history import ArrivedSamples
from study.devices.accelerometer.tick_resampling import HALF_LENGTH_PERIODS, fit_and_resample, resample

TICK_HZ = 1000.0
START_S = 5e4
"""Of the host's clock: it has run for long, and must not lose digits by that."""


def board(
    rate_hz: float, drift_ppm: float, signal, seed: int = 1, seconds: float = 20.0
) -> tuple[ArrivedSamples, np.ndarray]:
    """What arrived of signal(host_s), and its values; packets wait for frames of 1 ms, then for the host."""
    random = np.random.default_rng(seed)
    true_s = START_S + np.arange(round(seconds * rate_hz)) / rate_hz
    device_s = 37.0 + (true_s - START_S) / (1 + 1e-6 * drift_ppm)
    frame = np.ceil(1000 * (true_s - START_S) + 1e-6).astype(int)
    arrived_s = START_S + frame / 1000 + random.exponential(0.0005, frame[-1] + 1)[frame]
    for start in random.integers(0, len(true_s) - 400, 10):  # the host stood still: a burst
        arrived_s[start : start + 300] = np.maximum(arrived_s[start : start + 300], arrived_s[start + 300])
    arrived_s = np.maximum.accumulate(arrived_s)
    zeros = np.zeros(len(true_s))
    values = signal(true_s)[:, None] * np.ones(3)
    return ArrivedSamples(device_s, zeros, values, device_s, zeros, arrived_s), values


def tone(frequency_hz: float, phase: float = 0.7):
    return lambda s: np.cos(2 * np.pi * frequency_hz * (s - START_S) + phase)


def found_tone(values: np.ndarray, tick_s: np.ndarray, frequency_hz: float) -> complex:
    """Amplitude and phase at START_S + 0, of cos."""
    phasor = estimate_phasors(values, TICK_HZ, frequency_hz)[0][0]
    reference = estimate_phasors(tone(frequency_hz, 0.0)(tick_s)[:, None], TICK_HZ, frequency_hz)[0][0]
    return complex(phasor / reference)


def late_of(found: complex) -> float:
    """Seconds, of a tone of 45 Hz and the phase 0.7."""
    return float((0.7 - np.angle(found)) / (2 * np.pi * 45.0))


LEAST_DELAY_S = {1000.0: 1e-3, 2000.0: 0.5e-3, 4000.0: 0.25e-3, 10_000.0: 0.1e-3}
"""Of an arrival: it cannot be seen, and is in every time. Samples lie right at the frames, and just miss them."""

TICKS_S = START_S + 10.0 + np.arange(2000) / TICK_HZ


@pytest.mark.parametrize("drift_ppm", [-300.0, 0.0, 40.0, 300.0])
@pytest.mark.parametrize("rate_hz", [1000.0, 2000.0, 4000.0, 10_000.0])
def test_a_tone_keeps_its_phase_through_drift_offset_and_late_arrivals(rate_hz, drift_ppm):
    stretch, values = board(rate_hz, drift_ppm, tone(45.0))
    placed = fit_and_resample(stretch, values, TICKS_S, TICK_HZ)
    assert placed.fit is not None and placed.fit.drift_ppm == pytest.approx(drift_ppm, abs=10.0)
    assert np.isfinite(placed.values).all()
    found = found_tone(placed.values, TICKS_S, 45.0)
    assert abs(found) == pytest.approx(1.0, abs=0.002)
    assert late_of(found) == pytest.approx(LEAST_DELAY_S[rate_hz], abs=6e-5)  # 1 degree at 45 Hz


def test_without_the_drift_the_phase_would_run_away():
    """The negative control: 300 ppm over 10 s are 3 ms, 49 degrees at 45 Hz."""
    stretch, values = board(2000.0, 300.0, tone(45.0))
    as_if = START_S + (stretch.device_s - stretch.device_s[0])  # the offset at the beginning, no drift
    found = found_tone(resample(as_if, values, TICKS_S, TICK_HZ), TICKS_S, 45.0)
    assert abs(np.angle(found) - 0.7) > np.radians(40)


def test_the_newest_sample_at_each_tick_would_come_late():
    """The negative control of all this: what was recorded before samples were placed."""
    stretch, values = board(2000.0, 0.0, tone(45.0))
    newest = np.searchsorted(stretch.arrived_s, TICKS_S, "right") - 1
    assert late_of(found_tone(values[newest], TICKS_S, 45.0)) > 1e-3
    placed = fit_and_resample(stretch, values, TICKS_S, TICK_HZ).values
    assert np.abs(values[newest] - tone(45.0)(TICKS_S)[:, None]).max() > 0.4
    assert np.abs(placed - tone(45.0)(TICKS_S)[:, None]).max() < 0.15


@pytest.mark.parametrize("rate_hz", [2000.0, 4000.0, 10_000.0])
@pytest.mark.parametrize(("frequency_hz", "lowest", "highest"), [(300.0, 0.999, 1.001), (620.0, 0.0, 1.2e-4)])
def test_what_a_tick_can_show_passes_and_what_it_would_alias_does_not(rate_hz, frequency_hz, lowest, highest):
    sample_s = START_S + np.arange(round(3 * rate_hz)) / rate_hz
    values = np.column_stack((tone(frequency_hz)(sample_s), np.ones(len(sample_s))))
    placed = resample(sample_s, values, START_S + 1.0 + np.arange(1000) / TICK_HZ, TICK_HZ)
    assert lowest <= np.sqrt(2) * placed[:, 0].std() <= highest
    np.testing.assert_allclose(placed[:, 1], 1.0, atol=1e-12)


def test_a_few_lost_packets_change_little_and_a_gap_leaves_ticks_without_a_value():
    random = np.random.default_rng(3)
    stretch, values = board(2000.0, 50.0, tone(45.0))
    lost = random.random(len(values)) < 0.05
    lost[22_000:22_040] = True  # 20 ms, at 11 s
    kept = ArrivedSamples(stretch.device_s[~lost], stretch.restarts[~lost], values[~lost], *_arrivals(stretch))
    placed = fit_and_resample(kept, values[~lost], TICKS_S, TICK_HZ).values
    known = np.isfinite(placed[:, 0])
    around = np.abs(TICKS_S - (START_S + 11.01)) < 0.01 + HALF_LENGTH_PERIODS / TICK_HZ
    assert not known[around][1:-1].any() and known[~around].mean() > 0.97
    # 45 Hz, spaces of 1 to 2.5 ms bridged: the amplitude of a trial stays within a percent, and so does its phase.
    found = found_tone(np.where(np.isfinite(placed), placed, np.nan), TICKS_S, 45.0)
    whole = found_tone(fit_and_resample(stretch, values, TICKS_S, TICK_HZ).values, TICKS_S, 45.0)
    assert abs(found / whole - 1) < 0.01


def test_a_board_that_began_anew_is_placed_by_each_of_its_clocks():
    stretch, values = board(2000.0, 80.0, tone(45.0))
    anew = stretch.device_s > stretch.device_s[0] + 11.0
    device_s = stretch.device_s - 30.0 * anew  # its time began again
    restarts = anew.astype(float)
    silent = np.abs(stretch.device_s - stretch.device_s[0] - 11.0) < 0.1
    keep = ~silent
    again = ArrivedSamples(
        device_s[keep], restarts[keep], values[keep], device_s[keep], restarts[keep], stretch.arrived_s[keep]
    )
    placed = fit_and_resample(again, values[keep], TICKS_S, TICK_HZ).values
    known = np.isfinite(placed[:, 0])
    assert 0.2 / 2 < 1 - known.mean() < 0.3 / 2
    assert late_of(found_tone(placed, TICKS_S, 45.0)) == pytest.approx(LEAST_DELAY_S[2000.0], abs=6e-5)
    # The negative control: as if it were one clock, nothing of the second part is where it belongs.
    one_clock = ArrivedSamples(np.sort(device_s[keep]), 0 * restarts[keep], *_of(again))
    assert (
        abs(
            np.angle(found_tone(fit_and_resample(one_clock, values[keep], TICKS_S, TICK_HZ).values, TICKS_S, 45.0))
            - 0.7
        )
        > 0.1
    )


def test_a_clock_that_was_heard_for_less_than_a_second_places_nothing():
    stretch, values = board(2000.0, 0.0, tone(45.0), seconds=0.9)
    placed = fit_and_resample(stretch, values, START_S + 0.3 + np.arange(100) / TICK_HZ, TICK_HZ)
    assert placed.fit is None and np.isnan(placed.values).all()
    assert np.isnan(resample(np.zeros(0), np.zeros((0, 3)), TICKS_S, TICK_HZ)).all()


def _arrivals(stretch: ArrivedSamples) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    return stretch.last_device_s, stretch.last_restarts, stretch.arrived_s


def _of(stretch: ArrivedSamples) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    return stretch.raw, np.sort(stretch.last_device_s), 0 * stretch.last_restarts, stretch.arrived_s
