"""Transformed up-down staircase: the next level, and the end of a run.

Read `step` first: it is the complete rule, except for runs whose levels the Psi method chooses
(`protocols.procedure.psi`). The state is a value: `begin_staircase` makes it, `step` returns the next one. Levels are
in dB re 1 N and not restricted to a grid of steps, because a level that was limited to the cap need not be on that
grid. `study.session.state` folds a session's log with these functions; `analysis` uses them too.

Source: H. Levitt, Transformed up-down methods in psychoacoustics, J. Acoust. Soc. Am. 49 (1971), 467-477.
"""

import math
from dataclasses import dataclass, replace
from enum import Enum

from protocols.definition.staircase_rule import StaircaseRule, StepChange
from protocols.procedure.psi import LevelAndAnswer, choose_level_db, compute_posterior, estimate_threshold


class Heading(Enum):
    """Direction of the last change of level; NONE before the first change, which is therefore no reversal."""

    NONE = "none"
    UP = "up"
    DOWN = "down"


@dataclass(frozen=True, slots=True)
class StaircaseState:
    """State of one run before its next trial."""

    level_db: float
    """Level of the next trial, dB re 1 N."""
    right_in_a_row: int = 0
    """Consecutive right answers since the last wrong answer, or since a step of the up-down rule reset the count."""
    wrong_in_a_row: int = 0
    """Consecutive wrong answers since the last right answer, or since a step of the up-down rule reset the count."""
    heading: Heading = Heading.NONE
    """Direction of the last change of level; NONE throughout where Psi chooses the levels."""
    reversal_levels_db: tuple[float, ...] = ()
    """Level of the trial that made each reversal, before roving, dB re 1 N."""
    reversal_trials: tuple[int, ...] = ()
    """Index of the trial whose answer made each reversal, from 0."""
    trials: int = 0
    """Number of trials answered."""
    trials_at_cap: int = 0
    """Number of trials answered at the cap."""
    pushes_against_cap: int = 0
    """Number of times the up-down rule asked for a level above the cap."""
    reversals_at_cap: int = 0
    """Number of reversals whose trial had the cap as its level."""
    answered: tuple[LevelAndAnswer, ...] = ()
    """All answers of a run whose levels are chosen by Psi; empty for other rules."""
    spread_db: float = math.inf
    """Standard deviation of the threshold's posterior (dB), for a run whose levels are chosen by Psi; infinite before
    its first answer and for other rules."""

    @property
    def reversals(self) -> int:
        """Number of reversals so far, those at the cap included; 0 where Psi chooses the levels."""
        return len(self.reversal_levels_db)


def begin_staircase(rule: StaircaseRule) -> StaircaseState:
    """Return the state before the first answer of a run, at the rule's start level."""
    return StaircaseState(level_db=to_db(rule.start_n))


def step(rule: StaircaseRule, state: StaircaseState, correct: bool) -> StaircaseState:
    """Compute the state after one answer.

    The level rises after `up_after_wrong` consecutive wrong answers and falls after `down_after_right` consecutive
    right ones (after one each until the first reversal, with `initial_one_up_one_down`); a change of direction is a
    reversal; the run ends with its last reversal, or at the rule's trial limit. A rule with `is_bayesian` takes its
    levels from Psi instead, and ends by `is_complete` or at the trial limit. Raises ValueError if the run is already
    finished.
    """
    if is_finished(rule, state):
        raise ValueError("this run is finished: no answer can follow")
    counted_state = _count_answer(rule, state, correct)
    if rule.is_bayesian:
        return _apply_psi(rule, counted_state, correct)
    is_initial = rule.initial_one_up_one_down and state.reversals == 0
    if counted_state.wrong_in_a_row >= (1 if is_initial else rule.up_after_wrong):
        return _move_level(rule, counted_state, Heading.UP)
    if counted_state.right_in_a_row >= (1 if is_initial else rule.down_after_right):
        return _move_level(rule, counted_state, Heading.DOWN)
    return counted_state


def is_finished(rule: StaircaseRule, state: StaircaseState) -> bool:
    """Whether the run is complete or has reached its trial limit."""
    is_at_trial_limit = rule.trial_limit > 0 and state.trials >= rule.trial_limit
    return is_complete(rule, state) or is_at_trial_limit


