"""Forward selection of discovered laws, up to `LAW_MOST_ROUNDS`.

In each round, sums of terms are screened on the axes and readings with the largest error above the noise, the best sums
are fitted by output error, and the preferred fit is added. Finally exponents are rounded where that fits as well
(`snap_exponents`). The package's docstring has the equations. Called by `add_laws`."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from analysis.diagnosis.discovery.antisymmetric_pairs import (
    find_antisymmetric_pairs,
    make_antisymmetric,
)
from analysis.diagnosis.discovery.beam import is_worth_adding, search_best_sums
from analysis.diagnosis.discovery.evaluate_shape import evaluate_shape
from analysis.diagnosis.discovery.fit_laws import fit_sums, put_simplest_first, run_within_time
from analysis.diagnosis.discovery.fit_sum import Sum, fit_constant
from analysis.diagnosis.discovery.grammar import AXES
from analysis.diagnosis.discovery.matched_filter import View, build_views
from analysis.diagnosis.discovery.screen_terms import build_normal_equations, cross_validate_terms
from analysis.diagnosis.discovery.snap_exponents import snap_exponents
from analysis.diagnosis.discovery.view_terms import list_view_terms
from analysis.diagnosis.errors.hypothesis import remove_claim
from analysis.diagnosis.errors.output_error import Fitted, evaluate_fit
from analysis.diagnosis.limits import (
    EXPLAINED_ERROR,
    FITTED_SUM_ERROR_RATIO,
    LAW_ALONE_REMAINDER,
    LAW_AXES_SHARE,
    LAW_COMMAND_SHARE,
    LAW_MOST_ROUNDS,
    LAW_NOISE_POWER,
    MOST_FITTED_SUMS,
    NOISE_ALONE,
)
from analysis.diagnosis.search.explain import Explanation
from analysis.diagnosis.search.parsimony import is_worthwhile
from analysis.diagnosis.search.search_context import FittedCandidate, SearchContext
from analysis.diagnosis.search.time_budget import limit_map
from analysis.diagnosis.types import Progress, TimeBudget


@dataclass(frozen=True, slots=True, eq=False)
class Round:
    """A round of the forward selection, in which a law was added."""

    fitted_candidates: tuple[FittedCandidate, ...]
    """The preferred one first (`put_simplest_first`), which was added; the others by rising error."""
    sums: tuple[Sum, ...]
    """The screened sums in the order of `fitted_candidates`."""
    chance_share: float
    """Negative control: largest share of the held-out squares that a term removes from the missing force (or a
    reading's residual) after that was shuffled in time; 0 where the law's view was not screened."""
    complete: bool = True
    """Whether time was left after the sums were fitted."""

    @property
    def shares_above_noise(self) -> tuple[float, float]:
        """Shares (at most 1) of the held-out squares of the missing force above the noise that the added law removes,
        and that chance removes."""
        best_sum = self.sums[0]
        excess_error = max(best_sum.base_error - 1.0, 1e-300)
        removed_error, error_removed_by_chance = (
            best_sum.base_error - best_sum.cross_validated_error,
            self.chance_share * best_sum.base_error,
        )
        return min(removed_error / excess_error, 1.0), min(error_removed_by_chance / excess_error, 1.0)


@dataclass(frozen=True, slots=True, eq=False)
class Discovery:
    """Result of the search for discovered laws: the fits, and the rounds that led to them."""

    explanation: Explanation
    """The explanation whose `after` contains the laws, with the rounds and steps of their selection."""
    rounds: tuple[Round, ...]
    """The rounds in order, at least one."""
    equally_good_count: int = 1
    """Number of laws that fitted about equally well, of which the last law was chosen by its error on held-out
    stretches."""


def discover_laws(
    context: SearchContext,
    catalogue_explanation: Explanation,
    progress: Progress,
    time_left: TimeBudget,
    max_laws: int = LAW_MOST_ROUNDS,
    single_term: bool = False,
) -> Discovery | None:
    """Search laws by forward selection: at most `max_laws` (an antisymmetric pair counts as one), fitted by output
    error; None where the error is that of the noise, where no law is worth its parameters or, with single_term, where
    such a law does not suffice. catalogue_explanation: by effects of the catalogue; its re-tuned model is the start.
    single_term: only laws of single terms that are likely to explain the whole error; the search ends where a screen
    shows that they do not, or a fit of a law that depends on no other axis."""
    context = replace(context, map_=limit_map(context.map_, time_left))
    retuned = catalogue_explanation.retuned.fitted
    current = context.score_fit(evaluate_fit(context.measure, context.tuning, retuned.deviations, retuned.hypothesis))
    rounds: list[Round] = []
    law_steps: list[FittedCandidate] = []
    target_error = EXPLAINED_ERROR if single_term else NOISE_ALONE
    while len(rounds) < max_laws and time_left() and current.score.worst_channel > target_error:
        progress("looking for a law outside the catalogue", 0.6 + 0.1 * len(rounds))  # shares chosen by hand
        next_round = _find_next_law(context, current.fitted, time_left, single_term)
        if next_round is None or not is_worthwhile(current, next_round.fitted_candidates[0]):
            break
        if next_round.sums[0].partner is not None:
            law_steps.append(_remove_partner_law(context, next_round.fitted_candidates[0]))
        current = next_round.fitted_candidates[0]
        rounds.append(next_round)
        law_steps.append(current)
        may_act_on_other_axis = next_round.sums[0].partner is None and depends_on_another_axis(next_round.sums[0])
        if single_term and current.score.worst_channel > target_error and not may_act_on_other_axis:
            return None
    if not rounds:
        return None
    snapped_fit = run_within_time(lambda: snap_exponents(context, current.fitted), current.fitted)
    snapped_candidate = context.score_fit(make_antisymmetric(context.measure, context.tuning, snapped_fit))
    law_steps[-1] = snapped_candidate
    explanation = Explanation(
        catalogue_explanation.before,
        catalogue_explanation.retuned,
        context.with_test_score(snapped_candidate),
        tuple(round_.fitted_candidates for round_ in rounds for _ in range(1 if round_.sums[0].partner is None else 2)),
        tuple(law_steps),
    )
    return Discovery(explanation, tuple(rounds))


def depends_on_another_axis(term_sum: Sum) -> bool:
    """Whether a sum depends on the motion or the command of another axis than its own."""
    signal_names = {signal_name for term in term_sum.terms for signal_name in term.variables}
    return any(signal_name[-1:] in AXES and signal_name[-1:] != AXES[term_sum.axis] for signal_name in signal_names)


def _remove_partner_law(context: SearchContext, pair: FittedCandidate) -> FittedCandidate:
    """Remove the second law of an antisymmetric pair from the candidate: each law is a step of the explanation."""
    hypothesis = remove_claim(pair.fitted.hypothesis, len(pair.fitted.hypothesis.claims) - 1)
    return context.score_fit(evaluate_fit(context.measure, context.tuning, pair.fitted.deviations, hypothesis))


def _find_next_law(context: SearchContext, base_fit: Fitted, time_left: TimeBudget, single_term: bool) -> Round | None:
    """Find the next law: screen sums in the views with the largest error above the noise, and fit the best. None where
    none can be fitted or, with single_term, where the best sum leaves too much in the screen (`_may_explain_alone`)."""
    views = build_views(context.measure, context.tuning, base_fit)
    ranked_by_view = [
        (view, search_best_sums(build_normal_equations(view), list_view_terms(view), time_left))
        for view in _select_views_to_search(views)
    ]
    candidates = sorted(
        (
            *(
                candidate_sum
                for view, ranked_sums in ranked_by_view
                for candidate_sum in ranked_sums.sums
                if not _cancels_command(view, candidate_sum)
            ),
            *find_antisymmetric_pairs(views),
            *_find_constant_forces(views),
        ),
        key=lambda candidate_sum: _compute_explained_squares(views, candidate_sum),
        reverse=True,
    )
    sums_to_fit = _choose_sums_to_fit(_keep_close_to_best(_select_best_of_each_structure(candidates)))
    if single_term and sums_to_fit and not _may_explain_alone(sums_to_fit[0]):
        return None
    fitted_sums = fit_sums(context, base_fit, sums_to_fit, time_left)
    if not fitted_sums:
        return None
    ranked_fits = put_simplest_first(context, fitted_sums)
    best_sum = ranked_fits[0][1]
    # The negative control of the views that the best law, or either half of a pair, acts in.
    acting_views = [(half.acts_on, half.axis) for half in (best_sum, best_sum.partner) if half is not None]
    chance_share = max(
        (ranked_sums.chance_share for view, ranked_sums in ranked_by_view if (view.acts_on, view.axis) in acting_views),
        default=0.0,
    )
    return Round(
        tuple(candidate for candidate, _ in ranked_fits),
        tuple(term_sum for _, term_sum in ranked_fits),
        chance_share,
        time_left(),
    )


def _find_constant_forces(views: Sequence[View]) -> list[Sum]:
    """Find the constant forces that remove more than `LAW_WORTH_SHARE` of the error above the noise of an axis, where
    the error is more than `LAW_NOISE_POWER` times that of the noise. All axes are tested, because no view's error shows
    a constant, which each regression contains."""
    constants = [fit_constant(view) for view in views if view.acts_on == "force"]
    return [
        constant
        for constant in constants
        if constant is not None
        and constant.base_error > LAW_NOISE_POWER
        and is_worth_adding(constant.base_error, constant.cross_validated_error)
    ]


def _may_explain_alone(best_sum: Sum) -> bool:
    """Whether a sum is a single term that leaves at most `LAW_ALONE_REMAINDER` of the error above the noise in the
    screen."""
    leaves_little = best_sum.cross_validated_error - 1 <= LAW_ALONE_REMAINDER * (best_sum.base_error - 1)
    return leaves_little and len(best_sum.terms) == 1


def _choose_sums_to_fit(sums: Sequence[Sum]) -> list[Sum]:
    """Choose the best `MOST_FITTED_SUMS` sums and, if each of them contains all variables of the first, also the best
    sum that does not, so that the first has a rival. sums: the best first."""
    sums_to_fit = [*sums[:MOST_FITTED_SUMS]]
    if not sums_to_fit or any(not set(sums[0].variables) <= set(term_sum.variables) for term_sum in sums_to_fit):
        return sums_to_fit
    rival = next((term_sum for term_sum in sums if not set(sums[0].variables) <= set(term_sum.variables)), None)
    return sums_to_fit if rival is None else [*sums_to_fit, rival]


def _select_views_to_search(views: Sequence[View]) -> list[View]:
    """Select the views in which laws are searched, at most two of axes and two of readings, by falling error over
    the noise: above `LAW_NOISE_POWER`, and at least `LAW_AXES_SHARE` of the largest of its kind."""
    selected_views: list[View] = []
    for acts_on in ("force", "response"):
        error_by_output = [(_compute_relative_error(view), view.output) for view in views if view.acts_on == acts_on]
        largest_error = max((relative_error for relative_error, _ in error_by_output), default=0.0)
        significant_errors = [
            (relative_error, output) for relative_error, output in error_by_output if relative_error > LAW_NOISE_POWER
        ]
        selected_views += [
            views[output]
            for relative_error, output in sorted(significant_errors, reverse=True)[:2]
            if relative_error >= LAW_AXES_SHARE * largest_error
        ]
    return selected_views


def _cancels_command(view: View, term_sum: Sum) -> bool:
    """Whether a force cancels more than `LAW_COMMAND_SHARE` (half) of the command of its axis. If mass, damping and
    stiffness shrink in proportion, the force balance then approaches its trivial solution 0 = 0."""
    if term_sum.acts_on != "force":
        return False
    cancelled = command_power = 0.0
    for record in view.records:
        command = record.columns[f"f{AXES[term_sum.axis]}"]
        for term, factor in zip(term_sum.terms, term_sum.factors, strict=True):
            force = factor * evaluate_shape(term.shape, term.numbers, record.columns, record.rate_hz)
            cancelled -= float(force @ command)
        command_power += float(command @ command)
    return cancelled > LAW_COMMAND_SHARE * command_power


def _compute_relative_error(view: View) -> float:
    """Compute the held-out squares of the re-tuned model in a view over those of noise alone; 1 = noise."""
    model_equations = build_normal_equations(view)
    base_squares = cross_validate_terms(model_equations, view.residual[None, :]).base_squares
    return float(base_squares.sum()) / (view.noise * len(view.residual))


def _compute_explained_squares(views: Sequence[View], term_sum: Sum) -> float:
    """Compute the held-out squares that a sum removes, in squared units of its view's residual."""
    view = next(view for view in views if (view.acts_on, view.axis) == (term_sum.acts_on, term_sum.axis))
    explained_squares = (term_sum.base_error - term_sum.cross_validated_error) * view.noise * len(view.residual)
    # The errors of a pair are the means of those of its halves.
    return explained_squares if term_sum.partner is None else 2 * explained_squares


def _keep_close_to_best(sums: Sequence[Sum]) -> list[Sum]:
    """Keep the sums whose error above the noise is at most `FITTED_SUM_ERROR_RATIO` times that of the first, which
    counts as at least `LAW_NOISE_POWER` - 1."""
    return [
        term_sum
        for term_sum in sums
        if term_sum.cross_validated_error - 1
        <= FITTED_SUM_ERROR_RATIO * max(sums[0].cross_validated_error - 1, LAW_NOISE_POWER - 1)
    ]


def _select_best_of_each_structure(sums: Sequence[Sum]) -> list[Sum]:
    """Select the best sum of each structure (axis or reading, shapes, pair or not). sums: the best first."""
    best_by_structure: dict[object, Sum] = {}
    for term_sum in sums:
        shapes = frozenset(term.shape for term in term_sum.terms)
        best_by_structure.setdefault((term_sum.acts_on, term_sum.axis, term_sum.partner is None, shapes), term_sum)
    return list(best_by_structure.values())
