"""Periodic multisines: sums of sinusoids of equal amplitude on whole lines (multiples of 1 / period), with random
phases.

    w(t) = sum over lines k of cos(2 pi k t / T + phi_k),        phi_k uniform in [0, 2 pi)

scaled to a given peak. Phases are random, not optimised for a low peak as Schroeder's are, because odd distortion
averages out of an estimate only over random phases. The crest factor (peak over rms) is kept low by taking the best of
several draws. With m axes driven at once, every m experiments form a group that is orthogonal at every line
(Dobrowiecki, Schoukens and Guillaume, IEEE Transactions on Instrumentation and Measurement 55 (2006)): each axis has
its own random phases, and in experiment e (from 0) the phases of axis a (from 0) are advanced by 2 pi e a / m. Called
by `study.session.stimulus` for recordings and probes, and by `analysis.evaluation.reproduction.played_response`.
"""

from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from equalizer.signals.signal import FloatArray

IntArray = npt.NDArray[np.int64]
"""Numbers k of spectral lines, (lines,)."""

PHASE_DRAWS = 32
"""Number of draws of the phases, of which the draw with the lowest peak is kept. Crest factor on one axis with 76 or
239 odd lines, 60 seeds each: 2.5 to 3.0; with a single draw 2.6 to 4.9."""


def list_lines_between(
    from_hz: float, to_hz: float, period_samples: int, sample_rate_hz: float, *, odd_only: bool
) -> IntArray:
    """List the numbers k of the lines k / period from `from_hz` to `to_hz`, both included, below half the sample rate.

    period_samples: samples per period. odd_only: odd k only, which leaves the even lines to even distortion. Raises
    ValueError where the band is not within 0 to half the rate, or holds no line.
    """
    if not 0 < from_hz <= to_hz <= sample_rate_hz / 2:
        raise ValueError(
            f"a multisine needs 0 < from_hz <= to_hz <= {sample_rate_hz / 2:g} Hz (half the rate), "
            f"not {from_hz:g} to {to_hz:g}"
        )
    spacing_hz = sample_rate_hz / period_samples
    # The tolerance of 1e-9 lines keeps a line at an end of the band in spite of rounding.
    first_line, last_line = np.ceil(from_hz / spacing_hz - 1e-9), np.floor(to_hz / spacing_hz + 1e-9)
    candidates: IntArray = np.arange(first_line, last_line + 1).astype(np.int64)
    lines: IntArray = candidates[(2 * candidates < period_samples) & ((candidates % 2 == 1) | (not odd_only))]
    if len(lines) == 0:
        raise ValueError(
            f"a period of {period_samples / sample_rate_hz:g} s has no {'odd ' if odd_only else ''}line from "
            f"{from_hz:g} to {to_hz:g} Hz"
        )
    return lines


def make_multisines(
    lines: IntArray, period_samples: int, amplitude: float, axes: int, realisations: int, seed: int
) -> tuple[FloatArray, ...]:
    """Make one period, (period_samples, axes), for each of `realisations` experiments; it may be repeated without a
    discontinuity.

    The norm over the axes peaks at `amplitude` in each experiment, in the unit of `amplitude`. Every `axes` experiments
    are a group, orthogonal at every line. An experiment depends on the seed and its own number only, not on the number
    of realisations.
    """
    groups = -(-realisations // axes)
    waves = [
        wave
        for group in range(groups)
        for wave in _draw_group(lines, period_samples, axes, np.random.default_rng([seed, group]))
    ]
    return tuple(amplitude * wave / np.linalg.norm(wave, axis=1).max() for wave in waves[:realisations])


def _draw_group(lines: IntArray, period_samples: int, axes: int, generator: np.random.Generator) -> FloatArray:
    """Draw a group, (experiments, period_samples, axes), with as many experiments as axes: the draw whose highest peak
    over all its experiments is lowest."""
    # (experiments, axes): phase factors exp(2 pi i e a / m), a discrete Fourier matrix, whose rows are orthogonal.
    phase_factors = np.exp(2j * np.pi * np.outer(np.arange(axes), np.arange(axes)) / axes)

    def draw_period() -> FloatArray:
        """Draw a group with random phases, not scaled."""
        phases = generator.uniform(0, 2 * np.pi, (len(lines), axes))
        spectrum = np.zeros((axes, period_samples // 2 + 1, axes), dtype=complex)
        spectrum[:, lines] = np.exp(1j * phases) * phase_factors[:, None, :]
        return np.fft.irfft(spectrum, period_samples, axis=1)

    return _choose_lowest_peak(draw_period)


def make_interleaved_multisine(lines: IntArray, period_samples: int, axes: int, seed: int) -> FloatArray:
    """Make one period, (period_samples, axes), whose norm over the axes peaks at 1. Each line drives a single axis
    (axis a the lines a, a + axes, a + 2 axes, … of `lines`), so that one experiment measures the response to every
    axis."""
    generator, axis_of_line = np.random.default_rng(seed), np.arange(len(lines)) % axes

    def draw_period() -> FloatArray:
        """Draw a period with random phases, not scaled."""
        spectrum = np.zeros((period_samples // 2 + 1, axes), dtype=complex)
        spectrum[lines, axis_of_line] = np.exp(2j * np.pi * generator.uniform(size=len(lines)))
        return np.fft.irfft(spectrum, period_samples, axis=0)

    wave = _choose_lowest_peak(draw_period)
    return np.asarray(wave / np.linalg.norm(wave, axis=1).max())


def _choose_lowest_peak(draw: Callable[[], FloatArray]) -> FloatArray:
    """Choose, of `PHASE_DRAWS` calls of `draw`, the array whose norm over its last dimension (the axes) has the lowest
    peak."""
    return min((draw() for _ in range(PHASE_DRAWS)), key=lambda waves: float(np.linalg.norm(waves, axis=-1).max()))
