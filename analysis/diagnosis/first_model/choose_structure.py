"""Choose the structure of a first model: the requested one, or the plainest that fits held-out data about as well.

The structures are those of `model_structures`, fitted by force balance where a motion was measured along the commands;
otherwise, and always with two modes, to spectra. A sentence states what the remaining error depends on
(`describe_remaining_error`). For a user who asks for a model alone; a diagnosis uses `fit_without_model`.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from analysis.diagnosis.balance.laws.law import smooth_sign
from analysis.diagnosis.balance.motion import Motion, NoMotionError
from analysis.diagnosis.data.closed_loop import is_in_closed_loop
from analysis.diagnosis.data.input_checks import NothingToDiagnoseError, require_comparable
from analysis.diagnosis.first_model.model_structures import (
    KINDS,
    BalancedRecordings,
    Kind,
    ParameterEstimate,
    StructureFit,
    StructureFitError,
    balance_recordings,
    choose_simplest,
    fit_modal_structure,
    fit_structure,
)
from analysis.diagnosis.limits import MODES_GAIN, REPORTED_REMAINDER_SHARE, RICHER_STRUCTURE_GAIN
from equalizer.identification.mechanical.mechanical_free_simulation import compute_simulation_errors
from equalizer.identification.mechanical.mechanical_lines import compute_all_lines, split_fit_and_test
from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.recording import Recording
from equalizer.signals.signal import FloatArray
from equalizer.signals.summary import Summary, SummaryDisplay

REMAINDER_REGRESSORS: dict[str, Callable[[Motion], FloatArray]] = {
    "the direction of motion (like dry friction)": lambda m: smooth_sign(m.velocity, 0.01 * float(m.velocity.std())),
    "the square of the speed": lambda m: m.velocity * np.abs(m.velocity),
    "the square of the position": lambda m: (m.position - m.position.mean(axis=0)) ** 2,
    "the cube of the position (like a hardening spring)": lambda m: (m.position - m.position.mean(axis=0)) ** 3,
}
"""Functions of a motion, (n, d) each, by the words for the remaining error that is correlated with them. The sign of
the velocity is smoothed over 1 % of its standard deviation: chosen, narrow enough for dry friction."""


@dataclass(frozen=True, slots=True)
class TriedStructure:
    """A structure that was tried, with its error, and the reason where it was refused."""

    kind: Kind
    error: float | None
    """Relative error (`StructureFit.error`), cross-validated or held-out; None where it was not fitted."""
    refusal: str
    """Why it was not fitted, or, for a fit to spectra, not preferred to one by force balance; else empty."""


@dataclass(frozen=True, repr=False, slots=True, eq=False)
class ChosenStructure(SummaryDisplay):
    """The chosen structure, all that were tried, why it was chosen, and a sentence on the error that remains."""

    fit: StructureFit
    tried: tuple[TriedStructure, ...]
    """In the order of the trials; the chosen one among them."""
    reason: str
    """Why this structure was chosen, in a sentence or two."""
    remains: str
    """Sentence on the error that remains."""

    def summary(self) -> Summary:
        """Parameters with their 95 % intervals, the reason of the choice, and the error that remains, for display."""
        return Summary(
            f"First model: {self.fit.kind}",
            (
                *((parameter.name, _format_parameter(parameter)) for parameter in self.fit.parameters),
                ("reason", self.reason),
                ("remaining error", self.remains),
            ),
        )


def _format_parameter(parameter: ParameterEstimate) -> str:
    """Format value, interval where it is known, and unit."""
    interval_text = "" if parameter.half_width is None else f" ± {parameter.half_width:.2g}"
    return f"{parameter.value:.4g}{interval_text} {parameter.unit}"


def choose_structure(
    recordings: Recording | Sequence[Recording],
    requested_kind: Kind | None = None,
    on_progress: Callable[[float], None] = lambda share: None,
) -> ChosenStructure:
    """Fit the structures and choose one. requested_kind: fit this one only; None = choose. on_progress: receives the
    share done of a fit to spectra, 0 to 1. Raises StructureFitError where the requested structure, or all structures,
    cannot be fitted, or does not exist, and for recordings that are inconsistent or not alike."""
    recordings = _require_comparable(recordings)
    if requested_kind is not None and requested_kind not in KINDS:
        raise StructureFitError(f"there is no structure '{requested_kind}'; the structures are {', '.join(KINDS)}")
    try:
        balanced: BalancedRecordings | None = balance_recordings(recordings)
        no_balance_reason = ""
    except NoMotionError as problem:
        balanced, no_balance_reason = None, str(problem)
    if requested_kind is not None:
        return _fit_requested(balanced, recordings, requested_kind, on_progress)
    structure_fits, trials = _fit_structures(balanced, recordings, on_progress)
    if not structure_fits:
        raise StructureFitError("; ".join(f"{trial.kind}: {trial.refusal}" for trial in trials))
    if balanced is None:
        fits_by_size = sorted(structure_fits, key=lambda structure_fit: structure_fit.model.coordinates)
        best = (
            fits_by_size[-1] if fits_by_size[-1].error < (1 - MODES_GAIN) * fits_by_size[0].error else fits_by_size[0]
        )
        sentence = f"Structures were compared by the held-out error of a free simulation, because {no_balance_reason}."
        return ChosenStructure(best, trials, sentence, describe_remaining_error(None, best))
    best = choose_simplest(structure_fits)
    reason = (
        "From the fewest parameters on, a structure with more was preferred where it lowers the cross-validated error "
        f"power significantly (by more than {100 * RICHER_STRUCTURE_GAIN:.0f} %); the choice is {best.kind}."
    )
    choice = ChosenStructure(best, trials, reason, describe_remaining_error(balanced, best))
    if balanced.untimed or balanced.free or balanced.turns_freely:
        return choice
    return _compare_with_spectra(choice, recordings, on_progress)


def _fit_requested(
    balanced: BalancedRecordings | None,
    recordings: Sequence[Recording],
    kind: Kind,
    on_progress: Callable[[float], None],
) -> ChosenStructure:
    """Fit one structure: by force balance where that is possible. Other arguments and errors as `choose_structure`."""
    fit = (
        fit_structure(balanced, kind)
        if balanced is not None and kind != "two-mode"
        else fit_modal_structure(recordings, kind, on_progress)
    )
    trials = (TriedStructure(fit.kind, fit.error, ""),)
    return ChosenStructure(fit, trials, "The structure was requested.", describe_remaining_error(balanced, fit))


def _require_comparable(recordings: Recording | Sequence[Recording]) -> tuple[Recording, ...]:
    """Return the recordings as a tuple. Raises StructureFitError without any, and where they are inconsistent or differ
    in channels, units or rate."""
    recordings = (recordings,) if isinstance(recordings, Recording) else tuple(recordings)
    names = [f"recording {number}" for number in range(1, len(recordings) + 1)]
    try:
        require_comparable(recordings, names, "fit them separately")
    except NothingToDiagnoseError as refusal:
        raise StructureFitError(str(refusal)) from refusal
    return recordings


def describe_remaining_error(balanced: BalancedRecordings | None, fit: StructureFit) -> str:
    """Describe the model's error in a sentence and, where `fit` is by force balance on recordings with a time axis,
    which regressor explains most of its power, or that none explains `REPORTED_REMAINDER_SHARE` of it."""
    error_text = f"{100 * fit.error:.3g} % of the {fit.error_signal}"
    if balanced is None or fit.joint is None or balanced.untimed:
        return f"An error of {error_text} remains."
    motions = balanced.regressions[0].motions
    residual_forces = [
        residual_force[motion.mask_valid_samples(motion.fit)]
        for residual_force, motion in zip(fit.joint.residual_forces, motions, strict=True)
    ]
    shares_by_cause = {
        cause: _compute_explained_share(
            [motion.decimate(compute_regressor(motion))[motion.mask_valid_samples(motion.fit)] for motion in motions],
            residual_forces,
        )
        for cause, compute_regressor in REMAINDER_REGRESSORS.items()
    }
    cause, explained_share = max(shares_by_cause.items(), key=lambda item: item[1])
    if explained_share < REPORTED_REMAINDER_SHARE:
        return f"An error of {error_text} remains; no tested function of speed or position explains much of it."
    return f"An error of {error_text} remains; {100 * explained_share:.0f} % of its power is explained by {cause}."


def _compute_explained_share(columns: Sequence[FloatArray], residual_forces: Sequence[FloatArray]) -> float:
    """Compute the squared correlation of columns with the residual forces, the largest over the axes. Arrays (n, axes),
    one per motion."""
    x, y = np.vstack(columns), np.vstack(residual_forces)
    x, y = x - x.mean(axis=0), y - y.mean(axis=0)
    power_product = np.maximum((x**2).sum(axis=0) * (y**2).sum(axis=0), 1e-300)
    return float(((x * y).sum(axis=0) ** 2 / power_product).max())


def _fit_structures(
    balanced: BalancedRecordings | None, recordings: Sequence[Recording], on_progress: Callable[[float], None]
) -> tuple[list[StructureFit], tuple[TriedStructure, ...]]:
    """Fit every structure that the recordings allow, with force balances not yet two modes. balanced: None where only
    spectra can be fitted."""
    structure_kinds: tuple[Kind, ...] = (
        ("mass-spring", "two-mode") if balanced is None else ("massless", "motor", "mass-spring")
    )
    structure_kinds = ("motor", "mass-spring") if balanced is not None and balanced.free else structure_kinds
    structure_fits, trials = [], []
    for structure_kind in structure_kinds:
        try:
            fit = (
                fit_modal_structure(recordings, structure_kind, on_progress)
                if balanced is None
                else fit_structure(balanced, structure_kind)
            )
        except StructureFitError as refusal:
            trials.append(TriedStructure(structure_kind, None, str(refusal)))
            continue
        structure_fits.append(fit)
        trials.append(TriedStructure(structure_kind, fit.error, ""))
    return structure_fits, tuple(trials)


def _compare_with_spectra(
    choice: ChosenStructure, recordings: Sequence[Recording], on_progress: Callable[[float], None]
) -> ChosenStructure:
    """Compare a structure chosen by force balance with a fit to spectra: mass-spring with two modes; another structure
    whose error in a free simulation is not below the signal itself, as where noise of a differentiated position biases
    it, with two modes or, without a mode that lowers the error, with mass, damper and spring. The fit to spectra is
    chosen where its error in a free simulation of held-out samples (of the fitted ones where none are) is smaller by
    more than `MODES_GAIN`."""
    if choice.fit.kind != "mass-spring":
        simulation_errors = _compute_simulation_errors((choice.fit.model,), recordings)
        if simulation_errors is None or simulation_errors[0] < 1:
            return choice
    if any(is_in_closed_loop(recording) or recording.meta.get("imposed") for recording in recordings):
        reason = "it is fitted to spectra, which a controller or an imposed motion biases"
        return _append_trial(choice, TriedStructure("two-mode", None, reason))
    kinds: tuple[Kind, ...] = ("two-mode",) if choice.fit.kind == "mass-spring" else ("two-mode", "mass-spring")
    for kind in kinds:
        try:
            modal_fit = fit_modal_structure(recordings, kind, on_progress)
            break
        except StructureFitError as refusal:
            choice = _append_trial(choice, TriedStructure(kind, None, str(refusal)))
    else:
        return choice
    errors = _compute_simulation_errors((choice.fit.model, modal_fit.model), recordings)
    if errors is None:
        return _append_trial(choice, TriedStructure(kind, modal_fit.error, "no segment to test by is excited"))
    comparison = (
        f"In a free simulation the error of {choice.fit.kind} is {100 * errors[0]:.3g} %, that of {kind} fitted to "
        f"spectra {100 * errors[1]:.3g} %."
    )
    if errors[1] < (1 - MODES_GAIN) * errors[0]:
        trials = (*choice.tried, TriedStructure(kind, modal_fit.error, ""))
        return ChosenStructure(modal_fit, trials, comparison, describe_remaining_error(None, modal_fit))
    refused = TriedStructure(kind, modal_fit.error, "the fit to spectra lowers the error too little")
    return _append_trial(choice, refused, comparison)


def _compute_simulation_errors(
    models: Sequence[MechanicalModel], recordings: Sequence[Recording]
) -> tuple[float, ...] | None:
    """Compute each model's error in a free simulation of the samples kept for a test, or of those to fit where none
    are; None where no segment is excited."""
    fit_recordings, test_recordings = split_fit_and_test(recordings)
    segment_lines = compute_all_lines(test_recordings or fit_recordings)
    if not segment_lines:
        return None
    edges_hz = [
        float(select_bound(lines_of_segment.frequency_hz[lines_of_segment.excited]))
        for lines_of_segment in segment_lines
        for select_bound in (np.min, np.max)
    ]
    band_hz = (min(edges_hz), max(edges_hz))
    return tuple(float(compute_simulation_errors(model, segment_lines, band_hz)[0][-1]) for model in models)


def _append_trial(choice: ChosenStructure, trial: TriedStructure, sentence: str = "") -> ChosenStructure:
    """Append a tried structure to the choice, and a sentence to its reason."""
    return ChosenStructure(choice.fit, (*choice.tried, trial), f"{choice.reason} {sentence}".rstrip(), choice.remains)
