"""Sentences for the user about held-out errors: compared with the noise, with all laws together, and with a black box.

The ceiling is the fit of all laws together in a force balance (`BalanceErrors.ceiling`): the error that no sum of a few
laws should be expected to beat. Errors are rms errors over the rms of the signal, unless a text says otherwise.
"""

from collections.abc import Sequence

from analysis.diagnosis.document import Errors
from analysis.diagnosis.result.findings import BalanceErrors, BlackBox
from analysis.diagnosis.settings import FIT_CONFIRMED, SAME_TO_READERS
from analysis.diagnosis.unit_wording import error_of_signal, error_text, share_text
from analysis.wording import capitalise

SAME = 1e-9
"""Relative difference of two errors of the same data that is due to rounding."""


def black_box_sentence(box: BlackBox | None, named: bool) -> str:
    """Sentence that compares held-out errors of a black box and of the physics; empty without a black box. named:
    whether effects were named; else the physics is the re-tuned model."""
    if box is None:
        return ""
    physics = "the physics" if named else "the re-tuned model"
    fitted = f"A black box ({box.kind}, {box.numbers} parameters), fitted to the same samples, has an error of"
    errors = f"{error_of_signal(box.test)} on the held-out data; {physics} has {error_text(box.physics)}"
    if black_box_beats(box):
        return (
            f"{fitted} {errors}. The black box predicts better: the data contain structure that no named effect "
            "explains."
        )
    if box.physics * SAME_TO_READERS < box.test:
        return f"{fitted} {errors}. {capitalise(physics)} predicts better."
    return f"{fitted} {errors}: the black box does not predict better."


def black_box_beats(box: BlackBox) -> bool:
    """Whether the held-out error of the black box is smaller by more than the factor `SAME_TO_READERS`."""
    return box.test * SAME_TO_READERS < box.physics


def describe_ceiling(reached: Sequence[BalanceErrors]) -> tuple[str, ...]:
    """One sentence per axis whose force balance was tested."""
    return tuple(_describe_ceiling_of_axis(each, len(reached) == 1) for each in reached)


def _describe_ceiling_of_axis(reached: BalanceErrors, single: bool) -> str:
    """The sentence of one axis. single: whether the device has no other, so that it needs no name."""
    along = "" if single else f" along {reached.axis}"
    if not reached.tested:
        return (
            f"In the force balance{along}, no law could be tested: the device moves only once, and the held-out data "
            "contain almost no motion. Record several motions, or give one of them the role of a test."
        )
    model = (
        "the error of the re-tuned model is" if reached.given else "the error of mass, damping and stiffness alone is"
    )
    alone = f"In the force balance{along}, on held-out data, {model} {error_text(reached.linear)} of the force"
    named = f"with the named laws it is {error_text(reached.named)}" if reached.any_named else "no law is named"
    if reached.any_named and reached.named <= reached.ceiling * (1 + SAME):
        return f"{alone}, {named}, and all laws together reach no smaller error."
    share = (
        f", and that is {share_text(reached.share)} of the reduction of the error power that all laws together reach"
        if reached.named < reached.linear
        else ""
    )
    return (
        f"{alone}; with all laws together it is {error_text(reached.ceiling)}, a bound that a sum of a few laws can "
        f"hardly reach; {named}{share}."
    )


_NOISE_SOURCES = {"rest": "at the level measured at rest", "quiet band": "at the level measured above the driven band"}
"""Words for noise that was not estimated from repeats, by `NoiseFloor.how`. Its level during excitation is then
unknown, so that errors are not stated in units of it."""


def times_text(ratio: float) -> str:
    """A ratio in words, such as "1.04 times"."""
    return f"{ratio:.2f} times" if ratio < 10 else f"{ratio:.3g} times"


def fall_text(errors: Errors, first: tuple[str, str], last: tuple[str, str], how: str = "") -> str:
    """Clause on the change of the held-out error between two stages. first, last: a field of `Errors`, and its name in
    words. how: `NoiseFloor.how`; empty where it is not known."""
    before, after = getattr(errors, first[0]), getattr(errors, last[0])
    if before is None or after is None:
        return "how much better it predicts held-out data is not known"
    goes = "falls" if after * SAME_TO_READERS < before else "goes"
    return (
        f"the error on held-out data {goes} from {error_of_signal(before)} ({first[1]}) to "
        f"{error_text(after)} ({last[1]}){_noise(errors, after, how)}"
    )


def one_error(text: str, error: float | None, errors: Errors, how: str = "") -> str:
    """Clause on a single held-out error and on the noise, or that the error is not known. text: begins the clause."""
    if error is None:
        return "its error on held-out data is not known"
    return f"{text}, its error on held-out data is {error_of_signal(error)}{_noise(errors, error, how)}"


def _noise(errors: Errors, error: float, how: str) -> str:
    """End of a clause: an error compared with that of noise alone."""
    if not errors.noise or how == "unknown":
        return "; what noise alone would leave is not known"
    if how in _NOISE_SOURCES:
        return f"; noise {_NOISE_SOURCES[how]} would leave {error_text(errors.noise)}"
    return f", {times_text(error / errors.noise)} what noise alone would leave ({error_text(errors.noise)})"


def confirmation_sentence(fit: Errors, test: Errors) -> str:
    """A sentence where held-out data do not confirm the fit; else empty. The errors of both sets are compared in units
    of their noise, so that different signals do not matter."""
    if None in (test.after, test.retuned, test.noise, fit.after, fit.noise):
        return ""
    assert test.after is not None and test.retuned is not None and test.noise and fit.after is not None and fit.noise
    if test.after > test.retuned:
        return (
            "The held-out data do not confirm this: there the re-tuned model alone has a smaller error "
            f"({error_of_signal(test.retuned)} compared with {error_text(test.after)})."
        )
    there, here = test.after / test.noise, fit.after / fit.noise
    if there > FIT_CONFIRMED * max(here, 1.0):
        return (
            f"The held-out data confirm this only in part: the error is {times_text(there)} the noise there and "
            f"{times_text(here)} the noise on the fitted data."
        )
    return ""
