"""Modal form of a state-space model: blocks of two poles, [[a, 1], [b, a]] with poles a ± sqrt(b).

In this form a complex pair becomes two real poles continuously, which a fit needs. The order is even, because a block
has two poles.
"""

from dataclasses import dataclass

import numpy as np

from equalizer.signals.signal import ComplexArray, FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class ModalForm:
    """Poles and the outputs' shapes; states 2k and 2k + 1 belong to block k."""

    a: FloatArray
    """(blocks,)"""
    b: FloatArray
    """(blocks,)"""
    C: FloatArray
    """(p, 2 blocks)"""

    @property
    def state_matrix(self) -> FloatArray:
        """(2 blocks, 2 blocks)"""
        n = 2 * len(self.a)
        A = np.zeros((n, n))
        first, second = np.arange(0, n, 2), np.arange(1, n, 2)
        A[first, first] = A[second, second] = self.a
        A[first, second], A[second, first] = 1.0, self.b
        return A

    @property
    def poles(self) -> ComplexArray:
        """(2 blocks,)"""
        root = np.sqrt(self.b.astype(np.complex128))
        return np.concatenate([self.a + root, self.a - root])

    def from_states(self, z: ComplexArray) -> ComplexArray:
        """C (zI - A)^-1, shape (lines, p, n). z: (lines,)."""
        away = z[:, None] - self.a
        scale = 1 / (away**2 - self.b)
        first, second = self.C[:, ::2], self.C[:, 1::2]
        states = np.empty((len(z), *self.C.shape), dtype=np.complex128)
        states[:, :, ::2] = (first * away[:, None] + second * self.b) * scale[:, None]
        states[:, :, 1::2] = (first + second * away[:, None]) * scale[:, None]
        return states

    def to_states(self, z: ComplexArray, B: FloatArray) -> ComplexArray:
        """(zI - A)^-1 B, shape (lines, n, m). z: (lines,), B: (n, m)."""
        away = (z[:, None] - self.a)[:, :, None]
        scale = 1 / (away**2 - self.b[:, None])
        states = np.empty((len(z), *B.shape), dtype=np.complex128)
        states[:, ::2] = (away * B[::2] + B[1::2]) * scale
        states[:, 1::2] = (self.b[:, None] * B[::2] + away * B[1::2]) * scale
        return states


def modal_form(A: FloatArray, C: FloatArray) -> ModalForm:
    """The same poles and output shapes in blocks. A: (n, n) with n even, C: (p, n)."""
    values, vectors = np.linalg.eig(A)
    return from_poles(values, C @ vectors)


def from_poles(poles: ComplexArray, shapes: ComplexArray) -> ModalForm:
    """The real modal form of given poles and output shapes. poles: (n,), conjugates included; shapes: (p, n), the
    outputs' share in each."""
    upper = np.flatnonzero(poles.imag > 0)
    real = np.flatnonzero(poles.imag == 0)
    real = real[np.argsort(poles[real].real)]
    if len(real) % 2 or 2 * len(upper) + len(real) != len(poles):
        raise ValueError(f"{len(poles)} poles, {len(real)} of them real, do not form pairs; choose an even order")
    blocks = len(poles) // 2
    a, b, C = np.empty(blocks), np.empty(blocks), np.empty((len(shapes), len(poles)))
    k = len(upper)
    a[:k], b[:k] = poles[upper].real, -(poles[upper].imag ** 2)
    C[:, 0 : 2 * k : 2], C[:, 1 : 2 * k : 2] = poles[upper].imag * shapes[:, upper].real, shapes[:, upper].imag
    first, second = real[::2], real[1::2]
    half = (poles[first].real - poles[second].real) / 2
    a[k:], b[k:] = (poles[first].real + poles[second].real) / 2, half**2
    C[:, 2 * k :: 2] = half * (shapes[:, first] - shapes[:, second]).real
    C[:, 2 * k + 1 :: 2] = (shapes[:, first] + shapes[:, second]).real
    return ModalForm(a, b, C)
