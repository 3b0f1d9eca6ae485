"""Separate trials by who answered: people, simulated participants, or people at a device that did not move.

An analysis never mixes these populations: answers of simulated participants, or of people who felt nothing, say nothing
about human thresholds. The column `felt` of a trial decides: empty (simulated participant), true (a person) or false (a
person at a device that did not move).
"""

from collections.abc import Iterable
from enum import Enum

from analysis.psychophysics.runs import InconsistentTrialsError
from protocols.trial import Trial


class Population(Enum):
    """Who answered a trial, and whether a stimulus could be felt."""

    PEOPLE = "people"
    """A person answered, and the device moved."""
    SIMULATED = "simulated participants"
    """The program answered."""
    NOT_FELT = "people who felt nothing"
    """A person answered while the device was simulated, so that nothing moved: a rehearsal, not a measurement."""


def split_by_population(trials: Iterable[Trial]) -> dict[Population, tuple[Trial, ...]]:
    """Split the trials by population, in the order of `Population`; trials are ordered by session, and sessions by
    their first trial. A population without trials has no key.

    Raises InconsistentTrialsError, with the name of the session, where its answers belong to different populations.
    """
    sessions: dict[tuple[str, str], list[Trial]] = {}
    for trial in trials:
        sessions.setdefault((trial.subject, trial.session), []).append(trial)
    trials_by_population: dict[Population, list[Trial]] = {}
    for (subject, session), session_trials in sessions.items():
        trials_by_population.setdefault(_find_session_population(subject, session, session_trials), []).extend(
            session_trials
        )
    return {
        population: tuple(trials_by_population[population])
        for population in Population
        if population in trials_by_population
    }


def _find_session_population(subject: str, session: str, session_trials: list[Trial]) -> Population:
    """Find the population of one session from its trials (at least one); raises InconsistentTrialsError where they
    disagree."""
    # Only answered trials count, if there are any: `felt` may not be known yet for a trial without an answer.
    populations = {_find_trial_population(trial) for trial in session_trials if trial.is_valid} or {
        _find_trial_population(trial) for trial in session_trials
    }
    if len(populations) > 1:
        kinds = " and ".join(population.value for population in Population if population in populations)
        raise InconsistentTrialsError(
            f"session {session} of {subject} mixes trials of {kinds} (column felt): a session contains trials of "
            "one kind only; find the cause, remove the wrong rows, and analyse it again"
        )
    return populations.pop()


def _find_trial_population(trial: Trial) -> Population:
    """Find the population of a trial by its column `felt`."""
    if trial.felt is None:
        return Population.SIMULATED
    return Population.PEOPLE if trial.felt else Population.NOT_FELT
