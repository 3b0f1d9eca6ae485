"""One description of a device on two sets of its recordings, scaled so that both count alike."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.fft import irfft, next_fast_len, rfft
from scipy.linalg import solve_toeplitz

from analysis.diagnosis.contrast.fault import EVERY, Fault, Variant
from analysis.diagnosis.contrast.force_base import ForceBase
from analysis.diagnosis.contrast.ledger import Grams, Places, weights_of
from analysis.diagnosis.contrast.step_base import StepBase
from analysis.diagnosis.contrast.taken import Taken
from analysis.diagnosis.contrast.watch_base import WatchBase
from analysis.diagnosis.data.lagged_products import lagged_products
from analysis.diagnosis.types import Mask
from equalizer.signals.signal import FloatArray

Base = ForceBase | StepBase | WatchBase
FOLDS = 6
"""Blocks of each set."""
MEMORY = 8
"""Samples of the error's own past that foretell it (an autoregression): what is left is white."""


@dataclass(frozen=True, slots=True, eq=False)
class Side:
    """One set of stretches, by one base."""

    parts: tuple[Taken, ...]
    rows: tuple[FloatArray, ...]
    """Per part (kept, 1 + columns): what is to be told, and what tells it."""
    masks: tuple[Mask, ...]
    scale: float
    """Rms of its white error by a base of its own."""

    @property
    def count(self) -> int:
        return sum(int(mask.sum()) for mask in self.masks)


@dataclass(frozen=True, slots=True, eq=False)
class Stream:
    """One base on both sets."""

    base: Base
    clean: Side
    other: Side
    colour: FloatArray
    """Of the filter that makes the errors white."""
    columns: FloatArray
    """(1 + columns,): rms of each."""

    def grams(self, side: Side, changed: Sequence[Sequence[FloatArray]]) -> "Grams":
        """Of a side's rows and of what they change by; see `Grams`."""
        moved = [_changing(each, side.rows) for each in changed]
        wide = [
            np.hstack([part, *(each[number][:, at] - part[:, at] for each, at in zip(changed, moved, strict=True))])
            for number, part in enumerate(side.rows)
        ]
        scale = np.concatenate([self.columns, *(self.columns[at] for at in moved)]) * side.scale
        white = np.concatenate([filtered(self.colour, part) for part in wide]) / scale
        kept = white[np.concatenate(side.masks)]
        return Grams(
            np.array([block.T @ block for block in np.array_split(kept, FOLDS)]),
            tuple(moved),
            len(self.columns),
        )


def filtered(steps: FloatArray, samples: FloatArray) -> FloatArray:
    """(n, k), from zero before the first sample."""
    room = next_fast_len(len(samples) + len(steps) - 1, True)
    return np.asarray(irfft(rfft(samples, room, axis=0) * rfft(steps, room)[:, None], room, axis=0)[: len(samples)])


def _changing(rows: Sequence[FloatArray], plain: Sequence[FloatArray]) -> Places:
    """Columns in which they differ."""
    largest = np.array([np.abs(a - b).max(axis=0) for a, b in zip(rows, plain, strict=True)])
    return np.flatnonzero(largest.max(axis=0) > 0.0)


def stream_of(base: Base, clean: Sequence[Taken], other: Sequence[Taken]) -> Stream:
    rows, masks = (base.rows(clean), base.rows(other)), (base.valid_samples(clean), base.valid_samples(other))
    everything = np.vstack([part[mask] for side in (0, 1) for part, mask in zip(rows[side], masks[side], strict=True)])
    columns = np.sqrt(np.mean(everything**2, axis=0))
    columns = np.where(columns > 0, columns, 1.0)
    courses = [_own_error(rows[side], masks[side], columns) for side in (0, 1)]
    colour = _colour([*courses[0], *courses[1]], [*masks[0], *masks[1]])
    sides = [
        Side(tuple(parts), rows[side], masks[side], _white_error(rows[side], masks[side], columns, colour))
        for side, parts in enumerate((clean, other))
    ]
    return Stream(base, sides[0], sides[1], colour, columns)


def _own_error(rows: Sequence[FloatArray], masks: Sequence[Mask], columns: FloatArray) -> list[FloatArray]:
    whole = np.vstack([part[mask] for part, mask in zip(rows, masks, strict=True)]) / columns
    weights = weights_of(whole.T @ whole)
    return [part @ (weights / columns) * columns[0] for part in rows]


def _white_error(rows: Sequence[FloatArray], masks: Sequence[Mask], columns: FloatArray, colour: FloatArray) -> float:
    """Rms of the white error that a base of these rows' own leaves, over the rms of what is told."""
    white = np.vstack([filtered(colour, part)[mask] for part, mask in zip(rows, masks, strict=True)])
    gram = (white / columns).T @ (white / columns) / len(white)
    weights = weights_of(gram)
    return max(float(np.sqrt(max(float(weights @ gram @ weights), 0.0))), 1e-9)


def _colour(errors: Sequence[FloatArray], masks: Sequence[Mask]) -> FloatArray:
    courses = [np.where(mask, error, np.nan)[:, None] for error, mask in zip(errors, masks, strict=True)]
    power = np.sum([lagged_products(course, MEMORY)[:, 0] for course in courses if len(course) > MEMORY], axis=0)
    if not np.any(power > 0):
        return np.array([1.0])
    power[0] *= 1 + 1e-6
    return np.asarray(np.concatenate([[1.0], -np.asarray(solve_toeplitz(power[:-1], power[1:]))]))


def changed_rows(stream: Stream, side: Side, fault: Fault, variant: Variant) -> list[tuple[FloatArray, ...]]:
    """Rows with each size of 1 undone."""
    found = []
    tells = fault.place == (made := _made_by(stream.base))[0] and fault.site in (made[1], EVERY)
    if tells and variant.told is not None and isinstance(stream.base, ForceBase):
        rate_hz = stream.base.rate_hz
        return [tuple(np.hstack([part[:, :1], variant.told(part[:, 1:], rate_hz)]) for part in side.rows)]
    for undo in variant.undo:
        undone = tuple(undo(part) for part in side.parts)
        still = all(a.response is b.response for a, b in zip(undone, side.parts, strict=True))
        rows = stream.base.rows(undone, side.rows if still else None)
        unit = variant.unit(_kept_of(stream.base)) if tells else 1.0
        unit *= _weaker(side, rows) if tells and fault.place == "actuator" else 1.0
        found.append(rows if unit == 1.0 else tuple(unit * part for part in rows))
    return found


def _kept_of(base: Base) -> int:
    return base.step if isinstance(base, StepBase) else 1


def _made_by(base: Base) -> tuple[str, int]:
    """Place and number of the part that makes what a base tells."""
    return ("actuator", base.axis) if isinstance(base, ForceBase) else ("sensor", base.channel)


def _weaker(side: Side, rows: Sequence[FloatArray]) -> float:
    """A weaker actuator must not make every error smaller."""
    before, after = (float(np.std(np.concatenate([part[:, 0] for part in each]))) for each in (side.rows, rows))
    return before / after if after > 0 else 1.0
