"""Tables of a diagnosis report: parameters, rivals and candidates of the missing physics, model errors, mismatches.

Errors are given for the model as given, for the model with re-tuned parameters, and for the model with the effects that
were found, each on the fitted and on held-out data.
"""

from collections.abc import Mapping, Sequence
from typing import Literal

from analysis.diagnosis.document import Estimate, Mismatch, NamedEffect
from analysis.diagnosis.effect_words import format_estimate, format_place, get_noun
from analysis.diagnosis.result.candidate_wording import format_candidate_parameters
from analysis.diagnosis.result.findings import Findings
from analysis.diagnosis.result.retuned_parameters import list_parameters
from analysis.diagnosis.result.wording import extract_device
from analysis.diagnosis.unit_wording import format_error, format_probability, format_share, format_value
from analysis.reports.page import Table
from analysis.wording import MISSING, capitalise, end_sentence, format_p, format_signed

_MODEL_STAGES = (("before", "As given"), ("retuned", "Re-tuned"), ("after", "With the effects found"))
"""Attribute of each stage of the model, and its heading."""
_MOST_MISMATCH_ROWS = 12
"""Largest number of rows of the table of mismatches. Chosen."""
_SHARE_NOTE = (
    "In order of how much of the channel's whole signal is missing. Share: mismatch over signal there; where a state "
    "is named, the share of the mismatch's power that occurs in it."
)
_PART_NAMES: Mapping[str, str] = {"fit": "the fitted data", "test": "held-out data"}
"""Name of each part of the data in captions and rows, by its key."""


def tabulate_parameters(effect: NamedEffect) -> Table:
    """Tabulate an effect's parameters with their 95 % intervals."""
    rows = tuple(
        (name.replace("_", " "), format_estimate(parameter).partition(" [")[0], _format_interval(parameter))
        for name, parameter in effect.parameters.items()
    )
    return Table("Its parameters", ("Parameter", "Value", "95 % interval"), rows)


def tabulate_rivals(effect: NamedEffect) -> Table:
    """Tabulate a named effect, then its rivals, with probabilities and reasons; of the rivals, those that cannot be
    distinguished come first."""
    rival_rows = [(capitalise(get_noun(effect.effect)), format_probability(effect.probability), "named", "")]
    rival_rows += [
        (
            capitalise(get_noun(rival.effect)),
            format_probability(rival.probability),
            "cannot be distinguished" if rival.inseparable else "passed over",
            end_sentence(rival.why_not),
        )
        for rival in sorted(effect.rivals, key=lambda rival: (not rival.inseparable, -rival.probability))
    ]
    return Table("It and its rivals", ("Effect", "Probability", "Verdict", "Why"), tuple(rival_rows))


def tabulate_candidates(findings: Findings) -> Table | None:
    """Tabulate candidate effects that were not confirmed, the best first; None without candidates."""
    device = extract_device(findings)
    rows = tuple(
        (
            f"{capitalise(get_noun(candidate.effect))} "
            f"{format_place(candidate.place, candidate.axis, device.is_single_axis)}",
            format_candidate_parameters(candidate, device) or MISSING,
            format_share(candidate.held_out_gain),
            format_share(candidate.share_of_black_box),
            end_sentence(capitalise(candidate.why_not)),
        )
        for candidate in findings.diagnosis.candidates
    )
    if not rows:
        return None
    header = ("Candidate", "Parameters", "Held-out gain", "Of what all laws explain", "Reason not to name it")
    note = (
        "Held-out gain: share of the error's power that the law explains on held-out data, in addition to the other "
        "laws of the best sum. The next column gives the same as a share of what all laws together explain of the "
        "error of mass, damping and stiffness alone."
    )
    return Table("The best candidates, not confirmed", header, rows, (note,))


def tabulate_errors(findings: Findings) -> Table:
    """Tabulate root-mean-square errors over all channels as a share of the signal, on fitted and on held-out data, by
    stage of the model, with the noise."""
    rows = tuple(
        (
            f"On {_PART_NAMES[part]}",
            *(format_error(getattr(errors, stage)) for stage, _ in _MODEL_STAGES),
            format_error(errors.noise),
        )
        for part, errors in (("fit", findings.diagnosis.fit.fit), ("test", findings.diagnosis.fit.test))
    )
    header = ("Error, share of the signal", *(heading for _, heading in _MODEL_STAGES), "Noise alone")
    return Table("Errors over all channels, root-mean-square", header, rows)


