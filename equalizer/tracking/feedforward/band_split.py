"""Complementary filters: a signal split into a low, a middle and a high band that add up to it again.

The split comes before the forces are solved for: a model is not valid outside its band, and where the device's gain is
high there, a little content outside causes a large error. Two forms: symmetric filters, steep and without phase error
but late, for what is known beforehand; causal ones, without latency but shallow, for what begins at a contact.
"""

from dataclasses import dataclass
from functools import cached_property
from math import comb

import numpy as np
from scipy.signal import firwin, freqz, kaiser_beta, lfilter, oaconvolve

from equalizer.signals.signal import ComplexArray, FloatArray

STOPBAND_DB = 60.0
"""Attenuation of the filters outside their band."""
CAUSAL_ORDER = 3
"""Odd, so that both sides of a crossover fall off alike: 12 dB per octave."""


@dataclass(frozen=True, slots=True)
class BandEdges:
    """Crossover frequencies, at which both bands have equal gain. None = no such band; its neighbour extends to the
    end."""

    low_hz: float | None = 4.0
    """Lower band edge. The default is 1 Hz below the model's band (5 Hz), so that the model plays the whole band."""
    high_hz: float | None = 36.0

    def __post_init__(self) -> None:
        for name in ("low_hz", "high_hz"):
            edge = getattr(self, name)
            if edge is not None and not (np.isfinite(edge) and edge > 0):
                raise ValueError(f"{name} is {edge}; it must be a positive number, or None for no such band")
        if self.low_hz is not None and self.high_hz is not None and self.low_hz >= self.high_hz:
            raise ValueError(f"low_hz is {self.low_hz:g}, not below high_hz, {self.high_hz:g}")


@dataclass(frozen=True, slots=True, eq=False)
class Bands:
    """Three arrays of one shape; low + middle + high is the input, delayed by `latency_samples`."""

    low: FloatArray
    middle: FloatArray
    high: FloatArray
    latency_samples: int

    @property
    def total(self) -> FloatArray:
        return self.low + self.middle + self.high


@dataclass(frozen=True, eq=False)
class LinearPhaseSplit:
    """Symmetric (linear-phase) filters: no phase error, but a latency of `latency_ms`, and content spreads by it both
    ways."""

    edges: BandEdges
    sample_rate_hz: float
    transition_hz: float = 2.0
    """Width of each crossover; it determines the latency."""

    def __post_init__(self) -> None:
        _check_rate(self.edges, self.sample_rate_hz)
        lowest = self.edges.low_hz or self.edges.high_hz
        if not 0 < self.transition_hz <= 2 * (lowest or np.inf):
            raise ValueError(
                f"transition_hz is {self.transition_hz}; it must be positive and at most twice the lowest edge"
            )

    @property
    def latency_samples(self) -> int:
        """Half the length of the filters, by Kaiser's rule for STOPBAND_DB."""
        if self.edges.low_hz is None and self.edges.high_hz is None:
            return 0
        width = 2 * np.pi * self.transition_hz / self.sample_rate_hz
        return int(np.ceil((STOPBAND_DB - 7.95) / (2.285 * width) / 2))

    @property
    def latency_ms(self) -> float:
        return 1e3 * self.latency_samples / self.sample_rate_hz

    @cached_property
    def filters(self) -> FloatArray:
        """(3, taps): low, middle, high; they add up to a delayed impulse."""
        taps = 2 * self.latency_samples + 1
        everything, nothing = np.zeros(taps), np.zeros(taps)
        everything[self.latency_samples] = 1.0
        low = nothing if self.edges.low_hz is None else self._low_pass_filter(self.edges.low_hz)
        below_high = everything if self.edges.high_hz is None else self._low_pass_filter(self.edges.high_hz)
        return np.stack([low, below_high - low, everything - below_high])

    def split(self, wanted: FloatArray) -> Bands:
        """wanted: (N, channels). The bands have N + 2 latency_samples rows: the filters' run-in and run-out too."""
        low_taps, _, high_taps = self.filters
        late = np.pad(np.asarray(wanted, dtype=np.float64), ((self.latency_samples,) * 2, (0, 0)))
        low = oaconvolve(wanted, low_taps[:, None], axes=0)
        high = oaconvolve(wanted, high_taps[:, None], axes=0)
        return Bands(low, late - low - high, high, self.latency_samples)

    def response(self, frequency_hz: FloatArray) -> ComplexArray:
        """(lines, 3): real gains of low, middle and high, without the latency."""
        turned = np.exp(2j * np.pi * np.asarray(frequency_hz) * self.latency_samples / self.sample_rate_hz)
        parts = [freqz(taps, worN=frequency_hz, fs=self.sample_rate_hz)[1] for taps in self.filters]
        return np.asarray(np.stack(parts, axis=1) * turned[:, None])

    def _low_pass_filter(self, edge_hz: float) -> FloatArray:
        window = ("kaiser", kaiser_beta(STOPBAND_DB))
        taps = firwin(2 * self.latency_samples + 1, edge_hz, window=window, fs=self.sample_rate_hz)
        return np.asarray(taps)


