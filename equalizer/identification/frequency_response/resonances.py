"""Resonances of a measured response: peaks of its gain or of its coupling, with a mode fitted to each.

Peaks are searched on averages over bins of equal width in octaves: of the largest singular value of the response matrix
(gain), and of the Frobenius norm of its off-diagonal entries (coupling). A mode with one pole pair is then fitted to
the lines around each peak (`single_mode`). Its 95 % intervals are quantiles of refits with added noise, widened on both
sides by the misfit of a single mode: by the largest change of the result where the numerator, which stands for the
other modes, has one or two more powers.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.signal import find_peaks

from equalizer.identification.frequency_response.frequency_response import FrequencyResponse
from equalizer.identification.frequency_response.octave_bins import OctaveBins, average_octave_bins
from equalizer.identification.frequency_response.single_mode import fit_single_mode
from equalizer.signals.signal import FloatArray

GAIN, COUPLING = "gain", "coupling"
"""Names of the two curves in which peaks are searched."""


@dataclass(frozen=True, slots=True)
class ResonanceSearch:
    """Settings of the peak search and of the 95 % intervals. Heuristic values."""

    prominence_db: float = 3.0
    """Least prominence: ratio of a peak to the higher of the minima on its two sides."""
    bin_octaves: float = 1 / 48
    """Width (octaves) of the bins that are averaged before peaks are searched."""
    reach_octaves: float = 1 / 8
    """Half-width (octaves) of the interval around a peak to which a mode is fitted."""
    draws: int = 200
    """Number of refits with added noise, from which the intervals are computed."""
    seed: int = 1
    """Seed of the random noise."""


@dataclass(frozen=True, slots=True)
class Resonance:
    """Mode fitted to a peak of a frequency response, with 95 % intervals of its frequency and damping ratio."""

    frequency_hz: float
    """Natural frequency of the fitted mode."""
    frequency_interval_hz: tuple[float, float]
    """95 % interval, from refits with added noise and the misfit of a single mode; without the noise where that is not
    known."""
    damping_ratio: float
    damping_interval: tuple[float, float]
    """95 % interval of the damping ratio, from the same fits."""
    width_hz: float
    """Half-power bandwidth (Hz), 2 damping_ratio frequency_hz."""
    prominence_db: float
    seen_in: tuple[str, ...]
    """Curves that have this peak. GAIN: largest singular value; COUPLING: norm of the off-diagonal entries."""


@dataclass(frozen=True, slots=True)
class _Peak:
    """Local maximum of one curve; `curve_name` is GAIN or COUPLING."""

    frequency_hz: float
    prominence_db: float
    curve_name: str


def find_resonances(response: FrequencyResponse, search: ResonanceSearch | None = None) -> tuple[Resonance, ...]:
    """Find resonances between the first and the last reliable line, in ascending order of frequency; none without a
    reliable line. response: as estimated, not smoothed.

    A peak that no single mode fits is left out; of peaks with the same mode the most prominent is kept. Coupling is
    searched only where there are as many outputs as inputs.
    """
    search = search or ResonanceSearch()
    if not response.reliable.any():
        return ()
    end_lines = np.flatnonzero(response.reliable)[[0, -1]]
    lines = response.select_lines(np.isin(np.arange(len(response)), np.arange(end_lines[0], end_lines[1] + 1)))
    resonances: list[Resonance] = []
    for peak in sorted(
        _find_peaks(average_octave_bins(lines, search.bin_octaves), search), key=lambda peak: -peak.prominence_db
    ):
        resonance = _fit_resonance(lines, peak, search)
        if resonance is None:
            continue
        same_mode = next((accepted for accepted in resonances if _is_same_mode(accepted, resonance)), None)
        if same_mode is None:
            resonances.append(resonance)
        elif peak.curve_name not in same_mode.seen_in:
            resonances[resonances.index(same_mode)] = _add_curve(same_mode, peak.curve_name)
    return tuple(sorted(resonances, key=lambda resonance: resonance.frequency_hz))


def _find_peaks(binned: OctaveBins, search: ResonanceSearch) -> list[_Peak]:
    """Find the peaks of both curves, in dB, whose prominence is at least `search.prominence_db`."""
    curves = {GAIN: np.linalg.norm(binned.response, ord=2, axis=(1, 2))}
    if binned.response.shape[1] == binned.response.shape[2]:
        off_axis = binned.response * (1 - np.eye(binned.response.shape[1]))
        curves[COUPLING] = np.linalg.norm(off_axis, axis=(1, 2))
    peaks = []
    for name, curve in curves.items():
        level_db = 20 * np.log10(np.maximum(curve, np.finfo(np.float64).tiny))
        bin_indices, properties = find_peaks(level_db, prominence=search.prominence_db)
        for bin_index, prominence_db in zip(bin_indices, properties["prominences"], strict=True):
            peaks.append(_Peak(float(binned.frequency_hz[bin_index]), float(prominence_db), name))
    return peaks


def _fit_resonance(lines: FrequencyResponse, peak: _Peak, search: ResonanceSearch) -> Resonance | None:
    """Fit a mode to a peak; None where there are fewer than six (chosen) lines or bins within `reach_octaves` of it,
    where no single mode fits, with or without more powers, or where the peak is not distinct from noise."""
    reach_factor = 2**search.reach_octaves
    peak_lines = lines.select_band(peak.frequency_hz / reach_factor, peak.frequency_hz * reach_factor)
    # A hundred points suffice for a single mode: more lines are averaged in bins, which saves time.
    binned = average_octave_bins(peak_lines, 2 * search.reach_octaves / 100) if len(peak_lines) >= 6 else None
    if binned is None or len(binned.frequency_hz) < 6:
        return None
    entries = binned.response.reshape(1, len(binned.frequency_hz), -1)
    noise_variance = np.nan_to_num(binned.noise_variance / binned.lines[:, None, None]).reshape(entries.shape)
    natural_hz, damping_ratio = fit_single_mode(binned.frequency_hz, entries)
    if not np.isfinite(natural_hz[0]):
        return None
    more_powers = np.array([fit_single_mode(binned.frequency_hz, entries, degree) for degree in (3, 4)])[:, :, 0]
    # A fit with more powers that finds no mode leaves the misfit to the other; without any, it is not known.
    if np.isnan(more_powers).all():
        return None
    misfit_hz, damping_misfit = np.nanmax(np.abs(more_powers - (natural_hz[0], damping_ratio[0])), axis=0)
    normal_draws = np.random.default_rng(search.seed).standard_normal((2, search.draws, *entries.shape[1:]))
    noisy_entries = entries + np.sqrt(noise_variance / 2) * (normal_draws[0] + 1j * normal_draws[1])
    drawn_natural_hz, drawn_damping_ratios = fit_single_mode(binned.frequency_hz, noisy_entries)
    # Where more than 5 % (chosen) of the noisy refits find no mode, the peak is not distinct from noise.
    if np.isnan(drawn_natural_hz).mean() > 0.05:
        return None
    return Resonance(
        frequency_hz=float(natural_hz[0]),
        frequency_interval_hz=_compute_interval(drawn_natural_hz, float(misfit_hz)),
        damping_ratio=float(damping_ratio[0]),
        damping_interval=_compute_interval(drawn_damping_ratios, float(damping_misfit)),
        width_hz=float(2 * damping_ratio[0] * natural_hz[0]),
        prominence_db=peak.prominence_db,
        seen_in=(peak.curve_name,),
    )


def _compute_interval(draws: FloatArray, misfit: float) -> tuple[float, float]:
    """Compute the 95 % interval of draws (draws,), as the 2.5 % and 97.5 % quantiles, widened on both sides by the
    misfit (unit of the draws), but not below 0, which no mode has; NaN is left out."""
    low, high = np.nanquantile(draws, (0.025, 0.975))
    return max(0.0, float(low) - misfit), float(high) + misfit


def _is_same_mode(first: Resonance, second: Resonance) -> bool:
    """Whether two modes are closer than a third of the wider bandwidth (heuristic): peaks of gain and of coupling
    deviate slightly from a mode's frequency."""
    return abs(first.frequency_hz - second.frequency_hz) < max(first.width_hz, second.width_hz) / 3


def _add_curve(resonance: Resonance, curve_name: str) -> Resonance:
    """Add a curve to `seen_in` of the resonance, in alphabetical order."""
    return replace(resonance, seen_in=tuple(sorted((*resonance.seen_in, curve_name))))