def tabulate_channel_errors(findings: Findings, part: Literal["fit", "test"]) -> Table | None:
    """Tabulate the rms error of each channel in its unit, with its ratio to the noise, by stage of the model; None
    where there are no time series. Channels without a known noise are left out. part: set of samples, a key of
    `_PART_NAMES`. Where a statistic was fitted, its chance error takes the place of the noise, and the unit is 1."""
    if not findings.time_series:
        return None
    channel_names, channel_units, noise_rms_by_channel = (
        findings.time_series[0].channels,
        findings.time_series[0].units,
        findings.noise_rms,
    )
    statistic, reference_name = findings.explanation.statistic, "noise"
    if statistic is not None:
        channel_units, noise_rms_by_channel, reference_name = (
            ("1",) * len(channel_names),
            dict(zip(channel_names, statistic.chance.tolist(), strict=True)),
            "chance",
        )
    scores_by_stage = {stage: getattr(getattr(findings.explanation, stage).score, part) for stage, _ in _MODEL_STAGES}
    rows = []
    for channel_index, (channel_name, channel_unit) in enumerate(zip(channel_names, channel_units, strict=True)):
        noise_rms = noise_rms_by_channel.get(channel_name)
        if noise_rms is None:
            continue
        ratios = [
            float(
                findings.channel_errors.get(stage, {}).get(channel_name, channel_ratios[channel_index])
                if part == "test"
                else channel_ratios[channel_index]
            )
            for stage, channel_ratios in scores_by_stage.items()
        ]
        rows.append((
            channel_name,
            *(f"{format_value(ratio * noise_rms, channel_unit)} ({_format_ratio(ratio)})" for ratio in ratios),
            format_value(noise_rms, channel_unit),
        ))  # fmt: skip
    header = (
        "Channel",
        *(f"{heading} (× {reference_name})" for _, heading in _MODEL_STAGES),
        capitalise(reference_name),
    )
    return Table(f"By channel, on {_PART_NAMES[part]}, rms", header, tuple(rows), folded=part == "fit")


def tabulate_mismatches(caption: str, mismatches: Sequence[Mismatch], is_timed: bool = True) -> Table:
    """Tabulate, folded, the first `_MOST_MISMATCH_ROWS` mismatches between model and device. is_timed: bands are in
    hertz; else in cycles per sample."""
    shown_mismatches = mismatches[:_MOST_MISMATCH_ROWS]
    rows = tuple(
        (
            mismatch.output,
            mismatch.input,
            f"{mismatch.band_hz[0]:g} to {mismatch.band_hz[1]:g} {'Hz' if is_timed else 'cycles per sample'}",
            MISSING if mismatch.amplitude is None else f"{mismatch.amplitude:g}",
            mismatch.state or MISSING,
            format_share(mismatch.share),
            format_p(mismatch.p_value),
        )
        for mismatch in shown_mismatches
    )
    remaining_count = len(mismatches) - len(shown_mismatches)
    notes: tuple[str, ...] = (
        (f"And {remaining_count} smaller {'place' if remaining_count == 1 else 'places'}.",)
        if remaining_count > 0
        else ()
    )
    notes += (_SHARE_NOTE,) if shown_mismatches else ()
    header = ("Channel", "Driven by", "Band", "Level", "State", "Share", "p")
    return Table(caption, header, rows, notes, folded=True)


def tabulate_retuned(findings: Findings) -> Table | None:
    """Tabulate, folded, all re-tuned parameters, before and after the found effects were added, with their deviations
    in standard deviations; None where nothing was re-tuned."""
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
    header = ("Parameter", "Re-tuned", "Standard deviations", "With the effects found", "Standard deviations")
    return Table("Every free parameter and its change", header, rows, folded=True)


def _format_ratio(ratio: float) -> str:
    """Format the ratio of an error to the noise, such as 1.25×; from 10 on with three significant digits."""
    return f"{ratio:.2f}×" if ratio < 10 else f"{ratio:.3g}×"


def _format_interval(estimate: Estimate) -> str:
    """Format the 95 % interval of an estimate with the digits of `format_value`; `MISSING` without an interval."""
    if estimate.ci95 is None:
        return MISSING
    formatted_value = format_value(estimate.value, estimate.unit, estimate.ci95)
    lower_text, upper_text = formatted_value[formatted_value.index("[") + 1 : -1].split(", ")
    return f"{lower_text} to {upper_text}"
