"""A diagnosis in plain sentences, the same in the report, in the terminal and on the screen.

`summary_lines` gives all of them in order, the verdict first; errors are relative to the signal, on held-out data.
"""

from collections.abc import Mapping, Sequence

from analysis.diagnosis.document import Diagnosis, Mismatch, NamedEffect, law_text
from analysis.diagnosis.effect_words import OF_THE_WHOLE, noun_of, parameters_text, place_words
from analysis.diagnosis.result.candidate_wording import (
    REFINED,
    Device,
    best_candidate_sentence,
    candidate_sentences,
    class_noun,
    class_sentence,
    refinement_sentence,
)
from analysis.diagnosis.result.ceiling_wording import (
    black_box_sentence,
    confirmation_sentence,
    describe_ceiling,
    fall_text,
    one_error,
)
from analysis.diagnosis.result.findings import Findings
from analysis.diagnosis.result.impact_wording import impact_sentence
from analysis.diagnosis.result.plausibility import implausible_sentences
from analysis.diagnosis.result.retuned_parameters import (
    MovedParameter,
    better_alone,
    better_model,
    describe_raised_error,
    describe_retuning,
    doubtful_sentences,
    find_moved_parameters,
)
from analysis.diagnosis.settings import FALSE_DISCOVERY_RATE
from analysis.diagnosis.unit_wording import probability_text, share_text
from analysis.wording import capitalise, conjoin, end_sentence, p_text

_PLACES_NAMED = 3
"""Largest number of places of a remaining mismatch that a sentence lists."""
_NOT_MORE = (
    "The residual is no larger than the estimated noise; only repeated periods of the excitation could show that "
    "nothing else is missing."
)


def effect_title(effect: NamedEffect, single: bool = False) -> str:
    """Noun and place of an effect: "dry friction on the x drive". single: the device has one axis."""
    if effect.effect in OF_THE_WHOLE and effect.axis is None:
        return noun_of(effect.effect)
    return f"{class_noun(effect)} {place_words(effect.place, effect.axis, single)}"


def effect_sentence(effect: NamedEffect, signature: str = "", single: bool = False) -> str:
    """Sentence on an effect with its parameters. signature: what the effect causes in the data, by the catalogue."""
    if effect.law is not None:
        signature = "; ".join(filter(None, (law_text(effect.law), signature)))
    text = ", ".join(filter(None, (effect_title(effect, single), parameters_text(effect.effect, effect.parameters))))
    return f"{capitalise(text)}: {signature}." if signature else f"{capitalise(text)}."


def verdict_sentence(diagnosis: Diagnosis, moved: Sequence[MovedParameter] = (), device: Device | None = None) -> str:
    """The answer, with which every output begins: verdict, named effects and held-out errors; where nothing is named,
    with the best candidate. moved: re-tuned parameters, for the verdict "parameters"."""
    single = device is not None and device.single
    errors = diagnosis.fit.test
    named = conjoin([effect_title(effect, single) for effect in diagnosis.effects])
    how = "" if device is None else device.noise
    if diagnosis.verdict == "no_mismatch":
        return f"The model agrees with the device: {one_error('as given', errors.before, errors, how)}."
    if diagnosis.verdict == "parameters":
        off = (
            f": {conjoin([number.text for number in moved])}"
            if moved
            else ", each within its calibration's standard deviation"
        )
        fall = fall_text(errors, ("before", "as given"), ("retuned", "re-tuned"), how)
        return f"No physics is missing; parameters of the model are wrong{off}. {capitalise(fall)}."
    if diagnosis.effects:
        fall = capitalise(fall_text(errors, better_model(errors), ("after", "with it"), how))
        if not significant(diagnosis.remainder):
            open_ = "" if diagnosis.verdict == "explained" else f" {_NOT_MORE}"
            return f"Missing in the model: {named}. {fall}.{open_}"
        return f"Missing in the model: {named}, but that is not all. {fall}, and a mismatch remains."
    sentence = (
        "Model and device disagree, and no effect of the catalogue explains it. "
        f"{capitalise(one_error(*better_alone(errors), errors, how))}."
    )
    return " ".join(filter(None, (sentence, best_candidate_sentence(diagnosis, device))))


def answer_of(found: Findings) -> str:
    """The sentence of the verdict, by band powers where impacts were compared."""
    diagnosis, device = found.diagnosis, device_of(found)
    if found.explanation.statistic is not None:
        return impact_sentence(
            diagnosis, conjoin([effect_title(effect, device.single) for effect in diagnosis.effects])
        )
    return verdict_sentence(
        diagnosis, final_moved_parameters(found) if diagnosis.verdict == "parameters" else (), device
    )


def device_of(found: Findings) -> Device:
    """The facts about the device that sentences need, from the given model and the noise floor."""
    return Device(found.given.inputs == 1, found.given.system, "" if found.floor is None else found.floor.how)


def rival_sentences(effect: NamedEffect) -> tuple[str, ...]:
    """A sentence per rival of the effect: its probability and why it was not chosen. Rivals that the data cannot
    distinguish from the effect are in `inseparable_sentence`."""
    return tuple(
        f"{capitalise(noun_of(rival.effect))} (probability {probability_text(rival.probability)}): "
        f"{end_sentence(rival.why_not)}"
        for rival in effect.rivals
        if not rival.inseparable and rival.why_not != REFINED
    )


