"""Population that answered: people, simulated participants, or people who felt nothing; never mixed in an analysis."""

from collections.abc import Iterable
from enum import Enum

from protocols.trial import Trial


class Population(Enum):
    """Who answered a trial, and whether anything could be felt."""

    PEOPLE = "people"
    SIMULATED = "simulated participants"
    NOT_FELT = "people who felt nothing"
    """A person answered while a simulated device moved nothing: good for a rehearsal, no measurement."""


def split_by_population(trials: Iterable[Trial]) -> dict[Population, tuple[Trial, ...]]:
    """The trials of each kind that occurs, in the order given.

    A session belongs to one kind as a whole. Raises ValueError naming the session where its answers do not agree.
    """
    sessions: dict[tuple[str, str], list[Trial]] = {}
    for trial in trials:
        sessions.setdefault((trial.subject, trial.session), []).append(trial)
    parts: dict[Population, list[Trial]] = {}
    for (subject, session), rows in sessions.items():
        parts.setdefault(_population_of(subject, session, rows), []).extend(rows)
    return {kind: tuple(parts[kind]) for kind in Population if kind in parts}


def _population_of(subject: str, session: str, rows: list[Trial]) -> Population:
    # A trial that was never answered may not know yet who would have felt it.
    kinds = {_kind(trial) for trial in rows if trial.counts} or {_kind(trial) for trial in rows}
    if len(kinds) > 1:
        named = " and ".join(kind.value for kind in Population if kind in kinds)
        raise ValueError(
            f"session {session} of {subject} mixes trials of {named} (column felt): one session holds one kind; "
            "analyse it after the wrong rows are explained and taken out"
        )
    return kinds.pop()


def _kind(trial: Trial) -> Population:
    if trial.felt is None:
        return Population.SIMULATED
    return Population.PEOPLE if trial.felt else Population.NOT_FELT
