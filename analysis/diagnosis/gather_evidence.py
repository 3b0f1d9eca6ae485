"""What starting values are drawn from: the motion and the force that a fit leaves unexplained."""

import numpy as np

from analysis.diagnosis.error_measure import FreeSimulation
from analysis.diagnosis.missing_force import missing_force
from analysis.diagnosis.output_error import Fitted
from analysis.diagnosis.tuning import Tuning
from equalizer.effects.evidence import Evidence

EXPECTED = 0.1
"""Rms of a missing force, as a share of the command's."""


def gather_evidence(measure: FreeSimulation, tuning: Tuning, fitted: Fitted) -> tuple[Evidence, ...]:
    """One per record."""
    model, found = tuning.tuned(fitted.deviations), []
    for record, left in zip(measure.records, fitted.residuals, strict=True):
        played = measure.played(model, fitted.hypothesis.placed(), record)
        residuals = np.where(np.isfinite(left), left, 0.0)
        rate_hz, p = record.recording.sample_rate_hz, model.outputs
        expected = EXPECTED * np.maximum(np.sqrt(np.mean(record.command**2, axis=0)), 1e-12)
        missing = missing_force(model, residuals, measure.unit, rate_hz, expected)
        predicted = record.measured - left * measure.unit
        seen = record.measured.shape[1] > p
        found.append(
            Evidence(
                model=model,
                sample_rate_hz=rate_hz,
                command=record.command,
                axis_position=played.axis_position + missing.position,
                axis_velocity=played.axis_velocity + missing.velocity,
                axis_force=missing.force,
                response=record.measured[:, :p],
                predicted=predicted[:, :p],
                noise=measure.noise[:p],
                used=(record.fit | record.choose).astype(np.float64),
                position=record.measured[:, p:] if seen else None,
                predicted_position=predicted[:, p:] if seen else None,
                position_noise=measure.noise[p:] if seen else None,
            )
        )
    return tuple(found)
