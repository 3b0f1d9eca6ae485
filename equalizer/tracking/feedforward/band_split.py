"""Complementary filters (crossovers): split a signal into low, middle and high bands whose sum is the signal.

The split precedes the inversion of a model, because the model is not valid outside its band: where the device's gain is
high there, even small content outside the band causes a large error. Two forms: linear-phase FIR filters, steep and
without phase error but with a latency, for signals known in advance; causal filters, without latency but with shallow
slopes, for signals that begin at a contact.
"""

from dataclasses import dataclass
from functools import cached_property
from math import comb

import numpy as np
from scipy.signal import firwin, freqz, kaiser_beta, lfilter, oaconvolve

from equalizer.signals.signal import ComplexArray, FloatArray

STOPBAND_DB = 60.0
"""Attenuation (dB) of the linear-phase filters in their stopband."""
CAUSAL_ORDER = 3
"""Order of the causal filters. An odd order gives both sides of a crossover the same slope: 12 dB per octave for 3."""


@dataclass(frozen=True, slots=True)
class BandEdges:
    """Crossover frequencies (Hz), at which adjacent bands have equal gain. None: that band does not exist, and the
    middle band extends to the end of the spectrum. Raises ValueError for edges that are not positive and rising."""

    low_hz: float | None = 4.0
    """Lower band edge. The default is 1 Hz below the model's band (5 Hz), so that the middle band keeps all of it."""
    high_hz: float | None = 36.0
    """Upper band edge."""

    def __post_init__(self) -> None:
        for name in ("low_hz", "high_hz"):
            edge = getattr(self, name)
            if edge is not None and not (np.isfinite(edge) and edge > 0):
                raise ValueError(f"{name} is {edge}; it must be a positive number, or None for no such band")
        if self.low_hz is not None and self.high_hz is not None and self.low_hz >= self.high_hz:
            raise ValueError(f"low_hz is {self.low_hz:g}, not below high_hz, {self.high_hz:g}")


@dataclass(frozen=True, slots=True, eq=False)
class Bands:
    """Three arrays (N, channels); low + middle + high is the input, delayed by `latency_samples`."""

    low: FloatArray
    middle: FloatArray
    high: FloatArray
    latency_samples: int

    @property
    def total(self) -> FloatArray:
        """Sum of the bands: the delayed input, (N, channels)."""
        return self.low + self.middle + self.high


@dataclass(frozen=True, eq=False)
class LinearPhaseSplit:
    """Linear-phase FIR filters (Kaiser window): no phase error, but a latency of `latency_ms`, by which content also
    spreads before and after its time. Raises ValueError for an unusable transition width or sample rate."""

    edges: BandEdges
    sample_rate_hz: float
    transition_hz: float = 2.0
    """Width of each crossover's transition band; the latency is inversely proportional to it."""

    def __post_init__(self) -> None:
        _check_rate(self.edges, self.sample_rate_hz)
        lowest = self.edges.low_hz or self.edges.high_hz
        if not 0 < self.transition_hz <= 2 * (lowest or np.inf):
            raise ValueError(
                f"transition_hz is {self.transition_hz}; it must be positive and at most twice the lowest edge"
            )

    @property
    def latency_samples(self) -> int:
        """Half the filter order, by Kaiser's formula: order = (A - 7.95) / (2.285 width), A = STOPBAND_DB, width in
        rad."""
        if self.edges.low_hz is None and self.edges.high_hz is None:
            return 0
        width = 2 * np.pi * self.transition_hz / self.sample_rate_hz
        return int(np.ceil((STOPBAND_DB - 7.95) / (2.285 * width) / 2))

    @property
    def latency_ms(self) -> float:
        """Latency in ms."""
        return 1e3 * self.latency_samples / self.sample_rate_hz

    @cached_property
    def filters(self) -> FloatArray:
        """(3, taps): impulse responses of low, middle and high; their sum is an impulse delayed by the latency."""
        taps = 2 * self.latency_samples + 1
        impulse, zeros = np.zeros(taps), np.zeros(taps)
        impulse[self.latency_samples] = 1.0
        low = zeros if self.edges.low_hz is None else self._low_pass_filter(self.edges.low_hz)
        below_high = impulse if self.edges.high_hz is None else self._low_pass_filter(self.edges.high_hz)
        return np.stack([low, below_high - low, impulse - below_high])

    def split(self, reference: FloatArray) -> Bands:
        """Split reference (N, channels). The bands have N + 2 latency_samples rows, with the filters' run-in and
        run-out."""
        low_taps, _, high_taps = self.filters
        delayed = np.pad(np.asarray(reference, dtype=np.float64), ((self.latency_samples,) * 2, (0, 0)))
        low = oaconvolve(reference, low_taps[:, None], axes=0)
        high = oaconvolve(reference, high_taps[:, None], axes=0)
        return Bands(low, delayed - low - high, high, self.latency_samples)

    def response(self, frequency_hz: FloatArray) -> ComplexArray:
        """(lines, 3): gains of low, middle and high with the latency removed, which are real up to rounding."""
        advance = np.exp(2j * np.pi * np.asarray(frequency_hz) * self.latency_samples / self.sample_rate_hz)
        parts = [freqz(taps, worN=frequency_hz, fs=self.sample_rate_hz)[1] for taps in self.filters]
        return np.asarray(np.stack(parts, axis=1) * advance[:, None])

    def _low_pass_filter(self, edge_hz: float) -> FloatArray:
        """(taps,): low-pass by the window method, with a gain of 1/2 at the edge."""
        window = ("kaiser", kaiser_beta(STOPBAND_DB))
        taps = firwin(2 * self.latency_samples + 1, edge_hz, window=window, fs=self.sample_rate_hz)
        return np.asarray(taps)


