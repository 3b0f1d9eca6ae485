"""Coupling onset: the frequency from which driving one axis moves the others, by a stated rule, with its interval.

Rule: the lowest frequency at which the worst coupling of the smoothed response, averaged over a twelfth of an octave,
passes a quarter (-12 dB). A single line above is noise; a resonance like the published one near 11 Hz, which couples
over an eighth of an octave, is what the rule is to find. The average is used rather than "stays above for n lines":
noise interrupts a run of lines, which put the onset 0.1 to 0.3 Hz too high in trials.
"""

from dataclasses import dataclass

import numpy as np
from scipy.special import ndtr, ndtri

from equalizer.identification.frequency_response.coupling import compute_worst_coupling, require_square_response
from equalizer.identification.frequency_response.frequency_response import BoolArray, FrequencyResponse
from equalizer.identification.frequency_response.local_polynomial import LocalPolynomial
from equalizer.signals.signal import ComplexArray, FloatArray

_HIGHEST_RESAMPLED = 1.5
"""Frequency up to which the resampled curves are computed, as a multiple of the onset."""


@dataclass(frozen=True, slots=True)
class OnsetRule:
    """Rule that defines the coupling onset, and the bootstrap of its interval: number of draws and random seed."""

    threshold: float = 0.25
    """Threshold of the coupling: off-axis over on-axis response of the worst axis."""
    octaves: float = 1 / 12
    """Width of the running average."""
    neighbours: int = 8
    """Lines on either side that the smoothing uses."""
    draws: int = 200
    seed: int = 1

    @property
    def sentence(self) -> str:
        """Definition of the onset in words for reports, with width and threshold; a clause without a full stop."""
        return (
            f"lowest frequency at which the worst ratio of acceleration across to acceleration along, averaged over "
            f"1/{1 / self.octaves:.3g} octave, passes {100 * self.threshold:g} %"
        )


@dataclass(frozen=True, slots=True)
class CouplingOnset:
    """Coupling onset of a frequency response with its confidence interval; result of `coupling_onset`."""

    frequency_hz: float | None
    """Onset; None: no coupling up to the last reliable line."""
    interval_hz: tuple[float, float] | None
    """95 % interval, from resampled noise plus half a line on either side for the line spacing; None where the noise is
    not known."""
    from_the_start: bool
    """Whether the coupling exceeds the threshold at the lowest reliable line: the onset may lie below."""
    threshold: float
    """Off-axis over on-axis response."""
    rule: str
    """The whole rule in words."""


def coupling_onset(response: FrequencyResponse, rule: OnsetRule | None = None) -> CouplingOnset:
    """The frequency from which driving one axis moves the others. response: as estimated, not smoothed yet, with inputs
    and outputs in one frame. Raises ValueError if it is not square, or has too few lines above the noise."""
    rule = rule or OnsetRule()
    require_square_response(response.response)
    lines = response.select_lines(response.reliable)
    local = LocalPolynomial.from_response(lines, rule.neighbours, 2)
    smooth = local.apply(lines.response)
    above_noise = _is_above_noise(lines, local, smooth, rule)
    if not above_noise.any():
        raise ValueError(
            f"coupling cannot be judged: at no line is the noise small compared with {100 * rule.threshold:g} % of "
            "the response; record more periods, or with a stronger excitation"
        )
    onset_hz = _find_onset(lines.frequency_hz[above_noise], compute_worst_coupling(smooth[above_noise]), rule)
    if onset_hz is None:
        return CouplingOnset(None, None, False, rule.threshold, rule.sentence)
    near_onset = lines.frequency_hz <= max(_HIGHEST_RESAMPLED * onset_hz, lines.frequency_hz[2 * rule.neighbours])
    has_noise = bool(np.isfinite(lines.noise_variance).all())
    drawn_onsets = (
        _bootstrap_onsets(lines.select_lines(near_onset), smooth[near_onset], above_noise[near_onset], rule)
        if has_noise
        else None
    )
    interval = (
        None
        if drawn_onsets is None
        else _widen_by_resolution(_bias_corrected_interval(onset_hz, drawn_onsets), lines.frequency_hz, onset_hz)
    )
    return CouplingOnset(
        onset_hz, interval, bool(onset_hz == lines.frequency_hz[above_noise][0]), rule.threshold, rule.sentence
    )


