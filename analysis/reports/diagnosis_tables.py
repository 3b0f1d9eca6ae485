"""Tables of a diagnosis report: parameters, rivals and candidates of the missing physics, model errors, mismatches.

Errors are given for the model as given, for the model with re-tuned parameters, and for the model with the effects that
were found, each on the fitted and on held-out data. `diagnosis_report` arranges the tables.
"""

from collections.abc import Mapping, Sequence
from typing import Literal

from analysis.diagnosis.document import Errors, Estimate, Mismatch, NamedEffect
from analysis.diagnosis.effect_words import estimate_text, noun_of, place_words
from analysis.diagnosis.result.candidate_wording import candidate_parameters
from analysis.diagnosis.result.findings import Findings
from analysis.diagnosis.result.retuned_parameters import list_parameters
from analysis.diagnosis.result.wording import extract_device
from analysis.diagnosis.unit_wording import error_text, probability_text, share_text, value_text
from analysis.reports.page import Table
from analysis.wording import MISSING, capitalise, end_sentence, format_p, format_signed

_STAGES = (("before", "As given"), ("retuned", "Re-tuned"), ("after", "With the effects found"))
"""Attribute of each stage of the model, and its heading."""
_MOST_PLACES = 12
"""Most rows of the table of mismatches."""
_SHARE = (
    "In order of how much of the channel's whole signal is missing. Share: mismatch over signal there; where a state "
    "is named, the share of the mismatch's power that occurs in it."
)
_PARTS: Mapping[str, str] = {"fit": "the fitted data", "test": "held-out data"}
"""Part of the data, and its text."""


def parameter_table(effect: NamedEffect) -> Table:
    """Table of an effect's parameters with their 95 % intervals."""
    rows = tuple(
        (name.replace("_", " "), estimate_text(parameter).partition(" [")[0], _interval_text(parameter))
        for name, parameter in effect.parameters.items()
    )
    return Table("Its parameters", ("Number", "Value", "95 % interval"), rows)


def rival_table(effect: NamedEffect) -> Table:
    """Table of a named effect and its rivals, with probabilities and reasons; rivals that cannot be distinguished come
    first."""
    rows = [(capitalise(noun_of(effect.effect)), probability_text(effect.probability), "named", "")]
    rows += [
        (
            capitalise(noun_of(rival.effect)),
            probability_text(rival.probability),
            "cannot be distinguished" if rival.inseparable else "passed over",
            end_sentence(rival.why_not),
        )
        for rival in sorted(effect.rivals, key=lambda rival: (not rival.inseparable, -rival.probability))
    ]
    return Table("It and its rivals", ("Effect", "Probability", "Verdict", "Why"), tuple(rows))


def candidate_table(findings: Findings) -> Table | None:
    """Table of candidate effects that were not confirmed, the best first; None without candidates."""
    device = extract_device(findings)
    rows = tuple(
        (
            f"{capitalise(noun_of(candidate.effect))} {place_words(candidate.place, candidate.axis, device.single)}",
            candidate_parameters(candidate, device) or MISSING,
            share_text(candidate.held_out_gain),
            share_text(candidate.share_of_black_box),
            end_sentence(capitalise(candidate.why_not)),
        )
        for candidate in findings.diagnosis.candidates
    )
    if not rows:
        return None
    header = ("Candidate", "Numbers", "Held-out gain", "Of what all laws explain", "Reason not to name it")
    note = (
        "Held-out gain: share of the error's power that the law explains on held-out data, in addition to the other "
        "laws of the best sum. The next column gives the same as a share of what all laws together explain of the "
        "error of mass, damping and stiffness alone."
    )
    return Table("The best candidates, not confirmed", header, rows, (note,))


def error_table(findings: Findings) -> Table:
    """Table of root-mean-square errors over all channels as a share of the signal, on fitted and on held-out data, by
    stage of the model, with the noise."""
    rows = tuple(
        (f"On {_PARTS[part]}", *(_stage_error_text(errors, stage) for stage, _ in _STAGES), error_text(errors.noise))
        for part, errors in (("fit", findings.diagnosis.fit.fit), ("test", findings.diagnosis.fit.test))
    )
    header = ("Error, share of the signal", *(words for _, words in _STAGES), "Noise alone")
    return Table("Errors over all channels, root-mean-square", header, rows)


