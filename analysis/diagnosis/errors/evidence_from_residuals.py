"""Convert the residuals of a simulation to `Evidence`, from which an effect's starting values are estimated.

A Wiener deconvolution (`estimate_missing_force`) gives the force along each driven axis that would explain the
residuals, and the motion that it adds to the simulated one. The laws of the effects are then regressed on this force
and motion.
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
deconvolution."""


def evidence_of(
    model: MechanicalModel,
    record: Observed,
    simulated: SimulationResult,
    residuals: FloatArray,
    scales: tuple[FloatArray, FloatArray],
) -> Evidence:
    """The evidence of one record. simulated: with the driven axes' motion. residuals: (n, c), residuals in units of the
    first of `scales`; NaN for missing samples, which count as zero. scales: the error measure's unit and noise, (c,)
    each, in the channels' units."""
    unit, noise = scales
    filled_residuals = np.where(np.isfinite(residuals), residuals, 0.0)
    rate_hz, p = record.recording.sample_rate_hz, model.outputs
    expected = EXPECTED_FORCE_SHARE * np.maximum(np.sqrt(np.mean(record.command**2, axis=0)), 1e-12)
    missing = estimate_missing_force(model, filled_residuals, unit, rate_hz, expected)
    measured, predicted = fill_gaps(record.measured, residuals * unit, simulated)
    has_position = measured.shape[1] > p
    return Evidence(
        model=model,
        sample_rate_hz=rate_hz,
        command=record.command,
        axis_position=simulated.axis_position + missing.position,
        axis_velocity=simulated.axis_velocity + missing.velocity,
        axis_force=missing.force,
        response=measured[:, :p],
        predicted=predicted[:, :p],
        noise=noise[:p],
        used=(record.fit | record.choose).astype(np.float64),
        position=measured[:, p:] if has_position else None,
        predicted_position=predicted[:, p:] if has_position else None,
        position_noise=noise[p:] if has_position else None,
    )


def fill_gaps(
    measured: FloatArray, residuals: FloatArray, simulated: SimulationResult
) -> tuple[FloatArray, FloatArray]:
    """Measured and predicted signals, (n, c) each, without gaps: missing samples are replaced by the simulation in
    both, so that their difference is zero. residuals: (n, c), in the channels' units."""
    is_measured = np.isfinite(measured)
    predicted = np.hstack([simulated.response, simulated.position])[:, : measured.shape[1]]
    predicted = np.where(is_measured, measured - residuals, predicted)
    return np.where(is_measured, measured, predicted), predicted
