"""Noise of a spectrum of which there is only one look: what a smooth response and a smooth transient leave unexplained
in a window of neighbouring lines (the local polynomial method of Schoukens, Vandersteen, Barbé and Pintelon, 2009).

Where a resonance is narrower than the window the figure is too large, never too small.
"""

import numpy as np

from equalizer.signals.lockin import ComplexArray
from equalizer.signals.signal import FloatArray

_SPARE = 8
"""Lines beyond the unknowns of a window."""


def local_noise(command: ComplexArray, response: ComplexArray) -> FloatArray:
    """(lines, p): expected |error|² of the response. command: (lines, m), response: (lines, p); NaN for too few."""
    lines, m = command.shape
    unknowns = 2 * m + 3
    taken = unknowns + _SPARE
    if lines < taken:
        return np.full(response.shape, np.nan)
    starts = np.arange(0, lines - taken + 1, max(1, lines // 4000))
    window = starts[:, None] + np.arange(taken)
    away = np.linspace(-1.0, 1.0, taken)
    driven = command[window]
    size = np.maximum(np.abs(driven).max(axis=(1, 2), keepdims=True), 1e-300)
    smooth = np.broadcast_to(away[:, None] ** np.arange(3), (len(window), taken, 3))
    regressors = np.concatenate([driven / size, away[:, None] * driven / size, smooth], axis=2)
    basis, _ = np.linalg.qr(regressors)
    values = response[window]
    explained = np.sum(np.abs(np.swapaxes(basis.conj(), 1, 2) @ values) ** 2, axis=1)
    power = np.maximum(np.sum(np.abs(values) ** 2, axis=1) - explained, 0.0) / (taken - unknowns)
    centre = starts + taken // 2
    return np.stack([np.interp(np.arange(lines), centre, power[:, out]) for out in range(power.shape[1])], axis=1)
