"""The noise of a signal's channels, as a value."""

from dataclasses import dataclass

from equalizer.signals.signal import FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class SegmentNoise:
    """What differs between the periods of one segment."""

    segment: int
    amplitude: float
    variance: FloatArray
    """(channels,)"""
    freedom: FloatArray
    """(channels,): degrees of freedom of the variance."""
    counted: tuple[bool, ...]
    """Per channel: whether it is part of the noise floor."""
    varies: tuple[bool, ...]
    """Per channel: larger than in the quietest segments, so there is more than noise in it."""


@dataclass(frozen=True, slots=True, eq=False)
class ChannelNoise:
    rms: FloatArray
    """(channels,): without the mean; NaN where unknown."""
    density: FloatArray
    """(lines, channels): white noise of variance s² has s² at each line. Its mean over lines is rms²; what a line of
    rfft / n is expected to hold is density / n."""
    freedom: FloatArray
    """(channels,): degrees of freedom of rms²; 0 where unknown."""
    rounding: FloatArray
    """(channels,): part of rms² that repeats because values are rounded: averaging does not lower it."""
    segments: tuple[SegmentNoise, ...] = ()
    """Empty unless measured from repeats."""
    more_than_rest: tuple[bool, ...] = ()
    """Per channel, from repeats: every segment differs between periods by more than rest, whose noise was taken."""
