"""Data classes of the noise of a signal's channels: rms, spectrum, and degrees of freedom of the estimates.

Made by `quiet_noise` and `repeat_noise`, and combined by `noise_floor`. Variances are in the channel's unit squared.
"""

from dataclasses import dataclass

from equalizer.signals.signal import FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class SegmentNoise:
    """Variance between the periods of one segment with a periodic excitation."""

    segment: int
    """Index of the segment in the recording."""
    amplitude: float
    """Level of the excitation, in the command's unit."""
    variance: FloatArray
    """(channels,)"""
    freedom: FloatArray
    """(channels,): degrees of freedom of the variance."""
    counted: tuple[bool, ...]
    """Per channel: whether the variance is used for the noise floor."""
    varies: tuple[bool, ...]
    """Per channel: whether the variance is larger than in the quietest segments, so that it contains more than
    noise."""


@dataclass(frozen=True, slots=True, eq=False)
class ChannelNoise:
    """Size, spectrum and uncertainty of the noise of each channel of a signal."""

    rms: FloatArray
    """(channels,): rms of the noise, without the mean; NaN where unknown."""
    density: FloatArray
    """(lines, channels): power density; s² at each line for white noise of variance s². Its mean over lines is rms²;
    the expected power of a line of rfft / n is density / n."""
    freedom: FloatArray
    """(channels,): degrees of freedom of rms²; 0 where unknown."""
    rounding: FloatArray
    """(channels,): part of rms² due to rounding that repeats with the motion: averaging does not lower it."""
    segments: tuple[SegmentNoise, ...] = ()
    """Variances by segment; empty unless measured from repeats."""
    more_than_rest: tuple[bool, ...] = ()
    """Per channel: whether every segment varies by more than the noise at rest, which was then used instead."""