@dataclass(frozen=True, slots=True, eq=False)
class CausalSplit:
    """Complementary causal filters that add up to the input without delay. Each band has a phase, see `phase_deg`.

    With q a low pass of one pole, (q + (1 - q))^order is 1: the terms with the higher powers of 1 - q are the band
    above the crossover, the others the band below. Steep bands that add up to the input overlap and partly cancel near
    a crossover, where each exceeds the input (`largest_gain`), so that errors of single bands no longer cancel. With a
    wide-band model, playing without a split is better from a contact on.
    """

    edges: BandEdges
    sample_rate_hz: float
    order: int = CAUSAL_ORDER

    def __post_init__(self) -> None:
        _check_rate(self.edges, self.sample_rate_hz)
        if self.order < 1 or self.order % 2 == 0:
            raise ValueError(f"order is {self.order}; it must be odd and positive")

    @property
    def latency_samples(self) -> int:
        return 0

    @property
    def latency_ms(self) -> float:
        return 0.0

    def split(self, wanted: FloatArray) -> Bands:
        """wanted: (N, channels), from rest."""
        x = np.asarray(wanted, dtype=np.float64)
        high = self._high_pass(self.edges.high_hz, x) if self.edges.high_hz else np.zeros_like(x)
        rest = x - high
        low = rest - self._high_pass(self.edges.low_hz, rest) if self.edges.low_hz else np.zeros_like(x)
        return Bands(low, rest - low, high, 0)

    def response(self, frequency_hz: FloatArray) -> ComplexArray:
        """(lines, 3): complex gains of low, middle and high; their sum is 1."""
        nothing = np.zeros(len(frequency_hz), complex)
        high = self._gain_above(self.edges.high_hz, frequency_hz) if self.edges.high_hz else nothing
        low = (1 - high) * (1 - self._gain_above(self.edges.low_hz, frequency_hz)) if self.edges.low_hz else nothing
        return np.asarray(np.stack([low, 1 - low - high, high], axis=1))

    def phase_deg(self, frequency_hz: FloatArray) -> FloatArray:
        """(lines, 3): phase lead (+) or lag (-) of each band against the input."""
        return np.asarray(np.degrees(np.angle(self.response(frequency_hz))))

    @property
    def largest_gain(self) -> float:
        """Largest gain of any band at any frequency."""
        lines = np.geomspace(0.05, 0.499 * self.sample_rate_hz, 2000)
        return float(np.abs(self.response(lines)).max())

    def _high_pass(self, edge_hz: float, x: FloatArray) -> FloatArray:
        pole = self.one_pole(edge_hz)
        total = np.zeros_like(x)
        for power in range((self.order + 1) // 2, self.order + 1):
            term = x
            for _ in range(self.order - power):
                term = lfilter(*pole, term, axis=0)
            for _ in range(power):
                term = term - lfilter(*pole, term, axis=0)
            total += comb(self.order, power) * term
        return total

    def _gain_above(self, edge_hz: float, frequency_hz: FloatArray) -> ComplexArray:
        q = freqz(*self.one_pole(edge_hz), worN=frequency_hz, fs=self.sample_rate_hz)[1]
        powers = range((self.order + 1) // 2, self.order + 1)
        return np.asarray(sum(comb(self.order, j) * (1 - q) ** j * q ** (self.order - j) for j in powers))

    def one_pole(self, edge_hz: float) -> tuple[FloatArray, FloatArray]:
        """Numerator and denominator, each (2,), of q."""
        w = np.tan(np.pi * edge_hz / self.sample_rate_hz)
        return np.array([w, w]) / (1 + w), np.array([1.0, (w - 1) / (1 + w)])


def _check_rate(edges: BandEdges, sample_rate_hz: float) -> None:
    highest = max(edges.low_hz or 0.0, edges.high_hz or 0.0)
    if not (np.isfinite(sample_rate_hz) and sample_rate_hz > 2 * highest):
        raise ValueError(f"sample_rate_hz is {sample_rate_hz}; it must be above twice the highest edge, {highest:g} Hz")
