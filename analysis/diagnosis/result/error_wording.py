"""Sentences for the user about held-out errors: compared with the noise, with all laws together, and with a black box.

Errors are rms errors over the rms of the signal, in a force balance over the rms of the force. There, a sum of a few
laws can hardly have a smaller error than all candidate laws together.
"""

from collections.abc import Sequence

from analysis.diagnosis.document import Errors
from analysis.diagnosis.limits import CONFIRMED_FIT_RATIO, EQUAL_ERROR_RATIO
from analysis.diagnosis.result.findings import BalanceErrors, BlackBox
from analysis.diagnosis.unit_wording import format_error, format_error_of_signal, format_share
from analysis.wording import capitalise

ROUNDING_TOLERANCE = 1e-9
"""Relative difference up to which two errors of the same data count as equal: above the rounding of 64-bit floats.
Chosen."""
_NOISE_SOURCES = {"rest": "at the level measured at rest", "quiet band": "at the level measured above the driven band"}
"""Words for noise that was not estimated from repeats, by `NoiseFloor.method`. Its level during excitation is then
unknown, so that errors are not stated in units of it."""


def describe_black_box(black_box: BlackBox | None, is_effect_named: bool) -> str:
    """Compare the held-out errors of a black box and of the physical model in words; empty without a black box.
    is_effect_named: whether effects were named; without any, the physical model is the re-tuned one."""
    if black_box is None:
        return ""
    physics_name = "the physics" if is_effect_named else "the re-tuned model"
    fit_text = (
        f"A black box ({black_box.kind}, {black_box.coefficient_count} parameter"
        f"{'s' if black_box.coefficient_count != 1 else ''}), fitted to the same samples, has an error of"
    )
    errors_text = (
        f"{format_error_of_signal(black_box.test_error)} on the held-out data; {physics_name} has "
        f"{format_error(black_box.physics_error)}"
    )
    if is_black_box_better(black_box):
        return (
            f"{fit_text} {errors_text}. The black box predicts better: the data contain structure that no named effect "
            "explains."
        )
    if black_box.physics_error * EQUAL_ERROR_RATIO < black_box.test_error:
        return f"{fit_text} {errors_text}. {capitalise(physics_name)} predicts better."
    return f"{fit_text} {errors_text}: the black box does not predict better."


def is_black_box_better(black_box: BlackBox) -> bool:
    """Whether the held-out error of the black box is smaller by more than the factor `EQUAL_ERROR_RATIO`."""
    return black_box.test_error * EQUAL_ERROR_RATIO < black_box.physics_error


def describe_balance_errors(axis_errors: Sequence[BalanceErrors]) -> tuple[str, ...]:
    """Describe the held-out errors of each axis's force balance, a text per axis, also where no law could be tested."""
    return tuple(_describe_axis_errors(errors, len(axis_errors) == 1) for errors in axis_errors)


def _describe_axis_errors(errors: BalanceErrors, is_single_axis: bool) -> str:
    """Describe the held-out errors of one axis. is_single_axis: whether the device has one axis, which is then not
    named."""
    axis_text = "" if is_single_axis else f" along {errors.axis}"
    if not errors.tested:
        return (
            f"In the force balance{axis_text}, no law could be tested: the device moves only once, and the held-out "
            "data contain almost no motion. Record several motions, or give one of them the role of a test."
        )
    model_text = (
        "the error of the re-tuned model is"
        if errors.is_model_given
        else "the error of mass, damping and stiffness alone is"
    )
    linear_text = (
        f"In the force balance{axis_text}, on held-out data, {model_text} {format_error(errors.linear_error)} of the "
        "force"
    )
    named_text = (
        f"with the named laws it is {format_error(errors.named_error)}" if errors.has_named_law else "no law is named"
    )
    if errors.has_named_law and errors.named_error <= errors.all_laws_error * (1 + ROUNDING_TOLERANCE):
        return f"{linear_text}, {named_text}, and all laws together reach no smaller error."
    share_text = (
        f", and that is {format_share(errors.share)} of the reduction of the error power that all laws together reach"
        if errors.named_error < errors.linear_error
        else ""
    )
    return (
        f"{linear_text}; with all laws together it is {format_error(errors.all_laws_error)}, a bound that a sum of a "
        f"few laws can hardly reach; {named_text}{share_text}."
    )


def format_ratio(ratio: float) -> str:
    """Format a ratio with two decimals, such as "1.04 times"; from 10 on with three significant digits."""
    return f"{ratio:.2f} times" if ratio < 10 else f"{ratio:.3g} times"


def describe_error_change(
    errors: Errors, first_stage: tuple[str, str], last_stage: tuple[str, str], noise_method: str = ""
) -> str:
    """Describe in a clause the change of the held-out error between two stages, and the noise; a statement that it is
    not known where an error is None. first_stage, last_stage: a field of `Errors`, and its name in words. noise_method:
    `NoiseFloor.method`; empty where it is not known."""
    first_error, last_error = getattr(errors, first_stage[0]), getattr(errors, last_stage[0])
    if first_error is None or last_error is None:
        return "how much better it predicts held-out data is not known"
    change_verb = "falls" if last_error * EQUAL_ERROR_RATIO < first_error else "goes"
    return (
        f"the error on held-out data {change_verb} from {format_error_of_signal(first_error)} ({first_stage[1]}) to "
        f"{format_error(last_error)} ({last_stage[1]}){_describe_noise(errors, last_error, noise_method)}"
    )


def describe_error(beginning: str, error: float | None, errors: Errors, noise_method: str = "") -> str:
    """Describe in a clause a held-out error and the noise; a statement that it is not known where the error is None.
    beginning: first words of the clause."""
    if error is None:
        return "its error on held-out data is not known"
    return (
        f"{beginning}, its error on held-out data is {format_error_of_signal(error)}"
        f"{_describe_noise(errors, error, noise_method)}"
    )


def _describe_noise(errors: Errors, error: float, noise_method: str) -> str:
    """Compare an error with that of noise alone, as the end of a clause: by their ratio, or, for noise of
    `_NOISE_SOURCES`, by naming the noise; a statement that the noise is not known where it is None or 0, or its method
    "unknown"."""
    if not errors.noise or noise_method == "unknown":
        return "; what noise alone would leave is not known"
    if noise_method in _NOISE_SOURCES:
        return f"; noise {_NOISE_SOURCES[noise_method]} would leave {format_error(errors.noise)}"
    return f", {format_ratio(error / errors.noise)} what noise alone would leave ({format_error(errors.noise)})"


def describe_confirmation(fit_errors: Errors, test_errors: Errors) -> str:
    """State that held-out data do not confirm the fit, or only in part (`CONFIRMED_FIT_RATIO`); empty where they
    confirm it or an error is None. Errors of both sets are compared in units of their noise, which must not be 0,
    because their signals may differ."""
    if test_errors.after is None or test_errors.retuned is None or fit_errors.after is None:
        return ""
    if test_errors.noise is None or fit_errors.noise is None:
        return ""
    if test_errors.after > test_errors.retuned:
        return (
            "The held-out data do not confirm this: there the re-tuned model alone has a smaller error "
            f"({format_error_of_signal(test_errors.retuned)} compared with {format_error(test_errors.after)})."
        )
    test_ratio, fit_ratio = test_errors.after / test_errors.noise, fit_errors.after / fit_errors.noise
    if test_ratio > CONFIRMED_FIT_RATIO * max(fit_ratio, 1.0):
        return (
            f"The held-out data confirm this only in part: the error is {format_ratio(test_ratio)} the noise there and "
            f"{format_ratio(fit_ratio)} the noise on the fitted data."
        )
    return ""
