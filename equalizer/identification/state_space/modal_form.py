"""Modal form of a discrete state-space model: A is block-diagonal, with blocks [[a, 1], [b, a]] and poles a ± sqrt(b).

A complex pair (b < 0) becomes two real poles (b > 0) continuously, so that a gradient-based fit can pass from a pair to
two real poles. The order is even, because a block has two poles. Used by the starting models and their `refinement`.
"""

from dataclasses import dataclass

import numpy as np

from equalizer.signals.signal import ComplexArray, FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class ModalForm:
    """Poles (of the z plane) and output matrix; states 2k and 2k + 1 belong to block k."""

    a: FloatArray
    """(blocks,): mean of the two poles."""
    b: FloatArray
    """(blocks,): square of half their difference; negative for a complex pair."""
    C: FloatArray
    """(p, 2 blocks): output matrix."""

    @property
    def state_matrix(self) -> FloatArray:
        """A, (2 blocks, 2 blocks)."""
        n = 2 * len(self.a)
        A = np.zeros((n, n))
        first, second = np.arange(0, n, 2), np.arange(1, n, 2)
        A[first, first] = A[second, second] = self.a
        A[first, second], A[second, first] = 1.0, self.b
        return A

    @property
    def poles(self) -> ComplexArray:
        """Poles, (2 blocks,): a + sqrt(b) of all blocks, then a - sqrt(b)."""
        root = np.sqrt(self.b.astype(np.complex128))
        return np.concatenate([self.a + root, self.a - root])

    def compute_state_outputs(self, z: ComplexArray) -> ComplexArray:
        """Compute C (zI - A)^-1, shape (lines, p, n). z: (lines,)."""
        offset = z[:, None] - self.a
        inverse_denominator = 1 / (offset**2 - self.b)
        first, second = self.C[:, ::2], self.C[:, 1::2]
        state_outputs = np.empty((len(z), *self.C.shape), dtype=np.complex128)
        state_outputs[:, :, ::2] = (first * offset[:, None] + second * self.b) * inverse_denominator[:, None]
        state_outputs[:, :, 1::2] = (first + second * offset[:, None]) * inverse_denominator[:, None]
        return state_outputs

    def compute_state_responses(self, z: ComplexArray, B: FloatArray) -> ComplexArray:
        """Compute (zI - A)^-1 B, shape (lines, n, m). z: (lines,), B: (n, m)."""
        offset = (z[:, None] - self.a)[:, :, None]
        inverse_denominator = 1 / (offset**2 - self.b[:, None])
        state_responses = np.empty((len(z), *B.shape), dtype=np.complex128)
        state_responses[:, ::2] = (offset * B[::2] + B[1::2]) * inverse_denominator
        state_responses[:, 1::2] = (self.b[:, None] * B[::2] + offset * B[1::2]) * inverse_denominator
        return state_responses


def build_form_from_poles(poles: ComplexArray, shapes: ComplexArray) -> ModalForm:
    """Make the real modal form of given poles and output shapes. poles: (n,), conjugates included; shapes: (p, n),
    output of each pole's mode. Raises ValueError where the number of real poles is odd or a conjugate is missing."""
    upper_poles = np.flatnonzero(poles.imag > 0)
    real_poles = np.flatnonzero(poles.imag == 0)
    real_poles = real_poles[np.argsort(poles[real_poles].real)]
    if len(real_poles) % 2 or 2 * len(upper_poles) + len(real_poles) != len(poles):
        raise ValueError(f"{len(poles)} poles, {len(real_poles)} of them real, do not form pairs; choose an even order")
    blocks = len(poles) // 2
    a, b, C = np.empty(blocks), np.empty(blocks), np.empty((len(shapes), len(poles)))
    pairs = len(upper_poles)
    a[:pairs], b[:pairs] = poles[upper_poles].real, -(poles[upper_poles].imag ** 2)
    C[:, 0 : 2 * pairs : 2], C[:, 1 : 2 * pairs : 2] = (
        poles[upper_poles].imag * shapes[:, upper_poles].real,
        shapes[:, upper_poles].imag,
    )
    first, second = real_poles[::2], real_poles[1::2]
    half_difference = (poles[first].real - poles[second].real) / 2
    a[pairs:], b[pairs:] = (poles[first].real + poles[second].real) / 2, half_difference**2
    C[:, 2 * pairs :: 2] = half_difference * (shapes[:, first] - shapes[:, second]).real
    C[:, 2 * pairs + 1 :: 2] = (shapes[:, first] + shapes[:, second]).real
    return ModalForm(a, b, C)