def is_complete(rule: StaircaseRule, state: StaircaseState) -> bool:
    """Whether the run yields a threshold: it has all its reversals or, under Psi, all its trials or a posterior
    standard deviation of at most `bayesian.spread_db`."""
    if rule.is_bayesian:
        return state.trials >= rule.bayesian.trials or state.spread_db <= rule.bayesian.spread_db
    return state.reversals >= rule.reversals


def compute_level_n(rule: StaircaseRule, state: StaircaseState) -> float:
    """Compute the level to present (N); never above the cap, not even by rounding in the conversion from dB."""
    return min(to_newton(state.level_db), rule.cap_n)


def to_db(level_n: float) -> float:
    """Convert a level above 0 from N to dB re 1 N: 20 log10(level_n)."""
    return 20.0 * math.log10(level_n)


def to_newton(level_db: float) -> float:
    """Convert a level from dB re 1 N to N: 10^(level_db / 20)."""
    return float(10.0 ** (level_db / 20.0))


def _count_answer(rule: StaircaseRule, state: StaircaseState, correct: bool) -> StaircaseState:
    """Count the answer: trials, trials at the cap, and consecutive right or wrong answers."""
    return replace(
        state,
        right_in_a_row=state.right_in_a_row + 1 if correct else 0,
        wrong_in_a_row=0 if correct else state.wrong_in_a_row + 1,
        trials=state.trials + 1,
        trials_at_cap=state.trials_at_cap + _is_at_cap(rule, state.level_db),
    )


def _apply_psi(rule: StaircaseRule, state: StaircaseState, correct: bool) -> StaircaseState:
    """Set the level that Psi chooses after this answer, at most the cap, and the standard deviation of the new
    posterior."""
    cap_db, answered = to_db(rule.cap_n), (*state.answered, (state.level_db, correct))
    posterior = compute_posterior(answered, cap_db)
    level_db = min(choose_level_db(posterior, cap_db), cap_db)
    return replace(state, level_db=level_db, answered=answered, spread_db=estimate_threshold(posterior, cap_db).sd_db)


def _move_level(rule: StaircaseRule, state: StaircaseState, heading: Heading) -> StaircaseState:
    """Move the level one step and reset the counters of consecutive answers; at the cap an upward movement is only
    counted and is no reversal."""
    reset_state = replace(state, right_in_a_row=0, wrong_in_a_row=0)
    if heading is Heading.UP and _is_at_cap(rule, state.level_db):
        return replace(reset_state, pushes_against_cap=state.pushes_against_cap + 1)
    is_reversal = state.heading is not Heading.NONE and heading is not state.heading
    step_db = _find_step_db(rule, state.reversals, is_reversal)
    uncapped_db = state.level_db + (step_db if heading is Heading.UP else -step_db)
    cap_db = to_db(rule.cap_n)
    next_state = replace(
        reset_state,
        level_db=min(uncapped_db, cap_db),
        heading=heading,
        pushes_against_cap=state.pushes_against_cap + (uncapped_db > cap_db + _LEVEL_TOLERANCE_DB),
    )
    if not is_reversal:
        return next_state
    return replace(
        next_state,
        reversal_levels_db=(*state.reversal_levels_db, state.level_db),
        reversal_trials=(*state.reversal_trials, state.trials - 1),
        reversals_at_cap=state.reversals_at_cap + _is_at_cap(rule, state.level_db),
    )


def _find_step_db(rule: StaircaseRule, reversals_before: int, is_reversal: bool) -> float:
    """Find the size of the next change of level (dB). The phase of `rule.steps` follows from the number of reversals so
    far; `rule.step_change` determines whether the present reversal already counts. After the last phase its step
    remains."""
    reversals_with_present = reversals_before + is_reversal
    match rule.step_change:
        case StepChange.AFTER_REVERSAL:
            # The movement at the reversal that completes a phase still has that phase's step.
            reversal_count = reversals_before
        case StepChange.AT_REVERSAL:
            reversal_count = reversals_with_present
        case StepChange.AT_NEXT_REVERSAL:
            reversal_count = reversals_with_present - 1
    for phase in rule.steps:
        if reversal_count < phase.reversals:
            return phase.step_db
        reversal_count -= phase.reversals
    return rule.steps[-1].step_db


_LEVEL_TOLERANCE_DB = 1e-9
"""Tolerance (dB) within which two levels are equal: above rounding, far below any step in use. Chosen."""


def _is_at_cap(rule: StaircaseRule, level_db: float) -> bool:
    """Whether the level is the cap, within rounding."""
    return level_db >= to_db(rule.cap_n) - _LEVEL_TOLERANCE_DB
