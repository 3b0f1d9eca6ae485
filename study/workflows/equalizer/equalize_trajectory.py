"""`hapteq equalize`: a table of forces from a table of wanted accelerations and identified models of the device.

The forces are the feedforward of an LQR tracker (`equalizer.tracking.feedforward`) under the cap. With `--physics`, the
forces of known nonlinear effects along the predicted motion are added. Each refusal names its cause and a remedy.
"""

import math
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from equalizer.plant.identified_model import IdentifiedModel
from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.tracking.bands.narrow_and_wide_models import BandFacts, solve_banded_feedforward
from equalizer.tracking.compensation.effect_compensation import Compensation, compensate
from equalizer.tracking.feedforward.feedforward import Feedforward, FeedforwardSettings
from equalizer.tracking.feedforward.trajectory import TRAJECTORY, Trajectory, require_rate
from equalizer.tracking.lqr.limits import ForceLimitError, ForcePeaks, require_under_cap
from equalizer.tracking.workspace.feedforward_at_place import feedforward_at
from study.errors import StudyError, WrongUseError
from study.store.formats.mechanical_model_file import read_mechanical_model
from study.store.formats.trajectory_file import read_trajectory, write_trajectory
from study.workflows.equalizer.playback_models import PlaybackModels, Vector, compute_peak_gain, read_playback_models
from study.workflows.free_name import require_free

HIGHEST_MPS2 = 1e4
"""Largest accepted acceleration (m/s^2), a thousand times gravity: larger values indicate a wrong unit in the table."""
LARGEST_ERROR = 0.5
"""Predicted tracking error, relative to the wanted signal, above which forces are refused."""
LEAST_WEIGHT_RATIO = 1e-7
"""Ratio of the root of the force's weight to the model's peak gain below which the weight is lost in rounding."""


@dataclass(frozen=True, slots=True)
class EqualizePlan:
    """Request of an equalization: files of identified models, table of wanted accelerations, table of forces to write.
    at_m: place in the workspace (m). cap_n: largest force (N). constrain: keep the forces below the cap at the cost of
    accuracy, instead of refusing."""

    models: tuple[Path, ...]
    trajectory: Path
    out: Path
    at_m: Vector | None = None
    weight: float = 1e-3
    """Weight of the forces in the tracker's cost."""
    cap_n: float = 3.0
    constrain: bool = False
    physics: Path | None = None
    """Mechanical model whose named effects are compensated."""


@dataclass(frozen=True, slots=True, eq=False)
class EqualizedTrajectory:
    """Forces computed for a wanted trajectory, with the models and the solution behind them."""

    plan: EqualizePlan
    reference: Trajectory
    forces: Trajectory
    """Forces to play in N, including those that compensate known effects."""
    models: PlaybackModels
    feedforward: Feedforward
    """Feedforward from the linear models alone."""
    peaks: ForcePeaks
    """Force peaks of `forces`."""
    bands: BandFacts | None
    compensation: Compensation | None


def equalize_trajectory(plan: EqualizePlan) -> EqualizedTrajectory:
    """Read, solve and write. Raises StudyError; nothing is written then."""
    check_free(plan.out)
    equalized = solve_trajectory(plan)
    write_trajectory(plan.out, equalized.forces)
    return equalized


def solve_trajectory(plan: EqualizePlan) -> EqualizedTrajectory:
    """Read and solve without writing. Raises StudyError."""
    reference = _read_reference(plan.trajectory)
    models = read_playback_models(plan.models, plan.at_m, plan.weight)
    physics = None if plan.physics is None else read_mechanical_model(plan.physics)
    amplitude_n = None if physics is None else _amplitude_n(models.nearest)
    try:
        require_rate(reference, models.most_weighted.sample_rate_hz)
        feedforward, bands = _solve(plan, reference, models)
    except ForceLimitError as limit:
        raise StudyError(
            "The forces would be too strong",
            f"{plan.trajectory.name}: {limit}.",
            "Scale the accelerations, give --constrain, or raise --cap for a device that no hand holds.",
            saved="Nothing was written.",
        ) from limit
    except ValueError as problem:
        _require_weight(plan, models)
        raise _not_equalized(f"{plan.trajectory.name}: {problem}.") from problem
    _require_reached(plan, feedforward, in_bands=bands is not None)
    compensation = None
    if physics is not None:
        compensation = _compensate(plan, feedforward, models.most_weighted, physics, amplitude_n)
    samples = feedforward.forces.samples if compensation is None else compensation.forces
    forces = replace(feedforward.forces, samples=samples)
    peaks = require_under_cap(samples, plan.cap_n, forces.sample_rate_hz)
    return EqualizedTrajectory(
        plan, reference, Trajectory(forces, reference.start_s), models, feedforward, peaks, bands, compensation
    )


