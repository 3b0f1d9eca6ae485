"""Build a linear mechanical model M a + D v + K q = f from force balances, with one body per command.

The rows of M, D and K are the weights of the balances without further laws; the matrices are then made symmetric. The
tolerance of a matrix is half the largest difference between its entries and those of the balances with the named laws
(not made symmetric), plus a share (`FOUND_PARAMETER_DEVIATION`) of the largest entry: 0 for a matrix of zeros, such as
the stiffness of a shaft that turns freely, which is then not re-tuned. A diagonal mass
is at least `MASSLESS_SHARE` of the force's rms over that of the acceleration, because every coordinate of a mechanical
model needs a mass.

`fit_without_model` takes the model of `build_plain_model` where there is one. `confirm.force_balance_measures` compares
with the model of `build_first_model`, and by `compute_law_power_share` decides whether it also compares in the narrow
band in which the noise is small."""

from collections.abc import Sequence

import numpy as np

from analysis.diagnosis.balance.judge_laws import Balance
from analysis.diagnosis.balance.motion import Motion
from analysis.diagnosis.first_model.reduced_recordings import is_reduction_needed
from analysis.diagnosis.limits import FOUND_PARAMETER_DEVIATION, MASSLESS_SHARE
from equalizer.plant.mechanical_model import ActuatorLimits, MechanicalModel, MechanicalModelError, Tolerance
from equalizer.signals.recording import Recording
from equalizer.signals.signal import FloatArray


def build_first_model(balances: Sequence[Balance], recording: Recording, name: str) -> MechanicalModel | None:
    """Build a linear model with the masses, dampers and springs of force balances, one per command, at least one.
    recording: reduced by `reduce_recordings` where the balances contain more than one body per command. name: of the
    model. None where the commands do not drive one measured motion each. Raises MechanicalModelError for matrices that
    are no valid model, numpy.linalg.LinAlgError where a fit fails."""
    regressions = [balance.search.regression for balance in balances]
    command_count = len(balances)
    if command_count > len(regressions[0].motions[0].channels) or command_count != len(recording.response.channels):
        return None
    driven_channels = [regression.base_terms.driven_channel for regression in regressions]
    named_laws = [tuple(law.law_index for law in balance.named if law.law_index >= 0) for balance in balances]
    rows_without_laws, rows_with_laws = (
        _fit_matrix_rows(balances, laws, driven_channels) for laws in ([()] * command_count, named_laws)
    )
    matrices = [np.array([rows[matrix_index] for rows in rows_without_laws]) for matrix_index in range(3)]
    matrices_with_laws = [np.array([rows[matrix_index] for rows in rows_with_laws]) for matrix_index in range(3)]
    mass, damping, stiffness = ((matrix + matrix.T) / 2 for matrix in matrices)
    least_inertial_force = MASSLESS_SHARE * _compute_rms(np.vstack([motion.force for motion in regressions[0].motions]))
    accelerations = [
        np.gradient(motion.velocity[:, driven_channels], 1 / motion.rate_hz, axis=0)
        for motion in regressions[0].motions
    ]
    least_masses = least_inertial_force / np.maximum(_compute_rms(np.vstack(accelerations)), 1e-300)  # no 0 / 0
    mass = mass + np.diag(np.maximum(least_masses - np.diagonal(mass), 0.0))
    tolerances = [
        float(np.max(np.abs(base_matrix - with_laws)) / 2 + FOUND_PARAMETER_DEVIATION * np.abs(base_matrix).max())
        for base_matrix, with_laws in zip((mass, damping, stiffness), matrices_with_laws, strict=True)
    ]
    return MechanicalModel(
        name,
        recording.response.quantities[0],
        mass,
        damping,
        stiffness,
        np.eye(command_count),
        np.eye(command_count),
        tolerance=Tolerance(tolerances[0], tolerances[1], tolerances[2]),
        actuator=ActuatorLimits(delay_s=_find_common_delay_s(balances)),
        rotational=recording.is_rotational,
    )


