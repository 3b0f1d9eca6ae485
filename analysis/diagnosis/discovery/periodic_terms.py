"""Periodic terms of discovered laws: sines of the position, and of time, that start at spectral lines of the missing
force. The ranges of the search and the bounds of the parameters are chosen by hand.
"""

from itertools import product

import numpy as np

from analysis.diagnosis.discovery.grammar import Axis, Columns, Term
from equalizer.signals.signal import FloatArray


def find_periodic_terms(
    columns: Columns, own_axis: Axis, missing_force: FloatArray, rate_hz: float
) -> tuple[Term, ...]:
    """Find sines of position with a free pitch, alone or times command or velocity, and sines of time with a free
    frequency, times position, velocity or command, that start at spectral lines of `missing_force` (n,), N (N m).

    Of position, for each factor: the two strongest lines of pitches from the largest position down to about 1/40 of it,
    computed from fewer than 16000 evenly spaced samples. Their spacing, 0.35 per travel of a symmetric motion, is as
    fine as in `balance.laws`. Pitches of 1/12 of the travel (peak to peak) or more hardly make a line; they also start
    on a grid, as sine and cosine. A pitch varies within a factor of 2, up to the travel; lines of longer pitches, which
    the spectrum has where the motion is far from position 0, are left out. Of time: the strongest line above
    `_SLOWEST_LINE_HZ` for each factor; its frequency varies by 20 %."""
    x = columns[own_axis.x]
    stride = max(len(x) // 8000, 1)
    wave_numbers = np.arange(1.0, 40.0, 0.175) / own_axis.largest_position
    travel = float(np.ptp(x))
    wave_numbers = wave_numbers[wave_numbers * travel >= 1.0]
    phasors = np.exp(-2j * np.pi * np.outer(x[::stride], wave_numbers)).astype(np.complex64)
    terms = []
    for factor_signal, wave_count, start_phase in product(
        ("", own_axis.f, own_axis.v), np.geomspace(1.0, 12.0, 13).tolist(), (0.0, np.pi / 2)
    ):
        pitch = travel / wave_count
        terms.append(
            _build_sine_term(
                factor_signal, f"{own_axis.x}/p0", pitch, (0.5 * pitch, min(2 * pitch, travel)), start_phase
            )
        )
    for factor_signal in ("", own_axis.f, own_axis.v):
        factor = columns[factor_signal] if factor_signal else np.ones_like(x)
        spectrum = (missing_force * factor)[::stride].astype(np.complex64) @ phasors
        for line_index in _find_peaks(np.abs(spectrum), 2):
            pitch = 1 / float(wave_numbers[line_index])
            bounds = (0.5 * pitch, min(2 * pitch, travel))
            terms.append(
                _build_sine_term(factor_signal, f"{own_axis.x}/p0", pitch, bounds, _compute_phase(spectrum[line_index]))
            )
    for factor_signal in (own_axis.x, own_axis.v, own_axis.f):
        padded_length = 4 * len(x)  # Zero-padded: a start half a line off is out of phase by the end.
        spectrum = np.fft.rfft(missing_force * columns[factor_signal], padded_length)
        spectrum[: int(_SLOWEST_LINE_HZ * padded_length / rate_hz) + 1] = 0
        line_index = int(np.argmax(np.abs(spectrum)))
        line_hz = max(line_index, 1) * rate_hz / padded_length
        terms.append(
            _build_sine_term(
                factor_signal, "p0*t", line_hz, (0.8 * line_hz, 1.2 * line_hz), _compute_phase(spectrum[line_index])
            )
        )
    return tuple(terms)


_SLOWEST_LINE_HZ = 0.1
"""Frequency (Hz) up to which lines in time are not searched: slow drifts are other terms of the grammar. Chosen by
hand."""


def _build_sine_term(
    factor_signal: str, cycles_formula: str, start_value: float, bounds: tuple[float, float], start_phase: float
) -> Term:
    """Build a sine times a signal, factor_signal (empty: alone). cycles_formula: of the number of cycles, with p0 in
    it; start_value and bounds: of p0; start_phase: of p1, in rad, which is bounded to ± 20 rad, about three periods."""
    shape = f"sin(2*pi*{cycles_formula} + p1)"
    return Term(
        f"{factor_signal}*{shape}" if factor_signal else shape,
        (start_value, start_phase),
        (bounds, (-20.0, 20.0)),
        (),
        (1,),
    )


def _compute_phase(spectral_line: complex) -> float:
    """Compute the phase (rad) of a sine from its complex Fourier coefficient, whose angle is that of a cosine."""
    return float(np.angle(spectral_line) + np.pi / 2)


def _find_peaks(amplitudes: FloatArray, max_count: int) -> list[int]:
    """Find the indices of the largest local maxima of amplitudes (lines,) over two neighbours on each side, largest
    first, at most `max_count`; the two outermost lines at each end are left out."""
    peak_indices = [k for k in range(2, len(amplitudes) - 2) if amplitudes[k] == amplitudes[k - 2 : k + 3].max()]
    return sorted(peak_indices, key=lambda k: -amplitudes[k])[:max_count]
