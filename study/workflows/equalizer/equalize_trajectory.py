"""Compute the feedforward forces that make a device follow a table of target accelerations (`hapteq equalize`).

The forces are the feedforward of a finite-horizon LQR tracker (`equalizer.tracking.feedforward`) for identified models
of the device, under a force cap. With `--physics`, forces that compensate known nonlinear effects along the predicted
motion are added. `equalize_trajectory` solves and writes, `solve_trajectory` does not write.
"""

import math
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from equalizer.plant.identified_model import IdentifiedModel
from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.tracking.bands.narrow_and_wide_models import BandPredictions, solve_banded_feedforward
from equalizer.tracking.compensation.effect_compensation import Compensation, compensate
from equalizer.tracking.feedforward.feedforward import Feedforward, FeedforwardSettings
from equalizer.tracking.feedforward.trajectory import TRAJECTORY, Trajectory, require_rate
from equalizer.tracking.lqr.limits import ForceLimitError, ForcePeaks, require_under_cap
from equalizer.tracking.workspace.feedforward_at_place import compute_feedforward_at_place
from study.errors import StudyError, WrongUseError
from study.store.formats.mechanical_model_file import read_mechanical_model
from study.store.formats.trajectory_file import read_trajectory, write_trajectory
from study.workflows.equalizer.playback_models import PlaybackModels, Vector, compute_peak_gain, read_playback_models
from study.workflows.output_paths import require_new_outputs

MAX_ACCELERATION_MPS2 = 1e4
"""Largest accepted acceleration (m/s^2), a thousand times gravity: larger values indicate a wrong unit in the table."""
MAX_TRACKING_ERROR = 0.5
"""Largest accepted predicted tracking error, rms relative to that of the target signal. Chosen: at 1/2 the amplitude of
the motion is wrong by up to 6 dB."""
MIN_WEIGHT_RATIO = 1e-7
"""Least ratio of the square root of the forces' weight to the model's peak gain. Its square is added to the squared
gain; near the relative spacing of 64-bit floats (2e-16) it would be lost in rounding."""


@dataclass(frozen=True, slots=True)
class EqualizePlan:
    """Request of an equalization. models: files of identified models. trajectory: table of target accelerations. out:
    table of forces to write. at_m: place in the workspace (m), needed for models of several places. cap_n: largest
    norm of the force (N). constrain: keep the forces within the cap at the cost of accuracy, instead of raising an
    error."""

    models: tuple[Path, ...]
    trajectory: Path
    out: Path
    at_m: Vector | None = None
    weight: float = 1e-3
    """Weight of the forces in the tracker's cost, (m/s² per N)²."""
    cap_n: float = 3.0
    constrain: bool = False
    physics: Path | None = None
    """Mechanical model whose effects are compensated as far as possible; None: no compensation."""


@dataclass(frozen=True, slots=True, eq=False)
class EqualizedTrajectory:
    """Forces computed for a target trajectory, with the models and the solution behind them."""

    plan: EqualizePlan
    reference: Trajectory
    """Target accelerations (m/s²)."""
    forces: Trajectory
    """Forces to play in N, including those that compensate known effects."""
    models: PlaybackModels
    feedforward: Feedforward
    """Feedforward from the linear models alone."""
    peaks: ForcePeaks
    """Force peaks of `forces`."""
    bands: BandPredictions | None
    """Edges and predicted errors of the bands of a narrow and a wide model; None with a single band."""
    compensation: Compensation | None
    """Compensation of known effects; None without `EqualizePlan.physics`."""


def equalize_trajectory(plan: EqualizePlan) -> EqualizedTrajectory:
    """Read the inputs, solve for the forces and write them. Raises StudyError, before anything is written, where an
    output exists, an input is not valid, or the forces are refused (`solve_trajectory`)."""
    require_new_output(plan.out)
    equalized = solve_trajectory(plan)
    write_trajectory(plan.out, equalized.forces)
    return equalized


