"""Complementary filters (crossovers): split a signal into low, middle and high bands whose sum is the signal.

The split precedes the inversion of a model, because the model is not valid outside its band: where the device's gain is
high there, even small content outside the band causes a large error. Two forms: linear-phase FIR filters, steep and
without phase error but with a latency, for signals known in advance (used by `feedforward` and `bands`); causal
filters, without latency but with shallow slopes, for signals that begin at a contact (used by `bands` and
`realtime`).
"""

from dataclasses import dataclass
from functools import cached_property
from math import comb

import numpy as np
from scipy.signal import firwin, freqz, kaiser_beta, lfilter, oaconvolve

from equalizer.signals.signal import ComplexArray, FloatArray

STOPBAND_DB = 60.0
"""Attenuation (dB) of the linear-phase filters in their stopband. Chosen: 0.1 % of an amplitude remains."""
CAUSAL_ORDER = 3
"""Order of the causal filters. An odd order gives both sides of a crossover the same slope: 12 dB per octave for 3."""


@dataclass(frozen=True, slots=True)
class BandEdges:
    """Crossover frequencies (Hz), at which adjacent bands have about equal gain. None: that outer band does not exist,
    and the middle band extends to 0 Hz or to half the sample rate. Raises ValueError for an edge that is not positive
    and finite, and for a low edge that is not below the high edge."""

    low_hz: float | None = 4.0
    """Crossover between the low and the middle band. The default, 4 Hz, is 1 Hz below a model band that begins at 5 Hz,
    so that the middle band keeps all of it."""
    high_hz: float | None = 36.0
    """Crossover between the middle and the high band; the default is 1 Hz above a model band that ends at 35 Hz."""

    def __post_init__(self) -> None:
        for name in ("low_hz", "high_hz"):
            edge_hz = getattr(self, name)
            if edge_hz is not None and not (np.isfinite(edge_hz) and edge_hz > 0):
                raise ValueError(f"{name} is {edge_hz}; it must be a positive number, or None for no such band")
        if self.low_hz is not None and self.high_hz is not None and self.low_hz >= self.high_hz:
            raise ValueError(f"low_hz is {self.low_hz:g}, not below high_hz, {self.high_hz:g}")


@dataclass(frozen=True, slots=True, eq=False)
class Bands:
    """Three arrays (N, channels), in the unit of the signal; low + middle + high is the input, delayed by
    `latency_samples`. Result of both `split` methods."""

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
    """Linear-phase FIR filters (Kaiser window): no phase error, but a latency of `latency_ms`. Their impulse responses
    are symmetric about it, so that content spreads to earlier and later samples by up to the latency. Raises ValueError
    for a transition width that is not positive or exceeds twice the lowest edge, and for a sample rate of at most twice
    the highest edge."""

    edges: BandEdges
    sample_rate_hz: float
    transition_hz: float = 2.0
    """Width (Hz) of each crossover's transition band; the latency is inversely proportional to it. Default chosen."""

    def __post_init__(self) -> None:
        _check_sample_rate(self.edges, self.sample_rate_hz)
        lowest_edge_hz = self.edges.low_hz or self.edges.high_hz
        if not 0 < self.transition_hz <= 2 * (lowest_edge_hz or np.inf):
            raise ValueError(
                f"transition_hz is {self.transition_hz}; it must be positive and at most twice the lowest edge"
            )

    @property
    def latency_samples(self) -> int:
        """Half the filter order, rounded up, by Kaiser's formula: order = (A - 7.95) / (2.285 width), with A =
        STOPBAND_DB and the transition width in rad per sample (Oppenheim and Schafer, Discrete-Time Signal Processing,
        section on Kaiser windows). 0 without edges."""
        if self.edges.low_hz is None and self.edges.high_hz is None:
            return 0
        width_rad = 2 * np.pi * self.transition_hz / self.sample_rate_hz
        return int(np.ceil((STOPBAND_DB - 7.95) / (2.285 * width_rad) / 2))

    @property
    def latency_ms(self) -> float:
        """Latency in ms."""
        return 1e3 * self.latency_samples / self.sample_rate_hz

    @cached_property
    def filters(self) -> FloatArray:
        """(3, taps): impulse responses of low, middle and high; their sum is an impulse delayed by the latency. taps =
        2 latency_samples + 1."""
        tap_count = 2 * self.latency_samples + 1
        impulse, zeros = np.zeros(tap_count), np.zeros(tap_count)
        impulse[self.latency_samples] = 1.0
        low_taps = zeros if self.edges.low_hz is None else self._design_low_pass(self.edges.low_hz)
        below_high_taps = impulse if self.edges.high_hz is None else self._design_low_pass(self.edges.high_hz)
        return np.stack([low_taps, below_high_taps - low_taps, impulse - below_high_taps])

    def split(self, reference: FloatArray) -> Bands:
        """Split the reference (N, channels) by convolution. The bands have N + 2 latency_samples rows, because they
        include the start and the decay of the filters."""
        low_taps, _, high_taps = self.filters
        delayed_reference = np.pad(np.asarray(reference, dtype=np.float64), ((self.latency_samples,) * 2, (0, 0)))
        low_band = oaconvolve(reference, low_taps[:, None], axes=0)
        high_band = oaconvolve(reference, high_taps[:, None], axes=0)
        return Bands(low_band, delayed_reference - low_band - high_band, high_band, self.latency_samples)

    def compute_response(self, frequency_hz: FloatArray) -> ComplexArray:
        """Compute the frequency responses of low, middle and high, (lines, 3), with the latency removed: they are real
        up to rounding. frequency_hz: (lines,)."""
        delay_removal = np.exp(2j * np.pi * np.asarray(frequency_hz) * self.latency_samples / self.sample_rate_hz)
        band_gains = [freqz(taps, worN=frequency_hz, fs=self.sample_rate_hz)[1] for taps in self.filters]
        return np.asarray(np.stack(band_gains, axis=1) * delay_removal[:, None])

    def _design_low_pass(self, edge_hz: float) -> FloatArray:
        """Design a low-pass by the window method, with a gain of 1/2 at edge_hz (Hz): impulse response (taps,)."""
        window = ("kaiser", kaiser_beta(STOPBAND_DB))
        taps = firwin(2 * self.latency_samples + 1, edge_hz, window=window, fs=self.sample_rate_hz)
        return np.asarray(taps)


