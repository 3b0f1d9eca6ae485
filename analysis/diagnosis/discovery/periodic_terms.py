"""Periodic terms of discovered laws: waves along the travel, and in time, that start at spectral lines of the missing
force. Called by `view_terms`.
"""

from itertools import product

import numpy as np

from analysis.diagnosis.discovery.grammar import Axis, Columns, Term
from equalizer.signals.signal import FloatArray


def find_periodic_terms(
    columns: Columns, own_axis: Axis, missing_force: FloatArray, rate_hz: float
) -> tuple[Term, ...]:
    """Sines of position with a free pitch, alone or times command or velocity, and sines of time with a free frequency,
    times position, velocity or command. They start at the strongest spectral lines of `missing_force` (n,); pitches of
    1/12 of the travel or more, which hardly make a line, also start on a grid. No pitch exceeds the travel."""
    x = columns[own_axis.x]
    stride = max(len(x) // 8000, 1)
    wave_numbers = np.arange(1.0, 40.0, 0.175) / own_axis.travel
    phasors = np.exp(-2j * np.pi * np.outer(x[::stride], wave_numbers)).astype(np.complex64)
    terms = []
    travel = float(np.ptp(x))
    for weight_signal, wave_count, phase in product(
        ("", own_axis.f, own_axis.v), np.geomspace(1.0, 12.0, 13).tolist(), (0.0, np.pi / 2)
    ):
        pitch = travel / wave_count
        terms.append(
            _build_sine_term(weight_signal, f"{own_axis.x}/p0", pitch, (0.5 * pitch, min(2 * pitch, travel)), phase)
        )
    for weight_signal in ("", own_axis.f, own_axis.v):
        weight = columns[weight_signal] if weight_signal else np.ones_like(x)
        lines = (missing_force * weight)[::stride].astype(np.complex64) @ phasors
        for line_index in _find_peaks(np.abs(lines), 2):
            pitch = 1 / float(wave_numbers[line_index])
            bounds = (0.5 * pitch, min(2 * pitch, travel))
            terms.append(
                _build_sine_term(
                    weight_signal, f"{own_axis.x}/p0", pitch, bounds, _compute_sine_phase(lines[line_index])
                )
            )
    for weight_signal in (own_axis.x, own_axis.v, own_axis.f):
        padded_length = 4 * len(x)  # Zero-padded: a start half a line off is out of phase by the end.
        lines = np.fft.rfft(missing_force * columns[weight_signal], padded_length)
        lines[: int(_SLOWEST_LINE_HZ * padded_length / rate_hz) + 1] = 0
        line_index = int(np.argmax(np.abs(lines)))
        line_hz = max(line_index, 1) * rate_hz / padded_length
        terms.append(
            _build_sine_term(
                weight_signal, "p0*t", line_hz, (0.8 * line_hz, 1.2 * line_hz), _compute_sine_phase(lines[line_index])
            )
        )
    return tuple(terms)


_SLOWEST_LINE_HZ = 0.1
"""Frequency (Hz) up to which lines in time are not searched: drifts are terms of their own."""


def _build_sine_term(
    weight: str, argument: str, start_value: float, bounds: tuple[float, float], start_phase: float
) -> Term:
    """A sine times a weight (empty: alone). argument: formula of the cycles, with p0 in it; start_value and bounds: of
    p0; start_phase: of p1, rad."""
    shape = f"sin(2*pi*{argument} + p1)"
    return Term(f"{weight}*{shape}" if weight else shape, (start_value, start_phase), (bounds, (-20.0, 20.0)), (), (1,))


def _compute_sine_phase(spectral_line: complex) -> float:
    """Phase (rad) of a sine from its complex Fourier coefficient, whose angle is that of a cosine."""
    return float(np.angle(spectral_line) + np.pi / 2)


def _find_peaks(power: FloatArray, max_count: int) -> list[int]:
    """Indices of the largest local maxima of a spectrum (lines,), over two neighbours on each side; largest first."""
    peaks = [k for k in range(2, len(power) - 2) if power[k] == power[k - 2 : k + 3].max()]
    return sorted(peaks, key=lambda k: -power[k])[:max_count]
