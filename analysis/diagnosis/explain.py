"""From a model and what was observed to the physics that the model lacks: re-tune, screen, fit, choose, add, prune."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from analysis.diagnosis.candidates import candidates
from analysis.diagnosis.error_measure import FreeSimulation
from analysis.diagnosis.gather_evidence import gather_evidence
from analysis.diagnosis.hypothesis import NOTHING
from analysis.diagnosis.output_error import Fitted, Sensitivity, evaluated, fit, sensitivity
from analysis.diagnosis.rivalry import Arena, Contender, contest, refine
from analysis.diagnosis.screening import screen
from equalizer.effects.effect import Effect

RETUNING_ROUNDS = 4
MOST_EFFECTS = 3
CLEAN = 1.05
"""Errors of so many times the noise, in the worst channel, count as noise alone."""
WORTHWHILE = 0.3
"""Share of what is left over that a further effect must take to be added."""

Progress = Callable[[str, float], None]
"""What is being done, and the share of all that is done."""


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


def explain(arena: Arena, catalogue: Sequence[Effect], progress: Progress) -> Explanation:
    measure, tuning = arena.measure, arena.tuning
    before = evaluated(measure, tuning, np.zeros(len(tuning.names)), NOTHING)
    progress("re-tuning the model within its tolerances", 0.0)
    known = sensitivity(measure, tuning, before.deviations, NOTHING, arena.map_)
    retuned = refine(arena, fit(measure, tuning, before, known, RETUNING_ROUNDS))
    base = arena.contender(retuned)
    rounds: list[tuple[Contender, ...]] = []
    steps: list[Contender] = []
    while len(rounds) < MOST_EFFECTS and base.standing.seen > CLEAN:
        progress(f"looking for the {('first', 'second', 'third')[len(rounds)]} effect", (1 + len(rounds)) / 4)
        contenders = _next(arena, catalogue, base.fitted)
        if not contenders or not _worthwhile(base, contenders[0]):
            rounds.append(contenders)
            break
        rounds.append(contenders)
        base = contenders[0]
        steps.append(base)
    return Explanation(arena.contender(before), arena.contender(retuned), base, tuple(rounds), tuple(steps))


def _next(arena: Arena, catalogue: Sequence[Effect], base: Fitted) -> tuple[Contender, ...]:
    assert isinstance(arena.measure, FreeSimulation)
    evidence = gather_evidence(arena.measure, arena.tuning, base)
    suggested = candidates(catalogue, evidence[0])
    known: Sensitivity = sensitivity(arena.measure, arena.tuning, base.deviations, base.hypothesis, arena.map_)
    screened = screen(arena.measure, arena.tuning, base, known, suggested, arena.map_)
    return contest(arena, base, known, screened)


def _worthwhile(base: Contender, better: Contender) -> bool:
    return better.standing.chosen_by < (1 - WORTHWHILE) * base.standing.chosen_by
