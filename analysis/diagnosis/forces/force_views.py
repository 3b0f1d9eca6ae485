"""Error measure by forces along the measured motion: choice of the frequency band, and noise of the forces in it.

Theory of operation. With the motion q measured, the force that a model misses follows without simulation (inverse
dynamics): the model's force M a + D v + K q + (effects along q) is compared with the actuator's force, both low-pass
filtered up to `band_hz`. Differentiating q twice multiplies its noise by (2 pi f)² M, so the band is the widest in
which that noise stays below `NOISE_SHARE` of the force, and ends where the force has no power. Noise densities of q are
converted through the inverse response of the model; an actuator's own uncertainty is added in quadrature. Samples at
the ends, where the filter has no full support, are not used. Called by `choose_measure` and `rigid_model`.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from analysis.diagnosis.data.measured_motion import MeasuredMotion, choose_measured_motion
from analysis.diagnosis.data.observed import Observed
from analysis.diagnosis.forces.inverse_dynamics import compute_band_motion
from analysis.diagnosis.forces.inverse_response import compute_inverse_response
from analysis.diagnosis.forces.predicted_force import PredictedForce, count_edge_samples
from analysis.diagnosis.noise.channel_noise import ChannelNoise
from analysis.diagnosis.noise.noise_floor import NoiseFloor
from equalizer.effects.simulation.forces_along_motion import compute_actuator_force
from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.band_limited import compute_low_pass_gain, filter_low_pass
from equalizer.signals.signal import FloatArray, Signal

ACTUATOR_ERROR = 0.01
"""Relative uncertainty of an actuator's force at best; it counts as noise. By hand."""
NOISE_SHARE = 0.02
"""Largest force noise due to the motion's noise, relative to the force's rms; differentiation amplifies it. By hand."""
WIDEST_BAND, NARROWEST_BAND = 0.2, 0.002
"""Largest and smallest end of the band, relative to the sample rate. By hand."""
TRIED_BANDS = 24
"""Number of ends that are tried between them, in a geometric series."""
BAND_OVER_MEDIAN = 10.0
"""Largest end of the band, relative to the frequency below which half of the force's power lies: far above it there is
noise alone. By hand."""
ASSUMED_NOISE = 1e-4
"""Noise of the motion relative to its rms, assumed where it is not known. By hand."""


@dataclass(frozen=True, slots=True, eq=False)
class ForceViews:
    """The error measure by predicted forces with the noise of its forces."""

    measure: PredictedForce
    floors: tuple[NoiseFloor, ...]
    """Noise of the forces, per record."""


def build_force_views(
    records: Sequence[Observed], model: MechanicalModel, floors: Sequence[NoiseFloor], band_hz: float | None = None
) -> ForceViews:
    """The error measure by forces along the measured motion, with its noise. records: with motion, see `has_motion`.
    floors: noise of their signals. band_hz: end of the band; None = by the noise. Raises numpy.linalg.LinAlgError where
    the measured outputs do not determine the model's motion."""
    motions = [
        choose_measured_motion(record.recording, model, floor) for record, floor in zip(records, floors, strict=True)
    ]
    applied_forces = [
        compute_actuator_force(model, record.command, record.recording.sample_rate_hz, (), record.recording.hold)
        for record in records
    ]
    band_hz = band_hz or _choose_band_hz(records, motions, applied_forces, floors, model)
    views, floors_of_views = [], []
    for record, motion, force, floor in zip(records, motions, applied_forces, floors, strict=True):
        view = _build_view(record, force, band_hz)
        views.append(view)
        floors_of_views.append(_compute_force_noise(model, motion, floor, band_hz))
    forces = np.vstack([view.measured for view in views])
    # An unsuitable model overestimates the noise, so it is limited to the strongest force; that of an idle axis may be
    # less than the noise.
    noise = np.minimum(np.fmin.reduce([floor.response_rms for floor in floors_of_views]), np.std(forces, axis=0).max())
    noise = np.asarray(np.hypot(noise, ACTUATOR_ERROR * np.sqrt(np.mean(forces**2, axis=0))))
    rate_hz = records[0].recording.sample_rate_hz
    band_motions = tuple(compute_band_motion(motion.position, rate_hz, band_hz) for motion in motions)
    measure = PredictedForce(tuple(views), band_motions, noise, noise, band_hz)
    return ForceViews(measure, tuple(floors_of_views))


