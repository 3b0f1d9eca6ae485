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
from protocols.definition.probes import LOWEST_LINE_HZ, PERIOD_S, ProbeSettings
from study.session.stimulus.held_stimulus import HeldStimulus

FADE_S = 0.25
"""Duration of the raised-cosine fade at both ends (s), so that the onset excites few modes. Chosen by hand."""
HELD_S = FADE_S + PERIOD_S + 0.1
"""Time from the start until the program asks for the fade-out (s): fade-in, one whole period, and a margin of 0.1 s."""
PHASES_SEED = 16
"""Seed of the phases, the same for every probe, so that probes can be compared line by line."""


def make_probe_wave(settings: ProbeSettings, sample_rate_hz: float) -> FloatArray:
    """One period, (n, 3), whose norm over the axes peaks at 1. Each axis has every third odd line from
    `LOWEST_LINE_HZ` on."""
    n = round(PERIOD_S * sample_rate_hz)
    lines = list_lines_between(LOWEST_LINE_HZ, settings.to_hz, n, sample_rate_hz, odd_only=True)
    return make_interleaved_multisine(lines, n, 3, PHASES_SEED)


def make_probe_stimulus(settings: ProbeSettings, level_n: float, sample_rate_hz: float) -> HeldStimulus:
    """A probe whose norm peaks at `level_n` (N). Raises ValueError for a level above the cap of probes, or not above
    0."""
    if not 0 < level_n <= settings.probe_cap_n:
        raise ValueError(f"a probe of {level_n:g} N is not within its cap of {settings.probe_cap_n:g} N")
    loop = _make_force_signal(level_n * make_probe_wave(settings, sample_rate_hz), sample_rate_hz)
    return HeldStimulus(loop, fade_in_s=FADE_S, fade_out_s=FADE_S, fade_shape="raised_cosine")


def make_reference_commands(settings: ProbeSettings, sample_rate_hz: float) -> tuple[Signal, tuple[Segment, ...]]:
    """The reference as commands (n, 3) in N, and its whole periods as segments: first at full level, then at half of
    it, because a response that depends on the level shows friction. The last third of each part is held out, to test a
    model."""
    wave = make_probe_wave(settings, sample_rate_hz)
    n, fade = len(wave), round(FADE_S * sample_rate_hz)
    part = max(4, round(settings.reference_s / PERIOD_S / 2))
    # Between the parts the level falls linearly over one period.
    level = np.concatenate([np.ones(fade + part * n), np.linspace(1.0, 0.5, n), np.full(part * n + fade, 0.5)])
    level_n = settings.reference_n * level
    # A segment begins at the first sample of a period, after the fade.
    periodic = wave[np.arange(-fade, len(level) - fade) % n]
    forces = apply_fades(level_n[:, None] * periodic, fade, fade)
    segments = []
    for start, peak_n in ((fade, settings.reference_n), (fade + (part + 1) * n, settings.reference_n / 2)):
        middle, stop = start + (2 * part // 3) * n, start + part * n
        segments += [
            Segment(start, middle, "multisine", peak_n, n, "fit"),
            Segment(middle, stop, "multisine", peak_n, n, "test"),
        ]
    return _make_force_signal(forces, sample_rate_hz), tuple(segments)


def _make_force_signal(samples: FloatArray, sample_rate_hz: float) -> Signal:
    """Samples (n, 3) in N as a signal of forces along x, y and z."""
    return Signal(samples, sample_rate_hz, "force", "N", ("fx", "fy", "fz"))