@dataclass(frozen=True, slots=True, eq=False)
class CausalSplit:
    """Complementary causal filters whose sum is the input without delay. Each band has a phase, see
    `compute_phase_deg`.

    With a first-order low-pass q, (q + (1 - q))^order = 1. Its binomial terms with the higher powers of 1 - q make the
    band above the crossover, the others the band below. Near a crossover the gain of a single band may exceed 1
    (`largest_gain`): the bands partly cancel there, but the errors with which each band is reproduced do not cancel.
    Raises ValueError for an even or non-positive order, and for a sample rate of at most twice the highest edge.
    """

    edges: BandEdges
    sample_rate_hz: float
    order: int = CAUSAL_ORDER
    """Odd and positive; each side of a crossover falls off by 3 (order + 1) dB per octave."""

    def __post_init__(self) -> None:
        _check_sample_rate(self.edges, self.sample_rate_hz)
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
        """Split the reference (N, channels), with filters that start at rest; the bands have N rows."""
        samples = np.asarray(reference, dtype=np.float64)
        high_band = self._filter_above(self.edges.high_hz, samples) if self.edges.high_hz else np.zeros_like(samples)
        below_high_edge = samples - high_band
        low_band = (
            below_high_edge - self._filter_above(self.edges.low_hz, below_high_edge)
            if self.edges.low_hz
            else np.zeros_like(samples)
        )
        return Bands(low_band, below_high_edge - low_band, high_band, 0)

    def compute_response(self, frequency_hz: FloatArray) -> ComplexArray:
        """Compute the complex gains of low, middle and high, (lines, 3); their sum is 1. frequency_hz: (lines,)."""
        zeros = np.zeros(len(frequency_hz), complex)
        high_gain = self._compute_gain_above(self.edges.high_hz, frequency_hz) if self.edges.high_hz else zeros
        low_gain = (
            (1 - high_gain) * (1 - self._compute_gain_above(self.edges.low_hz, frequency_hz))
            if self.edges.low_hz
            else zeros
        )
        return np.asarray(np.stack([low_gain, 1 - low_gain - high_gain, high_gain], axis=1))

    def compute_phase_deg(self, frequency_hz: FloatArray) -> FloatArray:
        """Compute the phase of each band relative to the input, (lines, 3), in degrees; positive is a lead.
        frequency_hz: (lines,)."""
        return np.asarray(np.degrees(np.angle(self.compute_response(frequency_hz))))

    @property
    def largest_gain(self) -> float:
        """Largest gain of any band, sampled at 2000 frequencies from 0.05 Hz to just below half the sample rate."""
        frequency_hz = np.geomspace(0.05, 0.499 * self.sample_rate_hz, 2000)
        return float(np.abs(self.compute_response(frequency_hz)).max())

    def _filter_above(self, edge_hz: float, samples: FloatArray) -> FloatArray:
        """Filter the samples (N, channels) to the band above an edge (Hz): the binomial terms with at least (order + 1)
        / 2 factors 1 - q."""
        coefficients = self.design_one_pole(edge_hz)
        band_above = np.zeros_like(samples)
        for power in range((self.order + 1) // 2, self.order + 1):
            term = samples
            for _ in range(self.order - power):
                term = lfilter(*coefficients, term, axis=0)
            for _ in range(power):
                term = term - lfilter(*coefficients, term, axis=0)
            band_above += comb(self.order, power) * term
        return band_above

    def _compute_gain_above(self, edge_hz: float, frequency_hz: FloatArray) -> ComplexArray:
        """Compute the complex gain (lines,) of `_filter_above`. frequency_hz: (lines,)."""
        q = freqz(*self.design_one_pole(edge_hz), worN=frequency_hz, fs=self.sample_rate_hz)[1]
        powers = range((self.order + 1) // 2, self.order + 1)
        return np.asarray(
            sum(comb(self.order, power) * (1 - q) ** power * q ** (self.order - power) for power in powers)
        )

    def design_one_pole(self, edge_hz: float) -> tuple[FloatArray, FloatArray]:
        """Design the first-order low-pass q = 1 / (1 + s / w) by the bilinear transform, with the frequency axis
        corrected so that its corner is at edge_hz (Hz): numerator and denominator, (2,) each."""
        warped_corner = np.tan(np.pi * edge_hz / self.sample_rate_hz)
        return np.array([warped_corner, warped_corner]) / (1 + warped_corner), np.array(
            [1.0, (warped_corner - 1) / (1 + warped_corner)]
        )


def _check_sample_rate(edges: BandEdges, sample_rate_hz: float) -> None:
    """Raise ValueError unless the sample rate exceeds twice the highest edge."""
    highest_edge_hz = max(edges.low_hz or 0.0, edges.high_hz or 0.0)
    if not (np.isfinite(sample_rate_hz) and sample_rate_hz > 2 * highest_edge_hz):
        raise ValueError(
            f"sample_rate_hz is {sample_rate_hz}; it must be above twice the highest edge, {highest_edge_hz:g} Hz"
        )
