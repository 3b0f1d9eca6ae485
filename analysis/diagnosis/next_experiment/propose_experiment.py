"""Proposes the next recordings for a finished search whose data could not distinguish effects."""

from dataclasses import dataclass

import numpy as np

from analysis.diagnosis.document import NextExperiment
from analysis.diagnosis.errors.output_error import Fitted, hypothesis_sensitivity, residuals_to_fit
from analysis.diagnosis.next_experiment.choose_experiment import (
    Bench,
    ExperimentSet,
    as_document,
    choose_set,
    predict_gains,
)
from analysis.diagnosis.next_experiment.experiment_menu import experiment_menu
from analysis.diagnosis.search.explain import Explanation
from analysis.diagnosis.search.parsimony import both_stand
from analysis.diagnosis.search.search_context import FittedCandidate, SearchContext, sensitivity_at
from equalizer.effects.placing import place_of_effect
from equalizer.signals.signal import FloatArray

MOST_RIVALS = 3
"""Rivals whose experiments are simulated; each takes a second or more."""


@dataclass(frozen=True, slots=True, eq=False)
class Proposal:
    """Recordings of the menu that would distinguish the named effect from its rivals, with what each would gain."""

    names: tuple[str, ...]
    """What is named, then its rivals."""
    axis: int
    level: float
    """Level of the menu's commands."""
    chosen: ExperimentSet

    @property
    def document(self) -> NextExperiment | None:
        """The proposed recordings; None where none would discriminate."""
        return as_document(self.chosen, self.names)


def propose_experiment(context: SearchContext, found: Explanation) -> Proposal | None:
    """Propose recordings for the first effect that some recording would distinguish from one of its rivals, else for
    the last that has rivals; None where no rival is as good as the named effects."""
    proposal = None
    for fitted_candidates in found.rounds[: len(found.steps)]:
        rivals = _rivals(fitted_candidates)
        named = fitted_candidates[0].fitted
        if not rivals or _has_conditions(named):
            continue  # no experiment of the menu sets a condition
        claim = named.hypothesis.claims[-1]
        record = context.measure.records[0]
        sensed = place_of_effect(claim.effect) == "sensor"
        axis = min(claim.sites[0], record.command.shape[1] - 1) if sensed else claim.sites[0]
        # No louder than that axis was driven.
        level = max(float(np.abs(each.command[:, axis]).max()) for each in context.measure.records)
        if level == 0:
            continue
        rate_hz = record.recording.sample_rate_hz
        bench = Bench(context.tuning, rate_hz, record.recording.hold, context.measure.noise)
        menu = experiment_menu(context.tuning.model, rate_hz, axis, level)
        predicted = [
            predict_gains(bench, named, rival.fitted, _compute_recorded_information(context, rival), menu)
            for rival in rivals
        ]
        names = (claim.effect.name, *(rival.newest for rival in rivals))
        proposal = Proposal(names, axis, level, choose_set(predicted))
        if proposal.document is not None:
            break
    return proposal


def _rivals(fitted_candidates: tuple[FittedCandidate, ...]) -> list[FittedCandidate]:
    """The best rivals, each of another name, that the data do not distinguish from the named effect."""
    best = fitted_candidates[0]
    found: dict[str, FittedCandidate] = {}
    for other in fitted_candidates[1:]:
        if other.newest != best.newest and both_stand(best, other) and not _has_conditions(other.fitted):
            found.setdefault(other.newest, other)
    return list(found.values())[:MOST_RIVALS]


def _has_conditions(fitted: Fitted) -> bool:
    return any(claim.effect.with_conditions for claim in fitted.hypothesis.claims)


def _compute_recorded_information(context: SearchContext, candidate: FittedCandidate) -> FloatArray:
    """Information matrix of a candidate's parameters from the existing recordings, calibration included."""
    fitted = candidate.fitted
    own = hypothesis_sensitivity(
        context.measure, context.tuning, fitted, residuals_to_fit(context.measure, fitted.residuals)
    )
    columns = np.vstack([sensitivity_at(context, fitted.deviations, fitted.hypothesis).columns, own])
    known = columns @ columns.T
    t = len(fitted.deviations)
    known[:t, :t] += np.eye(t)
    return np.asarray(known)
