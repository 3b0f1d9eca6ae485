"""Coupling onset: the frequency from which driving one axis moves the others, by a stated rule, with its interval.

Rule: the lowest frequency at which the worst coupling of the smoothed response, averaged over a twelfth of an octave,
passes a quarter (-12 dB). A single line above it may be noise; a resonance like the published one near 11 Hz, which
couples over an eighth of an octave, must be found. The average is used rather than "stays above for n lines": noise
interrupts a run of lines, which put the onset 0.1 to 0.3 Hz too high in trials.
"""

from dataclasses import dataclass

import numpy as np
from scipy.special import ndtr, ndtri

from equalizer.identification.frequency_response.coupling import compute_worst_coupling, require_square_response
from equalizer.identification.frequency_response.frequency_response import FrequencyResponse
from equalizer.identification.frequency_response.local_polynomial import LocalPolynomial
from equalizer.signals.signal import BoolArray, ComplexArray, FloatArray

_SMOOTHING_ORDER = 2
"""Order of the local polynomials by which the response is smoothed. Chosen."""
_HIGHEST_RESAMPLED_RATIO = 1.5
"""Frequency up to which the resampled curves are computed, relative to the onset. Chosen: a drawn onset above it counts
as the highest frequency."""


@dataclass(frozen=True, slots=True)
class OnsetRule:
    """Rule that defines the coupling onset, and the bootstrap of its interval."""

    threshold: float = 0.25
    """Threshold of the coupling: off-axis over on-axis response of the worst axis."""
    averaged_octaves: float = 1 / 12
    """Width of the running average, in octaves."""
    neighbours: int = 8
    """Number of lines on either side that the smoothing uses. Chosen."""
    draws: int = 200
    """Number of draws of the bootstrap. Chosen."""
    seed: int = 1
    """Random seed of the bootstrap."""

    @property
    def sentence(self) -> str:
        """Definition of the onset in words for reports, with width and threshold; a clause without a full stop."""
        return (
            f"lowest frequency at which the worst ratio of acceleration across to acceleration along, averaged over "
            f"1/{1 / self.averaged_octaves:.3g} octave, passes {100 * self.threshold:g} %"
        )


@dataclass(frozen=True, slots=True)
class CouplingOnset:
    """Coupling onset of a frequency response with its confidence interval."""

    frequency_hz: float | None
    """Onset; None: the averaged coupling does not exceed the threshold at any line above the noise."""
    interval_hz: tuple[float, float] | None
    """95 % interval, from resampled noise plus half a line on either side for the line spacing; None without an onset,
    or where the noise is not known."""
    is_at_lowest_line: bool
    """Whether the averaged coupling exceeds the threshold at the lowest line above the noise: the onset may lie
    below."""
    threshold: float
    """Threshold of the coupling: off-axis over on-axis response."""
    rule: str
    """Definition of the onset in words, `OnsetRule.sentence`."""


def find_coupling_onset(response: FrequencyResponse, rule: OnsetRule | None = None) -> CouplingOnset:
    """Find the frequency from which driving one axis moves the others. response: as estimated, not smoothed yet, with
    inputs and outputs in one frame. rule: None = the default. Raises ValueError if the response is not square, has too
    few reliable lines for the smoothing, or none at which the noise is small compared with the threshold."""
    rule = rule or OnsetRule()
    require_square_response(response.response)
    lines = response.select_lines(response.reliable)
    smoother = LocalPolynomial.from_response(lines, rule.neighbours, _SMOOTHING_ORDER)
    smoothed_response = smoother.apply(lines.response)
    is_above_noise = _mark_lines_above_noise(lines, smoother, smoothed_response, rule)
    if not is_above_noise.any():
        raise ValueError(
            f"coupling cannot be judged: at no line is the noise small compared with {100 * rule.threshold:g} % of "
            "the response; record more periods, or with a stronger excitation"
        )
    onset_hz = _find_onset(
        lines.frequency_hz[is_above_noise], compute_worst_coupling(smoothed_response[is_above_noise]), rule
    )
    if onset_hz is None:
        return CouplingOnset(None, None, False, rule.threshold, rule.sentence)
    is_near_onset = lines.frequency_hz <= max(
        _HIGHEST_RESAMPLED_RATIO * onset_hz, lines.frequency_hz[2 * rule.neighbours]
    )
    is_noise_known = bool(np.isfinite(lines.noise_variance).all())
    drawn_onsets_hz = (
        _bootstrap_onsets(
            lines.select_lines(is_near_onset), smoothed_response[is_near_onset], is_above_noise[is_near_onset], rule
        )
        if is_noise_known
        else None
    )
    interval_hz = (
        None
        if drawn_onsets_hz is None
        else _widen_by_resolution(
            _compute_bias_corrected_interval(onset_hz, drawn_onsets_hz), lines.frequency_hz, onset_hz
        )
    )
    return CouplingOnset(
        onset_hz, interval_hz, bool(onset_hz == lines.frequency_hz[is_above_noise][0]), rule.threshold, rule.sentence
    )


