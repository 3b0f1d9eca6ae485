"""How far a mechanical model is from measured lines, in units of what is expected of it, and its slope."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from equalizer.identification.frequency_response.frequency_response import BoolArray
from equalizer.identification.frequency_response.noise_floor import over_neighbours
from equalizer.identification.mechanical.mechanical_lines import SegmentLines, repeat_alike
from equalizer.identification.mechanical.mechanical_response import PoleForm, free_response, pole_form, sampled_response
from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.lockin import ComplexArray
from equalizer.signals.recording import Hold
from equalizer.signals.signal import FloatArray

LARGEST = 0.25
"""Of what a channel answers at most round a line. Segments contradict each other more where resonances shift with the
level, and those lines carry most of the motion."""
_LINES = 9


def with_scatter(segments: Sequence[SegmentLines]) -> tuple[SegmentLines, ...]:
    """Their noise raised to that scatter, where more segments than inputs repeat alike. All have the same band's
    lines, as `of_band` gives them.

    Scatter is what no linear model can explain, because segments with the same lines contradict each other there:
    friction and the like, seen between realisations, directions and levels."""
    return tuple(
        _raised(segment, [other for other in segments if repeat_alike(segment, other)]) for segment in segments
    )


def _raised(one: SegmentLines, alike: Sequence[SegmentLines]) -> SegmentLines:
    m = one.command.shape[1]
    if len(alike) <= m:
        return one
    sizes = [_size(other) for other in alike]
    answers = [np.abs(other.response / size) ** 2 for other, size in zip(alike, sizes, strict=True)]
    largest = LARGEST**2 * over_neighbours(np.max(answers, axis=0), _LINES)
    scatter = np.minimum(_scatter(alike, sizes), largest) * _size(one) ** 2
    return replace(one, noise=np.fmax(one.noise, scatter))


def _size(segment_lines: SegmentLines) -> float:
    return max(float(np.sqrt(np.mean(np.abs(segment_lines.command) ** 2))), 1e-300)


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


LEFT_OUT_EVERY = 4
_RUN_AWAY = 1e120
"""Of what states at both ends make of a line: the square of more is no number."""
_STEP = 1e-6


@dataclass(frozen=True, slots=True, eq=False)
class LineGroup:
    """Segments with the same lines, folded: misfit = target - root G per line and response, of unit expected power."""

    frequency_hz: FloatArray
    root: ComplexArray
    """(lines, p, rows, m)"""
    target: ComplexArray
    """(lines, p, rows)"""
    weight: FloatArray
    """(lines, p)"""
    left_out: BoolArray
    """(lines,): kept for judging structures."""
    count: FloatArray
    """(lines,): misfits behind the rows."""
    transient: bool
    rate_hz: float
    hold: Hold

    def without_left_out(self) -> "LineGroup":
        return self.of(~self.left_out)

    def thinned(self, most: int) -> "LineGroup":
        """Every second, third... line, of which others are left out in turn."""
        every = -(-len(self.frequency_hz) // most)
        part = self.of(np.arange(len(self.frequency_hz)) % every == 0)
        return replace(part, left_out=_turn_by_turn(len(part.frequency_hz)))

    def of(self, chosen: BoolArray) -> "LineGroup":
        return LineGroup(
            self.frequency_hz[chosen], self.root[chosen], self.target[chosen], self.weight[chosen],
            self.left_out[chosen], self.count[chosen], self.transient, self.rate_hz, self.hold,
        )  # fmt: skip


def line_groups(segments: Sequence[SegmentLines], floor: float) -> tuple[LineGroup, ...]:
    """Segments that repeat and have the same lines become one group, however many they are."""
    found: list[LineGroup] = []
    for segment in with_scatter(segments):
        weight = _weight(segment, floor)
        root = weight[:, :, None, None] * segment.command[:, None, None, :]
        target = (weight * segment.response)[:, :, None]
        left_out = _turn_by_turn(len(segment.frequency_hz))
        group = LineGroup(
            segment.frequency_hz, root, target, weight, left_out, np.count_nonzero(weight, axis=1).astype(float),
            segment.transient, segment.rate_hz, segment.hold,
        )  # fmt: skip
        alike = [i for i, other in enumerate(found) if not group.transient and _same_lines(group, other)]
        if alike:
            found[alike[0]] = _folded(found[alike[0]], group)
        else:
            found.append(group)
    return tuple(found)


def misfits(groups: Sequence[LineGroup], model: MechanicalModel) -> list[ComplexArray]:
    """Per group (lines, p, rows), with the transients that suit the lines which are not left out."""
    form, found = pole_form(model), []
    for group in groups:
        response = sampled_response(model, group.frequency_hz, group.rate_hz, group.hold, form)
        misfit = group.target - (group.root @ response[..., None])[..., 0]
        found.append(
            _without_transient(group, transient_basis(group, model, form), misfit) if group.transient else misfit
        )
    return found


def transient_basis(group: LineGroup, model: MechanicalModel, form: PoleForm) -> ComplexArray:
    """(lines, p, columns), weighted. form: the model's."""
    free = free_response(model, group.frequency_hz, group.rate_hz, form)
    if model.quantity == "acceleration":  # the last command of before goes straight through
        straight = np.broadcast_to(np.eye(model.outputs), (len(free), model.outputs, model.outputs))
        free = np.concatenate([free, straight], axis=2)
    return np.asarray(group.weight[:, :, None] * free)


