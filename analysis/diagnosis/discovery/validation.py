"""Checks that a discovered law must pass before it is named; each check that fails gives a reason, as a clause.

Of the many formulas that the search tries, some fit any data. A law is named only where held-out stretches of another
kind than the fitted ones confirm it (extrapolation), where its factor agrees between stretches (stability), where the
same search in a time-shuffled force finds clearly less (negative control), where no law of other variables fits as
well, no exponent is above the grammar's bound, and the model's coupled parameters cannot imitate it. Called by
`add_laws`."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from analysis.diagnosis.confirm.held_out_gain import estimate_held_out_gain
from analysis.diagnosis.data.observed import Observed
from analysis.diagnosis.discovery.antisymmetric_pairs import can_coupling_imitate
from analysis.diagnosis.discovery.convert_sum import convert_sum_to_law, list_fitted_laws
from analysis.diagnosis.discovery.discover import Discovery, Round
from analysis.diagnosis.discovery.fit_laws import run_within_time
from analysis.diagnosis.discovery.fit_sum import Sum
from analysis.diagnosis.discovery.grammar import POWER_BOUNDS
from analysis.diagnosis.discovery.snap_exponents import converge_and_snap
from analysis.diagnosis.effect_words import get_noun
from analysis.diagnosis.errors.fit_score import compute_residual_rms, compute_signal_rms
from analysis.diagnosis.limits import LAW_FACTOR_ERROR, LOUDER_RATIO, NOISE_ACCURACY, SAME_LAW_SHARE, SHUFFLED_RATIO
from analysis.diagnosis.search.explain import Explanation
from analysis.diagnosis.search.parsimony import are_inseparable
from analysis.diagnosis.search.search_context import FittedCandidate, SearchContext
from analysis.wording import conjoin
from equalizer.effects.discovered_law import derive_axis_letters
from equalizer.signals.recording import Segment
from equalizer.signals.signal import FloatArray

NO_OTHER_EXCITATION = (
    "the held-out data contain no other kind of excitation than the data in which it was found, such as a stronger "
    "one or one on several axes"
)
"""Reason not to name a law: see `describe_held_out_kinds`."""
STEEP_POWER = (
    "its exponent {:.3g} is larger than any that the search begins with: such a power stands for an edge or a stop, "
    "whose place these recordings do not determine"
)
"""Reason not to name a law with an exponent, the format's argument, above `POWER_BOUNDS`."""
COUPLING_EXPLAINS_HALF = (
    "the model's own coupled damping or stiffness, which acts on both axes alike, can explain half of such a force: "
    "a force on one axis and an antisymmetric pair of half its size fit equally well"
)
"""Reason not to name a law: see `can_coupling_imitate`."""


def find_failed_checks(
    context: SearchContext, discovery: Discovery, rivals: Sequence[FittedCandidate]
) -> tuple[str, ...]:
    """List the reasons, as clauses, not to name the laws; empty where they pass all checks. rivals: the best of the
    catalogue, with held-out error."""
    return tuple(dict.fromkeys(_run_checks(context, discovery, rivals)))


def choose_on_held_out(context: SearchContext, discovery: Discovery) -> Discovery:
    """Replace the last law by an inseparable law of the same round (no pair) whose held-out error is significantly
    smaller, if there is one: formulas that agree on the fitted data may differ on stronger commands. The alternatives
    are few and fixed beforehand, and the chosen law must still pass all other checks. Ends early with the time of the
    context's map."""
    last_round, best_candidate, law_count = discovery.rounds[-1], discovery.explanation.after, 1
    chosen_sum = last_round.sums[0]
    for candidate, term_sum in zip(last_round.fitted_candidates[1:], last_round.sums[1:], strict=True):
        is_pair = chosen_sum.partner is not None or term_sum.partner is not None
        if is_pair or not are_inseparable(last_round.fitted_candidates[0], candidate):
            continue
        law_count += 1
        early_gain = estimate_held_out_gain(context.full_measure, best_candidate, context.with_test_score(candidate))
        if early_gain is not None and early_gain.high < 0:
            continue  # Significantly worse: converging to about the same fit would not make it better.
        converged_fit = run_within_time(partial(converge_and_snap, context, candidate.fitted), None)
        if converged_fit is None:
            break
        refined_candidate = context.with_test_score(context.score_fit(converged_fit))
        gain = estimate_held_out_gain(context.full_measure, best_candidate, refined_candidate)
        if gain is not None and gain.low > 0:
            best_candidate, chosen_sum = refined_candidate, term_sum
    if chosen_sum is last_round.sums[0]:
        return discovery
    reordered_round = _put_first(last_round, chosen_sum)
    explanation = replace(
        discovery.explanation,
        after=best_candidate,
        rounds=(*discovery.explanation.rounds[:-1], reordered_round.fitted_candidates),
        steps=(*discovery.explanation.steps[:-1], best_candidate),
    )
    return Discovery(explanation, (*discovery.rounds[:-1], reordered_round), law_count)


