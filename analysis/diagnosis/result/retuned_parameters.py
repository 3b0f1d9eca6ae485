"""Find the model parameters that re-tuning moved by a standard deviation or more, and describe doubtful ones."""

from collections.abc import Sequence
from dataclasses import dataclass

from analysis.diagnosis.document import Errors
from analysis.diagnosis.errors.tuning import Tuning
from analysis.diagnosis.limits import EQUAL_ERROR_RATIO, RETUNING_DOUBTED, RETUNING_NAMED
from analysis.diagnosis.unit_wording import format_error, format_error_of_signal, format_value
from analysis.wording import conjoin, typeset
from equalizer.signals.signal import FloatArray

_MOST_LISTED = 4
"""Largest number of re-tuned parameters that a sentence lists; the others are counted. Chosen."""


@dataclass(frozen=True, slots=True)
class MovedParameter:
    """A parameter of the model that a fit moved, with its change."""

    name: str
    change: float
    """Change of the parameter, in `unit`."""
    unit: str
    """As in `Tuning.units`; "1" for a relative change."""
    deviations: float
    """Change in standard deviations of the calibration."""
    at_bound: bool = False
    """Whether the parameter is at the bound of the search (`Tuning.bound`)."""

    @property
    def text(self) -> str:
        """Name and change in words, such as "damping fx +0.35 N s/m (2.1 standard deviations)"."""
        return f"{self.name} {self.change_text} ({abs(self.deviations):.2g} standard deviations)"

    @property
    def change_text(self) -> str:
        """The change with its sign and unit; a relative change in per cent."""
        sign = "+" if self.change >= 0 else ""
        percent = float(f"{100 * self.change:.2g}")
        change_size = f"{typeset(f'{percent:g}')} %" if self.unit == "1" else format_value(self.change, self.unit)
        return f"{sign}{change_size}"


def list_parameters(tuning: Tuning, deviations: FloatArray) -> tuple[MovedParameter, ...]:
    """List all free parameters of the model with their changes. deviations: (parameters,), in standard deviations of
    the calibration; within 1e-6 (rounding) of `Tuning.bound` they are at the bound."""
    return tuple(
        MovedParameter(name, float(change), unit, float(deviation), bool(abs(deviation) >= tuning.bound - 1e-6))
        for name, change, unit, deviation in zip(
            tuning.names, tuning.to_changes(deviations), tuning.units, deviations, strict=True
        )
    )


def find_moved_parameters(tuning: Tuning, deviations: FloatArray) -> tuple[MovedParameter, ...]:
    """Find the parameters that moved by `RETUNING_NAMED` standard deviations or more, the largest move first.
    deviations: (parameters,), in standard deviations of the calibration."""
    moved_parameters = [
        parameter for parameter in list_parameters(tuning, deviations) if abs(parameter.deviations) >= RETUNING_NAMED
    ]
    return tuple(sorted(moved_parameters, key=lambda parameter: -abs(parameter.deviations)))


def describe_retuning(moved_parameters: Sequence[MovedParameter], fitted: bool = False) -> str:
    """Describe the re-tuned parameters in a sentence; empty where none moved. fitted: whether the model was first
    fitted to the same recordings, so that its parameters have no calibration."""
    if not moved_parameters:
        return ""
    texts = [
        f"{parameter.name} {parameter.change_text}" if fitted else parameter.text
        for parameter in moved_parameters[:_MOST_LISTED]
    ]
    unlisted_count = len(moved_parameters) - _MOST_LISTED
    sentence = conjoin([*texts, f"{unlisted_count} more"] if unlisted_count > 0 else texts)
    if fitted:
        subject = "these parameters of the first model changed by more than the tolerance of the first fit"
        return f"In the final fit, {subject}: {sentence}."
    return f"Re-tuned beyond the calibration's standard deviation: {sentence}."


def describe_doubtful_parameters(moved_parameters: Sequence[MovedParameter], fitted: bool = False) -> tuple[str, ...]:
    """Describe parameters that moved by `RETUNING_DOUBTED` standard deviations or more, so that they may compensate for
    physics that was not named: a sentence each up to `_MOST_LISTED`, else one with their number. fitted: as in
    `describe_retuning`; then one sentence on those of them at their bound, if there are any."""
    doubtful_parameters = [parameter for parameter in moved_parameters if abs(parameter.deviations) >= RETUNING_DOUBTED]
    at_bound = [parameter for parameter in doubtful_parameters if parameter.at_bound]
    if fitted:
        names = conjoin([parameter.name for parameter in at_bound])
        return (
            (f"These parameters of the first model reached the limit of their allowed range: {names}.{_UNDETERMINED}",)
            if at_bound
            else ()
        )
    if len(doubtful_parameters) > _MOST_LISTED:
        return (
            f"{len(doubtful_parameters)} parameters were moved by {RETUNING_DOUBTED:g} standard deviations of their "
            f"calibration or more{f', {len(at_bound)} of them to the limit of their allowed range' if at_bound else ''}"
            ": either the calibration is wrong, or they compensate for physics that was not named.",
        )
    return tuple(
        f"The {parameter.name} was moved by {abs(parameter.deviations):.2g} standard deviations of its "
        f"calibration{_AT_LIMIT if parameter in at_bound else ''}: either the calibration is wrong, or it compensates "
        "for physics that was not named."
        for parameter in doubtful_parameters
    )


_UNDETERMINED = " The fit has not found a best value for them, or they compensate for physics that was not named."
_AT_LIMIT = ", to the limit of its allowed range"
"""Parts of the sentences of `describe_doubtful_parameters`: its end for a fitted model; a parameter at its bound."""


def _is_error_raised(errors: Errors) -> bool:
    """Whether re-tuning raises the held-out error by more than a factor `EQUAL_ERROR_RATIO`; False where an error is
    not known."""
    return (
        errors.before is not None and errors.retuned is not None and errors.retuned > EQUAL_ERROR_RATIO * errors.before
    )


def choose_better_model(errors: Errors) -> tuple[str, str]:
    """Choose the model with which named effects are compared: the given model where re-tuning raises the held-out
    error, else the re-tuned model. Returns its field in `Errors`, and words for it."""
    return ("before", "as given") if _is_error_raised(errors) else ("retuned", "re-tuned without it")


def choose_better_error(errors: Errors) -> tuple[str, float | None]:
    """Choose the given model where re-tuning raises the held-out error, else the re-tuned model. Returns words for it,
    and its held-out error."""
    return ("as given", errors.before) if _is_error_raised(errors) else ("re-tuned", errors.retuned)


def describe_raised_error(errors: Errors) -> str:
    """Describe in a sentence that re-tuning raises the held-out error; empty where it does not. errors: on held-out
    data, relative to the signal."""
    if not _is_error_raised(errors) or errors.before is None or errors.retuned is None:
        return ""
    return (
        f"Re-tuning raises the error on held-out data from {format_error(errors.before)} to "
        f"{format_error_of_signal(errors.retuned)}: the fitted data differ from the held-out data, and the "
        "re-tuned parameters are doubtful."
    )
