"""Write the sentences of a diagnosis, the same in the report, in the terminal and on the screen.

`write_summary_lines` returns those of the terminal in order, the verdict first. Errors are on held-out data, relative
to the signal or, in a force balance, to the force.
"""

from collections.abc import Sequence

from analysis.diagnosis.document import Diagnosis, Mismatch, NamedEffect, format_law
from analysis.diagnosis.effect_words import WHOLE_DEVICE_FAULTS, format_parameters, format_place, get_noun
from analysis.diagnosis.limits import FALSE_DISCOVERY_RATE
from analysis.diagnosis.result.candidate_wording import (
    REFINEMENT_REASON,
    DeviceWording,
    describe_best_candidate,
    describe_candidates,
    describe_class,
    describe_refinements,
    format_class_noun,
)
from analysis.diagnosis.result.error_wording import (
    describe_balance_errors,
    describe_black_box,
    describe_confirmation,
    describe_error,
    describe_error_change,
)
from analysis.diagnosis.result.findings import Findings
from analysis.diagnosis.result.impact_wording import format_impact_answer
from analysis.diagnosis.result.plausibility import describe_doubts
from analysis.diagnosis.result.retuned_parameters import (
    MovedParameter,
    choose_better_error,
    choose_better_model,
    describe_doubtful_parameters,
    describe_raised_error,
    describe_retuning,
    find_moved_parameters,
)
from analysis.diagnosis.unit_wording import format_probability, format_share, typeset_unit
from analysis.wording import capitalise, conjoin, end_sentence, format_p_text
from equalizer.effects.discovered_law import set_law_values
from equalizer.effects.effect import PlacedEffect

_MAX_LISTED_PLACES = 3
"""Largest number of rows of a remaining mismatch that a sentence lists. Chosen."""
_DISAGREEMENT = "Model and device disagree, and no effect of the catalogue explains it."
_DISAGREEMENT_OR_NOISE = (
    "Model and recording differ, and no effect of the catalogue explains it; only repeated periods of the excitation "
    "could show how much of the difference is noise."
)
"""Answers of the verdict `unexplained`: where noise was measured from repeats (or is not stated), and where it was
estimated otherwise or is not known."""
_AT_NOISE_LEVEL = (
    "The residual is no larger than the estimated noise; only repeated periods of the excitation could show that "
    "nothing else is missing."
)
"""Remark on a diagnosis without a remaining mismatch that is not `explained`."""


def format_effect_title(effect: NamedEffect, is_single_axis: bool = False) -> str:
    """Format noun and place of an effect: "dry friction on the x drive"; the noun alone for a fault of the whole
    device. is_single_axis: whether the device has one axis, which is then not named."""
    if effect.effect in WHOLE_DEVICE_FAULTS and effect.axis is None:
        return get_noun(effect.effect)
    return f"{format_class_noun(effect)} {format_place(effect.place, effect.axis, is_single_axis)}"


def describe_effect(effect: NamedEffect, signature: str = "", device: DeviceWording | None = None) -> str:
    """Describe an effect with its parameters in a sentence. signature: what it causes in the data, from the catalogue;
    a discovered law is written before it. device: None = several axes, and a law without its unit."""
    is_single_axis = device is not None and device.is_single_axis
    if effect.law is not None:
        force_unit = "" if device is None else typeset_unit(device.system.force)
        signature = "; ".join(filter(None, (format_law(effect.law, force_unit), signature)))
    title_and_parameters = ", ".join(
        filter(None, (format_effect_title(effect, is_single_axis), format_parameters(effect.effect, effect.parameters)))
    )
    return f"{capitalise(title_and_parameters)}: {signature}." if signature else f"{capitalise(title_and_parameters)}."


def describe_verdict(
    diagnosis: Diagnosis, moved_parameters: Sequence[MovedParameter] = (), device: DeviceWording | None = None
) -> str:
    """Describe the verdict, with named effects and held-out errors; where it is "unexplained", with the best candidate.
    moved_parameters: re-tuned by a standard deviation or more, for the verdict "parameters". device: None = several
    axes and no statement on the noise."""
    is_single_axis = device is not None and device.is_single_axis
    errors = diagnosis.fit.test
    effect_titles = conjoin([format_effect_title(effect, is_single_axis) for effect in diagnosis.effects])
    noise_method = "" if device is None else device.noise
    if diagnosis.verdict == "no_mismatch":
        return f"The model agrees with the device: {describe_error('as given', errors.before, errors, noise_method)}."
    if diagnosis.verdict == "parameters":
        change_text = (
            f": {conjoin([parameter.text for parameter in moved_parameters])}"
            if moved_parameters
            else ", each by less than its tolerance"
        )
        error_text = describe_error_change(errors, ("before", "as given"), ("retuned", "re-tuned"), noise_method)
        return f"No physics is missing; parameters of the model are wrong{change_text}. {capitalise(error_text)}."
    if diagnosis.effects:
        error_text = capitalise(
            describe_error_change(errors, choose_better_model(errors), ("after", "with it"), noise_method)
        )
        if not select_significant(diagnosis.remainder):
            remark = "" if diagnosis.verdict == "explained" else f" {_AT_NOISE_LEVEL}"
            return f"Missing in the model: {effect_titles}. {error_text}.{remark}"
        return f"Missing in the model: {effect_titles}, but that is not all. {error_text}, and a mismatch remains."
    # Noise that does not repeat was not measured in the driven band, where coloured noise may be larger.
    disagreement = _DISAGREEMENT if noise_method in ("", "repeats") else _DISAGREEMENT_OR_NOISE
    sentence = f"{disagreement} {capitalise(describe_error(*choose_better_error(errors), errors, noise_method))}."
    return " ".join(filter(None, (sentence, describe_best_candidate(diagnosis, device))))


