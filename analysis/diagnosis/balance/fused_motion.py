"""Fusion of measured positions and accelerations of the same points: positions with less noise at high frequencies.

The second derivative of a position with white noise of density N_p has noise of density w^4 N_p, w = 2 pi f, which
exceeds the noise N_a of a measured acceleration at high frequencies. Of all sums W p + (1 - W) a / (-w^2) of a position
p and an acceleration a, that with

    W = N_a / (N_a + w^4 N_p)

has the least noise at each frequency (weights by the inverse variance; a complementary filter whose corner is where
w^4 = N_a / N_p). The position is the reference: gain and offset of the accelerometer are fitted to it. So is the jump
of the acceleration at a change of a held command, which a reading just before that change does not contain, while the
derivative of the position contains half of it. Both are fused only where they agree: what the fit leaves, whitened by
the noise of both, must be mostly that noise. Begin at `fuse_with_accelerations`, which is called by `motion`.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.fft import rfftfreq

from analysis.diagnosis.balance.band import estimate_white_noise_density
from analysis.diagnosis.data.measured_motion import fill_gaps
from analysis.diagnosis.data.observed import Observed
from analysis.diagnosis.limits import LARGEST_SENSOR_DISAGREEMENT
from equalizer.plant.mechanical_model import DERIVATIVE_OF_QUANTITY
from equalizer.signals.band_limited import compute_end_to_end_line, compute_low_pass_gain, filter_spectrum
from equalizer.signals.signal import FloatArray

EDGE_PERIODS = 3.0
"""Periods of the upper end of the band at either end of a recording that are not compared, because a filtered sample
there depends on samples beyond the end. Chosen."""


@dataclass(frozen=True, slots=True)
class SensorNoise:
    """Spectral densities of the white noise of two sensors of a point, one-sided."""

    position: float
    """In squared units of the position per Hz."""
    acceleration: float
    """In squared units of the acceleration per Hz."""

    def compute_position_weight(self, omega: FloatArray) -> FloatArray:
        """Compute W of the module docstring at angular frequencies (rad/s)."""
        return np.asarray(self.acceleration / (self.acceleration + omega**4 * self.position))

    def compute_acceleration_weight(self, omega: FloatArray) -> FloatArray:
        """Compute (1 - W) / (-omega²), in s², which is 0 at 0."""
        return np.asarray(-(omega**2) * self.position / (self.acceleration + omega**4 * self.position))


def fuse_with_accelerations(
    records: Sequence[Observed], positions: Sequence[FloatArray], band_hz: float
) -> list[FloatArray]:
    """Fuse positions (n, d), without NaN, with the accelerations among the responses of their records. band_hz: as in
    `fuse_accelerations`."""
    responses = [record.recording.response for record in records]
    columns = [k for k, quantity in enumerate(responses[0].quantities) if DERIVATIVE_OF_QUANTITY.get(quantity) == 2]
    if not columns:
        return list(positions)
    accelerations = [fill_gaps(response.samples[:, columns]) for response in responses]
    commands = [fill_gaps(record.command) for record in records]
    return fuse_accelerations(positions, accelerations, commands, responses[0].sample_rate_hz, band_hz)


def fuse_accelerations(
    positions: Sequence[FloatArray],
    accelerations: Sequence[FloatArray],
    commands: Sequence[FloatArray],
    rate_hz: float,
    band_hz: float,
) -> list[FloatArray]:
    """Fuse the positions (n, d) of each recording with the accelerations (n, p) that agree with them, in any order;
    commands (n, m); all without NaN. band_hz: upper end of the band in which they are compared. Positions for which no
    acceleration agrees are returned as they are."""
    fused = [samples.copy() for samples in positions]
    constants = [
        np.column_stack([np.diff(samples, axis=0, prepend=samples[:1]), np.ones(len(samples))]) for samples in commands
    ]
    measured = [[samples[:, [channel]] for samples in accelerations] for channel in range(accelerations[0].shape[1])]
    acceleration_noises = [_estimate_noise(samples, rate_hz) for samples in measured]
    for column in range(positions[0].shape[1]):
        columns = [samples[:, [column]] for samples in positions]
        position_noise, least_disagreement = _estimate_noise(columns, rate_hz), LARGEST_SENSOR_DISAGREEMENT
        for acceleration, acceleration_noise in zip(measured, acceleration_noises, strict=True):
            if not min(position_noise, acceleration_noise) > 0:
                continue
            noise = SensorNoise(position_noise, acceleration_noise)
            terms = [np.hstack(pair) for pair in zip(acceleration, constants, strict=True)]
            coefficients, disagreement = _fit_acceleration(columns, terms, noise, (rate_hz, band_hz))
            if disagreement <= least_disagreement:
                least_disagreement = disagreement
                for samples, position, rows in zip(fused, columns, terms, strict=True):
                    samples[:, [column]] = _combine(position, rows @ coefficients, noise, rate_hz)
    return fused


def _estimate_noise(records: Sequence[FloatArray], rate_hz: float) -> float:
    """Estimate the density of the white noise of a channel, (n, 1) in each recording: the least over the recordings in
    which it varies; 0 where it varies in none."""
    varying = [samples[:, 0] for samples in records if np.ptp(samples) > 0]
    return min((estimate_white_noise_density(samples, rate_hz) for samples in varying), default=0.0)


def _fit_acceleration(
    positions: Sequence[FloatArray], terms: Sequence[FloatArray], noise: SensorNoise, sampling_hz: tuple[float, float]
) -> tuple[FloatArray, float]:
    """Fit the second derivatives of positions (n, 1) by sums of terms (n, k), whitened by the noise of both sensors.
    sampling_hz: sample rate and upper end of the band. Returns the coefficients (k, 1), and the mean square of the
    residual relative to that of the noise; infinity where no recording is long enough."""
    rate_hz, band_hz = sampling_hz

    def compute_whitening(omega: FloatArray) -> FloatArray:
        """Compute the gain that gives the noise of the difference the density 1 within the band."""
        low_pass = compute_low_pass_gain(omega / (2 * np.pi), band_hz)
        return np.asarray(low_pass / np.sqrt(noise.acceleration + omega**4 * noise.position))

    edge = int(EDGE_PERIODS * rate_hz / band_hz) + 1
    pairs = [(position, rows) for position, rows in zip(positions, terms, strict=True) if len(position) > 4 * edge]
    if not pairs:
        return np.zeros((terms[0].shape[1], 1)), np.inf
    derivatives = [
        _filter(position - compute_end_to_end_line(position), rate_hz, lambda w: -(w**2) * compute_whitening(w))
        for position, _ in pairs
    ]
    target = np.vstack([derivative[edge:-edge] for derivative in derivatives])
    regressors = np.vstack([_filter(rows, rate_hz, compute_whitening)[edge:-edge] for _, rows in pairs])
    coefficients = np.asarray(np.linalg.lstsq(regressors, target, rcond=None)[0], dtype=np.float64)
    lines_hz = np.linspace(0.0, rate_hz / 2, 4096)
    noise_mean_square = float(np.mean(compute_low_pass_gain(lines_hz, band_hz) ** 2)) * rate_hz / 2
    return coefficients, float(np.mean((target - regressors @ coefficients) ** 2)) / noise_mean_square


def _combine(position: FloatArray, acceleration: FloatArray, noise: SensorNoise, rate_hz: float) -> FloatArray:
    """Combine a position and an acceleration, (n, 1) each, with the least noise at each frequency."""
    line = compute_end_to_end_line(position)
    low = _filter(position - line, rate_hz, noise.compute_position_weight)
    return line + low + _filter(acceleration, rate_hz, noise.compute_acceleration_weight)


def _filter(samples: FloatArray, rate_hz: float, compute_gain: Callable[[FloatArray], FloatArray]) -> FloatArray:
    """Filter samples (n, k) by a gain over the angular frequency (rad/s). Both sensors are continued beyond the ends as
    odd functions, so that there, too, the one remains the second derivative of the other."""
    return filter_spectrum(
        samples, lambda length: compute_gain(2 * np.pi * rfftfreq(length, 1 / rate_hz)), subtract_line=False
    )
