"""Signature curve of a named effect: the residual of the model without it, against the variable that it depends on.

For forces of the mechanism and the actuator the residual is the missing force, for sensors the error of a channel. The
fitted law is part of the curve. An effect without such a variable has the spectrum of the residual.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np

from analysis.diagnosis.errors.evidence_from_residuals import EXPECTED_FORCE_SHARE
from analysis.diagnosis.forces.missing_force import estimate_missing_force
from analysis.diagnosis.result.curves.law_curves import compute_law_signature
from analysis.diagnosis.result.curves.signature_bins import (
    compute_bin_means,
    compute_law_bin_means,
    compute_running_rms,
)
from analysis.diagnosis.result.findings import Signature
from equalizer.effects.effect import OnCommand, OnResponse, PlacedEffect, Structure
from equalizer.effects.simulation.simulator import SimulationResult, simulate_mechanism
from equalizer.effects.starts.evidence import Evidence
from equalizer.signals.recording import Hold
from equalizer.signals.signal import FloatArray
from equalizer.signals.spectral_density import estimate_spectral_density
from equalizer.signals.unit_system import LINEAR, UnitSystem

Abscissa = Literal["velocity", "position", "acceleration", "command", "reading", "time", "growth", "frequency"]
"""Variable of a curve; "growth": running rms over time, for an error that grows."""

ABSCISSA_BY_EFFECT: Mapping[str, Abscissa] = {
    "coulomb_friction": "velocity",
    "asymmetric_friction": "velocity",
    "stribeck_friction": "velocity",
    "viscous_damping": "velocity",
    "quadratic_damping": "velocity",
    "position_dependent_friction": "velocity",
    "presliding_hysteresis": "velocity",
    "added_mass": "acceleration",
    "hardening_stiffness": "position",
    "asymmetric_stiffness": "position",
    "constant_force": "position",
    "gravity_torque": "position",
    "cogging": "position",
    "end_stop": "position",
    "force_saturation": "command",
    "force_deadband": "command",
    "force_gain": "command",
    "force_nonlinearity": "command",
    "sensor_clipping": "reading",
    "sensor_gain": "reading",
    "sensor_nonlinearity": "reading",
    "sensor_misalignment": "reading",
    "cross_axis_sensitivity": "reading",
    "sensor_offset": "time",
    "sensor_drift": "time",
    "clock_drift": "growth",
}
"""Variable of each effect's curve; an effect that is not listed is shown as a spectrum ("frequency"), except a
discovered law that `law_curves` can draw."""
_SPECTRAL_LINES = 1024
"""Largest number of spectral lines before they are averaged in twelfths of an octave. Chosen by hand."""


@dataclass(frozen=True, slots=True)
class CurveNames:
    """Axis and channel names, and units, for the labels of a curve."""

    axes: tuple[str, ...]
    """Names of the driven axes."""
    channels: tuple[str, ...]
    """Names of the response's channels."""
    unit: str
    """Unit of the response."""
    system: UnitSystem = LINEAR
    """Units of motion and force."""


def compute_signature(
    evidence: Evidence, complete_prediction: FloatArray, placed_effect: PlacedEffect, names: CurveNames, hold: Hold
) -> Signature:
    """Compute the curve of one effect. evidence: of the final model with all its effects except this one.
    complete_prediction: (n, p), prediction of the final model with all its effects. hold: of the commands between
    samples."""
    law_signature = compute_law_signature(evidence, placed_effect, names.axes, names.system)
    if law_signature is not None:
        return law_signature
    action, abscissa = placed_effect.effect.action, ABSCISSA_BY_EFFECT.get(placed_effect.effect.name, "frequency")
    if abscissa in ("velocity", "position", "acceleration") and not isinstance(action, (OnCommand, OnResponse)):
        return _compute_motion_signature(evidence, placed_effect, abscissa, names, hold)
    if abscissa == "command" and isinstance(action, OnCommand):
        return _compute_command_signature(evidence, placed_effect, names)
    if abscissa in ("reading", "time", "growth") and isinstance(action, OnResponse):
        changed_signal = action.change(
            evidence.predicted, evidence.sample_rate_hz, placed_effect.sites, placed_effect.values
        )
        if abscissa == "reading":
            return _compute_reading_signature(evidence, placed_effect, changed_signal - evidence.predicted, names)
        return _compute_time_signature(evidence, placed_effect, changed_signal - evidence.predicted, names, abscissa)
    return _compute_frequency_signature(evidence, complete_prediction - evidence.predicted, placed_effect, names)