def _choose_band_hz(
    records: Sequence[Observed],
    motions: Sequence[MeasuredMotion],
    applied_forces: Sequence[FloatArray],
    floors: Sequence[NoiseFloor],
    model: MechanicalModel,
) -> float:
    """End in Hz of the widest band in which noise stays below `NOISE_SHARE` of the force in the quietest record."""
    rate_hz = records[0].recording.sample_rate_hz
    force_power = max(float(np.mean((force - force.mean(axis=0)) ** 2)) for force in applied_forces)
    widest_share = (
        BAND_OVER_MEDIAN * float(np.median([_compute_median_hz(force, rate_hz) for force in applied_forces])) / rate_hz
    )
    for band_hz in (
        np.geomspace(min(max(widest_share, NARROWEST_BAND), WIDEST_BAND), NARROWEST_BAND, TRIED_BANDS) * rate_hz
    ):
        noise = min(
            float(np.max(_compute_force_noise(model, motion, floor, float(band_hz)).response_rms))
            for motion, floor in zip(motions, floors, strict=True)
        )
        if noise <= NOISE_SHARE * np.sqrt(force_power):
            break
    return float(band_hz)


def _compute_median_hz(force: FloatArray, rate_hz: float) -> float:
    """The frequency in Hz below which half of the power lies."""
    power = (np.abs(np.fft.rfft(force - force.mean(axis=0), axis=0)) ** 2).sum(axis=1)
    return float(np.searchsorted(np.cumsum(power), power.sum() / 2)) * rate_hz / len(force)


def _build_view(record: Observed, force: FloatArray, band_hz: float) -> Observed:
    """The record with the filtered force of its actuators as the response, without the samples at its ends. force:
    (n, m) in N."""
    recording = record.recording
    rate_hz, command = recording.sample_rate_hz, recording.command
    filtered = filter_low_pass(force, rate_hz, band_hz, delay_s=0.5 / rate_hz)
    signal = Signal(filtered, rate_hz, command.quantity, command.unit, command.channels)
    view = replace(recording, response=signal, position=None)
    edge_samples = min(count_edge_samples(rate_hz, band_hz), len(filtered) // 8)
    is_undistorted = np.zeros(len(filtered), dtype=np.bool_)
    is_undistorted[edge_samples : len(filtered) - edge_samples] = True
    return Observed(
        view,
        record.command,
        signal.samples,
        record.fit & is_undistorted,
        record.choose & is_undistorted,
        record.test & is_undistorted,
    )


def _compute_force_noise(
    model: MechanicalModel, motion: MeasuredMotion, floor: NoiseFloor, band_hz: float
) -> NoiseFloor:
    """Noise of the force along the motion, from the motion's noise through the model's inverse response."""
    frequency_hz, m = floor.frequency_hz, model.inputs
    pass_gain = compute_low_pass_gain(frequency_hz, band_hz)[:, None, None]
    gain = np.abs(pass_gain * compute_inverse_response(model, np.maximum(frequency_hz, 1e-3))[:, :m]) ** 2
    assumed_density = (ASSUMED_NOISE * np.std(motion.position, axis=0)) ** 2
    density = np.einsum("lij,lj->li", gain, np.where(np.isfinite(motion.noise), motion.noise, assumed_density))
    freedom = np.full(m, float(np.max(floor.response.freedom, initial=1.0)))
    noise = ChannelNoise(np.sqrt(density.mean(axis=0)), density, freedom, np.zeros(m))
    return NoiseFloor(floor.method, frequency_hz, noise, None, floor.remarks)