def solve_trajectory(plan: EqualizePlan) -> EqualizedTrajectory:
    """Read the inputs and solve for the forces, without writing. Raises StudyError where an input cannot be read or
    used, forces exceed the cap, or the predicted tracking error exceeds `MAX_TRACKING_ERROR`."""
    reference = _read_reference(plan.trajectory)
    models = read_playback_models(plan.models, plan.at_m, plan.weight)
    physics = None if plan.physics is None else read_mechanical_model(plan.physics)
    amplitude_n = None if physics is None else _read_amplitude_n(models.nearest)
    try:
        reference = require_rate(reference, models.most_weighted.sample_rate_hz)
        feedforward, band_predictions = _solve_feedforward(plan, reference, models)
    except ForceLimitError as limit_error:
        raise StudyError(
            "The forces would be too strong",
            f"{plan.trajectory.name}: {limit_error}.",
            "Scale the accelerations, give --constrain, or raise --cap for a device that no hand holds.",
            saved="Nothing was written.",
        ) from limit_error
    except ValueError as error:
        _require_weight(plan, models)
        raise _make_table_error(f"{plan.trajectory.name}: {error}.") from error
    _require_accuracy(plan, feedforward, in_bands=band_predictions is not None)
    compensation = None
    if physics is not None:
        compensation = _compensate_known_effects(plan, feedforward, models.most_weighted, physics, amplitude_n)
    samples = feedforward.forces.samples if compensation is None else compensation.forces
    forces = replace(feedforward.forces, samples=samples)
    peaks = require_under_cap(samples, plan.cap_n, forces.sample_rate_hz)
    return EqualizedTrajectory(
        plan,
        reference,
        Trajectory(forces, reference.start_s),
        models,
        feedforward,
        peaks,
        band_predictions,
        compensation,
    )


def require_new_output(out_path: Path, *further_paths: Path) -> None:
    """Check, before any work, that no output path exists and that their folder does. Raises StudyError."""
    require_new_outputs(out_path, *further_paths, title="The forces were not computed", kind="tables")


def _read_reference(path: Path) -> Trajectory:
    """Read the table of target accelerations (m/s²). Raises WrongUseError for another kind of table, StudyError for a
    value that is NaN or above `MAX_ACCELERATION_MPS2` in magnitude."""
    trajectory = read_trajectory(path)
    if trajectory.kind is not TRAJECTORY:
        raise WrongUseError(
            "This is no table of accelerations",
            f"{path.name} holds {trajectory.kind.name}; its header must be {','.join(TRAJECTORY.header)}.",
            "Give the wanted accelerations in m/s^2, as the last file.",
            saved="Nothing was written.",
        )
    magnitudes = np.abs(trajectory.signal.samples)
    if not magnitudes.max() <= MAX_ACCELERATION_MPS2:  # true for NaN as well
        row, axis = np.unravel_index(int(magnitudes.argmax()), magnitudes.shape)
        acceleration = trajectory.signal.samples[row, axis]
        # Column 0 of the table is the time; line 1 is the header, and lines are counted from 1.
        raise _make_table_error(
            f"{path.name} wants {acceleration:g} m/s^2 of {TRAJECTORY.header[1 + axis]} in line {row + 2}; the largest "
            f"acceleration that is accepted is {MAX_ACCELERATION_MPS2:g} m/s^2."
        )
    return trajectory


def _require_weight(plan: EqualizePlan, models: PlaybackModels) -> None:
    """Raise StudyError if the weight of the forces is lost in rounding, see `MIN_WEIGHT_RATIO`."""
    if math.sqrt(plan.weight) < MIN_WEIGHT_RATIO * max(compute_peak_gain(model) for model in models.all_models):
        raise StudyError(
            "The forces were not computed",
            f"--weight {plan.weight:g} is too small to keep forces finite where the model hardly moves.",
            "Give a weight above zero, such as --weight 0.001.",
            saved="Nothing was written.",
        )


