"""Spectral lines of a periodic recording: which are driven, which are silent, and whether their power exceeds the
noise.

A linear device responds on driven lines only. Where all driven lines are odd multiples of one line, odd distortion
falls on odd lines and even distortion on even ones (Schoukens, Vaes and Pintelon, IEEE Control Systems 36 (2016), 38).
The driven lines are found in the recorded excitation or command, so that any multisine with silent lines is suitable.

Lines are tested in octaves that begin at powers of 2 Hz, the same for all recordings, so that results of different
recordings can be compared band by band. The ratio of the power on silent lines to that of the noise is F-distributed.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.special import fdtrc

from analysis.diagnosis.types import Mask
from equalizer.signals.signal import ComplexArray, FloatArray

Band = tuple[float, float]
"""Lower edge (Hz), included, and upper edge (Hz), excluded."""
_SILENT_SHARE = 3e-3
"""Largest amplitude of a silent line, relative to the strongest line of its input, or to a tenth of the strongest of
all inputs if that is more. Chosen by hand."""
_DRIVEN_SHARE = 0.01
"""Least power of a driven input, relative to the strongest. Chosen by hand."""
_MAX_INCONCLUSIVE_CHANGES = 16
"""Number of changes of a command up to which the length of its zero-order hold is not estimated. Chosen by hand."""
_SMALLEST_POSITIVE = np.finfo(np.float64).tiny  # least noise power of a line, against division by zero
_MAX_F_RATIO = 1e300
"""Upper limit of an F ratio: SciPy returns NaN for infinity."""


@dataclass(frozen=True, slots=True, eq=False)
class DetectionLines:
    """Driven lines and the silent ones between them, as masks (lines,); row 0 is line 1, the inverse of the period."""

    driven: Mask
    """Lines that the excitation drives, of any input."""
    odd: Mask
    """Silent lines that only odd distortion reaches."""
    even: Mask
    """Silent lines that only even distortion reaches."""
    either: Mask
    """Silent lines that odd and even distortion reach, because even lines were driven, too, or a single line was."""
    step: int
    """Greatest common divisor of the driven lines' numbers: lines between its multiples detect noise only."""

    @property
    def has_silent(self) -> bool:
        """Whether there is a silent line that distortion would reach."""
        return bool((self.odd | self.even | self.either).any())


