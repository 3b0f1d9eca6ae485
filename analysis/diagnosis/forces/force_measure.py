"""Build the error measure on forces along the measured motion: choose its frequency band, compute the forces' noise.

Theory of operation. With the motion q measured, the force that a model misses follows without simulation (inverse
dynamics): the force M a + D v + K q that the model needs is compared with that of the actuators and the effects along
q, both low-pass filtered up to `band_hz`. Differentiating q twice multiplies its noise by (2 pi f)² M, so the band is,
by default, the widest tried in which that noise is at most `NOISE_SHARE` of the force, and ends where the force has
hardly any power. Noise densities of q are converted through the inverse response of the model; an actuator's own
uncertainty is added in quadrature. Samples at the ends, where the filter has no full support, are not used.
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
from analysis.diagnosis.noise.noise_floor import NoiseFloor, choose_least_noise
from equalizer.effects.simulation.forces_along_motion import compute_actuator_force
from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.band_limited import compute_low_pass_gain, filter_low_pass
from equalizer.signals.signal import FloatArray, Signal

ACTUATOR_ERROR_SHARE = 0.01
"""Least uncertainty of an actuator's force, relative to its rms; it is added to the noise. By hand."""
NOISE_SHARE = 0.02
"""Largest force noise due to the motion's noise, relative to the force's rms; differentiation amplifies it. By hand."""
WIDEST_BAND_SHARE, NARROWEST_BAND_SHARE = 0.2, 0.002
"""Largest and smallest end of the band, relative to the sample rate. By hand."""
TRIED_BAND_COUNT = 24
"""Number of band ends that are tried, in a geometric series down to the narrowest band. By hand."""
MAX_BAND_TO_MEDIAN = 10.0
"""Largest end of the band, relative to the frequency below which half of the force's power lies: far above it there is
noise alone. By hand."""
ASSUMED_NOISE_SHARE = 1e-4
"""Root of the motion's noise density relative to the motion's standard deviation, assumed where it is not known. By
hand."""


@dataclass(frozen=True, slots=True, eq=False)
class ForceMeasure:
    """The error measure on forces, with the noise of its forces."""

    measure: PredictedForce
    """Compares the forces in the commands' unit, N or N m in SI."""
    floors: tuple[NoiseFloor, ...]
    """Noise of the forces, per record."""


def build_predicted_force_measure(
    records: Sequence[Observed], model: MechanicalModel, floors: Sequence[NoiseFloor], band_hz: float | None = None
) -> ForceMeasure:
    """Build the error measure on forces along the measured motion, with its noise. records: at least one, with motion
    (`has_motion`), of one rate. floors: noise of their signals. band_hz: end of the band in Hz; None = chosen by the
    noise. Raises numpy.linalg.LinAlgError where the measured outputs do not determine the model's motion."""
    motions = [
        choose_measured_motion(record.recording, model, floor) for record, floor in zip(records, floors, strict=True)
    ]
    applied_forces = [
        compute_actuator_force(model, record.command, record.recording.sample_rate_hz, (), record.recording.hold)
        for record in records
    ]
    band_hz = band_hz or _choose_band_hz(records, motions, applied_forces, floors, model)
    force_records, force_floors = [], []
    for record, motion, force, floor in zip(records, motions, applied_forces, floors, strict=True):
        force_record = _build_force_record(record, force, band_hz)
        force_records.append(force_record)
        force_floors.append(_compute_force_noise(model, motion, floor, band_hz))
    # The samples that are compared, or all where none is: the filter distorts the force at the ends.
    used_forces = [record.measured[record.fit | record.choose | record.test] for record in force_records]
    has_role = any(len(used_force) for used_force in used_forces)
    forces = np.vstack(used_forces if has_role else [record.measured for record in force_records])
    noise_by_record = [floor.response_rms for floor in force_floors]
    least_noise = choose_least_noise(noise_by_record, [motion.position for motion in motions])
    # Where an axis rests in all records, its force has the noise that the motion of the other axes causes.
    least_noise = np.where(np.isnan(least_noise), np.fmin.reduce(noise_by_record), least_noise)
    # An unsuitable model overestimates the noise, so it is limited to the strongest force's standard deviation, because
    # that of an idle axis may be below the noise.
    noise = np.minimum(least_noise, np.std(forces, axis=0).max())
    noise = np.asarray(np.hypot(noise, ACTUATOR_ERROR_SHARE * np.sqrt(np.mean(forces**2, axis=0))))
    rate_hz = records[0].recording.sample_rate_hz
    band_motions = tuple(compute_band_motion(motion.position, rate_hz, band_hz) for motion in motions)
    measure = PredictedForce(tuple(force_records), band_motions, noise, noise, band_hz)
    return ForceMeasure(measure, tuple(force_floors))