def _require_accuracy(plan: EqualizePlan, feedforward: Feedforward, in_bands: bool) -> None:
    """Raise StudyError if the predicted error exceeds `MAX_TRACKING_ERROR` or is NaN. Where the cap reduces the
    accuracy, the error without the cap is compared. in_bands: whether narrow and wide models were combined."""
    tracking_error = feedforward.error if feedforward.loss is None else feedforward.loss.error_free
    if not tracking_error <= MAX_TRACKING_ERROR and in_bands:
        raise StudyError(
            "The forces were not computed",
            f"According to the model, the error of the best forces would be {100 * tracking_error:.0f} % of the wanted "
            "acceleration: the three bands need time to rise and decay, and the table begins or ends too close to "
            "the motion.",
            "Put 3 s of zeros before and after the motion, or give one model.",
            saved="Nothing was written.",
        )
    if not tracking_error <= MAX_TRACKING_ERROR:
        raise StudyError(
            "The forces were not computed",
            f"According to the model, the error of the best forces would be {100 * tracking_error:.0f} % of the wanted "
            f"acceleration: along some direction the device hardly moves, for --weight {plan.weight:g}.",
            "Check units and axes of the recording that it was made from and identify it again, or lower --weight.",
            saved="Nothing was written.",
        )


def _solve_feedforward(
    plan: EqualizePlan, reference: Trajectory, models: PlaybackModels
) -> tuple[Feedforward, BandPredictions | None]:
    """Solve for the feedforward forces; where narrow and wide models are combined, return also the predicted errors of
    the bands, else None. Raises ForceLimitError where the cap is exceeded, ValueError for unsuitable models."""
    settings = FeedforwardSettings(plan.weight, plan.cap_n, plan.constrain)
    if models.two_bands is None:
        return compute_feedforward_at_place(models.at_place, reference.signal, settings), None
    banded_solution = solve_banded_feedforward(models.two_bands, reference.signal, settings)
    return banded_solution.feedforward, banded_solution.predictions


def _read_amplitude_n(model: IdentifiedModel) -> float | None:
    """Read the force amplitude of the identification (N); None where the provenance states null, because the effects
    were removed from its recordings. Raises StudyError where the amplitude is missing or not above 0."""
    amplitude_n = model.provenance.get("amplitude_n", 0.0)
    if amplitude_n is None:
        return None
    if not amplitude_n > 0:
        raise StudyError(
            "Known physics cannot be compensated with this model",
            "The model's file does not state the force amplitude of its identification. The damping that friction adds "
            "depends on it: some friction is in the model already and would be counted twice.",
            "Identify it again from recordings whose segments state their amplitude, or leave out --physics.",
            saved="Nothing was written.",
        )
    return float(amplitude_n)


def _compensate_known_effects(
    plan: EqualizePlan,
    feedforward: Feedforward,
    model: IdentifiedModel,
    physics: MechanicalModel,
    amplitude_n: float | None,
) -> Compensation:
    """Add the forces of the known effects along the predicted motion. amplitude_n: as from `_read_amplitude_n`. Raises
    StudyError where the mechanical model does not match the identified one."""
    try:
        compensation = compensate(
            feedforward.forces.samples, feedforward.reference, model, physics, amplitude_n, plan.cap_n
        )
    except ValueError as error:
        raise StudyError(
            "The known physics does not fit the model",
            f"{plan.physics}: {error}.",
            "Correct the [[effect]] sections, or leave out --physics.",
            saved="Nothing was written.",
        ) from error
    return compensation


def _make_table_error(explanation: str) -> StudyError:
    """Make the error for a table that cannot be equalized with the model. explanation: a sentence."""
    return StudyError(
        "The forces were not computed",
        explanation,
        "Correct what is named, or give a table and a model that fit each other.",
        saved="Nothing was written.",
    )
