"""Fit candidate structures of a first linear model, M a + D v + K x = u, and choose one by cross-validated error.

A diagnosis without a given model may start from one. Some structures omit matrices (`PARTS_OF`). They are fitted by the
force balance where every command has a measured position or velocity (`fit_structure`), else, and always with modes, to
spectra (`fit_modal_structure`).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Literal, get_args

import numpy as np

from analysis.diagnosis.balance.laws.law import measure_scales
from analysis.diagnosis.balance.motion import Motion, NoMotionError, compute_motions
from analysis.diagnosis.balance.regression import Regression
from analysis.diagnosis.data.measured_motion import is_free_motion
from analysis.diagnosis.data.observed_parts import observe_parts
from analysis.diagnosis.first_model.joint_fit import PARTS, JointFit, Part, build_regressions, fit_jointly
from analysis.diagnosis.limits import MASSLESS_SHARE, MODEL_FLOOR, RICHER_STRUCTURE_ERRORS, RICHER_STRUCTURE_GAIN
from analysis.wording import format_sentence
from equalizer.identification.mechanical.mechanical_fit import fit_mechanical_model
from equalizer.identification.mechanical.mechanical_fit_result import MechanicalFitError, MechanicalFitSettings
from equalizer.identification.mechanical.widened_tolerance import widen_tolerance
from equalizer.plant.effect_vocabulary import find_matrix_unit
from equalizer.plant.linear_simulation import compute_driven_axes
from equalizer.plant.mechanical_model import MechanicalModel, MechanicalModelError, Tolerance
from equalizer.signals.recording import Recording
from equalizer.signals.unit_system import UnitSystem, find_unit_system

Kind = Literal["mass-spring", "two-mode", "gravity", "massless", "motor"]
"""Structures: mass, damper and spring; the same with modes on the axes; a pendulum, whose weight acts as a spring;
damper and spring alone; mass and damper alone."""
KINDS: tuple[Kind, ...] = get_args(Kind)
PARTS_OF: dict[Kind, tuple[Part, ...]] = {
    "massless": ("damping", "stiffness"),
    "motor": ("mass", "damping"),
    "mass-spring": PARTS,
    "gravity": PARTS,
}
"""Matrices that the force balance fits, by structure; fewer without a time axis or for a free motion."""
FIXED_SHARE = 1e-6
"""Chosen so that re-tuning hardly changes a mass: factor on the least mass without a time axis; standard deviation of
the mass over the largest mass, and, without a time axis, of the damping over the largest stiffness times a sample."""
NAME_TEMPLATE = "first model, {}"
"""Name of the fitted model, to be filled in with its structure."""
MEASURED_FORCE, SIMULATED_MOTION = "force along the measured motion", "free simulation"
"""Signals that held-out errors refer to, for `StructureFit.error_signal`."""


class StructureFitError(ValueError):
    """The structure cannot be fitted to the recordings; the text says why."""


@dataclass(frozen=True, slots=True)
class ParameterEstimate:
    """A parameter of a fitted model with its confidence interval."""

    name: str
    unit: str
    value: float
    half_width: float | None
    """Half width of the 95 % interval; None where it is not known."""


@dataclass(frozen=True, slots=True, eq=False)
class StructureFit:
    """A structure fitted to recordings: the model, its parameters and its held-out errors."""

    kind: Kind
    model: MechanicalModel
    parameters: tuple[ParameterEstimate, ...]
    held_out: tuple[float, ...]
    """Per axis or response channel: rms error over that of the signal, on held-out data if there are any."""
    channels: tuple[str, ...]
    error_signal: str
    """Signal that the held-out errors refer to, in words."""
    joint: JointFit | None
    """Result of the force balance; None for a fit to spectra."""
    remarks: tuple[str, ...]

    @property
    def error(self) -> float:
        """Relative error by which structures are compared: cross-validated, else the rms of `held_out`."""
        return self.joint.cross_validated_error if self.joint else float(np.sqrt(np.mean(np.square(self.held_out))))


@dataclass(frozen=True, slots=True, eq=False)
class BalancedRecordings:
    """Recordings whose motion was measured along every command, prepared for a force balance."""

    recording: Recording
    """The first one: source of the channels and units."""
    regressions: tuple[Regression, ...]
    """Force balance of each axis, without laws."""
    untimed: bool
    """Whether the recordings have no time axis: then only a stiffness can be fitted."""
    turns_freely: bool
    """Whether a shaft rotates freely, so that no spring can hold it."""
    rotational: bool
    """Whether the motion is an angle: in SI, inertia in kg m², stiffness in N m/rad."""
    free: bool = False
    """Whether the motion is free (not driven): parameters are per unit mass."""


def balance_recordings(recordings: Sequence[Recording]) -> BalancedRecordings:
    """Prepare the force balance of all axes. Raises NoMotionError where no motion or only accelerations were measured,
    the numbers of commands, responses and motions differ, or no sample is usable. recordings: at least one."""
    first = recordings[0]
    motions = compute_motions(observe_parts(recordings, len(first.response.channels)))
    axis_count = len(first.command.channels)
    if motions[0].order == 2:
        raise NoMotionError("only accelerations were measured")
    if len(motions[0].channels) != axis_count or len(first.response.channels) != axis_count:
        raise NoMotionError("not every command has exactly one measured motion")
    if not any(motion.mask_valid_samples(motion.fit).any() for motion in motions):
        raise NoMotionError("too few samples with motion are available for the fit")
    turns_freely = any(measure_scales(motions, axis, first.is_rotational).turns_freely for axis in range(axis_count))
    untimed, regressions = not np.isfinite(motions[0].band_hz), build_regressions(motions, turns_freely)
    return BalancedRecordings(first, regressions, untimed, turns_freely, first.is_rotational, is_free_motion(first))


def fit_structure(balanced: BalancedRecordings, kind: Kind) -> StructureFit:
    """Fit a structure by the force balance. Raises StructureFitError where the recordings cannot determine it, or no
    valid model results, such as one with a negative mass."""
    _require_suitable(balanced, kind)
    parts: tuple[Part, ...] = ("stiffness",) if balanced.untimed else PARTS_OF[kind]
    if balanced.free:
        parts = tuple(part for part in parts if part != "mass")
    try:
        fit = fit_jointly(balanced.regressions, parts)
        model = _build_model(balanced, fit, kind)
    except np.linalg.LinAlgError as problem:
        raise StructureFitError("the motion does not determine its parameters separately") from problem
    except MechanicalModelError as problem:
        raise StructureFitError(f"its parameters do not form a possible mechanism: {problem}") from problem
    names = balanced.recording.command.channels
    return StructureFit(
        kind,
        model,
        _list_parameters(balanced, fit, (model.system, parts)),
        tuple(fit.held_out.tolist()),
        names,
        MEASURED_FORCE,
        fit,
        _write_remarks(balanced, kind),
    )


def fit_modal_structure(
    recordings: Sequence[Recording], kind: Kind, on_progress: Callable[[float], None]
) -> StructureFit:
    """Fit "mass-spring" or "two-mode" to spectra. Raises StructureFitError for other structures, where the fit fails,
    and where a mode does not lower the held-out error."""
    if kind not in ("mass-spring", "two-mode"):
        raise StructureFitError("it needs a measured position or velocity along every command")
    axis_count = len(recordings[0].command.channels)
    settings = MechanicalFitSettings(most_modes=axis_count if kind == "two-mode" else 0)
    try:
        fit = fit_mechanical_model(recordings, settings, on_progress, NAME_TEMPLATE.format(kind))
    except (MechanicalFitError, MechanicalModelError, np.linalg.LinAlgError) as problem:
        raise StructureFitError(str(problem)) from problem
    if kind == "two-mode" and fit.model.coordinates == axis_count:
        raise StructureFitError("a mode on an axis does not lower the error on held-out lines")
    held_out_errors = tuple(error.fit if error.held_out is None else error.held_out for error in fit.errors)
    remarks = tuple(format_sentence(remark) for remark in fit.remarks)
    channels = recordings[0].response.channels
    return StructureFit(
        kind,
        widen_tolerance(fit.model),
        _list_modal_parameters(fit.model, recordings[0]),
        held_out_errors,
        channels,
        SIMULATED_MOTION,
        None,
        remarks,
    )


def choose_simplest(fits: Sequence[StructureFit]) -> StructureFit:
    """Choose among fits by force balance, at least one: from the fewest parameters on, a richer fit replaces the best
    where its cross-validated error power is lower by more than `RICHER_STRUCTURE_GAIN` of the best one's, more than
    `RICHER_STRUCTURE_ERRORS` standard errors over the folds, and more than `MODEL_FLOOR`²."""
    ordered = sorted(fits, key=lambda fit: (len(fit.parameters), fit.error))
    best = ordered[0]
    for richer in ordered[1:]:
        assert best.joint is not None and richer.joint is not None
        gains = best.joint.fold_errors - richer.joint.fold_errors
        gain_sd = float(np.std(gains, ddof=1) * np.sqrt(len(gains))) if len(gains) > 1 else np.inf
        least_gain = max(RICHER_STRUCTURE_GAIN * float(best.joint.fold_errors.sum()), RICHER_STRUCTURE_ERRORS * gain_sd)
        if gains.sum() > max(least_gain, MODEL_FLOOR**2):
            best = richer
    return best


def _require_suitable(balanced: BalancedRecordings, kind: Kind) -> None:
    """Raise StructureFitError where the force balance of these recordings cannot determine the structure."""
    if balanced.untimed and kind != "massless":
        raise StructureFitError("no time is known, hence no speeds or accelerations: only massless can be fitted")
    if kind == "two-mode":
        raise StructureFitError("it is fitted to spectra")
    if balanced.free and kind == "massless":
        raise StructureFitError("a body in free motion has a mass")
    if balanced.turns_freely and kind != "motor":
        raise StructureFitError("the shaft makes whole turns, so no spring holds it: only motor can be fitted")
    if kind == "gravity" and not balanced.rotational:
        raise StructureFitError("along a line, weight is a constant force, not a spring: gravity is for pendulums")


def _build_model(balanced: BalancedRecordings, fit: JointFit, kind: Kind) -> MechanicalModel:
    """Build the mechanical model of the fitted matrices, with a tolerance widened from their standard errors; damping
    that would supply energy is reduced to its diagonal. Raises MechanicalModelError for an invalid model, such as one
    with a negative mass or damping."""
    mass, damping, stiffness = (fit.matrices[part] for part in PARTS)
    if kind == "massless" or balanced.free:
        mass = np.diag(_find_least_mass(balanced.regressions[0].motions)) * (FIXED_SHARE if balanced.untimed else 1.0)
    problems = tuple(
        f"the {name} is negative ({matrix.diagonal().min():.3g})"
        for name, matrix in (("mass", mass), ("damping", damping))
        if matrix.diagonal().min() < 0
    )
    if problems:
        raise MechanicalModelError(problems)
    if np.linalg.eigvalsh(damping)[0] < 0:
        damping = np.diag(np.diagonal(damping))
    eye = np.eye(len(mass))
    std_errors = [fit.largest_standard_errors[part] or None for part in PARTS]
    recording = balanced.recording
    model = MechanicalModel(
        NAME_TEMPLATE.format(kind), balanced.recording.response.quantities[0], mass, damping, stiffness, eye, eye,
        tolerance=Tolerance(std_errors[0], std_errors[1], std_errors[2], None), rotational=balanced.rotational,
    )  # fmt: skip
    widened_model = widen_tolerance(model)
    assert widened_model.tolerance is not None
    widened = widened_model.tolerance
    tolerance = Tolerance(widened.mass_kg, widened.damping_n_s_per_m or None, widened.stiffness_n_per_m or None, None)
    if balanced.untimed:
        fixed_mass, fixed_damping = (FIXED_SHARE * float(np.abs(matrix).max()) for matrix in (mass, stiffness))
        tolerance = Tolerance(fixed_mass, fixed_damping, widened.stiffness_n_per_m, None)
    return replace(widened_model, tolerance=tolerance, units=find_unit_system(recording))


def _find_least_mass(motions: Sequence[Motion]) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    """Compute (d,): masses whose inertial force is `MASSLESS_SHARE` of the measured force (standard deviations). A
    simulation needs a mass, even where the recordings show none."""
    force = np.vstack([motion.force for motion in motions]).std(axis=0)
    accel = np.vstack([np.gradient(motion.velocity, 1 / motion.rate_hz, axis=0) for motion in motions]).std(axis=0)
    return np.asarray(MASSLESS_SHARE * force / np.maximum(accel, 1e-300))


def _list_parameters(
    balanced: BalancedRecordings, fit: JointFit, units_and_parts: tuple[UnitSystem, Sequence[Part]]
) -> tuple[ParameterEstimate, ...]:
    """List the diagonal elements of the fitted matrices, with their 95 % intervals."""
    names, (system, parts) = balanced.recording.command.channels, units_and_parts
    return tuple(
        ParameterEstimate(f"{part} {name}", find_matrix_unit(part, system), float(fit.matrices[part][k, k]),
               float(fit.half_widths[part][k, k]))
        for part in parts
        for k, name in enumerate(names)
    )  # fmt: skip


def _list_modal_parameters(model: MechanicalModel, recording: Recording) -> tuple[ParameterEstimate, ...]:
    """List mass, damping and stiffness along each driven axis, with 95 % intervals from the model's tolerance (1.96
    standard deviations); then, for a model with modes, all natural frequencies (Hz)."""
    driven_axes, estimates = compute_driven_axes(model), []
    tolerance = model.tolerance or Tolerance()
    deviations = (tolerance.mass_kg, tolerance.damping_n_s_per_m, tolerance.stiffness_n_per_m)
    for part, matrix, std in zip(PARTS, (model.mass, model.damping, model.stiffness), deviations, strict=True):
        values = np.einsum("ni,nk,ki->i", driven_axes, matrix, driven_axes)
        for name, value in zip(recording.command.channels, values.tolist(), strict=True):
            estimates.append(
                ParameterEstimate(f"{part} {name}", find_matrix_unit(part, model.system), value, std and 1.96 * std)
            )
    mode_count = model.coordinates - model.inputs
    if mode_count > 0:
        squared_frequencies = np.linalg.eigvals(np.linalg.solve(model.mass, model.stiffness)).real
        modes_hz = np.sqrt(np.maximum(squared_frequencies, 0.0)) / (2 * np.pi)
        estimates += [
            ParameterEstimate(f"mode {k}", "Hz", hz, None) for k, hz in enumerate(sorted(modes_hz.tolist()), start=1)
        ]
    return tuple(estimates)


def _write_remarks(balanced: BalancedRecordings, kind: Kind) -> tuple[str, ...]:
    """Write sentences on what the parameters of a structure mean."""
    if kind == "gravity":
        return (
            "The weight is linearised: its stiffness is mass times lever times the acceleration of gravity at the mean "
            "position, negative above the pivot; at large angles the effect gravity_torque describes it.",
        )
    if kind == "massless":
        note = "" if not balanced.untimed else " No time is known: samples are numbered, and damping is not fitted."
        return (f"The mass in the file is a lower bound for simulations; the forces do not determine it.{note}",)
    return ()