def _put_first(round_: Round, chosen_sum: Sum) -> Round:
    """Move the chosen sum and its candidate to the front of the round; the others keep their order."""
    order = sorted(range(len(round_.sums)), key=lambda index: round_.sums[index] is not chosen_sum)
    return replace(
        round_,
        fitted_candidates=tuple(round_.fitted_candidates[index] for index in order),
        sums=tuple(round_.sums[index] for index in order),
    )


def _run_checks(context: SearchContext, discovery: Discovery, rivals: Sequence[FittedCandidate]) -> Iterator[str]:
    """Yield a clause for each check that fails, some possibly repeated: extrapolation, stability, negative control,
    equally good laws, steep exponents, coupling, and the gain over the re-tuned model and over the rivals."""
    if not describe_held_out_kinds(context.full_measure.records):
        yield NO_OTHER_EXCITATION
    for round_index, round_ in enumerate(discovery.rounds):
        best_sum = round_.sums[0]
        if best_sum.factor_error > LAW_FACTOR_ERROR and not is_confirmed_on_held_out(discovery.explanation):
            yield f"its factor has a standard error of {100 * best_sum.factor_error:.0f} % between stretches"
        removed_share, chance_share = round_.shares_above_noise
        if 1 - removed_share > SHUFFLED_RATIO * (1 - chance_share):
            yield (
                f"it explains {100 * removed_share:.0f} % of the missing force above the noise, and the same search "
                f"explains {100 * chance_share:.0f} % of the force when it is shuffled in time"
            )
        yield from _check_rival_laws(context, discovery, round_index)
    for law in list_fitted_laws(discovery.explanation.after.fitted.hypothesis):
        yield from (STEEP_POWER.format(k) for k in (law.exponents if law else ()) if k > POWER_BOUNDS[1])
    command_channels = context.full_measure.records[0].recording.command.channels
    if can_coupling_imitate(context.tuning, discovery.explanation.after.fitted, command_channels):
        yield COUPLING_EXPLAINS_HALF
    yield from _check_held_out_gain(
        context, discovery.explanation.after, (discovery.explanation.retuned, "the re-tuned model")
    )
    for rival in rivals:
        yield from _check_held_out_gain(
            context, discovery.explanation.after, (rival, f"{get_noun(rival.newest)} alone or with what it needs")
        )


def is_confirmed_on_held_out(explanation: Explanation) -> bool:
    """Whether the held-out error is so small that the law's factor, fitted to other stretches, must be correct within
    `LAW_FACTOR_ERROR`: a relative error s of the factor leaves the share s^2 of the error power above the noise."""
    retuned_excess, remaining_excess = (
        float(np.sum(np.maximum(candidate.score.test**2 - 1, 0.0)))
        for candidate in (explanation.retuned, explanation.after)
    )
    return retuned_excess > 0 and remaining_excess <= LAW_FACTOR_ERROR**2 * retuned_excess


def _check_held_out_gain(
    context: SearchContext, law_candidate: FittedCandidate, rival_and_name: tuple[FittedCandidate, str]
) -> Iterator[str]:
    """Yield a reason where the gain over a rival on held-out data is unknown or not significant."""
    gain = estimate_held_out_gain(context.full_measure, rival_and_name[0], law_candidate)
    if gain is None:
        yield "too little data was held out to confirm it"
    elif gain.low <= 0:
        yield (
            f"its gain on held-out data over {rival_and_name[1]} is not larger than its variation between stretches of "
            "the recording"
        )


