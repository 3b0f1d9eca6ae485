"""Detection of sensor faults without a model: quantization, clipping (saturation), lost samples (repeated readings).

A healthy device also repeats readings and has a largest one. Reference recordings of the device without the fault
therefore give the usual count of such readings, which a fault must exceed significantly (`_unusual`).
"""

from collections.abc import Mapping, Sequence

import numpy as np

from analysis.diagnosis.errors.hypothesis import Claim, Hypothesis, Spread, hypothesis_of_claim
from analysis.diagnosis.settings import READINGS_DEVIATIONS, READINGS_FACTOR, READINGS_LEAST, STEP_FACTOR
from analysis.diagnosis.types import Mask
from equalizer.effects.effect import Effect, Values
from equalizer.effects.starts.lattice import confirm_lattice_step, lattice_step
from equalizer.signals.recording import Recording
from equalizer.signals.signal import FloatArray

ALIKE = 1e-3
"""Relative difference of the quantization steps of two channels up to which they count as equal."""
LONG_RUNS = 2.0
"""Largest mean length in samples of runs of repeats that are taken for lost samples, as with half of all samples lost
at random: longer runs are backlash, or a sensor at rest."""
CATCHES_UP = 0.75
"""Least median step after a repeat, relative to the median of the other steps: after backlash it is half of that or
less."""
STRETCHES = 3
"""Number of stretches into which each reference recording is divided: the largest share of any stretch is usual."""
SAME = 1e-9
"""Relative difference up to which readings count as equal to a limit."""


def find_sensor_faults(
    recordings: Sequence[Recording], clean: Sequence[Recording], effects: Sequence[Effect]
) -> tuple[Hypothesis, ...]:
    """The first fault of quantization, clipping and lost samples that is found: at most one hypothesis, because
    quantized readings also repeat and accumulate at the largest value. clean: reference recordings, at least one;
    effects: those that may be named."""
    known = {effect.name: effect for effect in effects}
    new = _readings(recordings)
    references = [
        part for recording in clean for part in np.array_split(_readings([recording]), STRETCHES) if len(part)
    ]
    for name, look in (
        ("quantization", _quantization),
        ("sensor_clipping", _find_clipping),
        ("lost_samples", _lost_samples),
    ):
        found = look(new, references)
        if found is not None:
            return (_hypothesis_of(known[name], *found),) if name in known else ()
    return ()


Found = tuple[tuple[int, ...], Values]
"""Channels, and the parameters of their fault."""


def _hypothesis_of(effect: Effect, channels: tuple[int, ...], values: Values) -> Hypothesis:
    """The hypothesis that these channels have the fault, with the same values."""
    spread: Spread = "all" if len(channels) > 1 else "one"
    return hypothesis_of_claim(Claim(effect, spread, channels), [values])


def _readings(recordings: Sequence[Recording]) -> FloatArray:
    """(n, p): responses of all recordings, one after another, without samples in which a channel is missing."""
    samples = np.vstack([recording.response.samples for recording in recordings])
    return np.asarray(samples[np.isfinite(samples).all(axis=1)])


def _quantization(new: FloatArray, references: Sequence[FloatArray]) -> Found | None:
    """Quantization: readings lie on a lattice whose step is more than `STEP_FACTOR` times that of every reference."""
    found = {}
    for c in range(new.shape[1]):
        step = lattice_step(new[:, c])
        if step is not None and all(
            step > STEP_FACTOR * confirm_lattice_step(readings[:, c], step) for readings in references
        ):
            found[c] = step
    alike = bool(found) and min(found.values()) > (1 - ALIKE) * max(found.values())
    return _choose_channels(found, alike and len(found) == new.shape[1], new.shape[1], "step")