def find_detection_lines(excitation: ComplexArray, hold_samples: int = 1) -> DetectionLines | None:
    """Find the driven lines of a periodic excitation, and the silent lines on which distortion appears; None where no
    line is driven.

    excitation: (lines, inputs), spectrum of one period, line k in row k - 1. hold_samples: samples for which each value
    of the command is held (zero-order hold); above half of its update rate there are only images, which do not count as
    driven.
    """
    amplitude = np.abs(excitation)
    amplitude[(len(amplitude) + 1) // hold_samples :] = 0
    largest_amplitude = amplitude.max()
    if largest_amplitude == 0:
        return None
    driven = np.asarray(
        (amplitude > _SILENT_SHARE * np.maximum(amplitude.max(axis=0), 0.1 * largest_amplitude)).any(axis=1)
    )
    line_numbers = np.arange(1, len(driven) + 1)
    step = int(np.gcd.reduce(line_numbers[driven]))
    lowest, highest = line_numbers[driven][[0, -1]]
    silent_lines = ~driven & (line_numbers >= lowest) & (line_numbers <= highest) & (line_numbers % step == 0)
    multiples = line_numbers // step
    odd_only = bool((multiples[driven] % 2 == 1).all()) and highest > lowest
    no_lines = np.zeros(len(driven), dtype=np.bool_)
    if not odd_only:
        return DetectionLines(driven, no_lines, no_lines, np.asarray(silent_lines), step)
    return DetectionLines(
        driven,
        np.asarray(silent_lines & (multiples % 2 == 1)),
        np.asarray(silent_lines & (multiples % 2 == 0)),
        no_lines,
        step,
    )


def compute_hold_samples(command: npt.NDArray[np.float64]) -> int:
    """Compute the length of the command's zero-order hold in samples: the greatest common divisor of the distances
    between its changes; 1 where it changes at most `_MAX_INCONCLUSIVE_CHANGES` times. command: (n, inputs)."""
    change_indices = np.flatnonzero(np.any(np.diff(command, axis=0) != 0, axis=1))
    return int(np.gcd.reduce(np.diff(change_indices))) if len(change_indices) > _MAX_INCONCLUSIVE_CHANGES else 1


def list_octaves(from_hz: float, to_hz: float) -> tuple[Band, ...]:
    """List all octaves [2^k, 2^(k+1)) Hz that overlap the closed interval from `from_hz` to `to_hz`, both positive; an
    upper end at 2^k therefore adds the octave from 2^k. Ends within 1e-9 octaves of 2^k count as 2^k (rounding)."""
    first_power = int(np.floor(np.log2(from_hz) + 1e-9))
    last_power = int(np.floor(np.log2(to_hz) + 1e-9))
    return tuple((2.0**power, 2.0 ** (power + 1)) for power in range(first_power, last_power + 1))


def select_lines_in_band(frequency_hz: FloatArray, band_hz: Band) -> Mask:
    """Mask (lines,) of the lines within the band: lower edge included, upper edge excluded, apart from rounding."""
    return np.asarray((frequency_hz >= band_hz[0] * (1 - 1e-9)) & (frequency_hz < band_hz[1] * (1 - 1e-9)))


def find_driven_inputs(power: FloatArray, channels: tuple[str, ...]) -> tuple[str, ...]:
    """Find the names of the inputs that were driven in a segment: those with more than `_DRIVEN_SHARE` of the power of
    the strongest; none without power. power: (inputs,)."""
    if power.max(initial=0.0) == 0:
        return ()
    return tuple(
        name for name, input_power in zip(channels, power, strict=True) if input_power > _DRIVEN_SHARE * power.max()
    )


def compute_noncentral_f_sf(
    ratio: npt.ArrayLike, lines: npt.ArrayLike, freedom: npt.ArrayLike, noncentrality: npt.ArrayLike
) -> FloatArray:
    """Compute the survival function P(F >= ratio) of a noncentral F distribution with d = 2 `lines` and `freedom`
    degrees of freedom, by the central F of equal first two moments (Patnaik, Biometrika 36 (1949) 202): with
    noncentrality c,

        d' = (d + c)² / (d + 2 c),    P(F >= f) = P(F_central(d', freedom) >= f d / (d + c)).

    Exact for c = 0. Chosen over the series because it also holds for noncentralities of millions.
    """
    numerator_freedom = 2 * np.asarray(lines, dtype=np.float64)
    c = np.asarray(noncentrality, dtype=np.float64)
    equivalent_freedom = (numerator_freedom + c) * ((numerator_freedom + c) / (numerator_freedom + 2 * c))
    scaled_ratio = np.asarray(ratio, dtype=np.float64) * numerator_freedom / (numerator_freedom + c)
    return np.asarray(fdtrc(equivalent_freedom, freedom, np.minimum(scaled_ratio, _MAX_F_RATIO)), dtype=np.float64)


def compute_excess_power(power: FloatArray, noise: FloatArray, freedom: float) -> tuple[float, float, float]:
    """Compute the summed power beyond noise, its detection limit (two standard errors of the noise), and the p-value.

    power: p (lines,), squared magnitudes. noise: s (lines,), their expectation without a signal, estimated with
    `freedom` degrees of freedom. Without a signal each p is exponential with mean s, so that the mean of p / s has an F
    distribution with 2 lines and `freedom` degrees of freedom, and the variance of sum(p - s) is sum(s²) + 2 sum(s)² /
    freedom, the second part from the error of s, which all lines share. Returns 0, 0 and 1 without lines, or where the
    noise is not finite.
    """
    if len(power) == 0 or not np.isfinite(noise).all():
        return 0.0, 0.0, 1.0
    ratio = float(np.mean(power / np.maximum(noise, _SMALLEST_POSITIVE)))
    p_value = float(fdtrc(2 * len(power), max(freedom, 1.0), min(ratio, _MAX_F_RATIO)))
    limit = 2 * float(np.sqrt(np.sum(noise**2) + 2 * np.sum(noise) ** 2 / max(freedom, 1.0)))
    return float(np.sum(power - noise)), limit, p_value