def _check_rival_laws(context: SearchContext, discovery: Discovery, round_index: int) -> Iterator[str]:
    """Yield a reason, as a clause, for each law of other variables that fits as well as the best of the round, that
    held-out data do not distinguish from it either, and whose prediction differs."""
    round_ = discovery.rounds[round_index]
    best_candidate = round_.fitted_candidates[0]
    equally_good = [
        (candidate, term_sum)
        for candidate, term_sum in zip(round_.fitted_candidates[1:], round_.sums[1:], strict=True)
        if are_inseparable(best_candidate, candidate) and term_sum.variables != round_.sums[0].variables
    ]
    if not equally_good:
        return
    law_candidate = context.with_test_score(best_candidate)
    for candidate, term_sum in equally_good:
        rival = context.with_test_score(candidate)
        gain = estimate_held_out_gain(context.full_measure, rival, law_candidate)
        is_distinguished = gain is not None and gain.low > 0
        if not is_distinguished and not _are_predictions_equal(discovery.explanation.retuned, law_candidate, rival):
            names = convert_sum_to_law(term_sum, context.measure.records[0].recording).variables
            yield f"a law of {' and '.join(names)} fits equally well"


def _are_predictions_equal(retuned: FittedCandidate, law_candidate: FittedCandidate, rival: FittedCandidate) -> bool:
    """Whether two laws predict the same residuals in all samples, including the held-out ones, within `SAME_LAW_SHARE`
    of the law's contribution: then they are one law in two notations, such as a relaxation of position or of speed."""
    difference_squares = law_squares = 0.0
    residual_sets = retuned.fitted.residuals, law_candidate.fitted.residuals, rival.fitted.residuals
    for base_residual, law_residual, rival_residual in zip(*residual_sets, strict=True):
        difference_squares += float(np.nansum((law_residual - rival_residual) ** 2))
        law_squares += float(np.nansum((law_residual - base_residual) ** 2))
    return difference_squares <= SAME_LAW_SHARE**2 * law_squares


def is_shorter_and_as_good(context: SearchContext, discovery: Discovery, rival: FittedCandidate) -> bool:
    """Whether the laws have fewer parameters than a rival (rounded exponents count) and are inseparable from it on the
    fitted data, and their held-out error is at most that of the rival, within `NOISE_ACCURACY`: the shorter of two
    equally good descriptions. Both have held-out errors. A tenth of `NOISE_ACCURACY` allows for unconverged fits."""
    law_candidate = discovery.explanation.after
    sums = [
        term_sum
        for round_ in discovery.rounds
        for term_sum in (round_.sums[0], round_.sums[0].partner)
        if term_sum is not None
    ]
    parameter_count = sum(1 + len(term.numbers) for term_sum in sums for term in term_sum.terms)
    if parameter_count >= len(rival.fitted.hypothesis.parameters) or not are_inseparable(rival, law_candidate):
        return False
    rival_gain = estimate_held_out_gain(context.full_measure, law_candidate, rival)
    log_error_change = np.mean(np.log(law_candidate.score.test)) - np.mean(np.log(rival.score.test))
    return (
        rival_gain is not None and rival_gain.low <= 0.1 * NOISE_ACCURACY and bool(log_error_change <= NOISE_ACCURACY)
    )


def describe_held_out_kinds(records: Sequence[Observed]) -> tuple[str, ...]:
    """Describe how the held-out stretches differ from those in which laws are searched (stronger commands, axes driven
    together, another kind of command); empty where they do not. A segment with samples of both roles counts as both,
    one without a command as neither. Stronger: by the factor `LOUDER_RATIO`."""
    fitted_segments: list[tuple[str, tuple[int, ...], float]] = []
    held_out_segments: list[tuple[str, tuple[int, ...], float]] = []
    for record in records:
        for segment in record.recording.segments:
            samples = slice(segment.start, segment.stop)
            excitation = _describe_excitation(segment, record.command[samples])
            if not excitation[1]:
                continue
            if record.test[samples].any():
                held_out_segments.append(excitation)
            if (record.fit | record.choose)[samples].any():
                fitted_segments.append(excitation)
    if not fitted_segments:
        return ()
    fitted_kinds, fitted_axes = {kind for kind, _, _ in fitted_segments}, {axes for _, axes, _ in fitted_segments}
    fitted_level = max(level for _, _, level in fitted_segments)
    differences = [
        (any(level > LOUDER_RATIO * fitted_level for _, _, level in held_out_segments), "stronger commands"),
        (any(axes not in fitted_axes and len(axes) > 1 for _, axes, _ in held_out_segments), "axes driven together"),
        (any(kind not in fitted_kinds for kind, _, _ in held_out_segments), "another kind of command"),
    ]
    return tuple(phrase for is_different, phrase in differences if is_different)


