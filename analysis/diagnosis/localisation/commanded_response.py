"""What the command itself brings to the silent lines: where a feedback adds to the excitation, the device's distortion
returns through it, and a linear device answers that, too."""

from collections.abc import Sequence

import numpy as np

from equalizer.signals.lockin import ComplexArray
from equalizer.signals.signal import FloatArray

_LEAST_INDEPENDENCE = 1e-3
_INTERPOLATED = 0.1
"""Relative error of a response between driven lines."""


def line_responses(commands: Sequence[ComplexArray], responses: Sequence[ComplexArray]) -> ComplexArray:
    """(lines, outputs, inputs): the linear response at lines where the experiments drive every direction; NaN
    elsewhere. commands: each (lines, inputs), zero where not driven; responses: each (lines, outputs)."""
    inputs, outputs = np.stack(commands, axis=1), np.stack(responses, axis=1)
    size = np.linalg.svd(inputs, compute_uv=False)
    usable = (inputs.shape[1] >= inputs.shape[2]) & (size[:, -1] > _LEAST_INDEPENDENCE * size[:, 0])
    found = np.full((len(inputs), outputs.shape[2], inputs.shape[2]), np.nan + 0j)
    if usable.any():
        solved = np.linalg.pinv(inputs[usable]) @ outputs[usable]
        found[usable] = np.swapaxes(solved, 1, 2)
    return found


def between_lines(response: ComplexArray) -> ComplexArray | None:
    """The same at all lines, from the nearest known ones; None where there are none. response: (lines, ...)"""
    known = np.flatnonzero(np.isfinite(response).all(axis=(1, 2)))
    if len(known) < 2:
        return None
    lines = np.arange(len(response))
    flat = response.reshape(len(response), -1)
    real = [np.interp(lines, known, column) for column in flat[known].real.T]
    imaginary = [np.interp(lines, known, column) for column in flat[known].imag.T]
    return np.asarray((np.array(real) + 1j * np.array(imaginary)).T.reshape(response.shape), dtype=np.complex128)


def commanded(response: ComplexArray, command: ComplexArray) -> tuple[ComplexArray, FloatArray]:
    """What the command's lines bring, and the variance of its error: both (lines, outputs)."""
    brought = np.einsum("lij,lj->li", response, command)
    return brought, _INTERPOLATED**2 * np.abs(brought) ** 2