@dataclass(frozen=True, slots=True, eq=False)
class CausalSplit:
    """Complementary causal filters whose sum is the input without delay. Each band has a phase, see `phase_deg`.

    With q a first-order low-pass, (q + (1 - q))^order = 1. Its binomial terms with the higher powers of 1 - q make the
    band above the crossover, the others the band below. Near a crossover the gain of a single band may exceed 1
    (`largest_gain`); the bands partly cancel there, and errors that differ between bands do not. With a wide-band
    model, playing without a split is better from a contact on. Raises ValueError for an even order or a low rate.
    """

    edges: BandEdges
    sample_rate_hz: float
    order: int = CAUSAL_ORDER
    """Odd; each side of a crossover falls off by 3 (order + 1) dB per octave."""

    def __post_init__(self) -> None:
        _check_rate(self.edges, self.sample_rate_hz)
        if self.order < 1 or self.order % 2 == 0:
            raise ValueError(f"order is {self.order}; it must be odd and positive")

    @property
    def latency_samples(self) -> int:
        """Always 0."""
        return 0

    @property
    def latency_ms(self) -> float:
        """Always 0."""
        return 0.0

    def split(self, reference: FloatArray) -> Bands:
        """Split reference (N, channels), with filters that start at rest; the bands have N rows."""
        x = np.asarray(reference, dtype=np.float64)
        high = self._high_pass(self.edges.high_hz, x) if self.edges.high_hz else np.zeros_like(x)
        below_high = x - high
        low = below_high - self._high_pass(self.edges.low_hz, below_high) if self.edges.low_hz else np.zeros_like(x)
        return Bands(low, below_high - low, high, 0)

    def response(self, frequency_hz: FloatArray) -> ComplexArray:
        """(lines, 3): complex gains of low, middle and high; their sum is 1."""
        zeros = np.zeros(len(frequency_hz), complex)
        high = self._gain_above(self.edges.high_hz, frequency_hz) if self.edges.high_hz else zeros
        low = (1 - high) * (1 - self._gain_above(self.edges.low_hz, frequency_hz)) if self.edges.low_hz else zeros
        return np.asarray(np.stack([low, 1 - low - high, high], axis=1))

    def phase_deg(self, frequency_hz: FloatArray) -> FloatArray:
        """(lines, 3): phase of each band relative to the input in degrees; positive is a lead."""
        return np.asarray(np.degrees(np.angle(self.response(frequency_hz))))

    @property
    def largest_gain(self) -> float:
        """Largest gain of any band at any frequency."""
        lines = np.geomspace(0.05, 0.499 * self.sample_rate_hz, 2000)
        return float(np.abs(self.response(lines)).max())

    def _high_pass(self, edge_hz: float, x: FloatArray) -> FloatArray:
        """Band of x (N, channels) above an edge: the binomial terms with at least (order + 1) / 2 factors 1 - q."""
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
        """(lines,): complex gain of `_high_pass`."""
        q = freqz(*self.one_pole(edge_hz), worN=frequency_hz, fs=self.sample_rate_hz)[1]
        powers = range((self.order + 1) // 2, self.order + 1)
        return np.asarray(sum(comb(self.order, j) * (1 - q) ** j * q ** (self.order - j) for j in powers))

    def one_pole(self, edge_hz: float) -> tuple[FloatArray, FloatArray]:
        """Numerator and denominator, each (2,), of q: 1 / (1 + s / w) by the bilinear transform, exact at the edge."""
        w = np.tan(np.pi * edge_hz / self.sample_rate_hz)
        return np.array([w, w]) / (1 + w), np.array([1.0, (w - 1) / (1 + w)])


def _check_rate(edges: BandEdges, sample_rate_hz: float) -> None:
    """Raise ValueError unless the sample rate exceeds twice the highest edge."""
    highest = max(edges.low_hz or 0.0, edges.high_hz or 0.0)
    if not (np.isfinite(sample_rate_hz) and sample_rate_hz > 2 * highest):
        raise ValueError(f"sample_rate_hz is {sample_rate_hz}; it must be above twice the highest edge, {highest:g} Hz")