def stacked(parts: Sequence[ComplexArray]) -> FloatArray:
    """One real vector, its sum of squares the sum of |.|²."""
    flat = np.concatenate([part.ravel() for part in parts])
    return np.concatenate([flat.real, flat.imag])


def jacobian(
    residuals: Callable[[FloatArray], FloatArray], unknowns: FloatArray, here: FloatArray, high: FloatArray
) -> FloatArray:
    """By differences; a step that would leave `high` goes the other way."""
    columns = np.empty((len(here), len(unknowns)))
    for k in range(len(unknowns)):
        step = _STEP * max(1.0, abs(unknowns[k]))
        step = -step if unknowns[k] + step > high[k] else step
        moved = unknowns.copy()
        moved[k] += step
        columns[:, k] = (residuals(moved) - here) / step
    return columns


def _weight(segment: SegmentLines, floor: float) -> FloatArray:
    """1 over the expected error: noise, and `floor` of the response's size round the line."""
    power = np.abs(segment.response) ** 2
    size = over_neighbours(power, 5)
    noise = np.where(np.isfinite(segment.noise), segment.noise, 0.0)
    least = 1e-12 * power.max(axis=0, initial=0.0) + 1e-300
    return np.asarray(segment.excited[:, None] / np.sqrt(noise + floor**2 * size + least))


def _turn_by_turn(lines: int) -> BoolArray:
    return np.asarray(np.arange(lines) % LEFT_OUT_EVERY == LEFT_OUT_EVERY // 2)


def _same_lines(group: LineGroup, other: LineGroup) -> bool:
    return (
        not other.transient
        and (group.rate_hz, group.hold) == (other.rate_hz, other.hold)
        and len(group.frequency_hz) == len(other.frequency_hz)
        and bool(np.allclose(group.frequency_hz, other.frequency_hz))
    )


def _folded(group: LineGroup, other: LineGroup) -> LineGroup:
    root = np.concatenate([group.root, other.root], axis=2)
    target = np.concatenate([group.target, other.target], axis=2)
    if root.shape[2] > root.shape[3] + 1:  # m + 1 rows hold all that the least squares needs to know
        triangle = np.asarray(np.linalg.qr(np.concatenate([root, target[..., None]], axis=3), mode="r"))
        root, target = triangle[..., :-1], triangle[..., -1]
    return LineGroup(
        group.frequency_hz, root, target, group.weight, group.left_out, group.count + other.count,
        group.transient, group.rate_hz, group.hold,
    )  # fmt: skip


def _without_transient(group: LineGroup, basis: ComplexArray, misfit: ComplexArray) -> ComplexArray:
    if not np.abs(basis).max(initial=0.0) < _RUN_AWAY:
        return misfit  # A fit may try a model that is unstable.
    kept = ~group.left_out
    columns, wanted = basis[kept].reshape(-1, basis.shape[2]), misfit[kept].reshape(-1)
    real = np.concatenate([columns.real, columns.imag])
    scale = np.maximum(np.linalg.norm(real, axis=0), 1e-300)
    ends = np.linalg.lstsq(real / scale, np.concatenate([wanted.real, wanted.imag]), rcond=1e-10)[0] / scale
    return np.asarray(misfit - (basis @ ends)[:, :, None])
