"""Consistency of measured positions, velocities and accelerations, and lags between channels of the same quantity.

An acceleration should be the second derivative of the position that was recorded with it. The check differentiates one
channel by central differences and estimates gain and lag of the other against it over the coherent spectral lines: a
gain other than 1 indicates a wrong unit or sign, a lag indicates a filter or a delay.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from analysis.look.channels import Channel, Stretch
from analysis.look.check import Check
from analysis.look.cross_spectra import CrossSpectra, estimate_cross_spectra
from analysis.look.gain_and_lag import GainAndLag, estimate_gain_and_lag
from analysis.wording import typeset
from equalizer.signals.signal import FloatArray

KINEMATICS, LAGS = "derivatives", "lag between channels"
_DERIVATIVE_ORDER = {"m": 0, "m/s": 1, "m/s^2": 2, "rad": 0, "rad/s": 1, "rad/s^2": 2}
"""Order of the time derivative of position or angle, by unit."""
_DERIVATIVE_NAMES = {1: "the derivative", 2: "the second derivative"}
LEAST_COHERENT_SHARE = 0.3
"""Least coherent share of a channel's power; below it, the channel measures a different motion and is not compared.
Chosen, as are the limits below."""
SAME_QUANTITY_SHARE, SAME_QUANTITY_SPREAD = 0.8, 0.2
"""Least coherent share, and largest spread of the ratio, of two channels that measure the same quantity."""
LARGEST_GAIN_ERROR, WRONG_GAIN_ERROR = 0.05, 0.2
"""Deviation of the gain's magnitude from 1 above which it is reported (also the tolerance for factors of unit errors),
and above which it counts as wrong, unless a lag indicates a filter."""
LARGEST_LAG_SAMPLES = 0.6
"""Largest lag (samples) that is not reported: a zero-order hold of the force delays the acceleration by half a sample,
and a backward difference delays a derivative by as much."""
_FILTER_ADVICE = (
    "It is delayed as well as smaller, as by a sensor's filter or a flexible part between both: model this, or "
    "compare the channels only below its corner frequency. A wrong unit or factor would cause no delay."
)
"""Advice where a gain below 1 comes with a lag."""
_UNIT_ERROR_FACTORS = (
    (1000.0, "mm taken for m, or ms for s"), (180 / np.pi, "degrees taken for radians"), (9.80665, "g for m/s^2"),
    (2 * np.pi, "turns taken for radians, or Hz for rad/s"), (60.0, "per minute taken for per second"),
    (30 / np.pi, "rpm taken for rad/s"), (25.4, "inches for millimetres"), (1 / 0.0254, "inches for metres"),
    (1 / 0.3048, "feet for metres"), (2.0, "a range or a count that is wrong by a factor of two"),
)  # fmt: skip
"""Factors of common unit errors, and their descriptions."""


@dataclass(frozen=True, slots=True)
class KinematicPair:
    """Two channels of which the second should be the derivative of the first, and how far they agree. The names of the
    fields are keys of the JSON file of `look_at_recordings`."""

    place: str
    """Label of the channel that is differentiated."""
    derivative: str
    """Label of the channel that it is compared with."""
    order: int
    """1: first derivative, 2: second."""
    agreement: GainAndLag
    """Gain and lag of the second channel relative to the derivative of the first."""


def find_kinematic_pairs(
    channels: Sequence[Channel], stretches: Sequence[Stretch], rate_hz: float
) -> tuple[KinematicPair, ...]:
    """Find, for each velocity and acceleration that is no excitation, the channel whose derivative has the largest
    coherent share with it; no pair where that share is below `LEAST_COHERENT_SHARE`. Constant channels are left out."""
    varying_channels = [
        channel
        for channel in channels
        if channel.unit in _DERIVATIVE_ORDER and channel.finite_samples.size and np.ptp(channel.finite_samples) > 0
    ]
    return tuple(
        pair
        for higher_channel in varying_channels
        if (pair := _find_best_pair(higher_channel, varying_channels, stretches, rate_hz))
    )


def _find_best_pair(
    higher_channel: Channel, varying_channels: Sequence[Channel], stretches: Sequence[Stretch], rate_hz: float
) -> KinematicPair | None:
    """Find the pair of `higher_channel` and the varying channel whose derivative agrees best with it; None where
    none does, and for an excitation."""
    pairs = []
    for lower_channel in varying_channels:
        order = _DERIVATIVE_ORDER[higher_channel.unit] - _DERIVATIVE_ORDER[lower_channel.unit]
        if (
            order > 0
            and higher_channel.unit.startswith(lower_channel.unit.split("/")[0])
            and higher_channel.role != "excitation"
        ):
            agreement = _compare_derivative(lower_channel, higher_channel, order, (stretches, rate_hz))
            if agreement is not None and agreement.coherent_share >= LEAST_COHERENT_SHARE:
                pairs.append(KinematicPair(lower_channel.label, higher_channel.label, order, agreement))
    return max(pairs, key=lambda pair: pair.agreement.coherent_share, default=None)


def _compare_derivative(
    lower_channel: Channel, higher_channel: Channel, order: int, timing: tuple[Sequence[Stretch], float]
) -> GainAndLag | None:
    """Estimate gain and lag of `higher_channel` relative to the derivative of `lower_channel`. timing: stretches, and
    sample rate in Hz. None where no stretch is long enough or no line is coherent."""
    stretches, rate_hz = timing
    differentiated = replace(lower_channel, samples=differentiate(lower_channel.samples, order, rate_hz))
    # The central difference has no value at the first and the last sample of a stretch.
    inner_stretches = [(start + 1, stop - 1) for start, stop in stretches if stop - start > 4]
    spectra = (
        estimate_cross_spectra((differentiated, higher_channel), inner_stretches, rate_hz) if inner_stretches else None
    )
    return estimate_gain_and_lag(spectra, 0, 1, _compute_difference_gain(spectra, order, rate_hz)) if spectra else None


def differentiate(samples: FloatArray, order: int, rate_hz: float) -> FloatArray:
    """Compute the derivative (n,) of samples (n,) by central differences, which have no phase error; NaN at both ends.
    order: 1 or 2."""
    differences = np.full(len(samples), np.nan)
    if order == 1:
        differences[1:-1] = (samples[2:] - samples[:-2]) * (rate_hz / 2)
    else:
        differences[1:-1] = (samples[2:] - 2 * samples[1:-1] + samples[:-2]) * rate_hz**2
    return differences


def _compute_difference_gain(spectra: CrossSpectra, order: int, rate_hz: float) -> FloatArray:
    """Compute the gain (lines,) of central differences relative to the exact derivative, with w = 2 pi f / rate: sin(w)
    / w for the first, (sin(w / 2) / (w / 2))^2 for the second derivative. At least 1e-6, because it is a divisor and
    that of the first derivative is 0 at half the sample rate."""
    angle_rad = 2 * np.pi * spectra.frequency_hz / rate_hz
    gain = np.sin(angle_rad) / angle_rad if order == 1 else (np.sin(angle_rad / 2) / (angle_rad / 2)) ** 2
    return np.maximum(gain, 1e-6)


def check_kinematics(pairs: Sequence[KinematicPair], rate_hz: float) -> tuple[Check, ...]:
    """Check each pair by the sign of the gain, its magnitude and the lag; empty without pairs."""
    return tuple(_check_pair(pair, rate_hz) for pair in pairs)


def _check_pair(pair: KinematicPair, rate_hz: float) -> Check:
    """Check one pair and report the most serious deviation: sign, then gain, then lag."""
    agreement = pair.agreement
    lag_text = _format_lag(agreement.lag_samples, rate_hz)
    finding_text = (
        f"{pair.derivative} is {typeset(f'{agreement.gain:.4g}')} times {_DERIVATIVE_NAMES[pair.order]} of "
        f"{pair.place}{lag_text} "
        f"(lines with {agreement.coherent_share:.0%} of its power)."
    )
    gain_error = abs(abs(agreement.gain) - 1)
    if agreement.gain < 0:
        return Check(
            KINEMATICS, "wrong", finding_text, f"Reverse the sign of one of them{_describe_unit_error(agreement.gain)}."
        )
    if (
        gain_error > WRONG_GAIN_ERROR
        and agreement.gain < 1
        and agreement.lag_samples > LARGEST_LAG_SAMPLES
        and not _describe_unit_error(agreement.gain)
    ):
        return Check(KINEMATICS, "notice", finding_text, _FILTER_ADVICE)
    if gain_error > WRONG_GAIN_ERROR:
        return Check(
            KINEMATICS,
            "wrong",
            finding_text,
            f"Check the units and factors of both{_describe_unit_error(agreement.gain)}.",
        )
    if gain_error > LARGEST_GAIN_ERROR:
        return Check(KINEMATICS, "notice", finding_text, "Check the calibration of both, and filters between them.")
    if abs(agreement.lag_samples) > LARGEST_LAG_SAMPLES:
        return Check(
            KINEMATICS,
            "notice",
            finding_text,
            "A filter or the data transfer delays one of them; correct the time shift, or model it.",
        )
    return Check(KINEMATICS, "fine", finding_text)


def _format_lag(lag_samples: float, rate_hz: float) -> str:
    """Format a lag in ms and samples for a sentence; empty up to `LARGEST_LAG_SAMPLES`."""
    if abs(lag_samples) <= LARGEST_LAG_SAMPLES:
        return ""
    return (
        f", {abs(lag_samples) / rate_hz * 1e3:.3g} ms ({abs(lag_samples):.2g} samples) "
        f"{'later' if lag_samples > 0 else 'earlier'}"
    )


def _describe_unit_error(gain: float) -> str:
    """Describe the unit error that would cause this gain or its reciprocal, within `LARGEST_GAIN_ERROR`; empty where
    none is known."""
    gain_magnitude = abs(gain)
    for unit_factor, description in _UNIT_ERROR_FACTORS:
        if min(abs(gain_magnitude / unit_factor - 1), abs(gain_magnitude * unit_factor - 1)) < LARGEST_GAIN_ERROR:
            return f"; {unit_factor:.4g} is {description}, or the other way round"
    return ""


def check_lags(channels: Sequence[Channel], spectra: CrossSpectra, rate_hz: float) -> tuple[Check, ...]:
    """Check the lags between channels that measure the same quantity, such as a command and its measurement or two
    sensors of one motion; a single "fine" check where there are none."""
    checks = tuple(_generate_lag_checks(channels, spectra, rate_hz))
    return checks or (Check(LAGS, "fine", "No two channels measure the same quantity, so no lag can be measured."),)


def _generate_lag_checks(channels: Sequence[Channel], spectra: CrossSpectra, rate_hz: float) -> Iterator[Check]:
    """Generate a check for every two channels of the same unit with a nearly constant gain (`SAME_QUANTITY_SHARE`,
    `SAME_QUANTITY_SPREAD`), except a command and an excitation."""
    for first_index, second_index in combinations(range(len(channels)), 2):
        first_channel, second_channel = channels[first_index], channels[second_index]
        if first_channel.unit != second_channel.unit or {first_channel.role, second_channel.role} == {
            "command",
            "excitation",
        }:
            continue
        agreement = estimate_gain_and_lag(spectra, first_index, second_index)
        if (
            agreement is None
            or agreement.coherent_share < SAME_QUANTITY_SHARE
            or agreement.gain_spread > SAME_QUANTITY_SPREAD
        ):
            continue
        lag_text = _format_lag(agreement.lag_samples, rate_hz)
        finding_text = (
            f"{second_channel.label} is {typeset(f'{agreement.gain:.4g}')} times {first_channel.label}"
            f"{lag_text or ', at the same time'}."
        )
        advice = "Shift the later one, or model what delays it." if lag_text else ""
        yield Check(LAGS, "notice" if lag_text else "fine", finding_text, advice)