def _is_above_noise(
    lines: FrequencyResponse, local: LocalPolynomial, smooth: ComplexArray, rule: OnsetRule
) -> BoolArray:
    """(lines,): where the smoothed noise is below a quarter of the threshold. Elsewhere noise alone may pass it."""
    noise = np.sqrt(np.nan_to_num(local.propagate_variance(lines.noise_variance)))
    on_axis = np.maximum(np.einsum("lii->li", np.abs(smooth)), np.finfo(np.float64).tiny)
    above_noise: BoolArray = (np.linalg.norm(noise, axis=1) / on_axis).max(axis=1) < rule.threshold / 4
    return above_noise


def _find_onset(frequency_hz: FloatArray, coupling: FloatArray, rule: OnsetRule) -> float | None:
    mean = _octave_average(frequency_hz, coupling, rule.octaves)
    above = np.flatnonzero(mean > rule.threshold)
    return _interpolate_crossing(frequency_hz, mean, int(above[0]), rule.threshold) if len(above) else None


def _octave_average(frequency_hz: FloatArray, coupling: FloatArray, octaves: float) -> FloatArray:
    """Running mean over the lines within half of `octaves` to either side."""
    first = np.searchsorted(frequency_hz, frequency_hz * 2 ** (-octaves / 2))
    stop = np.searchsorted(frequency_hz, frequency_hz * 2 ** (octaves / 2), side="right")
    total = np.concatenate([[0.0], np.cumsum(coupling)])
    mean: FloatArray = (total[stop] - total[first]) / (stop - first)
    return mean


def _interpolate_crossing(frequency_hz: FloatArray, coupling: FloatArray, first: int, threshold: float) -> float:
    """Frequency of the crossing, interpolated between the last line below and the first above."""
    if first == 0:
        return float(frequency_hz[0])
    below, above = coupling[first - 1], coupling[first]
    share = (threshold - below) / (above - below)
    return float(frequency_hz[first - 1] + share * (frequency_hz[first] - frequency_hz[first - 1]))


def _bootstrap_onsets(
    lines: FrequencyResponse, smooth: ComplexArray, above_noise: BoolArray, rule: OnsetRule
) -> FloatArray:
    """(draws,): onsets of a parametric bootstrap: noise of the measured size is added to the smoothed curve."""
    local = LocalPolynomial.from_response(lines, rule.neighbours, 2)
    size = np.sqrt(lines.noise_variance / 2)
    generator = np.random.default_rng(rule.seed)
    onsets = []
    for _ in range(rule.draws):
        noise = generator.standard_normal((2, *size.shape)) * size
        noisy_response = smooth + local.apply(noise[0] + 1j * noise[1])
        onset = _find_onset(lines.frequency_hz[above_noise], compute_worst_coupling(noisy_response[above_noise]), rule)
        onsets.append(float(lines.frequency_hz[-1]) if onset is None else onset)
    return np.array(onsets)


def _widen_by_resolution(
    interval_hz: tuple[float, float], frequency_hz: FloatArray, onset_hz: float
) -> tuple[float, float]:
    line = int(np.clip(np.searchsorted(frequency_hz, onset_hz), 1, len(frequency_hz) - 1))
    half = float(frequency_hz[line] - frequency_hz[line - 1]) / 2
    return interval_hz[0] - half, interval_hz[1] + half


def _bias_corrected_interval(onset_hz: float, onsets: FloatArray) -> tuple[float, float]:
    """Bias-corrected percentile interval (Efron 1981), because noise lets a curve pass the threshold earlier."""
    below = np.clip(np.mean(onsets < onset_hz), 0.5 / len(onsets), 1 - 0.5 / len(onsets))
    low, high = np.quantile(onsets, ndtr(2 * ndtri(below) + ndtri(np.array([0.025, 0.975]))))
    return float(low), float(high)