def _mark_lines_above_noise(
    lines: FrequencyResponse, smoother: LocalPolynomial, smoothed_response: ComplexArray, rule: OnsetRule
) -> BoolArray:
    """Mark the lines (lines,) at which the smoothed noise, over the on-axis response, is below a quarter of the
    threshold; elsewhere noise alone may pass it. Unknown noise counts as none."""
    noise_sd = np.sqrt(np.nan_to_num(smoother.propagate_variance(lines.noise_variance)))
    on_axis_gain = np.maximum(np.einsum("lii->li", np.abs(smoothed_response)), np.finfo(np.float64).tiny)
    is_above_noise: BoolArray = (np.linalg.norm(noise_sd, axis=1) / on_axis_gain).max(axis=1) < rule.threshold / 4
    return is_above_noise


def _find_onset(frequency_hz: FloatArray, coupling: FloatArray, rule: OnsetRule) -> float | None:
    """Find the frequency (Hz) at which the running mean of the coupling first exceeds the threshold; None where it
    never does."""
    mean_coupling = _average_over_octaves(frequency_hz, coupling, rule.averaged_octaves)
    lines_above = np.flatnonzero(mean_coupling > rule.threshold)
    return (
        _interpolate_crossing(frequency_hz, mean_coupling, int(lines_above[0]), rule.threshold)
        if len(lines_above)
        else None
    )


def _average_over_octaves(frequency_hz: FloatArray, coupling: FloatArray, octaves: float) -> FloatArray:
    """Average the coupling (lines,) over the lines within half of `octaves` to either side of each line."""
    first_lines = np.searchsorted(frequency_hz, frequency_hz * 2 ** (-octaves / 2))
    stop_lines = np.searchsorted(frequency_hz, frequency_hz * 2 ** (octaves / 2), side="right")
    cumulative_coupling = np.concatenate([[0.0], np.cumsum(coupling)])
    mean_coupling: FloatArray = (cumulative_coupling[stop_lines] - cumulative_coupling[first_lines]) / (
        stop_lines - first_lines
    )
    return mean_coupling


def _interpolate_crossing(frequency_hz: FloatArray, coupling: FloatArray, first_above: int, threshold: float) -> float:
    """Interpolate the frequency (Hz) of the crossing between the last line below the threshold and the first above; the
    lowest frequency where that is the first line."""
    if first_above == 0:
        return float(frequency_hz[0])
    coupling_below, coupling_above = coupling[first_above - 1], coupling[first_above]
    crossing_share = (threshold - coupling_below) / (coupling_above - coupling_below)
    return float(
        frequency_hz[first_above - 1] + crossing_share * (frequency_hz[first_above] - frequency_hz[first_above - 1])
    )


def _bootstrap_onsets(
    lines: FrequencyResponse, smoothed_response: ComplexArray, is_above_noise: BoolArray, rule: OnsetRule
) -> FloatArray:
    """Draw onsets (draws,), in Hz, of a parametric bootstrap: noise of the measured variance is added to the smoothed
    curve. A curve without an onset counts as its highest frequency."""
    smoother = LocalPolynomial.from_response(lines, rule.neighbours, _SMOOTHING_ORDER)
    component_sd = np.sqrt(lines.noise_variance / 2)
    generator = np.random.default_rng(rule.seed)
    onsets_hz = []
    for _ in range(rule.draws):
        noise = generator.standard_normal((2, *component_sd.shape)) * component_sd
        noisy_response = smoothed_response + smoother.apply(noise[0] + 1j * noise[1])
        onset_hz = _find_onset(
            lines.frequency_hz[is_above_noise], compute_worst_coupling(noisy_response[is_above_noise]), rule
        )
        onsets_hz.append(float(lines.frequency_hz[-1]) if onset_hz is None else onset_hz)
    return np.array(onsets_hz)


def _widen_by_resolution(
    interval_hz: tuple[float, float], frequency_hz: FloatArray, onset_hz: float
) -> tuple[float, float]:
    """Widen an interval by half the line spacing at the onset on either side."""
    line_above = int(np.clip(np.searchsorted(frequency_hz, onset_hz), 1, len(frequency_hz) - 1))
    half_spacing_hz = float(frequency_hz[line_above] - frequency_hz[line_above - 1]) / 2
    return interval_hz[0] - half_spacing_hz, interval_hz[1] + half_spacing_hz


def _compute_bias_corrected_interval(onset_hz: float, drawn_onsets_hz: FloatArray) -> tuple[float, float]:
    """Compute the bias-corrected 95 % percentile interval (Efron 1981), because noise lets a curve pass the threshold
    earlier."""
    share_below = np.clip(
        np.mean(drawn_onsets_hz < onset_hz), 0.5 / len(drawn_onsets_hz), 1 - 0.5 / len(drawn_onsets_hz)
    )
    low_hz, high_hz = np.quantile(drawn_onsets_hz, ndtr(2 * ndtri(share_below) + ndtri(np.array([0.025, 0.975]))))
    return float(low_hz), float(high_hz)
