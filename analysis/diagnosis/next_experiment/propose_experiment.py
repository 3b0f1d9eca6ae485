"""Propose the next recordings after a search whose data cannot distinguish effects."""

from dataclasses import dataclass

import numpy as np

from analysis.diagnosis.document import NextExperiment
from analysis.diagnosis.errors.output_error import Fitted, compute_effect_columns, stack_fit_residuals
from analysis.diagnosis.next_experiment.choose_experiment import (
    Bench,
    ExperimentSet,
    choose_experiments,
    make_document_entry,
    predict_gains,
)
from analysis.diagnosis.next_experiment.experiment_menu import list_experiments
from analysis.diagnosis.search.explain import Explanation
from analysis.diagnosis.search.parsimony import is_equal_rival
from analysis.diagnosis.search.search_context import FittedCandidate, SearchContext, compute_sensitivity
from equalizer.effects.placing import find_device_part
from equalizer.signals.signal import FloatArray

MOST_RIVALS = 3
"""Largest number of rivals whose experiments are simulated. Chosen: each takes a second or more."""


@dataclass(frozen=True, slots=True, eq=False)
class Proposal:
    """Recordings of the menu that distinguish the named effect from its rivals, with their expected gain."""

    names: tuple[str, ...]
    """The named effect, then its rivals."""
    axis: int
    level: float
    """Level of the proposed commands, in the commands' unit."""
    chosen: ExperimentSet

    @property
    def document(self) -> NextExperiment | None:
        """The proposed recordings; None where none would discriminate."""
        return make_document_entry(self.chosen, self.names)


def propose_experiment(context: SearchContext, explanation: Explanation) -> Proposal | None:
    """Propose recordings for the first named effect that a recording of the menu distinguishes from one of its rivals,
    else an empty set for the last effect with rivals; None where no effect has a rival that fits as well. Effects that
    depend on a recorded condition, and axes without a command, are skipped."""
    proposal = None
    for fitted_candidates in explanation.rounds[: len(explanation.steps)]:
        rivals = _select_rivals(fitted_candidates)
        named_fit = fitted_candidates[0].fitted
        if not rivals or _has_conditions(named_fit):
            continue  # no experiment of the menu sets a condition
        claim = named_fit.hypothesis.claims[-1]
        record = context.measure.records[0]
        is_sensor_effect = find_device_part(claim.effect) == "sensor"
        axis = min(claim.sites[0], record.command.shape[1] - 1) if is_sensor_effect else claim.sites[0]
        # The menu's largest command is that of the existing recordings on this axis.
        level = max(float(np.abs(recorded.command[:, axis]).max()) for recorded in context.measure.records)
        if level == 0:
            continue
        rate_hz = record.recording.sample_rate_hz
        bench = Bench(context.tuning, rate_hz, record.recording.hold, context.measure.noise)
        menu = list_experiments(context.tuning.model, rate_hz, axis, level)
        predicted_gains = [
            predict_gains(bench, named_fit, rival.fitted, _compute_recorded_information(context, rival), menu)
            for rival in rivals
        ]
        names = (claim.effect.name, *(rival.newest for rival in rivals))
        proposal = Proposal(names, axis, level, choose_experiments(predicted_gains))
        if proposal.document is not None:
            break
    return proposal


def _select_rivals(fitted_candidates: tuple[FittedCandidate, ...]) -> list[FittedCandidate]:
    """Select the best rivals, at most `MOST_RIVALS` of different names, that the data do not distinguish from the first
    candidate, the named effect."""
    named_candidate = fitted_candidates[0]
    rivals: dict[str, FittedCandidate] = {}
    for candidate in fitted_candidates[1:]:
        if (
            candidate.newest != named_candidate.newest
            and is_equal_rival(named_candidate, candidate)
            and not _has_conditions(candidate.fitted)
        ):
            rivals.setdefault(candidate.newest, candidate)
    return list(rivals.values())[:MOST_RIVALS]


def _has_conditions(fitted: Fitted) -> bool:
    """Whether an effect of the fit depends on a recorded condition, such as a temperature."""
    return any(claim.effect.with_conditions for claim in fitted.hypothesis.claims)


def _compute_recorded_information(context: SearchContext, candidate: FittedCandidate) -> FloatArray:
    """Compute the information matrix (d, d) of a candidate's parameters, the re-tuned ones first, from the existing
    recordings and the calibration."""
    fitted = candidate.fitted
    effect_columns = compute_effect_columns(
        context.measure, context.tuning, fitted, stack_fit_residuals(context.measure, fitted.residuals)
    )
    sensitivities = np.vstack(
        [compute_sensitivity(context, fitted.deviations, fitted.hypothesis).columns, effect_columns]
    )
    information = sensitivities @ sensitivities.T
    tuned_count = len(fitted.deviations)
    # The calibration's prior: deviations are in its standard deviations, so that each has the information 1.
    information[:tuned_count, :tuned_count] += np.eye(tuned_count)
    return np.asarray(information)
