"""Proposes the next recording for a finished search whose data could not distinguish two effects."""

from dataclasses import dataclass

import numpy as np

from analysis.diagnosis.document import NextExperiment
from analysis.diagnosis.errors.output_error import hypothesis_sensitivity, residuals_to_fit
from analysis.diagnosis.next_experiment.choose_experiment import Bench, PredictedGain, as_document, predict_gains
from analysis.diagnosis.next_experiment.experiment_menu import experiment_menu
from analysis.diagnosis.search.explain import Explanation
from analysis.diagnosis.search.parsimony import both_stand
from analysis.diagnosis.search.search_context import FittedCandidate, SearchContext, sensitivity_at
from equalizer.effects.placing import place_of_effect
from equalizer.signals.signal import FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class Proposal:
    """The menu's predicted gains for two rivals that the data do not distinguish."""

    names: tuple[str, str]
    axis: int
    level: float
    """Level of the menu's commands."""
    foreseen: tuple[PredictedGain, ...]
    """All of the menu, the best first."""

    @property
    def document(self) -> NextExperiment | None:
        """The best experiment; None where none would discriminate."""
        return as_document(self.foreseen[0], self.names)


def propose_experiment(context: SearchContext, found: Explanation) -> Proposal | None:
    """Propose a recording for the first pair of rivals that some recording would distinguish, else for the last pair;
    None where no rival is as good as the named effects."""
    proposal = None
    for fitted_candidates in found.rounds[: len(found.steps)]:
        rival = _best_rival(fitted_candidates)
        if rival is None:
            continue
        named, other = fitted_candidates[0].fitted, rival.fitted
        claims = named.hypothesis.claims[-1], other.hypothesis.claims[-1]
        if any(claim.effect.with_conditions for each in (named, other) for claim in each.hypothesis.claims):
            continue  # no experiment of the menu sets a condition
        record = context.measure.records[0]
        sensed = place_of_effect(claims[0].effect) == "sensor"
        axis = min(claims[0].sites[0], record.command.shape[1] - 1) if sensed else claims[0].sites[0]
        level = float(np.abs(record.command).max())
        rate_hz = record.recording.sample_rate_hz
        bench = Bench(context.tuning, rate_hz, record.recording.hold, context.measure.noise)
        menu = experiment_menu(context.tuning.model, rate_hz, axis, level)
        foreseen = predict_gains(bench, named, other, _recorded_information(context, rival), menu)
        proposal = Proposal((claims[0].effect.name, claims[1].effect.name), axis, level, foreseen)
        if proposal.document is not None:
            break
    return proposal


def _best_rival(fitted_candidates: tuple[FittedCandidate, ...]) -> FittedCandidate | None:
    """The best rival that the data do not distinguish from the named effect."""
    best = fitted_candidates[0]
    name = best.newest
    for other in fitted_candidates[1:]:
        if other.newest != name and both_stand(best, other):
            return other
    return None


def _recorded_information(context: SearchContext, candidate: FittedCandidate) -> FloatArray:
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