def _compute_motion_signature(
    evidence: Evidence, placed_effect: PlacedEffect, abscissa: Abscissa, names: CurveNames, hold: Hold
) -> Signature:
    """Compute the curve of the missing force over the motion, on the effect's axis with the largest missing force."""
    axis = _find_strongest_site(placed_effect.sites, evidence.axis_force)
    simulated = simulate_mechanism(evidence.model, evidence.command, evidence.sample_rate_hz, (placed_effect,), hold)
    force = simulated.axis_force
    if isinstance(placed_effect.effect.action, Structure):
        force = _compute_equivalent_force(evidence, simulated, hold)
    is_used, unit = evidence.used > 0, names.system.length
    unit += {"position": "", "velocity": "/s", "acceleration": "/s^2"}[abscissa]
    measured_abscissa, simulated_abscissa = (
        _compute_abscissa(position[:, axis], velocity[:, axis], abscissa, evidence.sample_rate_hz)
        for position, velocity in (
            (evidence.axis_position, evidence.axis_velocity),
            (simulated.axis_position, simulated.axis_velocity),
        )
    )
    bin_centres, mean, spread = compute_bin_means(
        measured_abscissa, evidence.axis_force[:, axis], is_used, evidence.sample_rate_hz
    )
    law_abscissa, law_force = compute_law_bin_means(simulated_abscissa[is_used], force[is_used, axis])
    return Signature(
        placed_effect.effect.name, names.axes[axis], f"{abscissa} of {names.axes[axis]} ({unit})",
        f"missing force ({names.system.force})", bin_centres, mean, spread, law_abscissa, law_force,
    )  # fmt: skip


def _compute_abscissa(position: FloatArray, velocity: FloatArray, abscissa: Abscissa, rate_hz: float) -> FloatArray:
    """Compute position, velocity or acceleration (n,) of an axis; its acceleration by differences of the velocity."""
    if abscissa == "acceleration":
        return np.asarray(np.gradient(velocity) * rate_hz)
    return velocity if abscissa == "velocity" else position


def _compute_equivalent_force(evidence: Evidence, with_effect: SimulationResult, hold: Hold) -> FloatArray:
    """Compute by deconvolution the force (n, m), in the commands' unit, that causes the same responses of the model
    without the effect."""
    without_effect = simulate_mechanism(evidence.model, evidence.command, evidence.sample_rate_hz, (), hold)
    response_changes, noise_levels = [with_effect.response - without_effect.response], [evidence.noise]
    if evidence.position_noise is not None:
        response_changes.append(with_effect.position - without_effect.position)
        noise_levels.append(evidence.position_noise)
    # 1e-12 N keeps the prior of the deconvolution positive for an axis without command.
    expected_force = EXPECTED_FORCE_SHARE * np.maximum(np.sqrt(np.mean(evidence.command**2, axis=0)), 1e-12)
    noise = np.concatenate(noise_levels)
    return estimate_missing_force(
        evidence.model, np.hstack(response_changes) / noise, noise, evidence.sample_rate_hz, expected_force
    ).force


def _compute_command_signature(evidence: Evidence, placed_effect: PlacedEffect, names: CurveNames) -> Signature:
    """Compute the curve of the missing force over the command of its axis; the law is the change of the command."""
    assert isinstance(placed_effect.effect.action, OnCommand)
    axis = _find_strongest_site(placed_effect.sites, evidence.axis_force)
    command, is_used = evidence.command[:, axis], evidence.used > 0
    changed_command = placed_effect.effect.action.change(command, 1 / evidence.sample_rate_hz, placed_effect.values)
    bin_centres, mean, spread = compute_bin_means(
        command, evidence.axis_force[:, axis], is_used, evidence.sample_rate_hz
    )
    law_abscissa, law_values = compute_law_bin_means(command[is_used], (changed_command - command)[is_used])
    unit = names.system.force
    return Signature(
        placed_effect.effect.name, names.axes[axis], f"command of {names.axes[axis]} ({unit})",
        f"missing force ({unit})", bin_centres, mean, spread, law_abscissa, law_values,
    )  # fmt: skip


def _compute_reading_signature(
    evidence: Evidence, placed_effect: PlacedEffect, change: FloatArray, names: CurveNames
) -> Signature:
    """Compute the curve of a channel's error over the predicted reading of a channel, for the pair in which that
    reading explains most of the change (n, p) of the readings by the effect."""
    is_used = evidence.used > 0
    predictions = evidence.predicted[is_used]
    # Projection of the change of one channel on the unit vector of the reading of another; 1e-300 avoids 0 / 0.
    projections = np.abs(change[is_used].T @ predictions) / np.maximum(np.sqrt(np.sum(predictions**2, axis=0)), 1e-300)
    channel, predictor = np.unravel_index(int(np.argmax(projections)), projections.shape)
    errors = (evidence.response - evidence.predicted)[:, channel]
    bin_centres, mean, spread = compute_bin_means(
        evidence.predicted[:, predictor], errors, is_used, evidence.sample_rate_hz
    )
    law_abscissa, law_values = compute_law_bin_means(predictions[:, predictor], change[is_used, channel])
    return Signature(
        placed_effect.effect.name, names.channels[channel], f"predicted {names.channels[predictor]} ({names.unit})",
        f"error of {names.channels[channel]} ({names.unit})", bin_centres, mean, spread, law_abscissa, law_values,
    )  # fmt: skip


