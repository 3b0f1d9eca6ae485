"""Excitation of a challenge recording: multisines to fit; sweeps, all driven axes at once and slow sines to test.

All numbers were chosen by hand; those of samples, except rests and fades, are for a period of 2000 samples.
"""

from dataclasses import dataclass

import numpy as np

from equalizer.signals.recording import Segment
from equalizer.signals.signal import FloatArray
from study.evaluation.challenge.case_settings import DEFAULT_SETTINGS, CaseSettings

RATE_HZ = 1000.0
"""Sample rate of all challenge recordings (Hz)."""
AXES = ("x", "y", "z")
"""Names of the bench's axes."""
LEVELS_N = (0.5, 1.5, 3.0)
"""Peaks of the multisines to fit (N); the second also that of one to test."""
PERIOD_SAMPLES, TEST_PERIODS = 2000, 2
"""Samples of a multisine's period, and periods of a segment to test."""
REST_SAMPLES = 500
"""Samples of rest between two segments."""
FIRST_LINE, LAST_LINE = 3, 479
"""Lines of a 2 s period: 1.5 to 239.5 Hz, odd lines only."""
SWEEP_PEAK_N, SWEEP_HZ, SWEEP_SAMPLES, SWEEP_FADE_SAMPLES = 1.8, (1.0, 240.0), 6000, 200
"""Swept sines of the test: peak (N), first and last frequency (Hz), samples, and samples of each fade."""
SLOW_PEAK_N, SLOW_HZ, SLOW_SAMPLES, SLOW_FADE_SAMPLES = 1.6, (0.9, 1.3, 2.1), 4000, 500
"""Slow sines of the test, for large motions: peak (N), frequency per axis (Hz), samples, and samples of the fade-in."""


@dataclass(frozen=True, slots=True, eq=False)
class DrivePlan:
    """Commands of a recording and their segments."""

    command: FloatArray
    """(samples, 3), N"""
    segments: tuple[Segment, ...]
    """In order of time; the rest after a segment belongs to none."""


def draw_multisine(random: np.random.Generator, level_n: float, period: int = PERIOD_SAMPLES) -> FloatArray:
    """Draw one period (period,), N, of a multisine with the peak `level_n`: odd lines of amplitude f^-1/2 and random
    phase. One of about every four neighbouring lines is left out, so that the response at the missing lines shows odd
    distortion. period: samples."""
    lines = np.arange(FIRST_LINE * period // PERIOD_SAMPLES | 1, LAST_LINE * period // PERIOD_SAMPLES + 1, 2)
    omitted_lines = [group[random.integers(len(group))] for group in np.array_split(lines, -(-len(lines) // 4))]
    spectrum = np.zeros(period // 2 + 1, dtype=complex)
    spectrum[lines] = np.exp(2j * np.pi * random.random(len(lines))) / np.sqrt(lines)
    spectrum[omitted_lines] = 0.0
    wave = np.fft.irfft(spectrum, period)
    scaled_wave: FloatArray = level_n * wave / np.abs(wave).max()
    return scaled_wave


def draw_plan(random: np.random.Generator, settings: CaseSettings = DEFAULT_SETTINGS) -> DrivePlan:
    """Draw commands and segments of a recording; it takes 105 s with the default settings."""
    commands: list[FloatArray] = []
    segments: list[Segment] = []
    start = 0

    def append_segment(command: FloatArray, kind: str, level_n: float, period: int, role: str) -> None:
        """Append a segment with the command (samples, 3), N, and the rest after it."""
        nonlocal start
        segments.append(Segment(start, start + len(command), kind, level_n, period, role))
        commands.extend((command, np.zeros((REST_SAMPLES, 3))))
        start += len(command) + REST_SAMPLES

    for axis in settings.axes:
        for level_n in LEVELS_N:
            wave = np.tile(draw_multisine(random, level_n, settings.period), settings.periods)
            append_segment(_place_on_axis(axis, wave), "multisine", level_n, settings.period, "fit")
    for axis in settings.axes:
        append_segment(
            _place_on_axis(axis, _make_sweep(settings.scale_duration(SWEEP_SAMPLES))), "sweep", SWEEP_PEAK_N, 0, "test"
        )
    common_command = np.zeros((settings.period, 3))
    for axis in settings.axes:
        common_command[:, axis] = draw_multisine(random, LEVELS_N[1], settings.period)
    append_segment(np.tile(common_command, (TEST_PERIODS, 1)), "multisine", LEVELS_N[1], settings.period, "test")
    append_segment(_make_slow_sines(settings), "slow", SLOW_PEAK_N, 0, "test")
    if settings.loud_n:
        loud_command = np.zeros((settings.period, 3))
        for axis in settings.axes:
            loud_command[:, axis] = draw_multisine(random, settings.loud_n, settings.period)
        append_segment(np.tile(loud_command, (TEST_PERIODS, 1)), "multisine", settings.loud_n, settings.period, "test")
    return DrivePlan(np.vstack(commands), tuple(segments))


def _place_on_axis(axis: int, wave: FloatArray) -> FloatArray:
    """Make the command (samples, 3), N, with the wave (samples,) on one axis and zero on the others."""
    command = np.zeros((len(wave), 3))
    command[:, axis] = wave
    return command


def _make_sweep(sample_count: int) -> FloatArray:
    """Make a logarithmic sine sweep (sample_count,), N, with linear fade-in and fade-out."""
    time_s, duration_s = np.arange(sample_count) / RATE_HZ, sample_count / RATE_HZ
    log_ratio = np.log(SWEEP_HZ[1] / SWEEP_HZ[0])
    cycles = SWEEP_HZ[0] * duration_s / log_ratio * (np.exp(log_ratio * time_s / duration_s) - 1.0)
    fade_in = np.minimum(np.arange(sample_count) / SWEEP_FADE_SAMPLES, 1.0)
    wave: FloatArray = SWEEP_PEAK_N * np.sin(2 * np.pi * cycles) * fade_in * np.append(1.0, fade_in[:0:-1])
    return wave


def _make_slow_sines(settings: CaseSettings) -> FloatArray:
    """Make sines (samples, 3), N, of all driven axes at once, each at its own frequency, with fade-in but no
    fade-out."""
    sample_numbers = np.arange(settings.scale_duration(SLOW_SAMPLES))
    fade_in = np.minimum(sample_numbers / SLOW_FADE_SAMPLES, 1.0)
    command: FloatArray = (
        SLOW_PEAK_N * np.sin(2 * np.pi * np.outer(sample_numbers / RATE_HZ, SLOW_HZ)) * fade_in[:, None]
    )
    command[:, [axis for axis in range(3) if axis not in settings.axes]] = 0.0
    return command