def check_free(out_path: Path, *further_paths: Path) -> None:
    """Check the output paths before any work. Raises StudyError."""
    require_free(out_path, *further_paths, title="The forces were not computed", kind="tables")


def _read_reference(path: Path) -> Trajectory:
    trajectory = read_trajectory(path)
    if trajectory.kind is not TRAJECTORY:
        raise WrongUseError(
            "This is no table of accelerations",
            f"{path.name} holds {trajectory.kind.name}; its header must be {','.join(TRAJECTORY.header)}.",
            "Give the wanted accelerations in m/s^2, as the last file.",
            saved="Nothing was written.",
        )
    sizes = np.abs(trajectory.signal.samples)
    if not sizes.max() <= HIGHEST_MPS2:
        row, axis = np.unravel_index(int(sizes.argmax()), sizes.shape)
        acceleration = trajectory.signal.samples[row, axis]
        raise _not_equalized(
            f"{path.name} wants {acceleration:g} m/s^2 of {TRAJECTORY.header[1 + axis]} in line {row + 2}; the largest "
            f"acceleration that is accepted is {HIGHEST_MPS2:g} m/s^2."
        )
    return trajectory


def _require_weight(plan: EqualizePlan, models: PlaybackModels) -> None:
    if math.sqrt(plan.weight) < LEAST_WEIGHT_RATIO * max(compute_peak_gain(model) for model in models.all_models):
        raise StudyError(
            "The forces were not computed",
            f"--weight {plan.weight:g} is too small to keep forces finite where the model hardly moves.",
            "Give a weight above zero, such as --weight 0.001.",
            saved="Nothing was written.",
        )


def _require_reached(plan: EqualizePlan, feedforward: Feedforward, in_bands: bool) -> None:
    """Raise if the models cannot reproduce the wanted signal. Where the cap costs accuracy, the error without the
    cap decides."""
    tracking_error = feedforward.error if feedforward.loss is None else feedforward.loss.error_free
    if not tracking_error <= LARGEST_ERROR and in_bands:
        raise StudyError(
            "The forces were not computed",
            f"According to the model, the error of the best forces would be {100 * tracking_error:.0f} % of the wanted "
            "acceleration: the three bands need time to rise and decay, and the table begins or ends too close to "
            "the motion.",
            "Put 3 s of zeros before and after the motion, or give one model.",
            saved="Nothing was written.",
        )
    if not tracking_error <= LARGEST_ERROR:
        raise StudyError(
            "The forces were not computed",
            f"According to the model, the error of the best forces would be {100 * tracking_error:.0f} % of the wanted "
            f"acceleration: along some direction the device hardly moves, for --weight {plan.weight:g}.",
            "Check units and axes of the recording that it was made from and identify it again, or lower --weight.",
            saved="Nothing was written.",
        )


def _solve(plan: EqualizePlan, reference: Trajectory, models: PlaybackModels) -> tuple[Feedforward, BandFacts | None]:
    settings = FeedforwardSettings(plan.weight, plan.cap_n, plan.constrain)
    if models.two_bands is None:
        return feedforward_at(models.at_place, reference.signal, settings), None
    banded = solve_banded_feedforward(models.two_bands, reference.signal, settings)
    return banded.feedforward, banded.facts


def _amplitude_n(model: IdentifiedModel) -> float | None:
    """Force amplitude of the identification; None if the effects were removed from its recordings."""
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


def _compensate(
    plan: EqualizePlan,
    feedforward: Feedforward,
    model: IdentifiedModel,
    physics: MechanicalModel,
    amplitude_n: float | None,
) -> Compensation:
    try:
        compensation = compensate(
            feedforward.forces.samples, feedforward.reference, model, physics, amplitude_n, plan.cap_n
        )
    except ValueError as problem:
        raise StudyError(
            "The known physics does not fit the model",
            f"{plan.physics}: {problem}.",
            "Correct the [[effect]] sections, or leave out --physics.",
            saved="Nothing was written.",
        ) from problem
    return compensation


def _not_equalized(explanation: str) -> StudyError:
    return StudyError(
        "The forces were not computed",
        explanation,
        "Correct what is named, or give a table and a model that fit each other.",
        saved="Nothing was written.",
    )
