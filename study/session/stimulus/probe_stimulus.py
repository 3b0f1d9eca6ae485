"""Forces of probes and references: an odd multisine on three axes at once, each line on a single axis.

Only odd multiples of 1 / period are excited, so that even-order distortion appears at the even lines, and the lines of
the axes are interleaved, so that one period gives the response to each axis (Pintelon and Schoukens, System
Identification, 2nd ed., 2012, chapters 2 and 4). A probe is played with the hand on the handle, between trials; a
reference is longer, at two levels, and played with no hand on the handle.
"""

import numpy as np

from equalizer.signals.excitation import apply_fades
from equalizer.signals.multisine import list_lines_between, make_interleaved_multisine
from equalizer.signals.recording import Segment
from equalizer.signals.signal import FloatArray, Signal
from protocols.definition.probes import FADE_S, LOWEST_LINE_HZ, PERIOD_S, ProbeSettings
from study.session.stimulus.held_stimulus import HeldStimulus

PHASE_SEED = 16
"""Seed of the phases, the same for every probe, so that probes can be compared line by line."""


def make_probe_wave(settings: ProbeSettings, sample_rate_hz: float) -> FloatArray:
    """Make one period of the multisine, (n, 3), without unit, whose norm over the axes peaks at 1. Each axis has every
    third odd line between `LOWEST_LINE_HZ` and `settings.to_hz`."""
    period_samples = round(PERIOD_S * sample_rate_hz)
    lines = list_lines_between(LOWEST_LINE_HZ, settings.to_hz, period_samples, sample_rate_hz, odd_only=True)
    return make_interleaved_multisine(lines, period_samples, 3, PHASE_SEED)


def make_probe_stimulus(settings: ProbeSettings, level_n: float, sample_rate_hz: float) -> HeldStimulus:
    """Make a probe, the repeated period, whose norm peaks at `level_n` (N). Raises ValueError for a level above the cap
    of probes, or not above 0."""
    if not 0 < level_n <= settings.probe_cap_n:
        raise ValueError(f"a probe of {level_n:g} N is not within its cap of {settings.probe_cap_n:g} N")
    period_signal = _make_force_signal(level_n * make_probe_wave(settings, sample_rate_hz), sample_rate_hz)
    return HeldStimulus(period_signal, fade_in_s=FADE_S, fade_out_s=FADE_S, fade_shape="raised_cosine")


def make_reference_commands(settings: ProbeSettings, sample_rate_hz: float) -> tuple[Signal, tuple[Segment, ...]]:
    """Make the reference as commands (n, 3) in N, and its whole periods as segments: first at full level, then at half
    of it, because a response that depends on the level shows friction. At each level, the last third of the periods
    (rounded up) is reserved for the test of a model. There are at least 4 periods per level (chosen)."""
    wave = make_probe_wave(settings, sample_rate_hz)
    period_samples, fade_samples = len(wave), round(FADE_S * sample_rate_hz)
    periods_per_level = max(4, round(settings.reference_s / PERIOD_S / 2))
    # The level falls linearly from 1 to 1/2 over one period, which belongs to no segment.
    level_fraction = np.concatenate(
        [
            np.ones(fade_samples + periods_per_level * period_samples),
            np.linspace(1.0, 0.5, period_samples),
            np.full(periods_per_level * period_samples + fade_samples, 0.5),
        ]
    )
    level_n = settings.reference_n * level_fraction
    # A segment begins at the first sample of a period, after the fade.
    periodic_wave = wave[np.arange(-fade_samples, len(level_fraction) - fade_samples) % period_samples]
    forces = apply_fades(level_n[:, None] * periodic_wave, fade_samples, fade_samples)
    segments = []
    for start, peak_n in (
        (fade_samples, settings.reference_n),
        (fade_samples + (periods_per_level + 1) * period_samples, settings.reference_n / 2),
    ):
        test_start, stop = (
            start + (2 * periods_per_level // 3) * period_samples,
            start + periods_per_level * period_samples,
        )
        segments += [
            Segment(start, test_start, "multisine", peak_n, period_samples, "fit"),
            Segment(test_start, stop, "multisine", peak_n, period_samples, "test"),
        ]
    return _make_force_signal(forces, sample_rate_hz), tuple(segments)


def _make_force_signal(samples: FloatArray, sample_rate_hz: float) -> Signal:
    """Convert samples (n, 3) in N to a signal of forces along x, y and z."""
    return Signal(samples, sample_rate_hz, "force", "N", ("fx", "fy", "fz"))