def _find_common_delay_s(balances: Sequence[Balance]) -> float:
    """Find the delay (s) that all commands share. 0 where their delays differ, because a model has a single delay, and
    where the recordings are reduced, because the reduction already removes the delay."""
    delays = {balance.search.regression.base_terms.delay_s for balance in balances}
    return delays.pop() if len(delays) == 1 and not is_reduction_needed(balances) else 0.0


def build_plain_model(balances: Sequence[Balance], recording: Recording, name: str) -> MechanicalModel | None:
    """Build the first model where at least one law is named and there is one body per command: no further fit is needed
    then. None otherwise, or where the matrices are no valid model (`build_first_model`)."""
    if not any(balance.named for balance in balances) or is_reduction_needed(balances):
        return None
    try:
        return build_first_model(balances, recording, name)
    except (MechanicalModelError, np.linalg.LinAlgError):
        return None


def compute_law_power_share(balances: Sequence[Balance], band_hz: float) -> float:
    """Compute the share of the power of a law's force that lies at frequencies up to `band_hz` (Hz): the smallest share
    of all named laws, 1 without any. Laws of the command (negative index) are not counted."""
    shares = [1.0]
    for balance in balances:
        regression = balance.search.regression
        law_indices = [judged_law.law_index for judged_law in balance.named if judged_law.law_index >= 0]
        weights, weight_index = (
            regression.fit_weights(regression.select_columns(law_indices)),
            regression.base_column_count,
        )
        for column_range in (regression.column_ranges[law_index] for law_index in law_indices):
            law_weights = weights[weight_index : weight_index + column_range.stop - column_range.start]
            weight_index += len(law_weights)
            shares.append(
                _compute_power_share(
                    [columns[:, column_range] @ law_weights for columns in regression.columns],
                    regression.motions,
                    band_hz,
                )
            )
    return min(shares)


def _compute_power_share(forces: Sequence[FloatArray], motions: Sequence[Motion], band_hz: float) -> float:
    """Compute the share of the forces' power at frequencies up to `band_hz` (Hz), 0 where all forces are equal. forces:
    (kept samples,) per motion. The mean over all recordings is subtracted, not that of each recording: where each moves
    in one direction only, friction differs between recordings by a constant, which must count as power in the band."""
    power_in_band, total_power, mean_force = 0.0, 1e-300, float(np.mean(np.concatenate(forces)))
    for force, motion in zip(forces, motions, strict=True):
        power = np.abs(np.fft.rfft(force - mean_force)) ** 2
        frequency_hz = np.fft.rfftfreq(len(force), motion.step / motion.rate_hz)
        power_in_band, total_power = (
            power_in_band + float(power[frequency_hz <= band_hz].sum()),
            total_power + float(power.sum()),
        )
    return power_in_band / total_power


def _fit_matrix_rows(
    balances: Sequence[Balance], laws: Sequence[Sequence[int]], driven_channels: Sequence[int]
) -> list[tuple[FloatArray, FloatArray, FloatArray]]:
    """Fit one row of the mass, damping and stiffness matrix, (commands,) each, to each balance with its laws. laws:
    their indices, per balance; driven_channels: channels of the driven motions. Unless the commands are reduced by the
    forces of modes and relaxations, these are left out of the fit, as of the model. A stiffness row that a balance does
    not contain is zero."""
    is_reduced, fitted_rows = is_reduction_needed(balances), []
    for balance, law_indices in zip(balances, laws, strict=True):
        regression = balance.search.regression
        select = regression.select_columns if is_reduced else regression.select_one_body_columns
        weights = regression.fit_weights(select(law_indices))[: regression.matrix_column_count]
        channel_count = len(regression.motions[0].channels)
        rows = [*weights.reshape(-1, channel_count)[:, list(driven_channels)], np.zeros(len(driven_channels))]
        fitted_rows.append((rows[0], rows[1], rows[2]))
    return fitted_rows


def _compute_rms(samples: FloatArray) -> FloatArray:
    """Compute the rms of each column about its mean, (k,). samples: (n, k)."""
    return np.asarray(np.sqrt(np.mean((samples - samples.mean(axis=0)) ** 2, axis=0)))
