"""What a diagnosis says, in plain sentences: the same in the report, in the terminal and on the screen."""

from collections.abc import Mapping, Sequence

from analysis.diagnosis.document import Diagnosis, Errors, Mismatch, NamedEffect
from analysis.diagnosis.effect_words import OF_THE_WHOLE, noun_of, numbers_text, place_words
from analysis.diagnosis.found_law import law_text
from analysis.diagnosis.result.candidate_wording import (
    REFINED,
    Device,
    best_candidate_sentence,
    candidate_sentences,
    class_noun,
    class_sentence,
    refinement_sentence,
)
from analysis.diagnosis.result.ceiling_wording import black_box_sentence, ceiling_sentences
from analysis.diagnosis.result.findings import Findings
from analysis.diagnosis.result.impact_wording import impact_sentence
from analysis.diagnosis.result.plausibility import implausible_sentences
from analysis.diagnosis.result.retuned_numbers import (
    MovedNumber,
    better_alone,
    better_model,
    doubtful_sentences,
    moved_numbers,
    raised_sentence,
    retuned_sentence,
)
from analysis.diagnosis.settings import FIT_CONFIRMED, SAME_TO_READERS
from analysis.diagnosis.unit_wording import error_text, probability_text, share_text
from analysis.wording import capital, ended, listed, p_text

_PLACES_NAMED = 3


def effect_title(effect: NamedEffect, single: bool = False) -> str:
    """ "dry friction on the x drive". single: the device has one axis."""
    if effect.effect in OF_THE_WHOLE and effect.axis is None:
        return noun_of(effect.effect)
    return f"{class_noun(effect)} {place_words(effect.place, effect.axis, single)}"


def effect_sentence(effect: NamedEffect, signature: str = "", single: bool = False) -> str:
    """signature: what is seen in the data where it is the cause, as the catalogue has it."""
    if effect.law is not None:
        signature = "; ".join(filter(None, (law_text(effect.law), signature)))
    said = ", ".join(filter(None, (effect_title(effect, single), numbers_text(effect.effect, effect.parameters))))
    return f"{capital(said)}: {signature}." if signature else f"{capital(said)}."


def verdict_sentence(diagnosis: Diagnosis, moved: Sequence[MovedNumber] = (), device: Device | None = None) -> str:
    """The whole answer, first thing to be read; where nothing is named, with the best candidate."""
    single = device is not None and device.single
    errors = diagnosis.fit.test
    named = listed([effect_title(effect, single) for effect in diagnosis.effects])
    if diagnosis.verdict == "no_mismatch":
        return f"The model answers as the device does: {_one_error('as it was given', errors.before, errors)}."
    if diagnosis.verdict == "parameters":
        off = (
            f": {listed([number.text for number in moved])}"
            if moved
            else ", each within its calibration's standard deviation"
        )
        return (
            f"No physics is missing; numbers of the model are off{off}. "
            f"{capital(_fall(errors, ('before', 'as given'), ('retuned', 're-tuned')))}."
        )
    if diagnosis.verdict == "explained":
        return f"Missing in the model: {named}. {capital(_fall(errors, better_model(errors), _AFTER))}."
    if diagnosis.verdict == "partly_explained":
        return (
            f"Missing in the model: {named}, but that is not all. "
            f"{capital(_fall(errors, better_model(errors), _AFTER))}, and a mismatch remains."
        )
    said = (
        "Model and device disagree, and no effect of the catalogue explains it. "
        f"{capital(_one_error(*better_alone(errors), errors))}."
    )
    return " ".join(filter(None, (said, best_candidate_sentence(diagnosis, device))))


def answer_of(found: Findings) -> str:
    """The verdict's sentence."""
    diagnosis, device = found.diagnosis, device_of(found)
    if found.explanation.statistic is not None:
        return impact_sentence(diagnosis, listed([effect_title(effect, device.single) for effect in diagnosis.effects]))
    return verdict_sentence(diagnosis, moved_of(found) if diagnosis.verdict == "parameters" else (), device)


