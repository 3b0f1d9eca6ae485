"""Faults of a converter or a line that a recording shows by itself, without any model: readings that take steps only,
that stay at a limit, or that are there twice. Recordings of the device in order say what of that is usual.
"""

from collections.abc import Mapping, Sequence

import numpy as np

from analysis.diagnosis.errors.hypothesis import Claim, Hypothesis, Spread, claimed
from analysis.diagnosis.settings import READINGS_DEVIATIONS, READINGS_FACTOR, READINGS_LEAST, STEP_FACTOR
from analysis.diagnosis.types import Mask
from equalizer.effects.effect import Effect, Values
from equalizer.effects.starts.lattice import confirm_lattice_step, lattice_step
from equalizer.signals.recording import Recording
from equalizer.signals.signal import FloatArray

ALIKE = 1e-3
"""Share of a step by which those of channels may differ that have the same."""
LONG_RUNS = 2.0
"""Repeats in a row, on average, as they are where half of all samples are lost: more is play, or a sensor at rest."""
CATCHES_UP = 0.75
"""Times the median step that the one after lost samples must be: a reading that play held goes half of one or less."""
STRETCHES = 3
"""Of each reference recording: what is usual in any of them is no fault."""
SAME = 1e-9
"""Share of its largest reading by which a channel's readings at a limit may differ."""


def seen_directly(
    recordings: Sequence[Recording], clean: Sequence[Recording], effects: Sequence[Effect]
) -> tuple[Hypothesis, ...]:
    """At most one: rounded readings also repeat and have a largest value. effects: those that may be named."""
    known = {effect.name: effect for effect in effects}
    new = _readings(recordings)
    references = [
        part for recording in clean for part in np.array_split(_readings([recording]), STRETCHES) if len(part)
    ]
    for name, look in (("quantization", _steps), ("sensor_clipping", _limit), ("lost_samples", _twice)):
        found = look(new, references)
        if found is not None:
            return (_claimed(known[name], *found),) if name in known else ()
    return ()


Found = tuple[tuple[int, ...], Values]
"""Channels, and what they show."""


def _claimed(effect: Effect, channels: tuple[int, ...], values: Values) -> Hypothesis:
    spread: Spread = "all" if len(channels) > 1 else "one"
    return claimed(Claim(effect, spread, channels), [values])


def _readings(recordings: Sequence[Recording]) -> FloatArray:
    """(n, p): those that are known, one after the other."""
    samples = np.vstack([recording.response.samples for recording in recordings])
    return np.asarray(samples[np.isfinite(samples).all(axis=1)])


def _steps(new: FloatArray, references: Sequence[FloatArray]) -> Found | None:
    found = {}
    for c in range(new.shape[1]):
        step = lattice_step(new[:, c])
        if step is not None and all(
            step > STEP_FACTOR * confirm_lattice_step(readings[:, c], step) for readings in references
        ):
            found[c] = step
    alike = bool(found) and min(found.values()) > (1 - ALIKE) * max(found.values())
    return _where(found, alike and len(found) == new.shape[1], new.shape[1], "step")


def _limit(new: FloatArray, references: Sequence[FloatArray]) -> Found | None:
    """A limit is reached on both sides where both are asked for, and holds more readings than the place below it."""
    found = {}
    for c in range(new.shape[1]):
        limit, count = _at_the_top(new[:, c])
        usual = max(_at_the_top(readings[:, c])[1] / len(readings) for readings in references) * len(new)
        beyond = max(float(np.abs(readings[:, c]).max()) for readings in references)
        elsewhere = max(_elsewhere(readings[:, c]) / len(readings) for readings in references) * len(new)
        if limit < beyond and _unusual(count, usual) and not _unusual(_elsewhere(new[:, c]), elsewhere):
            found[c] = limit
    within = bool(found) and bool(np.all(np.abs(new) <= max(found.values()) * (1 + SAME)))
    return _where(found, within, new.shape[1], "limit")


def _elsewhere(values: FloatArray) -> int:
    """Readings that stay as they were away from the largest magnitude: play holds them at any level, no limit does."""
    sizes = np.abs(values[1:])
    return int(np.count_nonzero((np.diff(values) == 0) & (sizes < sizes.max() * (1 - SAME))))


def _at_the_top(values: FloatArray) -> tuple[float, int]:
    """The largest magnitude, and how many readings have it more than have the next."""
    sizes = np.abs(values)
    limit = float(sizes.max())
    there = sizes >= limit * (1 - SAME)
    rest = sizes[~there]
    below = int(np.count_nonzero(rest >= rest.max() * (1 - SAME))) if len(rest) else 0
    return limit, int(np.count_nonzero(there)) - below


def _twice(new: FloatArray, references: Sequence[FloatArray]) -> Found | None:
    """Repeated samples that are scattered: a sensor at rest for a while has not lost samples."""
    repeated = _repeats(new)
    usual = max(float(_begun(_repeats(readings)).mean()) for readings in references) * len(repeated)
    begun = int(_begun(repeated).sum())
    if not _unusual(begun, usual) or repeated.sum() > LONG_RUNS * begun or not _catches_up(new, repeated):
        return None
    fraction = (float(repeated.sum()) - usual) / len(repeated)
    return tuple(range(new.shape[1])), {"fraction": fraction}


def _catches_up(values: FloatArray, repeated: Mask) -> bool:
    """After samples were lost, a reading steps as far as ever, or further; where play held it, it begins to move."""
    sizes = np.abs(np.diff(values, axis=0)).sum(axis=1)[1:]
    after = repeated[:-1] & ~repeated[1:]
    other = ~repeated[:-1] & ~repeated[1:]
    return bool(np.median(sizes[after]) > CATCHES_UP * np.median(sizes[other])) if after.any() and other.any() else True


def _repeats(values: FloatArray) -> Mask:
    return np.asarray((np.diff(values, axis=0) == 0).all(axis=1), dtype=np.bool_)


def _begun(repeated: Mask) -> Mask:
    """Where repeats begin, one after the other counted once."""
    return np.asarray(repeated & ~np.concatenate([[False], repeated[:-1]]), dtype=np.bool_)


def _unusual(count: int, usual: float) -> bool:
    return (
        count >= READINGS_LEAST
        and count > READINGS_FACTOR * usual
        and count > usual + READINGS_DEVIATIONS * np.sqrt(usual)
    )


def _where(found: Mapping[int, float], everywhere: bool, width: int, name: str) -> Found | None:
    """found: by channel. Where not all channels have the same, that with most of it is meant."""
    if not found:
        return None
    most = max(found, key=lambda channel: found[channel])
    return tuple(range(width)) if everywhere else (most,), {name: found[most]}