def _describe_excitation(segment: Segment, command: FloatArray) -> tuple[str, tuple[int, ...], float]:
    """Return the kind of excitation, indices of the driven axes, and the largest magnitude of the command (n, m)."""
    driven_axes = np.flatnonzero(np.abs(command).max(axis=0, initial=0.0) > 0)
    return segment.kind, tuple(driven_axes.tolist()), float(np.abs(command).max(initial=0.0))


def describe_held_out_test(
    context: SearchContext, explanation: Explanation, rivals: Sequence[FittedCandidate], law_count: int = 1
) -> str:
    """Write one to three sentences: on which data a named law was tested, its error compared with the best law of the
    catalogue, the number of equally good laws (law_count), and the range of motion within which it was tested."""
    measure, named_law = context.full_measure, explanation.after
    laws = [law for law in list_fitted_laws(named_law.fitted.hypothesis) if law is not None]
    held_out_kinds = conjoin(describe_held_out_kinds(measure.records))
    sentences = (
        f"The formula was tested on {held_out_kinds}, to which nothing was fitted: "
        f"there its error is {100 * _compute_held_out_error_share(context, explanation, named_law):.3g} % of the "
        "re-tuned model's error"
    )
    least_rival_share = min(
        (_compute_held_out_error_share(context, explanation, rival) for rival in rivals), default=None
    )
    if least_rival_share is not None:
        sentences += f", that of the best law of the catalogue {100 * least_rival_share:.3g} %"
    if law_count > 1:
        sentences += f". Of {law_count} formulas that fitted equally well, it is the one that these data confirm"
    ranges = _format_ranges_of_motion(context, explanation, {name for law in laws for name in law.variables})
    return f"{sentences}. Beyond {conjoin(ranges)} the formula is not tested." if ranges else f"{sentences}."


def _compute_held_out_error_share(context: SearchContext, explanation: Explanation, law: FittedCandidate) -> float:
    """Compute the law's held-out error over that of the re-tuned model: rms errors relative to the signal, rms over the
    channels, as the document's; NaN where nothing was held out."""
    records = context.full_measure.records
    masks = [record.test for record in records]
    signal_rms = np.maximum(compute_signal_rms(records, masks) / context.full_measure.unit, np.finfo(float).tiny)
    law_error, retuned_error = (
        np.sqrt(np.mean((compute_residual_rms(fit.fitted.residuals, masks) / signal_rms) ** 2))
        for fit in (law, explanation.retuned)
    )
    return float(law_error / retuned_error)


def _format_ranges_of_motion(
    context: SearchContext, explanation: Explanation, signal_names: set[str]
) -> tuple[str, ...]:
    """Format the largest position and speed of each axis that the law uses, held-out samples included, with unit."""
    measure, fitted = context.full_measure, explanation.after.fitted
    model, placed_effects = context.tuning.tune(fitted.deviations), fitted.hypothesis.list_placed_effects()
    evidence = measure.evidence(model, placed_effects, fitted.residuals)
    letters = derive_axis_letters(measure.records[0].recording.command.channels)
    length_unit, time_unit = model.system.length, model.system.time
    ranges = []
    for axis, letter in enumerate(letters):
        for name, unit in ((letter, length_unit), (f"v{letter}", f"{length_unit}/{time_unit}")):
            if name in signal_names:
                motions = [record.axis_velocity if name != letter else record.axis_position for record in evidence]
                largest_value = max(float(np.abs(motion[:, axis]).max()) for motion in motions)
                ranges.append(f"{name} = ± {largest_value:.3g} {unit}")
    return tuple(ranges)