def device_of(found: Findings) -> Device:
    return Device(found.given.inputs == 1, found.given.system)


_AFTER = ("after", "with it")


def times_text(ratio: float) -> str:
    """ "1.04 times"."""
    return f"{ratio:.2f} times" if ratio < 10 else f"{ratio:.3g} times"


def rival_sentences(effect: NamedEffect) -> tuple[str, ...]:
    """Why each was passed over; those that the data cannot tell from it come in `inseparable_sentence`."""
    return tuple(
        f"{capital(noun_of(rival.effect))} (probability {probability_text(rival.probability)}): {ended(rival.why_not)}"
        for rival in effect.rivals
        if not rival.inseparable and rival.why_not != REFINED
    )


def inseparable_sentence(effect: NamedEffect) -> str:
    """With what only refines it; empty where the data single one out."""
    return " ".join(filter(None, (_inseparable(effect), refinement_sentence(effect))))


def _inseparable(effect: NamedEffect) -> str:
    if effect.class_:
        return class_sentence(effect)
    others = [rival for rival in effect.rivals if rival.inseparable]
    if not others:
        return ""
    both = "both are" if len(others) == 1 else "all of them are"
    odds = ", ".join(
        f"{noun_of(name)} {probability_text(probability)}"
        for name, probability in (
            (effect.effect, effect.probability), *((other.effect, other.probability) for other in others)
        )
    )  # fmt: skip
    return (
        f"These data cannot tell {noun_of(effect.effect)} from {listed([noun_of(other.effect) for other in others])}: "
        f"{both} named (probabilities: {odds})."
    )


def remainder_sentence(diagnosis: Diagnosis, device: Device | None = None) -> str:
    """What is still unexplained, in the document's order: what misses most of the signal comes first."""
    left = diagnosis.remainder
    if not left:
        return "Nothing significant is left unexplained."
    more = len(left) - _PLACES_NAMED
    rest = f"; and {more} smaller {'place' if more == 1 else 'places'}" if more > 0 else ""
    return f"Still unexplained: {'; '.join(place_of(row, device) for row in left[:_PLACES_NAMED])}{rest}."


def place_of(mismatch: Mismatch, device: Device | None = None) -> str:
    """ "ax at 8 to 16 Hz, driven by fx at 0.5, near v = 0: 80 % of the mismatch (p < 0.0001)"."""
    low, high = mismatch.band_hz
    band = f" at {low:g} to {high:g} Hz" if device is None or device.system.time == "s" else ""
    level = "" if mismatch.amplitude is None else f" at {mismatch.amplitude:g}"
    state = f", {mismatch.state}" if mismatch.state else ""
    driven = f", driven by {mismatch.input}{level}" if mismatch.input else ""
    share = f"{share_text(mismatch.share)} of {'the mismatch' if mismatch.state else 'the signal'}"
    return f"{mismatch.output}{band}{driven}{state}: {share} ({p_text(mismatch.p_value)})"


def next_experiment_sentence(diagnosis: Diagnosis) -> str:
    wanted = diagnosis.next_experiment
    if wanted is None:
        alike = any(rival.inseparable for effect in diagnosis.effects for rival in effect.rivals)
        return "No further recording is foreseen to tell apart what these data cannot." if alike else ""
    splits = f"would tell {listed([noun_of(name) for name in wanted.splits])} apart" if wanted.splits else "would help"
    return f"The recording that {splits}: {wanted.command}. {capital(ended(wanted.why))}"


def share_sentence(effect: NamedEffect) -> str:
    return (
        f"It accounts for {100 * effect.share:.3g} % of the mismatch that re-tuning leaves; "
        f"the probability that this is its name is {probability_text(effect.probability)}.{gain_sentence(effect)}"
    )


