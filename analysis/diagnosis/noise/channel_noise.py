"""Data classes of the noise of a signal's channels: rms, power spectral density, degrees of freedom of the estimates.

Variances are in the channel's unit squared."""

from dataclasses import dataclass

from equalizer.signals.signal import FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class SegmentNoise:
    """Noise variance of one segment with a periodic excitation, from the differences between its periods."""

    segment: int
    """Index of the segment in the recording."""
    amplitude: float
    """Level of the excitation, in the command's unit."""
    variance: FloatArray
    """(channels,)."""
    freedom: FloatArray
    """(channels,): degrees of freedom of the variance."""
    is_pooled: tuple[bool, ...]
    """Per channel: whether the variance is averaged into the noise floor."""
    varies: tuple[bool, ...]
    """Per channel: whether the variance is significantly larger than in the quietest segments, so that it contains more
    than noise."""


@dataclass(frozen=True, slots=True, eq=False)
class ChannelNoise:
    """Size, spectrum and uncertainty of the noise of each channel of a signal."""

    rms: FloatArray
    """(channels,): rms of the noise, without the mean; NaN where unknown."""
    density: FloatArray
    """(lines, channels): power spectral density; s² at each line for white noise of variance s². Its mean over lines is
    rms²; the expected power of a line of rfft / n is density / n."""
    freedom: FloatArray
    """(channels,): degrees of freedom of rms²; 0 where unknown."""
    rounding: FloatArray
    """(channels,): part of rms² due to quantization that repeats with the motion, so that averaging does not lower
    it."""
    segments: tuple[SegmentNoise, ...] = ()
    """Variances by segment; empty unless measured from repeats."""
    more_than_rest: tuple[bool, ...] = ()
    """Per channel: whether the variance of every segment exceeds the noise at rest, which was then used instead."""