def channel_table(findings: Findings, part: Literal["fit", "test"]) -> Table | None:
    """Table of the rms error of each channel in its unit, with its ratio to the noise, by stage of the model; None
    where there are no time series. Where a statistic was fitted, its chance error takes the place of the noise."""
    if not findings.time_series:
        return None
    names, units, noises = findings.time_series[0].channels, findings.time_series[0].units, findings.noise_rms
    statistic, reference = findings.explanation.statistic, "noise"
    if statistic is not None:
        units, noises, reference = (
            ("1",) * len(names),
            dict(zip(names, statistic.chance.tolist(), strict=True)),
            "chance",
        )
    scores = {stage: getattr(getattr(findings.explanation, stage).score, part) for stage, _ in _STAGES}
    rows = []
    for k, (name, unit) in enumerate(zip(names, units, strict=True)):
        noise = noises.get(name)
        if noise is None:
            continue
        ratios = [
            float(findings.channel_errors.get(stage, {}).get(name, values[k]) if part == "test" else values[k])
            for stage, values in scores.items()
        ]
        rows.append((name, *(f"{value_text(ratio * noise, unit)} ({_ratio_text(ratio)})" for ratio in ratios),
                     value_text(noise, unit)))  # fmt: skip
    header = ("Channel", *(f"{words} (× {reference})" for _, words in _STAGES), capitalise(reference))
    return Table(f"By channel, on {_PARTS[part]}, rms", header, tuple(rows), folded=part == "fit")


def mismatch_table(caption: str, places: Sequence[Mismatch], is_timed: bool = True) -> Table:
    """Folded table of the first `_MOST_PLACES` mismatches between model and device. is_timed: bands are in hertz; else
    in cycles per sample."""
    worst = places[:_MOST_PLACES]
    rows = tuple(
        (
            mismatch.output,
            mismatch.input,
            f"{mismatch.band_hz[0]:g} to {mismatch.band_hz[1]:g} {'Hz' if is_timed else 'cycles per sample'}",
            MISSING if mismatch.amplitude is None else f"{mismatch.amplitude:g}",
            mismatch.state or MISSING,
            share_text(mismatch.share),
            format_p(mismatch.p_value),
        )
        for mismatch in worst
    )
    remaining_count = len(places) - len(worst)
    notes: tuple[str, ...] = (
        (f"And {remaining_count} smaller {'place' if remaining_count == 1 else 'places'}.",)
        if remaining_count > 0
        else ()
    )
    notes += (_SHARE,) if worst else ()
    header = ("Channel", "Driven by", "Band", "Level", "State", "Share", "p")
    return Table(caption, header, rows, notes, folded=True)


def tabulate_retuned(findings: Findings) -> Table | None:
    """Folded table of all re-tuned parameters, before and after the found effects were added, with their deviations in
    standard deviations; None where nothing was re-tuned."""
    if findings.tuning is None:
        return None
    retuned_parameters = list_parameters(findings.tuning, findings.explanation.retuned.fitted.deviations)
    final_parameters = list_parameters(findings.tuning, findings.explanation.after.fitted.deviations)
    rows = tuple(
        (
            retuned.name,
            retuned.change_text,
            format_signed(retuned.deviations),
            completed.change_text,
            format_signed(completed.deviations),
        )
        for retuned, completed in zip(retuned_parameters, final_parameters, strict=True)
    )
    header = ("Number", "Re-tuned", "Standard deviations", "With the effects found", "Standard deviations")
    return Table("Every free parameter, by the size of its change", header, rows, folded=True)


def _stage_error_text(errors: Errors, stage: str) -> str:
    """Error of one stage of `_STAGES` as text."""
    value: float | None = getattr(errors, stage)
    return error_text(value)


def _ratio_text(ratio: float) -> str:
    """Ratio of an error to the noise, such as 1.25×."""
    return f"{ratio:.2f}×" if ratio < 10 else f"{ratio:.3g}×"


def _interval_text(estimate: Estimate) -> str:
    """95 % interval of an estimate with the digits of `value_text`; `MISSING` without an interval."""
    if estimate.ci95 is None:
        return MISSING
    text = value_text(estimate.value, estimate.unit, estimate.ci95)
    low, high = text[text.index("[") + 1 : -1].split(", ")
    return f"{low} to {high}"
