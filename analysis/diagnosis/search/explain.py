"""Forward selection of missing effects: re-tune the model, screen candidates, fit the best, add one, repeat."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from analysis.diagnosis.errors.hypothesis import NOTHING, Hypothesis, together
from analysis.diagnosis.errors.output_error import Fitted, evaluated, gather_evidence
from analysis.diagnosis.search.brief import brief_of
from analysis.diagnosis.search.by_brief import fits_by_brief
from analysis.diagnosis.search.candidates import CLOCK_DRIFT, candidates, clock_drift_by_trial, within_data
from analysis.diagnosis.search.contest import contest, refine
from analysis.diagnosis.search.families import excludes
from analysis.diagnosis.search.no_answer import silences
from analysis.diagnosis.search.parsimony import plainest_first
from analysis.diagnosis.search.patience import OutOfPatienceError, always, impatient
from analysis.diagnosis.search.rivalry import SCREENING, STARTING, Arena, Contender, first_fits, sensitivity_at
from analysis.diagnosis.search.same_within_errors import excess
from analysis.diagnosis.search.screening import screen
from analysis.diagnosis.settings import ADDED_GAIN, ADDED_SHARE, MOST_EFFECTS, NOISE_ALONE, SEALED_SURPRISE, SEARCH_ON
from analysis.diagnosis.types import Patience, Progress
from equalizer.effects.effect import Effect
from equalizer.effects.starts.evidence import Evidence
from equalizer.signals.signal import FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class Statistic:
    """What contenders were compared by where waveforms cannot be predicted: a statistic of the response."""

    words: str
    chance: FloatArray
    """(c,): its usual difference between two simulations of one model; takes the place of the noise."""
    errors: FloatArray
    """(numbers,): standard errors of the final hypothesis's point."""


@dataclass(frozen=True, slots=True, eq=False)
class Explanation:
    before: Contender
    """The model as given,"""
    retuned: Contender
    """re-tuned within its tolerances,"""
    after: Contender
    """and with what was found; the same as re-tuned where nothing was."""
    rounds: tuple[tuple[Contender, ...], ...]
    """The contenders for the first effect, the second, …; the best first. The last may have brought nothing."""
    steps: tuple[Contender, ...]
    """What stood after each effect that was added."""
    statistic: Statistic | None = None
    """None where samples were compared, in units of their noise."""
    ended_early: bool = False
    """Patience ran out before the search was done."""
    barred: str = ""
    """An effect that was not to be named, where nothing but refinements of it explains as much."""
    undetermined: tuple[str, ...] = ()
    """Effects that were found, and are not named: the recordings leave their numbers open."""
    errors: tuple[Fitted, FloatArray] | None = None
    """A fit, and the standard errors of all its numbers, where they were computed already; as `final_errors`."""

    @property
    def stages(self) -> dict[str, Fitted]:
        return {"before": self.before.fitted, "retuned": self.retuned.fitted, "after": self.after.fitted}


def explain(arena: Arena, catalogue: Sequence[Effect], progress: Progress, patient: Patience = always) -> Explanation:
    """patient: asked before each piece of the search for effects; once it says no, what was found until then stands."""
    before = evaluated(arena.measure, arena.tuning, np.zeros(len(arena.tuning.names)), NOTHING)
    progress("re-tuning the model within its tolerances", 0.02)
    retuned = _retuned_from(arena, before)
    base = arena.contender(retuned)
    confirmed = arena.confirmed(base)
    surprised = bool(np.nanmax(confirmed.standing.test, initial=0.0) > SEALED_SURPRISE)
    rounds: list[tuple[Contender, ...]] = []
    steps: list[Contender] = []
    barred = ""
    hasty, ended_early = replace(arena, map_=impatient(arena.map_, patient)), False
    for certain in arena.certain:
        base = _with(arena, base, certain)
        rounds.append((base,))
        steps.append(base)
    surprised |= arena.sound is not None
    more = SEARCH_ON * (1.0 if arena.sound is None else arena.sound.beyond)
    while (
        not arena.certain
        and len(rounds) < MOST_EFFECTS
        and (base.standing.seen > (more if rounds else NOISE_ALONE) or (surprised and not rounds))
    ):
        step = Step(f"looking for the {_COUNTED[len(rounds)]} effect", 0.1 + 0.3 * len(rounds), progress)
        try:
            contenders = _next(hasty, catalogue, base.fitted, step)
        except OutOfPatienceError:
            ended_early = True
            break
        named = tuple(contender for contender in contenders if contender.newest not in arena.barred)
        rounds.append(named)
        if not named or not worthwhile(base, named[0]):
            break
        if named[0] is not contenders[0]:
            barred = contenders[0].newest
            break
        base = named[0]
        steps.append(base)
    ends = (arena.confirmed(arena.contender(before)), confirmed, arena.confirmed(base))
    return Explanation(*ends, tuple(rounds), tuple(steps), ended_early=ended_early, barred=barred)