def gain_sentence(effect: NamedEffect) -> str:
    """With a space before it; empty where nothing was held out."""
    gain = effect.held_out_gain
    if gain is None or gain.ci95 is None:
        return ""
    low, high = (share_text(max(end, 0.0)) for end in gain.ci95)
    return f" On held-out data it takes {share_text(max(gain.value, 0.0))} of the error's power ({low} to {high})."


def confirmation_sentence(fit: Errors, test: Errors) -> str:
    """Where the held-out data do not bear out the fit; else empty. Both records' errors are counted in their noise."""
    if None in (test.after, test.retuned, test.noise, fit.after, fit.noise):
        return ""
    assert test.after is not None and test.retuned is not None and test.noise and fit.after is not None and fit.noise
    if test.after > test.retuned:
        return (
            "The held-out data do not confirm this: there the re-tuned model alone does better "
            f"({error_text(test.retuned)} of the signal against {error_text(test.after)})."
        )
    there, here = test.after / test.noise, fit.after / fit.noise
    if there > FIT_CONFIRMED * max(here, 1.0):
        return (
            f"The held-out data confirm this only in part: {times_text(there)} the noise is left there, "
            f"{times_text(here)} the noise on what was fitted."
        )
    return ""


def summary_lines(found: Findings) -> tuple[str, ...]:
    """The diagnosis in a few sentences, the verdict first."""
    diagnosis, single = found.diagnosis, found.given.inputs == 1
    moved = moved_of(found)
    lines = [answer_of(found)]
    signatures = signature_texts(found)
    for effect in diagnosis.effects:
        lines += [effect_sentence(effect, signatures.get(effect.effect, ""), single), inseparable_sentence(effect)]
    if diagnosis.verdict in ("explained", "partly_explained"):
        lines.append(confirmation_sentence(diagnosis.fit.fit, diagnosis.fit.test))
    if diagnosis.verdict not in ("no_mismatch", "parameters"):
        lines += [
            raised_sentence(diagnosis.fit.test),
            retuned_sentence(moved),
            remainder_sentence(diagnosis, device_of(found)),
            *ceiling_sentences(found.reached),
            black_box_sentence(found.black_box, bool(diagnosis.effects)),
            *candidate_sentences(diagnosis, device_of(found)),
        ]
    lines += [next_experiment_sentence(diagnosis), *doubtful_sentences(moved), *implausible_sentences(found)]
    lines += found.remarks
    return tuple(line for line in lines if line)


def moved_of(found: Findings) -> tuple[MovedNumber, ...]:
    """The model's own numbers as they stand in the end, those that moved furthest first."""
    if found.tuning is None:
        return ()
    return moved_numbers(found.tuning, found.explanation.after.fitted.deviations)


def signature_texts(found: Findings) -> Mapping[str, str]:
    """By effect, as the catalogue has it."""
    return {placed.effect.name: placed.effect.signature for placed in found.named}


def _fall(errors: Errors, *stages: tuple[str, str]) -> str:
    (first, said_first), (last, said_last) = stages
    before, after = getattr(errors, first), getattr(errors, last)
    if before is None or after is None:
        return "how much better it predicts held-out data is not known"
    goes = "falls" if after * SAME_TO_READERS < before else "goes"
    return (
        f"the error on held-out data {goes} from {error_text(before)} of the signal ({said_first}) to "
        f"{error_text(after)} ({said_last}){_noise(errors, after)}"
    )


def _one_error(said: str, error: float | None, errors: Errors) -> str:
    if error is None:
        return "its error on held-out data is not known"
    return f"{said}, its error on held-out data is {error_text(error)} of the signal{_noise(errors, error)}"


def _noise(errors: Errors, error: float) -> str:
    if not errors.noise:
        return "; what noise alone would leave is not known"
    return f", {times_text(error / errors.noise)} what noise alone would leave ({error_text(errors.noise)})"
