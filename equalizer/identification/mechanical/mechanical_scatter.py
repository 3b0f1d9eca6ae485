"""What no linear model can explain, because segments with the same lines contradict each other there: friction and the
like, seen as scatter between realisations, directions and levels."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from equalizer.identification.frequency_response.noise_floor import over_neighbours
from equalizer.identification.mechanical.mechanical_lines import SegmentLines, repeat_alike
from equalizer.signals.signal import FloatArray

LARGEST = 0.25
"""Of what a channel answers at most round a line. Segments contradict each other more where resonances shift with the
level, and those lines carry most of the motion."""
_LINES = 9


def with_scatter(segments: Sequence[SegmentLines]) -> tuple[SegmentLines, ...]:
    """Their noise raised to that scatter, where more segments than inputs repeat alike. All have the same band's
    lines, as `of_band` gives them."""
    return tuple(_raised(one, [other for other in segments if repeat_alike(one, other)]) for one in segments)


def _raised(one: SegmentLines, alike: Sequence[SegmentLines]) -> SegmentLines:
    m = one.command.shape[1]
    if len(alike) <= m:
        return one
    sizes = [_size(other) for other in alike]
    answers = [np.abs(other.response / size) ** 2 for other, size in zip(alike, sizes, strict=True)]
    largest = LARGEST**2 * over_neighbours(np.max(answers, axis=0), _LINES)
    scatter = np.minimum(_scatter(alike, sizes), largest) * _size(one) ** 2
    return replace(one, noise=np.fmax(one.noise, scatter))


def _size(one: SegmentLines) -> float:
    return max(float(np.sqrt(np.mean(np.abs(one.command) ** 2))), 1e-300)


def _scatter(alike: Sequence[SegmentLines], sizes: Sequence[float]) -> FloatArray:
    """(lines, p): power that the best response at each line leaves, per degree of freedom, for a command of size 1."""
    m = alike[0].command.shape[1]
    driven = np.array([other.excited / size for other, size in zip(alike, sizes, strict=True)]).T[:, :, None]
    command = np.stack([other.command for other in alike], axis=1) * driven
    response = np.stack([other.response for other in alike], axis=1) * driven
    basis, triangle = np.linalg.qr(command)
    strengths = np.abs(np.diagonal(triangle, axis1=1, axis2=2))
    known = strengths.min(axis=1) > 1e-6 * strengths.max()
    explained = np.sum(np.abs(np.swapaxes(basis.conj(), 1, 2) @ response) ** 2, axis=1)
    left = np.maximum(np.sum(np.abs(response) ** 2, axis=1) - explained, 0.0)
    freedom = np.count_nonzero(driven[:, :, 0], axis=1) - m
    usable = known & (freedom > 0)
    total = over_neighbours(np.where(usable[:, None], left, 0.0), _LINES)
    return np.asarray(total / np.maximum(over_neighbours(np.where(usable, freedom, 0.0)[:, None], _LINES), 1e-12))
