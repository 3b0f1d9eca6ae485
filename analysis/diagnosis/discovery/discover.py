"""Forward selection of discovered laws, up to `LAW_MOST_ROUNDS`.

In each round, sums of terms are screened on the axes and readings with the largest excess error, the best sums are
fitted by output error, and the best fit is added.

Steps and equations: see the theory of operation in the package's docstring (`analysis/diagnosis/discovery`).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from analysis.diagnosis.discovery.antisymmetric_pairs import (
    antisymmetric_pairs,
    with_equal_halves,
)
from analysis.diagnosis.discovery.beam import best_sums
from analysis.diagnosis.discovery.evaluate_shape import evaluate_shape
from analysis.diagnosis.discovery.fit_laws import fit_sums, put_plainest_first, within_time
from analysis.diagnosis.discovery.fit_sum import Sum
from analysis.diagnosis.discovery.grammar import AXES
from analysis.diagnosis.discovery.matched_filter import View, views_of
from analysis.diagnosis.discovery.screen_terms import cross_validate_terms, products_of
from analysis.diagnosis.discovery.snap_exponents import snap_exponents
from analysis.diagnosis.discovery.view_terms import view_terms
from analysis.diagnosis.errors.hypothesis import without_claim
from analysis.diagnosis.errors.output_error import Fitted, evaluate_fit
from analysis.diagnosis.search.explain import Explanation
from analysis.diagnosis.search.parsimony import is_worthwhile
from analysis.diagnosis.search.search_context import FittedCandidate, SearchContext
from analysis.diagnosis.search.time_budget import limit_map
from analysis.diagnosis.settings import (
    EXPLAINED_ERROR,
    LAW_ALMOST_NOISE,
    LAW_ALONE_LEAVES,
    LAW_AXES_SHARE,
    LAW_COMMAND_TAKEN,
    LAW_FITTED,
    LAW_FITTED_WITHIN,
    LAW_MOST_ROUNDS,
    NOISE_ALONE,
)
from analysis.diagnosis.types import Progress, TimeBudget


@dataclass(frozen=True, slots=True, eq=False)
class Round:
    """A round of the selection, in which a law was added."""

    fitted_candidates: tuple[FittedCandidate, ...]
    """The best first."""
    sums: tuple[Sum, ...]
    """The screened sums in the order of `fitted_candidates`."""
    placebo: float
    """Largest share of the held-out squares of a time-shuffled missing force that a term removes."""
    complete: bool = True
    """Whether all sums were fitted before the time ended."""

    @property
    def shares_above_noise(self) -> tuple[float, float]:
        """Shares (at most 1) of the held-out squares of the missing force above the noise that the law removes, and
        that chance removes."""
        first = self.sums[0]
        above = max(first.without - 1.0, 1e-300)
        taken, by_chance = first.without - first.cross_validated, self.placebo * first.without
        return min(taken / above, 1.0), min(by_chance / above, 1.0)


@dataclass(frozen=True, slots=True, eq=False)
class Discovery:
    """Result of the search for discovered laws: the fits, and the rounds that led to them."""

    found: Explanation
    """The explanation whose `after` contains the laws, with the rounds and steps of their selection."""
    rounds: tuple[Round, ...]
    chosen_of: int = 1
    """Number of laws that fitted about equally well, of which the last law was chosen by its error on held-out
    stretches."""


def discover(
    context: SearchContext,
    known: Explanation,
    progress: Progress,
    time_left: TimeBudget,
    most: int = LAW_MOST_ROUNDS,
    alone: bool = False,
) -> Discovery | None:
    """The laws found, at most `most`, fitted by output error; None where none is worth its parameters. known: the
    explanation by named effects. alone: only laws of single terms that are likely to explain the whole error; the
    search ends where a screen or a fit shows that they do not, unless such a law may act on another axis."""
    context = replace(context, map_=limit_map(context.map_, time_left))
    retuned = known.retuned.fitted
    base = context.candidate(evaluate_fit(context.measure, context.tuning, retuned.deviations, retuned.hypothesis))
    rounds: list[Round] = []
    steps: list[FittedCandidate] = []
    enough = EXPLAINED_ERROR if alone else NOISE_ALONE
    while len(rounds) < most and time_left() and base.score.worst_channel > enough:
        progress("looking for a law outside the catalogue", 0.6 + 0.1 * len(rounds))
        found = _find_next_law(context, base.fitted, time_left, alone)
        if found is None or not is_worthwhile(base, found.fitted_candidates[0]):
            break
        if found.sums[0].partner is not None:
            steps.append(_first_half(context, found.fitted_candidates[0]))
        base = found.fitted_candidates[0]
        rounds.append(found)
        steps.append(base)
        open_ = found.sums[0].partner is None and depends_on_another_axis(found.sums[0])
        if alone and base.score.worst_channel > enough and not open_:
            return None
    if not rounds:
        return None
    snapped = within_time(lambda: snap_exponents(context, base.fitted), base.fitted)
    last = context.candidate(with_equal_halves(context.measure, context.tuning, snapped))
    steps[-1] = last
    whole = Explanation(
        known.before,
        known.retuned,
        context.with_test_score(last),
        tuple(each.fitted_candidates for each in rounds for _ in range(1 if each.sums[0].partner is None else 2)),
        tuple(steps),
    )
    return Discovery(whole, tuple(rounds))


def depends_on_another_axis(of: Sum) -> bool:
    """Whether a sum depends on the motion or the command of another axis than its own."""
    names = {name for term in of.terms for name in term.variables}
    return any(name[-1:] in AXES and name[-1:] != AXES[of.axis] for name in names)


def _first_half(context: SearchContext, pair: FittedCandidate) -> FittedCandidate:
    """The candidate without the second law of its pair, because each named law needs a step in the explanation."""
    hypothesis = without_claim(pair.fitted.hypothesis, len(pair.fitted.hypothesis.claims) - 1)
    return context.candidate(evaluate_fit(context.measure, context.tuning, pair.fitted.deviations, hypothesis))


def _find_next_law(context: SearchContext, base: Fitted, time_left: TimeBudget, alone: bool) -> Round | None:
    """The next law: sums screened in the views with the largest excess, the best fitted. None where nothing fits."""
    views = views_of(context.measure, context.tuning, base)
    searched = [(view, best_sums(products_of(view), view_terms(view), time_left)) for view in _views_to_search(views)]
    every = sorted(
        (
            *(item for view, found in searched for item in found.sums if not _undoes_command(view, item)),
            *antisymmetric_pairs(views),
        ),
        key=lambda item: _compute_explained_squares(views, item),
        reverse=True,
    )
    chosen = _choose_sums_to_fit(_keep_close_to_best(_best_of_each_structure(every)))
    if alone and chosen and not _may_explain_alone(chosen[0]):
        return None
    pairs = fit_sums(context, base, chosen, time_left)
    if not pairs:
        return None
    ranked = put_plainest_first(context, pairs)
    first = ranked[0][1]
    # The negative control of the views that the best law, or either half of a pair, acts in.
    own = [(each.acts_on, each.axis) for each in (first, first.partner) if each is not None]
    placebo = max((found.placebo for view, found in searched if (view.acts_on, view.axis) in own), default=0.0)
    return Round(tuple(item for item, _ in ranked), tuple(item for _, item in ranked), placebo, time_left())


def _may_explain_alone(best: Sum) -> bool:
    """Whether a single term leaves so little of the missing force in the screen that a fit is worth its time."""
    left = best.cross_validated - 1 <= LAW_ALONE_LEAVES * (best.without - 1)
    return left and len(best.terms) == 1


def _choose_sums_to_fit(sums: Sequence[Sum]) -> list[Sum]:
    """The best few sums, and the best one that lacks a variable of the first, so that it has a rival."""
    first = [*sums[:LAW_FITTED]]
    if not first or any(not set(sums[0].variables) <= set(each.variables) for each in first):
        return first
    other = next((each for each in sums if not set(sums[0].variables) <= set(each.variables)), None)
    return first if other is None else [*first, other]


def _views_to_search(views: Sequence[View]) -> list[View]:
    """Views in which laws are searched: at most two of axes and two of readings, by falling excess error."""
    found: list[View] = []
    for acts_on in ("force", "response"):
        missing = [(_excess(view), view.output) for view in views if view.acts_on == acts_on]
        most = max((excess for excess, _ in missing), default=0.0)
        worth = [(excess, output) for excess, output in missing if excess > LAW_ALMOST_NOISE]
        found += [
            views[output] for excess, output in sorted(worth, reverse=True)[:2] if excess >= LAW_AXES_SHARE * most
        ]
    return found


def _undoes_command(view: View, each: Sum) -> bool:
    """Whether a force cancels more than `LAW_COMMAND_TAKEN` (half) of the command of its axis. If mass, damping and
    stiffness shrink in proportion, the force balance then approaches its trivial solution 0 = 0."""
    if each.acts_on != "force":
        return False
    taken = power = 0.0
    for record in view.records:
        command = record.columns[f"f{AXES[each.axis]}"]
        for term, factor in zip(each.terms, each.factors, strict=True):
            force = factor * evaluate_shape(term.shape, term.numbers, record.columns, record.rate_hz)
            taken -= float(force @ command)
        power += float(command @ command)
    return taken > LAW_COMMAND_TAKEN * power


def _excess(view: View) -> float:
    """Excess error of a view: held-out squares of the re-tuned model over those of noise alone; 1 = noise."""
    base = products_of(view)
    without = cross_validate_terms(base, view.residual[None, :]).without
    return float(without.sum()) / (view.noise * len(view.residual))


def _compute_explained_squares(views: Sequence[View], each: Sum) -> float:
    """Held-out squares that a sum removes, in units of its view."""
    view = next(view for view in views if (view.acts_on, view.axis) == (each.acts_on, each.axis))
    own = (each.without - each.cross_validated) * view.noise * len(view.residual)
    # The errors of a pair are the means of those of its halves.
    return own if each.partner is None else 2 * own


def _keep_close_to_best(sums: Sequence[Sum]) -> list[Sum]:
    """The sums whose error above the noise is at most `LAW_FITTED_WITHIN` times that of the best sum."""
    return [
        each
        for each in sums
        if each.cross_validated - 1 <= LAW_FITTED_WITHIN * max(sums[0].cross_validated - 1, LAW_ALMOST_NOISE - 1)
    ]


def _best_of_each_structure(sums: Sequence[Sum]) -> list[Sum]:
    """The best sum of each structure: same axis or reading, same shapes, a pair or not. sums: the best first."""
    found: dict[object, Sum] = {}
    for each in sums:
        shapes = frozenset(term.shape for term in each.terms)
        found.setdefault((each.acts_on, each.axis, each.partner is None, shapes), each)
    return list(found.values())