def write_answer(findings: Findings) -> str:
    """Write the sentences of the verdict, about band powers where impacts were compared by them."""
    diagnosis, device = findings.diagnosis, extract_device(findings)
    if findings.explanation.statistic is not None:
        return format_impact_answer(
            diagnosis, conjoin([format_effect_title(effect, device.is_single_axis) for effect in diagnosis.effects])
        )
    return describe_verdict(diagnosis, find_final_moves(findings) if diagnosis.verdict == "parameters" else (), device)


def extract_device(findings: Findings) -> DeviceWording:
    """Extract the properties of the device that sentences need, from the given model, the noise floor and the units of
    the readings."""
    noise_method = "" if findings.floor is None else findings.floor.method
    return DeviceWording(findings.given.inputs == 1, findings.given.system, noise_method, findings.reading_units)


def describe_rivals(effect: NamedEffect) -> tuple[str, ...]:
    """Describe each rival of the effect in a sentence: its probability and why it was not chosen. Left out are rivals
    that the data cannot distinguish from the effect, and those with `REFINEMENT_REASON` (`describe_equivalents`)."""
    return tuple(
        f"{capitalise(get_noun(rival.effect))} (probability {format_probability(rival.probability)}): "
        f"{end_sentence(rival.why_not)}"
        for rival in effect.rivals
        if not rival.inseparable and rival.why_not != REFINEMENT_REASON
    )


def describe_equivalents(effect: NamedEffect) -> str:
    """Describe rivals that the data cannot distinguish from the effect, and laws that only refine it; empty where there
    are none."""
    return " ".join(filter(None, (_describe_inseparable(effect), describe_refinements(effect))))


def _describe_inseparable(effect: NamedEffect) -> str:
    """Describe the class of the effect, or the rivals marked as inseparable with their probabilities; else empty."""
    if effect.class_:
        return describe_class(effect)
    equivalents = [rival for rival in effect.rivals if rival.inseparable]
    if not equivalents:
        return ""
    subject = "both are" if len(equivalents) == 1 else "all of them are"
    probability_texts = ", ".join(
        f"{get_noun(name)} {format_probability(probability)}"
        for name, probability in (
            (effect.effect, effect.probability),
            *((equivalent.effect, equivalent.probability) for equivalent in equivalents),
        )
    )
    return (
        f"These data do not distinguish {get_noun(effect.effect)} from "
        f"{conjoin([get_noun(equivalent.effect) for equivalent in equivalents])}: {subject} "
        f"named (probabilities: {probability_texts})."
    )


def describe_remainder(diagnosis: Diagnosis, device: DeviceWording | None = None) -> str:
    """Describe the remaining mismatch: its first `_MAX_LISTED_PLACES` significant rows in the document's order
    (`list_mismatch_rows`), and the number of the others."""
    significant_rows = select_significant(diagnosis.remainder)
    if not significant_rows:
        return "No significant mismatch remains."
    unlisted_count = len(significant_rows) - _MAX_LISTED_PLACES
    unlisted_text = (
        f"; and {unlisted_count} smaller {'place' if unlisted_count == 1 else 'places'}" if unlisted_count > 0 else ""
    )
    return (
        f"Still unexplained: {'; '.join(describe_place(row, device) for row in significant_rows[:_MAX_LISTED_PLACES])}"
        f"{unlisted_text}."
    )


def select_significant(rows: Sequence[Mismatch]) -> tuple[Mismatch, ...]:
    """Select rows with a p-value of at most `FALSE_DISCOVERY_RATE`: a document may list rows that are not
    significant."""
    return tuple(row for row in rows if row.p_value <= FALSE_DISCOVERY_RATE)