def _compute_time_signature(
    evidence: Evidence, placed_effect: PlacedEffect, change: FloatArray, names: CurveNames, abscissa: Abscissa
) -> Signature:
    """Compute the curve over time of the error of the channel with the largest change (n, p) relative to the noise; of
    its running rms where the abscissa is "growth"."""
    is_used, rate_hz = evidence.used > 0, evidence.sample_rate_hz
    channel = int(np.argmax(np.sqrt(np.mean(change[is_used] ** 2, axis=0)) / evidence.noise))
    errors, times_s = (evidence.response - evidence.predicted)[:, channel], np.arange(len(change)) / rate_hz
    ordinate = f"error of {names.channels[channel]} ({names.unit})"
    if abscissa == "growth":
        bin_centres, mean, spread = compute_running_rms(times_s, errors, is_used)
        law_abscissa, law_values, _ = compute_running_rms(
            times_s, np.hypot(change[:, channel], evidence.noise[channel]), is_used
        )
        ordinate = f"rms {ordinate}"
    else:
        bin_centres, mean, spread = compute_bin_means(times_s, errors, is_used, rate_hz)
        law_abscissa, law_values = compute_law_bin_means(times_s[is_used], change[is_used, channel])
    return Signature(
        placed_effect.effect.name,
        names.channels[channel],
        "time (s)",
        ordinate,
        bin_centres,
        mean,
        spread,
        law_abscissa,
        law_values,
    )


def _compute_frequency_signature(
    evidence: Evidence, change: FloatArray, placed_effect: PlacedEffect, names: CurveNames
) -> Signature:
    """Compute the spectrum of the error of the channel with the largest change relative to the noise, and that of the
    change (n, p) of the prediction by the effect."""
    rate_hz, is_used = evidence.sample_rate_hz, evidence.used > 0
    errors = evidence.response - evidence.predicted
    channel = int(np.argmax(np.sqrt(np.mean(change[is_used] ** 2, axis=0)) / evidence.noise))
    frequency_hz, amplitude_density, spread = _compute_spectrum(errors[is_used, channel], rate_hz)
    _, law_density, _ = _compute_spectrum(change[is_used, channel], rate_hz)
    return Signature(
        placed_effect.effect.name, names.channels[channel], "frequency (Hz)",
        f"error of {names.channels[channel]}, amplitude density ({names.unit}/√Hz)",
        frequency_hz, amplitude_density, spread, frequency_hz, law_density,
    )  # fmt: skip


def _compute_spectrum(signal: FloatArray, rate_hz: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Compute frequency (Hz), amplitude density (unit/√Hz) in twelfths of an octave, and its standard error.
    Half-overlapping Hann windows count as 1.5 independent ones per window length; the relative error of an amplitude is
    half that of its power."""
    window_samples = min(2 * _SPECTRAL_LINES, len(signal))
    lines_hz, power = estimate_spectral_density(signal, rate_hz, window_samples)
    window_count = max(1.0, 1.5 * len(signal) / window_samples)
    edges = np.geomspace(lines_hz[1], lines_hz[-1], int(12 * np.log2(lines_hz[-1] / lines_hz[1])) + 1)
    bin_by_line = np.digitize(lines_hz[1:], edges)
    binned_power = [power[1:][bin_by_line == bin_index] for bin_index in np.unique(bin_by_line)]
    centres_hz = np.array(
        [float(np.exp(np.mean(np.log(lines_hz[1:][bin_by_line == bin_index])))) for bin_index in np.unique(bin_by_line)]
    )
    amplitude = np.array([float(np.sqrt(power_of_bin.mean())) for power_of_bin in binned_power])
    return (
        centres_hz,
        amplitude,
        amplitude / 2 / np.sqrt(window_count * np.array([len(power_of_bin) for power_of_bin in binned_power])),
    )


def _find_strongest_site(sites: tuple[int, ...], force: FloatArray) -> int:
    """Find the site with the largest mean square of force (n, m)."""
    return max(sites, key=lambda site: float(np.mean(force[:, site] ** 2)))