def _with(arena: Arena, base: Contender, hypothesis: Hypothesis) -> Contender:
    """With a hypothesis that is certain, whether or not it lowers the error."""
    start = evaluated(arena.measure, arena.tuning, base.fitted.deviations, together(base.fitted.hypothesis, hypothesis))
    return arena.contender(refine(arena, start))


def retuned_alone(arena: Arena) -> Fitted:
    """The model re-tuned, without any added effect."""
    return _retuned_from(arena, evaluated(arena.measure, arena.tuning, np.zeros(len(arena.tuning.names)), NOTHING))


def _retuned_from(arena: Arena, before: Fitted) -> Fitted:
    return refine(arena, before)


@dataclass(frozen=True, slots=True)
class Step:
    """Part of the work, for the progress display."""

    what: str
    begun: float
    progress: Progress

    def at(self, share: float) -> None:
        self.progress(self.what, self.begun + 0.3 * share)


def _next(arena: Arena, catalogue: Sequence[Effect], base: Fitted, step: Step) -> tuple[Contender, ...]:
    step.at(0.0)
    evidence = gather_evidence(arena.measure, arena.tuning, base)[0]
    told = [effect for effect in catalogue if arena.measure.tells(effect)]
    brief = brief_of(arena, base.hypothesis)
    if brief is None:
        suggested = _suggested(arena, base.hypothesis, told, evidence)
        known = sensitivity_at(arena, base.deviations, base.hypothesis)
        step.at(0.2)
        each = arena.guard.over(arena.map_, SCREENING)
        screened = screen(arena.measure, arena.tuning, base, known, suggested, each)
        fits = first_fits(arena, base, known, screened)
    else:
        timeless = _suggested(
            arena, base.hypothesis, [effect for effect in told if not effect.of_time], brief.of(evidence)
        )
        timed = _suggested(arena, base.hypothesis, [effect for effect in told if effect.of_time], evidence)
        step.at(0.2)
        fits = fits_by_brief(arena, brief, base, timeless, timed)
    step.at(0.6)
    contenders = contest(arena, base, fits)
    return plainest_first(
        [
            contender
            for contender in contenders
            if not silences(arena.measure, base, contender.fitted)
            and within_data(contender.fitted.hypothesis, evidence)
        ]
    )


def _suggested(arena: Arena, held: Hypothesis, catalogue: Sequence[Effect], evidence: Evidence) -> list[Hypothesis]:
    suggested = [
        hypothesis
        for hypothesis in candidates(catalogue, evidence, arena.guard.over(arena.map_, STARTING))
        if not any(excludes(claim, hypothesis.claims[0]) for claim in held.claims)
    ]
    if arena.sound is not None and not any(claim.effect.name == CLOCK_DRIFT for claim in held.claims):
        suggested += arena.guard.part(CLOCK_DRIFT, STARTING, lambda: clock_drift_by_trial(catalogue, evidence), ())
    return suggested


def worthwhile(base: Contender, better: Contender) -> bool:
    """Whether an effect lowers the error enough to be added. Where only the worst channel is above the noise, and not
    the mean over channels, its logarithm must fall by half."""
    gained, over = base.standing.chosen_by - better.standing.chosen_by, np.log(base.standing.seen)
    if excess(base) == 0 and over > np.log(NOISE_ALONE) and np.log(better.standing.seen) > over / 2:
        return False
    return gained > max(ADDED_SHARE * excess(base), ADDED_GAIN)


_COUNTED = ("first", "second", "third")