def describe_place(mismatch: Mismatch, device: DeviceWording | None = None) -> str:
    """Describe where a mismatch occurs and its share: "ax at 8 to 16 Hz, driven by fx at 0.5, near v = 0: 80 % of the
    mismatch (p < 0.0001)"."""
    low_hz, high_hz = mismatch.band_hz
    band_text = f" at {low_hz:g} to {high_hz:g} Hz" if device is None or device.system.time == "s" else ""
    level_text = "" if mismatch.amplitude is None else f" at {mismatch.amplitude:g}"
    state_text = f", {mismatch.state}" if mismatch.state else ""
    input_text = f", driven by {mismatch.input}{level_text}" if mismatch.input else ""
    share_text = f"{format_share(mismatch.share)} of {'the mismatch' if mismatch.state else 'the signal'}"
    return f"{mismatch.output}{band_text}{input_text}{state_text}: {share_text} ({format_p_text(mismatch.p_value)})"


def describe_next_experiment(diagnosis: Diagnosis) -> str:
    """Describe the recording to make next, and why. Without a proposal: a sentence that states this where rivals cannot
    be distinguished, else empty."""
    experiment = diagnosis.next_experiment
    if experiment is None:
        has_equivalents = any(rival.inseparable for effect in diagnosis.effects for rival in effect.rivals)
        return (
            "No further recording was found that would distinguish what these data do not." if has_equivalents else ""
        )
    named_noun, *rival_nouns = (get_noun(name) for name in experiment.splits) if experiment.splits else ("",)
    benefit = f"would distinguish {named_noun} from {conjoin(rival_nouns)}" if rival_nouns else "would help"
    subject = "The recordings" if "; then " in experiment.command else "The recording"
    return f"{subject} that {benefit}: {experiment.command}. {capitalise(end_sentence(experiment.why))}"


def describe_share(effect: NamedEffect) -> str:
    """Describe an effect's share of the mismatch after re-tuning, its probability, and its held-out gain where that is
    known."""
    return (
        f"It accounts for {100 * effect.share:.3g} % of the mismatch after re-tuning; the probability that this "
        f"effect is the cause is {format_probability(effect.probability)}.{describe_gain(effect)}"
    )


def describe_gain(effect: NamedEffect) -> str:
    """Describe the effect's held-out gain and its 95 % interval, values below 0 as 0, after a leading space; empty
    where no gain with an interval is known."""
    gain = effect.held_out_gain
    if gain is None or gain.ci95 is None:
        return ""
    low, high = (format_share(max(gain_limit, 0.0)) for gain_limit in gain.ci95)
    return f" On held-out data it explains {format_share(max(gain.value, 0.0))} of the error's power ({low} to {high})."


def write_summary_lines(findings: Findings) -> tuple[str, ...]:
    """Write the lines of the diagnosis: verdict, effects, mismatch, next experiment, doubts and remarks; none is
    empty."""
    diagnosis, device = findings.diagnosis, extract_device(findings)
    moved_parameters = find_final_moves(findings)
    lines = [write_answer(findings)]
    for effect in diagnosis.effects:
        lines += [
            describe_effect(effect, get_signature_text(findings, effect), device),
            describe_equivalents(effect),
        ]
    if diagnosis.verdict in ("explained", "partly_explained"):
        lines.append(describe_confirmation(diagnosis.fit.fit, diagnosis.fit.test))
    if diagnosis.verdict not in ("no_mismatch", "parameters"):
        lines += [
            describe_raised_error(diagnosis.fit.test),
            describe_retuning(moved_parameters, findings.fitted),
            describe_remainder(diagnosis, device),
            *describe_balance_errors(findings.balance_errors),
            describe_black_box(findings.black_box, bool(diagnosis.effects)),
            *describe_candidates(diagnosis, device),
        ]
    lines += [
        describe_next_experiment(diagnosis),
        *describe_doubtful_parameters(moved_parameters, findings.fitted),
        *describe_doubts(findings),
    ]
    lines += findings.remarks
    return tuple(line for line in lines if line)


def find_final_moves(findings: Findings) -> tuple[MovedParameter, ...]:
    """Find the model's own parameters that the final fit moved by a standard deviation of their calibration or more,
    the largest move first; empty without re-tuning."""
    if findings.tuning is None:
        return ()
    return find_moved_parameters(findings.tuning, findings.explanation.after.fitted.deviations)


def find_fitted_effect(findings: Findings, effect: NamedEffect) -> PlacedEffect | None:
    """Find the fit of a named effect, a discovered law by its formula; None where the findings have no such fit."""
    for placed_effect in findings.named:
        law = placed_effect.effect.law
        is_same_law = (
            effect.law is None or law is None
            or set_law_values(law, placed_effect.values).text == effect.law.expression
        )  # fmt: skip
        if placed_effect.effect.name == effect.effect and is_same_law:
            return placed_effect
    return None


def get_signature_text(findings: Findings, effect: NamedEffect) -> str:
    """Return the catalogue's text on what a named effect causes in the data; empty where it has no fit."""
    placed_effect = find_fitted_effect(findings, effect)
    return "" if placed_effect is None else placed_effect.effect.signature
