"""Conditions under which the identification of a state-space model is refused; each message states the remedy.

In order: estimates that disagree, a band beyond half the sample rate, inputs without excitation, outputs that are
always zero, a band without lines or with a gap, too much noise, and fewer lines than the order needs. Thresholds are
heuristic.
"""

from collections.abc import Sequence

import numpy as np

from equalizer.identification.frequency_response.frequency_response import FrequencyResponse
from equalizer.identification.state_space.settings import IdentificationSettings
from equalizer.identification.state_space.warped_subspace import choose_horizon
from equalizer.identification.state_space.weighted_lines import WeightedLines, weight_lines

LEAST_SIGNAL_TO_NOISE = 2.0
"""Least ratio of magnitude to standard error of the strongest entry at a typical (median) line, for a single entry;
n entries raise it by the factor sqrt(log(n) + 1), as the largest of them is larger by chance."""
LARGEST_GAP_OCTAVES = 0.1
"""Gap without a line, in octaves, above which a model is refused, if `LARGEST_GAP_SPACINGS` is exceeded too."""
LARGEST_GAP_SPACINGS = 3.0
"""Gap, in median line spacings, above which a model is refused, if `LARGEST_GAP_OCTAVES` is exceeded too."""
SWEEP_START_RATIO, SWEEP_END_RATIO = 1 / 1.1, 1.06
"""Start and end of the sweep that a message suggests, relative to the ends of the band. Chosen."""


class IdentificationError(ValueError):
    """No model can be fitted to the data. The message states the reason and the remedy."""


def require_lines(responses: Sequence[FrequencyResponse], settings: IdentificationSettings) -> WeightedLines:
    """Select and weight the lines of the band and its margin. Raises IdentificationError under the conditions of the
    module docstring."""
    _refuse_mixed_responses(responses)
    high_hz, rate_hz = settings.band_hz[1], responses[0].sample_rate_hz
    if high_hz >= rate_hz / 2:
        raise IdentificationError(
            f"the band ends at {high_hz:g} Hz, but at {rate_hz:g} samples per second nothing is known "
            f"from {rate_hz / 2:g} Hz on; choose a lower end or record faster"
        )
    _refuse_unexcited_inputs(responses, settings)
    _refuse_zero_outputs(responses, settings)
    lines = weight_lines(responses, settings.fitted_hz)
    _refuse_empty_band(responses, lines, settings)
    _refuse_noise(lines, settings)
    _refuse_too_high_an_order(lines, settings)
    return lines


def _refuse_mixed_responses(responses: Sequence[FrequencyResponse]) -> None:
    """Raise IdentificationError without any response, and where sample rate, channels or units differ."""
    if not responses:
        raise IdentificationError("no frequency response was given; estimate one from a recorded sweep first")
    first_response = responses[0]
    for compared_response in responses[1:]:
        for name in ("sample_rate_hz", "input_channels", "output_channels", "input_unit", "output_unit"):
            if getattr(compared_response, name) != getattr(first_response, name):
                raise IdentificationError(
                    f"the records differ in {name} ({getattr(first_response, name)} and "
                    f"{getattr(compared_response, name)}); identify each separately or convert one"
                )


def _refuse_unexcited_inputs(responses: Sequence[FrequencyResponse], settings: IdentificationSettings) -> None:
    """Raise IdentificationError where the response to some inputs, but not to all, is not finite at any line of the
    band."""
    has_response = [
        np.isfinite(estimate.select_band(*settings.band_hz).response).any(axis=(0, 1)) for estimate in responses
    ]
    is_undetermined = ~np.any(has_response, axis=0)
    names = ", ".join(
        name for name, is_missing in zip(responses[0].input_channels, is_undetermined, strict=True) if is_missing
    )
    if names and not is_undetermined.all():
        raise IdentificationError(
            f"the response to {names} is not determined: as many experiments as inputs are needed, "
            f"{len(is_undetermined)} here; record one sweep per input"
        )


def _refuse_zero_outputs(responses: Sequence[FrequencyResponse], settings: IdentificationSettings) -> None:
    """Raise IdentificationError where an output is zero at all lines of the band."""
    band_responses = [np.nan_to_num(estimate.select_band(*settings.band_hz).response) for estimate in responses]
    zero_outputs = ~np.any([(response != 0).any(axis=(0, 2)) for response in band_responses], axis=0)
    names = ", ".join(name for name, is_zero in zip(responses[0].output_channels, zero_outputs, strict=True) if is_zero)
    if names and any(len(response) for response in band_responses):
        raise IdentificationError(f"there is no signal from {names}, not even noise: check the sensor and record again")


