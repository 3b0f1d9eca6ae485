"""A signal: uniformly sampled channels with sample rate, quantity, unit and channel names. Immutable.
Recordings (`signals.recording`) and feedforward forces (`tracking.feedforward`) consist of signals."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Self, cast

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]
ComplexArray = npt.NDArray[np.complex128]
BoolArray = npt.NDArray[np.bool_]


@dataclass(frozen=True, slots=True, eq=False)
class Signal:
    """Samples with quantity, unit and channel names; the array is read-only, and a copy unless it can never change.
    Raises ValueError for samples that are not (n, channels), numbers of names, units or quantities that do not match
    the channels, and a sample rate that is not a positive number."""

    samples: FloatArray
    """(n, channels): time along the first dimension; NaN is a missing sample, as is one that NumPy's mask hides."""
    sample_rate_hz: float
    quantity: str | tuple[str, ...]
    """One word for all channels ("force", "acceleration", "position", "torque", "angle", ...), or one per channel
    where they differ. Equal words are replaced by a single word: only signals of mixed quantity have a tuple."""
    unit: str | tuple[str, ...]
    """Unit in ASCII: one for all channels, or one per channel where they differ."""
    channels: tuple[str, ...]
    """Channel names."""

    def __post_init__(self) -> None:
        samples = _copy_unless_immutable(self.samples)
        if samples.ndim != 2:
            raise ValueError(f"samples must have shape (n, channels), not {samples.shape}")
        object.__setattr__(self, "channels", collect_names(self.channels))
        if samples.shape[1] != len(self.channels):
            raise ValueError(f"{samples.shape[1]} columns of samples but {len(self.channels)} channel names")
        object.__setattr__(self, "quantity", _fold_equal_words("quantity", self.quantity, len(self.channels)))
        object.__setattr__(self, "unit", _fold_equal_words("unit", self.unit, len(self.channels)))
        if not (np.isfinite(self.sample_rate_hz) and self.sample_rate_hz > 0):
            raise ValueError(f"sample_rate_hz must be a positive number, not {self.sample_rate_hz}")
        object.__setattr__(self, "samples", samples)

    def __len__(self) -> int:
        return int(self.samples.shape[0])

    @property
    def quantities(self) -> tuple[str, ...]:
        """The quantity of each channel."""
        return list_per_channel(self.quantity, len(self.channels))

    @property
    def units(self) -> tuple[str, ...]:
        """The unit of each channel."""
        return list_per_channel(self.unit, len(self.channels))

    @property
    def duration_s(self) -> float:
        """Number of samples over the sample rate, in s: from the first sample to one period after the last."""
        return len(self) / self.sample_rate_hz

    def compute_times_s(self) -> FloatArray:
        """Compute the time (n,) of each sample (s), 0 at the first."""
        return np.arange(len(self), dtype=np.float64) / self.sample_rate_hz

    def select_samples(self, start: int, stop: int) -> Self:
        """Return the signal from sample `start` (included) to `stop` (excluded)."""
        return replace(self, samples=self.samples[start:stop])

    def select_channels(self, channel_indices: Sequence[int]) -> Self:
        """Return the signal with only the channels of these indices, in this order."""
        indices = list(channel_indices)
        return replace(
            self,
            samples=self.samples[:, indices],
            quantity=tuple(self.quantities[k] for k in indices),
            unit=tuple(self.units[k] for k in indices),
            channels=tuple(self.channels[k] for k in indices),
        )


def collect_names(names: str | Sequence[str]) -> tuple[str, ...]:
    """Collect names in a tuple; a single text is one name."""
    return (names,) if isinstance(names, str) else tuple(names)


def list_per_channel(words: str | Sequence[str], channel_count: int) -> tuple[str, ...]:
    """List quantities or units channel by channel. words: a single one for all channels, or one per channel."""
    listed_words = collect_names(words)
    return listed_words * channel_count if len(listed_words) == 1 else listed_words


def _copy_unless_immutable(samples: Any) -> FloatArray:
    """Copy samples of any real type to a contiguous, read-only array; one that has this form already, and whose memory
    no other array can change, is returned itself. Masked samples become NaN."""
    if type(samples) is np.ndarray and samples.dtype == np.float64 and samples.flags.c_contiguous:
        owner: Any = samples
        while isinstance(owner, np.ndarray) and not owner.flags.writeable:
            owner = owner.base
        if owner is None:
            return cast(FloatArray, samples)
    if isinstance(samples, np.ma.MaskedArray):
        samples = np.ma.filled(samples.astype(np.float64), np.nan)
    copy = np.array(samples, dtype=np.float64, order="C")
    copy.flags.writeable = False
    return copy


def _fold_equal_words(field_name: str, words: str | Sequence[str] | None, channel_count: int) -> str | tuple[str, ...]:
    """Reduce equal words to a single one. Raises ValueError for another number of words than channels, or None."""
    if isinstance(words, str):
        return words
    listed_words = () if words is None else tuple(words)
    if len(listed_words) != channel_count:
        raise ValueError(
            f"{len(listed_words)} entries of {field_name} for {channel_count} channels; give one for all, or one per "
            "channel"
        )
    return listed_words[0] if len(set(listed_words)) == 1 else listed_words


def find_runs(mask: npt.NDArray[np.bool_]) -> list[tuple[int, int]]:
    """Find start (included) and stop (excluded) of each run of true values in a mask (n,)."""
    run_edges = np.flatnonzero(np.diff(mask, prepend=False, append=False)).tolist()
    return list(zip(run_edges[::2], run_edges[1::2], strict=True))
