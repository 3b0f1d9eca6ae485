"""Which fault sets recordings apart from clean ones of the same device, weighed against what sets stretches of either
apart from each other: no real device is the same twice."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from analysis.diagnosis.balance.judged_law import LEVEL, bootstrap_draws
from analysis.diagnosis.contrast.actuator_faults import actuator_faults
from analysis.diagnosis.contrast.bases import bases_of, left_of, moves_alike, turning_of
from analysis.diagnosis.contrast.fault import Fault, Variant
from analysis.diagnosis.contrast.force_base import ForceBase
from analysis.diagnosis.contrast.ledger import Fit, Pair, fitted, foretold, left_by_own, left_with
from analysis.diagnosis.contrast.mechanism_faults import mechanism_faults
from analysis.diagnosis.contrast.sensor_faults import faults_of_all, sensor_faults, turned_sensor
from analysis.diagnosis.contrast.stream import FOLDS, Stream, changed_rows, stream_of
from analysis.diagnosis.contrast.taken import Taken, taken_of
from analysis.diagnosis.contrast.watch_base import watch_bases
from analysis.diagnosis.types import TimeBudget
from equalizer.signals.recording import Recording
from equalizer.signals.signal import FloatArray

ALL = tuple(range(FOLDS))
APART = ((0, 1), (2, 3), (4, 5), (0, 1, 2))
"""Blocks of a set that are weighed against its others: thirds and halves, like two recordings."""
FURTHER = 1.6
"""Times the largest excess between stretches of one set that both together must have. By hand: of seven public devices
in order, halves of which a fault was named had up to 1.53 times; faults that were named right, 1.75 and more."""
AS_ONE = 0.05
"""Excess of the error of both sets together over that of each by itself, up to which they are of one device."""
LEAST = 0.05
"""Of the error power of both sets, that a fault must gain: so much comes of one that adds a tenth to the error power of
one of them. What is less is not worth a name."""


@dataclass(frozen=True, slots=True, eq=False)
class Weighed:
    """A fault, as a reader would judge it."""

    fault: Fault
    values: dict[str, float]
    spread: dict[str, float]
    """Standard error of each value, from leaving out blocks of either set: what varies among the clean stretches makes
    a number as uncertain as what varies among the others."""
    errors: FloatArray
    """(blocks,): what is left with it undone: of the faulty set, then of the clean one."""
    gain: float
    """Error with it over error without it, less 1;"""
    usual: float
    """the largest that it has between stretches of one set;"""
    typical: float
    """their median: so much it gains by what it is, whatever the stretches."""
    share: float
    """Of what sets the two sets apart, beyond what each leaves by a base of its own."""
    held_out: float
    """What is left of the faulty set, each block by numbers fitted to all others."""
    gain_low: float
    """Lower end of the gain beyond the typical one, from resampled blocks."""
    apart: float
    """The largest excess between stretches of one set, in the faulty one with the fault undone; see `Compared`."""


@dataclass(frozen=True, slots=True, eq=False)
class Compared:
    weighed: tuple[Weighed, ...]
    """The best first;"""
    plain: FloatArray
    """(blocks,): what is left with nothing undone, as `Weighed.errors`."""
    samples: int
    """What would be left where each set had a base of its own,"""
    faulty_samples: int
    """and what of the faulty set."""
    held_out: float
    """As `Weighed.held_out`, with nothing undone."""
    faulty_share: float
    """rms of the own error of the faulty set, over the rms of what is told."""
    usual: float
    """The largest excess between stretches of one set; see `excess`;"""
    usual_clean: float
    """and of the clean one alone."""
    by_force: bool
    step_s: float
    complete: bool
    """All faults were weighed: the time did not run out before."""

    @property
    def excess(self) -> float:
        return float(self.plain.sum()) / self.samples - 1

    @property
    def differ(self) -> bool:
        """By more than stretches of one set do."""
        return self.excess > max(AS_ONE, FURTHER * self.usual)

    def differ_but_for(self, fault: Weighed) -> bool:
        """By more than stretches of one set would without the fault: what comes and goes sets them apart, too."""
        return self.excess > max(AS_ONE, FURTHER * max(self.usual_clean, fault.apart))


def compared(
    recordings: Sequence[Recording], clean: Sequence[Recording], without: frozenset[str], time_left: TimeBudget
) -> Compared | None:
    """None where there is too little, nothing holds, or one set hardly moves beside the other."""
    sides = taken_of(clean), taken_of(recordings)
    if not all(sides) or not moves_alike(*sides):
        return None
    try:
        streams, faults, by_force = _streams(*sides)
        found = _weigh(streams, [fault for fault in faults if fault.effect not in without], time_left)
    except (np.linalg.LinAlgError, ValueError):
        return None
    base = streams[0].base
    step_s = 1 / base.rate_hz if isinstance(base, ForceBase) else base.step / sides[0][0].rate_hz
    return replace(found, faulty_share=min(left_of(base, sides[1]), 1.0), by_force=by_force, step_s=step_s)


def _streams(clean: tuple[Taken, ...], faulty: tuple[Taken, ...]) -> tuple[list[Stream], list[Fault], bool]:
    recording = clean[0].recording
    bases, motions = bases_of(clean, faulty)
    by_force = isinstance(bases[0], ForceBase)
    timed = bool(motions) and np.isfinite(motions[0].band_hz)
    band_hz, step = (motions[0].band_hz, motions[0].step) if motions else (np.inf, 1)
    table = {id(part.recording): motion for part, motion in zip((*clean, *faulty), motions, strict=False)}
    streams = [stream_of(base, clean, faulty) for base in (*bases, *watch_bases(clean, band_hz, step))]
    faults: list[Fault] = []
    turns = turning_of(recording)
    for axis, name in enumerate(recording.command.channels):
        if timed:
            faults += mechanism_faults(axis, name, motions, lambda part: table[id(part.recording)], turns)
        if not recording.meta.get("imposed"):
            faults += actuator_faults(axis, name, (*clean, *faulty), by_force)
    for channel, name in enumerate(recording.response.channels):
        faults += sensor_faults(channel, name, (*clean, *faulty))
    if len(recording.response.channels) > 1:
        faults += faults_of_all((*clean, *faulty))
    if {name[-1:] for name in recording.response.channels} == {"x", "y", "z"}:
        faults.append(turned_sensor())
    return streams, faults, by_force


def _weigh(streams: Sequence[Stream], faults: Sequence[Fault], time_left: TimeBudget) -> Compared:
    clean = [stream.grams(stream.clean, []).blocks for stream in streams]
    bare = [Pair(stream.grams(stream.other, []), ALL, tuple(own)) for stream, own in zip(streams, clean, strict=True)]
    plain = fitted(bare, None)
    own = sum(stream.other.count for stream in streams)
    samples = own + sum(stream.clean.count for stream in streams)
    best: list[tuple[Fit, Fault, Variant, list[Pair]]] = []
    complete = False
    for fault in faults:
        if not time_left():
            break
        tried = []
        for variant in fault.variants:
            pairs = [
                Pair(stream.grams(stream.other, changed_rows(stream, stream.other, fault, variant)), ALL, tuple(own))
                for stream, own in zip(streams, clean, strict=True)
            ]
            if all(pair.with_it.sound for pair in pairs):
                tried.append((fitted(pairs, variant), fault, variant, pairs))
        if tried:
            best.append(min(tried, key=lambda each: each[0].error))
    else:
        complete = True
    best.sort(key=lambda each: each[0].error)
    weighed = sorted(
        (_weighed(streams, found, plain, samples) for found in best), key=lambda each: float(each.errors.sum())
    )
    held = sum(foretold(kept, np.zeros(0), block) for block, kept in enumerate(_apart(bare)))
    usual = [max(_excesses(each)) for each in (clean, [pair.with_it.blocks for pair in bare])]
    return Compared(tuple(weighed), plain.errors, samples, own, held, 0.0, max(usual), usual[0], True, 0.0, complete)


def _excesses(sides: Sequence[FloatArray]) -> Iterator[float]:
    """Of stretches of one set described together over each by itself. sides: per stream, products (blocks, k, k)."""

    def error(blocks: Sequence[int]) -> float:
        return sum(left_by_own(side[list(blocks)].sum(axis=0)) for side in sides)

    together = error(ALL)
    for at in APART:
        apart = error(at) + error([block for block in ALL if block not in at])
        yield together / max(apart, 1e-300) - 1


def _weighed(
    streams: Sequence[Stream], found: tuple[Fit, Fault, Variant, list[Pair]], plain: Fit, samples: int
) -> Weighed:
    fit, fault, variant, pairs = found
    values = variant.values(fit.sizes)
    apart = _apart(pairs)
    fits = [fitted(kept, variant) for kept in apart]
    sides = [[variant.values(fit.sizes) for fit in fits], _by_clean(pairs, variant)]
    held = sum(foretold(kept, each.sizes, block) for block, (kept, each) in enumerate(zip(apart, fits, strict=True)))
    spread = {name: float(np.sqrt(sum(_jackknifed([other[name] for other in side]) for side in sides)))
              for name in values}  # fmt: skip
    gains = list(_usual(streams, fault, variant, fit.sizes)) if plain.error > (1 + LEAST) * fit.error else [0.0]
    typical = max(float(np.median(gains)), 0.0)
    errors = fit.errors * (1 + typical)
    drawn = bootstrap_draws(len(errors))
    beyond = plain.errors[drawn].sum(axis=1) / np.maximum(errors[drawn].sum(axis=1), 1e-300) - 1
    left, room = float(errors.sum()), plain.error - samples
    return Weighed(
        fault, values, spread, errors, plain.error / max(left, 1e-300) - 1, max([0.0, *gains]) - typical, typical,
        (plain.error - left) / room if room > 0 else 0.0, held, float(np.quantile(beyond, LEVEL)),
        max(_excesses([pair.with_it.undone(fit.sizes) for pair in pairs])),
    )  # fmt: skip


def _by_clean(pairs: Sequence[Pair], variant: Variant) -> list[dict[str, float]]:
    """The values, without each block of the clean set."""
    kept = [
        [replace(pair, without=(*pair.without[:block], *pair.without[block + 1 :])) for pair in pairs] for block in ALL
    ]
    return [variant.values(fitted(each, variant).sizes) for each in kept]


def _jackknifed(values: Sequence[float]) -> float:
    """Variance of a number from those without each block."""
    return float((len(values) - 1) * np.var(values))


def _apart(pairs: Sequence[Pair]) -> list[list[Pair]]:
    """Without each block of the faulty set."""
    return [[replace(pair, at=tuple(other for other in ALL if other != block)) for pair in pairs] for block in ALL]


def _usual(streams: Sequence[Stream], fault: Fault, variant: Variant, sizes: FloatArray) -> Iterator[float]:
    """The gains by the fault between stretches of one set: of the clean one, from none of it to a size of a stretch's
    own; of the faulty one, from the size of all. There it is undone everywhere first: what a base cannot describe would
    gain in any stretch."""
    for clean in (True,) if fault.varies else (True, False):
        common = np.zeros_like(sizes) if clean else sizes
        sides = [stream.clean if clean else stream.other for stream in streams]
        both = [
            stream.grams(side, changed_rows(stream, side, fault, variant))
            for stream, side in zip(streams, sides, strict=True)
        ]
        for at in APART:
            rest = [block for block in ALL if block not in at]
            pairs = [Pair(grams, at, tuple(grams.undone(common)[rest])) for grams in both]
            yield left_with(pairs, common) / max(fitted(pairs, variant).error, 1e-300) - 1
