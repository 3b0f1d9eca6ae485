"""Sentences on likely errors of a unit or a sign: a channel differs from the model's prediction by a constant factor
only, or the command is not a force.

Windows start from the measured motion and therefore follow it in any unit. There, the force that the model needs along
the motion is compared with the applied one (`predict_forces`).

A wrong unit or reversed wiring is more likely than a device with such a response. Thresholds: `UNIT_FACTOR` on the
ratio of amplitudes, `UNIT_CORRELATION` on the correlation coefficient.
"""

from collections.abc import Sequence

import numpy as np

from analysis.diagnosis.data.measured_motion import has_motion
from analysis.diagnosis.errors.error_measure import ErrorMeasure
from analysis.diagnosis.limits import UNIT_CORRELATION, UNIT_FACTOR
from analysis.diagnosis.noise.noise_floor import NoiseFloor
from analysis.diagnosis.result.findings import TimeSeries
from equalizer.effects.placing import place_recorded_effects
from equalizer.plant.mechanical_model import MechanicalModel

COMMAND, MOTION = "the command's", "the motion's"
"""The other signal whose unit may be wrong, where the compared channels are responses, and where they are forces."""


def describe_measured_doubts(
    measure: ErrorMeasure, model: MechanicalModel, floors: Sequence[NoiseFloor], time_series: Sequence[TimeSeries]
) -> tuple[str, ...]:
    """Describe the doubts in the compared signals and, for windows, in the forces. time_series: of the measure."""
    return (
        *describe_unit_doubts(time_series, MOTION if measure.name == "predicted force" else COMMAND),
        *describe_unit_doubts(predict_forces(measure, model, floors), MOTION),
    )


def predict_forces(
    measure: ErrorMeasure, model: MechanicalModel, floors: Sequence[NoiseFloor]
) -> tuple[TimeSeries, ...]:
    """Predict, per record of windows, the force that the model needs along the measured motion; measured is the applied
    one. floors: noise of each record. Empty for other measures, and where the motion does not determine the force."""
    records = measure.records
    if not measure.name.startswith("windows") or not all(has_motion(record.recording, model) for record in records):
        return ()
    # Imported here: most diagnoses compare no forces.
    from analysis.diagnosis.forces.force_measure import build_predicted_force_measure

    try:
        forces = build_predicted_force_measure(records, model, floors).measure
        residuals = forces.residuals(model, place_recorded_effects(model, records[0].recording))
    except np.linalg.LinAlgError:
        return ()
    series = []
    for record, residual in zip(forces.records, residuals, strict=True):
        is_used = record.fit | record.choose | record.test
        measured, command = record.measured[is_used], record.recording.command
        predicted = measured - residual[is_used] * forces.unit
        series.append(
            TimeSeries(
                "",
                command.sample_rate_hz,
                command.channels,
                command.units,
                measured,
                predicted,
                predicted,
                predicted,
                (),
            )
        )
    return tuple(series)


def describe_unit_doubts(time_series: Sequence[TimeSeries], other: str = COMMAND) -> tuple[str, ...]:
    """Describe, in a sentence each, the channels whose measurement differs from the given model's prediction by a
    factor of at least `UNIT_FACTOR` or at most its reciprocal, or by its sign, while both correlate well
    (`UNIT_CORRELATION`); the factor is that of the first such recording. other: see `COMMAND`."""
    factors: dict[str, float] = {}
    for series in time_series:
        for channel, name in enumerate(series.channels):
            factor = _compute_signed_ratio(series, channel)
            if factor is not None and not 1 / UNIT_FACTOR < factor < UNIT_FACTOR:
                factors.setdefault(name, factor)
    return tuple(
        f"{name} has the shape that the model predicts, but {_describe_factor(factor)}: its "
        f"{_name_likely_error(factor)}, {other} or one in the model may be wrong."
        for name, factor in factors.items()
    )


def _compute_signed_ratio(series: TimeSeries, channel: int) -> float | None:
    """Compute the ratio of the measured to the predicted rms, both about their means, with the sign of the correlation;
    None where the correlation is below `UNIT_CORRELATION` in magnitude, a signal is constant or overflows, or no sample
    of both is finite."""
    measured, predicted = series.measured[:, channel], series.before[:, channel]
    is_finite = np.isfinite(measured) & np.isfinite(predicted)
    if not is_finite.any():
        return None
    measured_deviation, predicted_deviation = (
        signal[is_finite] - np.mean(signal[is_finite]) for signal in (measured, predicted)
    )
    deviation_norms = (
        float(np.sqrt(measured_deviation @ measured_deviation)),
        float(np.sqrt(predicted_deviation @ predicted_deviation)),
    )
    covariance = float(measured_deviation @ predicted_deviation)
    if (
        min(deviation_norms) == 0
        or not np.isfinite(deviation_norms).all()
        or abs(covariance) < UNIT_CORRELATION * deviation_norms[0] * deviation_norms[1]
    ):
        return None
    return float(np.copysign(deviation_norms[0] / deviation_norms[1], covariance))


def _describe_factor(factor: float) -> str:
    """Describe the factor in words, such as "12 times as large and with the other sign"; its magnitude only from
    `UNIT_FACTOR` on, either way."""
    magnitude = max(abs(factor), 1 / abs(factor))
    magnitude_text = f"{magnitude:.3g}" if magnitude < 100 else f"{magnitude:.0f}"
    phrases = (
        [f"{magnitude_text} times {'as large' if abs(factor) > 1 else 'smaller'}"] if magnitude >= UNIT_FACTOR else []
    )
    return " and ".join([*phrases, *(["with the other sign"] if factor < 0 else [])])


def _name_likely_error(factor: float) -> str:
    """Name what is likely wrong: "sign" where the factor is negative and its magnitude plausible, else "unit"."""
    return "sign" if -UNIT_FACTOR < factor < -1 / UNIT_FACTOR else "unit"


def describe_unknown_units(model: MechanicalModel) -> str:
    """Describe, in a sentence, the unit of forces, masses, damping and stiffness where the signal of the force (the
    command, or the response to an imposed motion) is no force or torque; empty for a known unit system."""
    system = model.system
    if system.has_force_unit:
        return ""
    force_unit_text = "have no unit" if system.force == "1" else f"are in {system.force}"
    force_name_and_unit = {"m": ("force", "N"), "rad": ("torque", "N m")}.get(system.length)
    if force_name_and_unit is None:
        motion_unit_text = "has no unit" if system.length == "1" else f"is in {system.length}"
        return (
            f"Forces {force_unit_text}, as their signal, and the motion {motion_unit_text}: forces, masses and "
            "stiffnesses are given in these units and not in N or kg."
        )
    name, unit = force_name_and_unit
    divisor_text = "" if system.force == "1" else f" per {system.force}"
    return (
        f"The {name}s {force_unit_text}, as their signal: every {name}, mass, damping and stiffness must be multiplied "
        f"by the {name} constant ({unit}{divisor_text}), which is not known; state it with --force-constant."
    )