def _choose_band_hz(
    records: Sequence[Observed],
    motions: Sequence[MeasuredMotion],
    applied_forces: Sequence[FloatArray],
    floors: Sequence[NoiseFloor],
    model: MechanicalModel,
) -> float:
    """Choose the end in Hz of the widest tried band in which the rms noise of the record with the least noise, of those
    with motion, is at most `NOISE_SHARE` of the largest rms force of any record, without its mean; the narrowest band
    where there is none."""
    rate_hz = records[0].recording.sample_rate_hz
    force_power = max(float(np.mean((force - force.mean(axis=0)) ** 2)) for force in applied_forces)
    widest_useful_share = (
        MAX_BAND_TO_MEDIAN
        * float(np.median([_compute_median_hz(force, rate_hz) for force in applied_forces]))
        / rate_hz
    )
    for band_hz in (
        np.geomspace(
            min(max(widest_useful_share, NARROWEST_BAND_SHARE), WIDEST_BAND_SHARE),
            NARROWEST_BAND_SHARE,
            TRIED_BAND_COUNT,
        )
        * rate_hz
    ):
        least_noise = min(
            (
                float(np.max(_compute_force_noise(model, motion, floor, float(band_hz)).response_rms))
                for motion, floor in zip(motions, floors, strict=True)
                if np.ptp(motion.position, axis=0).any()
            ),
            default=0.0,
        )
        if least_noise <= NOISE_SHARE * np.sqrt(force_power):
            break
    return float(band_hz)


def _compute_median_hz(force: FloatArray, rate_hz: float) -> float:
    """Compute the frequency in Hz below which half of the power of a force (n, m), without its mean, lies."""
    power = (np.abs(np.fft.rfft(force - force.mean(axis=0), axis=0)) ** 2).sum(axis=1)
    return float(np.searchsorted(np.cumsum(power), power.sum() / 2)) * rate_hz / len(force)


def _build_force_record(record: Observed, force: FloatArray, band_hz: float) -> Observed:
    """Build the record with the filtered force of its actuators as the response; the samples at its ends that the
    filter distorts, at most an eighth (by hand) each, have no role. force: (n, m), in the command's unit, means over
    the step after each sample; half a step of delay makes them means around the sample. band_hz: end of the band in
    Hz."""
    recording = record.recording
    rate_hz, command = recording.sample_rate_hz, recording.command
    filtered_force = filter_low_pass(force, rate_hz, band_hz, delay_s=0.5 / rate_hz)
    force_signal = Signal(filtered_force, rate_hz, command.quantity, command.unit, command.channels)
    force_recording = replace(recording, response=force_signal, position=None)
    edge_samples = min(count_edge_samples(rate_hz, band_hz), len(filtered_force) // 8)
    is_undistorted = np.zeros(len(filtered_force), dtype=np.bool_)
    is_undistorted[edge_samples : len(filtered_force) - edge_samples] = True
    return Observed(
        force_recording,
        record.command,
        force_signal.samples,
        record.fit & is_undistorted,
        record.choose & is_undistorted,
        record.test & is_undistorted,
    )


def _compute_force_noise(
    model: MechanicalModel, motion: MeasuredMotion, floor: NoiseFloor, band_hz: float
) -> NoiseFloor:
    """Compute the noise of the force along the motion, from the motion's noise through the model's inverse response up
    to `band_hz` (Hz). Frequencies below 1e-3 Hz (by hand) count as 1e-3 Hz; a density of the motion's noise that is not
    finite is replaced by `ASSUMED_NOISE_SHARE`. The method then stays "unknown": nothing is tested against a noise that
    was not estimated."""
    frequency_hz, input_count = floor.frequency_hz, model.inputs
    pass_gain = compute_low_pass_gain(frequency_hz, band_hz)[:, None, None]
    power_gain = (
        np.abs(pass_gain * compute_inverse_response(model, np.maximum(frequency_hz, 1e-3))[:, :input_count]) ** 2
    )
    assumed_density = (ASSUMED_NOISE_SHARE * np.std(motion.position, axis=0)) ** 2
    density = np.einsum("lij,lj->li", power_gain, np.where(np.isfinite(motion.noise), motion.noise, assumed_density))
    degrees_of_freedom = np.full(input_count, float(np.max(floor.response.freedom, initial=1.0)))
    force_noise = ChannelNoise(np.sqrt(density.mean(axis=0)), density, degrees_of_freedom, np.zeros(input_count))
    return NoiseFloor(floor.method, frequency_hz, force_noise, None, floor.remarks)
