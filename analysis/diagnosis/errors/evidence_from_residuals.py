"""Convert the residuals of a simulation to `Evidence`, from which an effect's starting values are estimated.

A Wiener deconvolution (`estimate_missing_force`) gives the force along each driven axis that would explain the
residuals, and the motion that it adds to the simulated one.
"""

import numpy as np

from analysis.diagnosis.data.observed import Observed
from analysis.diagnosis.forces.missing_force import estimate_missing_force
from equalizer.effects.simulation.simulator import SimulationResult
from equalizer.effects.starts.evidence import Evidence
from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.signal import FloatArray

EXPECTED_FORCE_SHARE = 0.1
"""Expected rms of a missing force, relative to the rms of the command along the same axis: the prior of the
deconvolution. Chosen by hand."""


def make_evidence(
    model: MechanicalModel,
    record: Observed,
    simulated: SimulationResult,
    residuals: FloatArray,
    scales: tuple[FloatArray, FloatArray],
) -> Evidence:
    """Make the evidence of one record. simulated: with the driven axes' motion. residuals: (n, c), residuals in units
    of the first of `scales`; NaN for missing samples, which count as zero. scales: the error measure's unit and noise,
    (c,) each, in the channels' units."""
    unit, noise = scales
    filled_residuals = np.where(np.isfinite(residuals), residuals, 0.0)
    # The least rms keeps the prior positive for an axis without command.
    expected_force_n = EXPECTED_FORCE_SHARE * np.maximum(np.sqrt(np.mean(record.command**2, axis=0)), 1e-12)
    missing_force = estimate_missing_force(
        model, filled_residuals, unit, record.recording.sample_rate_hz, expected_force_n
    )
    motion = (
        simulated.axis_position + missing_force.position,
        simulated.axis_velocity + missing_force.velocity,
        missing_force.force,
    )
    return gather_evidence(model, record, simulated, residuals * unit, noise, motion)


def gather_evidence(
    model: MechanicalModel,
    record: Observed,
    simulated: SimulationResult,
    residuals: FloatArray,
    noise: FloatArray,
    motion: tuple[FloatArray, FloatArray, FloatArray],
) -> Evidence:
    """Gather the evidence of one record. Missing samples are replaced by the simulation in the measured and in the
    predicted signals, so that their difference is zero. residuals, noise: (n, c) and (c,), in the channels' units.
    motion: position and velocity of the driven axes, and the missing force along them, (n, m) each."""
    is_measured, response_count = np.isfinite(record.measured), model.outputs
    predicted = np.hstack([simulated.response, simulated.position])[:, : is_measured.shape[1]]
    predicted = np.where(is_measured, record.measured - residuals, predicted)
    measured = np.where(is_measured, record.measured, predicted)
    has_position = measured.shape[1] > response_count
    return Evidence(
        model=model,
        sample_rate_hz=record.recording.sample_rate_hz,
        command=record.command,
        axis_position=motion[0],
        axis_velocity=motion[1],
        axis_force=motion[2],
        response=measured[:, :response_count],
        predicted=predicted[:, :response_count],
        noise=noise[:response_count],
        used=(record.fit | record.choose).astype(np.float64),
        position=measured[:, response_count:] if has_position else None,
        predicted_position=predicted[:, response_count:] if has_position else None,
        position_noise=noise[response_count:] if has_position else None,
    )
