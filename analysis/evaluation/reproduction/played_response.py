"""Response of a device from wanted to delivered acceleration, line by line (the published figure 5)."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from analysis.evaluation.reproduction.document import PlayedRow
from equalizer.signals.excitation import log_sweep
from equalizer.signals.multisine import lines_between, multisines
from equalizer.signals.signal import ComplexArray, FloatArray
from equalizer.tracking.feedforward.quality import measure_quality

SignalKind = Literal["sweep", "multisine"]


@dataclass(frozen=True, slots=True, eq=False)
class PlayedResponse:
    """Delivered over wanted, column by column the wanted axis; 1 on the diagonal is perfect."""

    name: str
    device: str
    place_m: tuple[float, float, float]
    hand: bool
    signal: SignalKind
    frequency_hz: FloatArray
    """(lines,)"""
    response: ComplexArray
    """(lines, axes, axes)"""
    peak_force_n: float
    clipped_ticks: int
    multiply_adds: int | None = None


def make_wanted_wave(
    kind: SignalKind, band_hz: tuple[float, float], period: int, sample_rate_hz: float, seed: int
) -> FloatArray:
    """A period (period,) of the wanted signal, with a peak of 1 and nothing outside the band."""
    low, high = band_hz
    if kind == "multisine":
        lines = lines_between(low, high, period, sample_rate_hz, odd_only=False)
        return multisines(lines, period, 1.0, 1, 1, seed)[0][:, 0]
    # A little wider than the band, so that the band's ends are not where the sweep turns.
    spectrum = np.fft.rfft(log_sweep(0.9 * low, 1.06 * high, 1.0, period, sample_rate_hz))
    spectrum[~lines_of_band(band_hz, period, sample_rate_hz)] = 0
    wave = np.fft.irfft(spectrum, period)
    peaked: FloatArray = wave / np.abs(wave).max()
    return peaked


def lines_of_band(
    band_hz: tuple[float, float], period: int, sample_rate_hz: float
) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    """(period // 2 + 1,)"""
    frequency_hz = np.fft.rfftfreq(period, 1 / sample_rate_hz)
    return np.asarray((frequency_hz >= band_hz[0] - 1e-9) & (frequency_hz <= band_hz[1] + 1e-9))


def estimate_response(
    wanted: FloatArray, delivered: Sequence[FloatArray], band_hz: tuple[float, float], sample_rate_hz: float
) -> tuple[FloatArray, ComplexArray]:
    """Frequencies (lines,) and response (lines, axes, axes), delivered over wanted. wanted: (axes, period), a wave for
    each axis in turn; delivered: for each of them a whole steady period, (period, axes)."""
    period = wanted.shape[1]
    used = lines_of_band(band_hz, period, sample_rate_hz)
    columns = [
        np.fft.rfft(played, axis=0)[used] / np.fft.rfft(wave)[used][:, None]
        for wave, played in zip(wanted, delivered, strict=True)
    ]
    frequency_hz = np.asarray(np.fft.rfftfreq(period, 1 / sample_rate_hz)[used], dtype=np.float64)
    return frequency_hz, np.stack(columns, axis=2)


def normalise_gain(response: ComplexArray) -> ComplexArray:
    """The response divided by its mean gain along the axes, which a static gain would correct."""
    along = np.abs(np.einsum("lii->li", response))
    level: ComplexArray = response / np.exp(np.log(along).mean())
    return level


def coupling_db(response: ComplexArray) -> FloatArray:
    """(lines,): the largest off-axis entry over the on-axis entry in dB, of the worst axis."""
    along = np.abs(np.einsum("lii->li", response))
    off = np.abs(response) * (1 - np.eye(response.shape[1]))
    ratio: FloatArray = 20 * np.log10(np.maximum((off.max(axis=1) / along).max(axis=1), 1e-12))
    return ratio


def describe_played(played: PlayedResponse) -> PlayedRow:
    """The response's figures of merit as a row of the document. error: rms departure from the identity matrix, per
    axis."""
    found = measure_quality(played.response)
    axes = played.response.shape[1]
    error = np.sqrt((np.abs(played.response - np.eye(axes)) ** 2).sum() / (axes * len(played.response)))
    x, y, z = (1000 * place for place in played.place_m)
    return PlayedRow(
        name=played.name,
        device=played.device,
        place_mm=(x, y, z),
        hand=played.hand,
        signal=played.signal,
        flatness_db=found.flatness_db,
        coupling_db=max(found.coupling_db, -240.0),
        median_coupling_db=float(np.median(coupling_db(played.response))),
        axis_error_deg=found.axis_error_deg,
        error=float(error),
        peak_force_n=played.peak_force_n,
        clipped_ticks=played.clipped_ticks,
        multiply_adds=played.multiply_adds,
    )