def inseparable_sentence(effect: NamedEffect) -> str:
    """Sentences on rivals that the data cannot distinguish from the effect, and on laws that only refine it; empty
    where there are none."""
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
        f"These data do not distinguish {noun_of(effect.effect)} from "
        f"{conjoin([noun_of(other.effect) for other in others])}: {both} named (probabilities: {odds})."
    )


def remainder_sentence(diagnosis: Diagnosis, device: Device | None = None) -> str:
    """Sentence on the remaining mismatch: its first `_PLACES_NAMED` significant rows in the document's order, which
    begins with the largest share of the signal, and the number of the others."""
    left = significant(diagnosis.remainder)
    if not left:
        return "No significant mismatch remains."
    more = len(left) - _PLACES_NAMED
    rest = f"; and {more} smaller {'place' if more == 1 else 'places'}" if more > 0 else ""
    return f"Still unexplained: {'; '.join(place_of(row, device) for row in left[:_PLACES_NAMED])}{rest}."


def significant(rows: Sequence[Mismatch]) -> tuple[Mismatch, ...]:
    """The rows with a p-value of at most `FALSE_DISCOVERY_RATE`: a document may list rows that are not significant."""
    return tuple(row for row in rows if row.p_value <= FALSE_DISCOVERY_RATE)


def place_of(mismatch: Mismatch, device: Device | None = None) -> str:
    """Where a mismatch occurs and its share, in words: "ax at 8 to 16 Hz, driven by fx at 0.5, near v = 0: 80 % of the
    mismatch (p < 0.0001)"."""
    low, high = mismatch.band_hz
    band = f" at {low:g} to {high:g} Hz" if device is None or device.system.time == "s" else ""
    level = "" if mismatch.amplitude is None else f" at {mismatch.amplitude:g}"
    state = f", {mismatch.state}" if mismatch.state else ""
    driven = f", driven by {mismatch.input}{level}" if mismatch.input else ""
    share = f"{share_text(mismatch.share)} of {'the mismatch' if mismatch.state else 'the signal'}"
    return f"{mismatch.output}{band}{driven}{state}: {share} ({p_text(mismatch.p_value)})"


def next_experiment_sentence(diagnosis: Diagnosis) -> str:
    """Sentences on the recording to make next, and why. Without a proposal: a sentence that says so where rivals cannot
    be distinguished, else empty."""
    wanted = diagnosis.next_experiment
    if wanted is None:
        alike = any(rival.inseparable for effect in diagnosis.effects for rival in effect.rivals)
        return "No further recording was found that would distinguish what these data do not." if alike else ""
    named, *rivals = (noun_of(name) for name in wanted.splits) if wanted.splits else ("",)
    splits = f"would distinguish {named} from {conjoin(rivals)}" if rivals else "would help"
    subject = "The recordings" if "; then " in wanted.command else "The recording"
    return f"{subject} that {splits}: {wanted.command}. {capitalise(end_sentence(wanted.why))}"


def share_sentence(effect: NamedEffect) -> str:
    """Sentences on an effect's share of the mismatch after re-tuning, its probability, and its held-out gain."""
    return (
        f"It accounts for {100 * effect.share:.3g} % of the mismatch after re-tuning; the probability that this "
        f"effect is the cause is {probability_text(effect.probability)}.{gain_sentence(effect)}"
    )


def gain_sentence(effect: NamedEffect) -> str:
    """Sentence on the effect's held-out gain, preceded by a space; empty where no gain with an interval is known."""
    gain = effect.held_out_gain
    if gain is None or gain.ci95 is None:
        return ""
    low, high = (share_text(max(end, 0.0)) for end in gain.ci95)
    return f" On held-out data it explains {share_text(max(gain.value, 0.0))} of the error's power ({low} to {high})."


def summary_lines(found: Findings) -> tuple[str, ...]:
    """The diagnosis in a few sentences, the verdict first."""
    diagnosis, single = found.diagnosis, found.given.inputs == 1
    moved = final_moved_parameters(found)
    lines = [answer_of(found)]
    signatures = signature_texts(found)
    for effect in diagnosis.effects:
        lines += [effect_sentence(effect, signatures.get(effect.effect, ""), single), inseparable_sentence(effect)]
    if diagnosis.verdict in ("explained", "partly_explained"):
        lines.append(confirmation_sentence(diagnosis.fit.fit, diagnosis.fit.test))
    if diagnosis.verdict not in ("no_mismatch", "parameters"):
        lines += [
            describe_raised_error(diagnosis.fit.test),
            describe_retuning(moved, found.fitted),
            remainder_sentence(diagnosis, device_of(found)),
            *describe_ceiling(found.reached),
            black_box_sentence(found.black_box, bool(diagnosis.effects)),
            *candidate_sentences(diagnosis, device_of(found)),
        ]
    lines += [
        next_experiment_sentence(diagnosis),
        *doubtful_sentences(moved, found.fitted),
        *implausible_sentences(found),
    ]
    lines += found.remarks
    return tuple(line for line in lines if line)


def final_moved_parameters(found: Findings) -> tuple[MovedParameter, ...]:
    """The model's own parameters that the final fit moved by a standard deviation of their calibration or more, the
    largest move first."""
    if found.tuning is None:
        return ()
    return find_moved_parameters(found.tuning, found.explanation.after.fitted.deviations)


def signature_texts(found: Findings) -> Mapping[str, str]:
    """What each named effect causes in the data, by name of the effect, in the words of the catalogue."""
    return {placed.effect.name: placed.effect.signature for placed in found.named}