def _refuse_empty_band(
    responses: Sequence[FrequencyResponse], lines: WeightedLines, settings: IdentificationSettings
) -> None:
    """Raise IdentificationError without any line to fit, and for a gap (`_refuse_gap`). The message suggests a
    sweep."""
    low_hz, high_hz = settings.band_hz
    measured_count = sum(len(estimate.select_band(low_hz, high_hz)) for estimate in responses)
    if not len(lines):
        reasons = "; ".join(dict.fromkeys(remark for estimate in responses for remark in estimate.remarks))
        problem = "none of its lines is reliable" if measured_count else "no line was excited there"
        raise IdentificationError(
            f"no data in {low_hz:g} to {high_hz:g} Hz: {problem}{f' ({reasons})' if reasons else ''}; "
            f"record {_describe_sweep(settings)}"
        )
    _refuse_gap(lines, settings)


def _describe_sweep(settings: IdentificationSettings) -> str:
    low_hz, high_hz = settings.band_hz
    return f"a sweep from {low_hz * SWEEP_START_RATIO:.3g} to {high_hz * SWEEP_END_RATIO:.3g} Hz"


def _refuse_gap(lines: WeightedLines, settings: IdentificationSettings) -> None:
    """Raise IdentificationError for a gap wider than `LARGEST_GAP_OCTAVES` and `LARGEST_GAP_SPACINGS`, in which the
    data do not determine the model. The message suggests a sweep."""
    low_hz, high_hz = settings.band_hz
    edges_hz = np.clip(np.concatenate([[low_hz], lines.frequency_hz, [high_hz]]), low_hz, high_hz)
    gap_octaves, gap_hz = np.diff(np.log2(edges_hz)), np.diff(edges_hz)
    median_spacing_hz = float(np.median(np.diff(lines.frequency_hz))) if len(lines) > 1 else 0.0
    widest_index = int(np.argmax(gap_octaves))
    if (
        gap_octaves[widest_index] <= LARGEST_GAP_OCTAVES
        or gap_hz[widest_index] <= LARGEST_GAP_SPACINGS * median_spacing_hz
    ):
        return
    below_hz, above_hz = edges_hz[widest_index], edges_hz[widest_index + 1]
    covered_low_hz, covered_high_hz = max(
        (low_hz, below_hz), (above_hz, high_hz), key=lambda side: float(side[1] / side[0])
    )
    raise IdentificationError(
        f"between {below_hz:.3g} and {above_hz:.3g} Hz no line can be used, but the band is {low_hz:g} to {high_hz:g} "
        f"Hz; record {_describe_sweep(settings)}, or choose a band that the lines cover "
        f"({covered_low_hz:.3g} to {covered_high_hz:.3g} Hz)"
    )


def _refuse_noise(lines: WeightedLines, settings: IdentificationSettings) -> None:
    """Raise IdentificationError where the median line does not exceed its noise by `LEAST_SIGNAL_TO_NOISE`."""
    strongest_ratios = (lines.weight * np.abs(lines.response)).max(axis=(1, 2))
    median_ratio = float(np.median(strongest_ratios))
    if median_ratio < LEAST_SIGNAL_TO_NOISE * np.sqrt(np.log(lines.response[0].size) + 1):
        low_hz, high_hz = settings.band_hz
        raise IdentificationError(
            f"the band {low_hz:g} to {high_hz:g} Hz contains only noise: its typical line is {median_ratio:.1f} times "
            "the noise; excite it more strongly or for longer (twice the time gives 3 dB)"
        )


def _refuse_too_high_an_order(lines: WeightedLines, settings: IdentificationSettings) -> None:
    """Raise IdentificationError for fewer lines than the unknowns, or the subspace method's block rows, need."""
    p, m = lines.response.shape[1:]
    n = settings.order
    unknowns = n * (p + m) + p * m
    block_rows = choose_horizon(n, p) + max(settings.longer_horizons)
    least_line_count = max(-(-unknowns // (p * m)), -(-block_rows * (p + m) // (2 * m)))
    if len(lines) < least_line_count:
        spacing_hz = (lines.frequency_hz[-1] - lines.frequency_hz[0]) / max(len(lines) - 1, 1)
        advice = f", or record longer periods (now {1 / spacing_hz:.3g} s)" if spacing_hz > 0 else ""
        raise IdentificationError(
            f"order {n} has {unknowns} unknowns and needs at least {least_line_count} lines, but the band holds "
            f"{len(lines)}; choose a lower order{advice}"
        )
