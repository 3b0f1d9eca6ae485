"""Separation of trials by who answered: people, simulated participants, or people at a device that did not move.

An analysis never mixes these populations: answers of simulated participants, or of people who felt nothing, say nothing
about human thresholds. The column `felt` of a trial decides: empty, true or false.
"""

from collections.abc import Iterable
from enum import Enum

from protocols.trial import Trial


class Population(Enum):
    """Who answered a trial, and whether a stimulus could be felt."""

    PEOPLE = "people"
    SIMULATED = "simulated participants"
    NOT_FELT = "people who felt nothing"
    """A person answered while the device was simulated, so that nothing moved: a rehearsal, not a measurement."""


def split_by_population(trials: Iterable[Trial]) -> dict[Population, tuple[Trial, ...]]:
    """The trials of each population that occurs, in the order given.

    Raises ValueError, with the name of the session, where the answers of one session belong to different populations.
    """
    sessions: dict[tuple[str, str], list[Trial]] = {}
    for trial in trials:
        sessions.setdefault((trial.subject, trial.session), []).append(trial)
    parts: dict[Population, list[Trial]] = {}
    for (subject, session), rows in sessions.items():
        parts.setdefault(_population_of(subject, session, rows), []).extend(rows)
    return {kind: tuple(parts[kind]) for kind in Population if kind in parts}


def _population_of(subject: str, session: str, rows: list[Trial]) -> Population:
    """Population of one session, whose trials are `rows`; raises ValueError where they disagree."""
    # Only answered trials count, if there are any: `felt` may not be known yet for a trial without an answer.
    kinds = {_trial_population(trial) for trial in rows if trial.is_valid} or {
        _trial_population(trial) for trial in rows
    }
    if len(kinds) > 1:
        kind_names = " and ".join(kind.value for kind in Population if kind in kinds)
        raise ValueError(
            f"session {session} of {subject} mixes trials of {kind_names} (column felt): a session contains trials of "
            "one kind only; find the cause, remove the wrong rows, and analyse it again"
        )
    return kinds.pop()


def _trial_population(trial: Trial) -> Population:
    """Population of a trial, by its column `felt`."""
    if trial.felt is None:
        return Population.SIMULATED
    return Population.PEOPLE if trial.felt else Population.NOT_FELT
