"""Periodic multisines: sinusoids of equal size on whole lines, with random phases.

Random phases, and not ones that were optimised for a low peak, because only over random phases does odd distortion
average out of an estimate. The crest factor is kept low by taking the best of several draws. On three axes at once the
experiments of a group are orthogonal (Dobrowiecki, Schoukens and Guillaume 2006): phases of its own for each axis, and
from one experiment to the next axis a turns by a thirds of a circle.
"""

from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from equalizer.signals.signal import FloatArray

IntArray = npt.NDArray[np.int64]

DRAWS = 32
"""Draws of the phases, of which the one with the lowest peak is kept: on one axis 2.8 to 3.5 times the rms; single
draws reach 4.8."""


def lines_between(from_hz: float, to_hz: float, n: int, sample_rate_hz: float, *, odd_only: bool) -> IntArray:
    """Multiples of 1 / period, both ends included, for a period of n samples. Below half the rate.

    Raises ValueError where there are none.
    """
    if not 0 < from_hz <= to_hz <= sample_rate_hz / 2:
        raise ValueError(
            f"a multisine needs 0 < from_hz <= to_hz <= {sample_rate_hz / 2:g} Hz (half the rate), "
            f"not {from_hz:g} to {to_hz:g}"
        )
    spacing_hz = sample_rate_hz / n
    lowest, highest = np.ceil(from_hz / spacing_hz - 1e-9), np.floor(to_hz / spacing_hz + 1e-9)
    between: IntArray = np.arange(lowest, highest + 1).astype(np.int64)
    lines: IntArray = between[(2 * between < n) & ((between % 2 == 1) | (not odd_only))]
    if len(lines) == 0:
        raise ValueError(
            f"a period of {n / sample_rate_hz:g} s has no {'odd ' if odd_only else ''}line from {from_hz:g} to "
            f"{to_hz:g} Hz"
        )
    return lines


def multisines(
    lines: IntArray, n: int, amplitude: float, axes: int, realisations: int, seed: int
) -> tuple[FloatArray, ...]:
    """One period for each realisation, shape (n, axes), which may be repeated without a jump.

    The peak of the norm over the axes is `amplitude` in each. Every `axes` realisations are a group, orthogonal at
    every line. A realisation depends on the seed and its own number only, not on how many are asked for.
    """
    groups = -(-realisations // axes)
    waves = [
        wave for group in range(groups) for wave in _draw_group(lines, n, axes, np.random.default_rng([seed, group]))
    ]
    return tuple(amplitude * wave / np.linalg.norm(wave, axis=1).max() for wave in waves[:realisations])


def _draw_group(lines: IntArray, n: int, axes: int, random: np.random.Generator) -> FloatArray:
    """(axes, n, axes): the experiments of one group, from the draw whose highest peak is lowest."""
    turns = np.exp(2j * np.pi * np.outer(np.arange(axes), np.arange(axes)) / axes)

    def draw() -> FloatArray:
        phases = random.uniform(0, 2 * np.pi, (len(lines), axes))
        spectrum = np.zeros((axes, n // 2 + 1, axes), dtype=complex)
        spectrum[:, lines] = np.exp(1j * phases) * turns[:, None, :]
        return np.fft.irfft(spectrum, n, axis=1)

    return _best_of_draws(draw)


def make_interleaved_multisine(lines: IntArray, n: int, axes: int, seed: int) -> FloatArray:
    """One period, shape (n, axes), whose norm over the axes peaks at 1. Each line drives one axis alone: axis a has
    every `axes`-th line, beginning with the a-th."""
    random, axis = np.random.default_rng(seed), np.arange(len(lines)) % axes

    def draw() -> FloatArray:
        spectrum = np.zeros((n // 2 + 1, axes), dtype=complex)
        spectrum[lines, axis] = np.exp(2j * np.pi * random.uniform(size=len(lines)))
        return np.fft.irfft(spectrum, n, axis=0)

    wave = _best_of_draws(draw)
    return np.asarray(wave / np.linalg.norm(wave, axis=1).max())


def _best_of_draws(draw: Callable[[], FloatArray]) -> FloatArray:
    """The draw whose highest peak of the norm over the axes, its last dimension, is lowest."""
    return min((draw() for _ in range(DRAWS)), key=lambda waves: float(np.linalg.norm(waves, axis=-1).max()))