def _find_clipping(new: FloatArray, references: Sequence[FloatArray]) -> Found | None:
    """Clipping: significantly more readings at the largest magnitude than in the references, which exceed that
    magnitude, and no more repeats below it than usual."""
    found = {}
    for c in range(new.shape[1]):
        limit, count = _top_readings(new[:, c])
        usual = max(_top_readings(readings[:, c])[1] / len(readings) for readings in references) * len(new)
        beyond = max(float(np.abs(readings[:, c]).max()) for readings in references)
        elsewhere = max(_repeats_below_top(readings[:, c]) / len(readings) for readings in references) * len(new)
        if limit < beyond and _unusual(count, usual) and not _unusual(_repeats_below_top(new[:, c]), elsewhere):
            found[c] = limit
    within = bool(found) and bool(np.all(np.abs(new) <= max(found.values()) * (1 + SAME)))
    return _choose_channels(found, within, new.shape[1], "limit")


def _repeats_below_top(values: FloatArray) -> int:
    """Number of repeated readings below the largest magnitude of one channel: backlash holds readings at any level,
    clipping at the limit only."""
    sizes = np.abs(values[1:])
    return int(np.count_nonzero((np.diff(values) == 0) & (sizes < sizes.max() * (1 - SAME))))


def _top_readings(values: FloatArray) -> tuple[float, int]:
    """The largest magnitude of one channel, and the number of readings there less the number at the next smaller
    magnitude."""
    sizes = np.abs(values)
    limit = float(sizes.max())
    there = sizes >= limit * (1 - SAME)
    rest = sizes[~there]
    below = int(np.count_nonzero(rest >= rest.max() * (1 - SAME))) if len(rest) else 0
    return limit, int(np.count_nonzero(there)) - below


def _lost_samples(new: FloatArray, references: Sequence[FloatArray]) -> Found | None:
    """Lost samples: significantly more runs of repeats than in the references, short and followed by a full step. The
    parameter is the share of lost samples. A sensor that rests for a while has not lost samples."""
    repeated = _repeats(new)
    usual = max(float(_run_starts(_repeats(readings)).mean()) for readings in references) * len(repeated)
    begun = int(_run_starts(repeated).sum())
    if not _unusual(begun, usual) or repeated.sum() > LONG_RUNS * begun or not _catches_up(new, repeated):
        return None
    fraction = (float(repeated.sum()) - usual) / len(repeated)
    return tuple(range(new.shape[1])), {"fraction": fraction}


def _catches_up(values: FloatArray, repeated: Mask) -> bool:
    """Whether the median step after a repeat is about as large as the other steps, as after lost samples; after
    backlash it is smaller."""
    sizes = np.abs(np.diff(values, axis=0)).sum(axis=1)[1:]
    after = repeated[:-1] & ~repeated[1:]
    other = ~repeated[:-1] & ~repeated[1:]
    return bool(np.median(sizes[after]) > CATCHES_UP * np.median(sizes[other])) if after.any() and other.any() else True


def _repeats(values: FloatArray) -> Mask:
    """(n - 1,): whether all channels repeat the reading before."""
    return np.asarray((np.diff(values, axis=0) == 0).all(axis=1), dtype=np.bool_)


def _run_starts(repeated: Mask) -> Mask:
    """(n - 1,): mask of the first repeat of each run."""
    return np.asarray(repeated & ~np.concatenate([[False], repeated[:-1]]), dtype=np.bool_)


def _unusual(count: int, usual: float) -> bool:
    """Whether a count exceeds the usual one by a factor and by several standard deviations of a Poisson count,
    sqrt(usual)."""
    return (
        count >= READINGS_LEAST
        and count > READINGS_FACTOR * usual
        and count > usual + READINGS_DEVIATIONS * np.sqrt(usual)
    )


def _choose_channels(found: Mapping[int, float], everywhere: bool, width: int, name: str) -> Found | None:
    """The channels with the fault: all, or only the one with the largest parameter. found: parameter by channel;
    everywhere: whether all channels have the fault; name: name of the parameter."""
    if not found:
        return None
    most = max(found, key=lambda channel: found[channel])
    return tuple(range(width)) if everywhere else (most,), {name: found[most]}
