"""How often the flag for a drifting response bias is raised. `python tests/references/drift_flag.py [STUDIES [SEED]]`
prints the table of docs/statistics.md, from 60 studies of ten unless told otherwise.

First without a staircase: sessions of five runs of 70 trials at a d' of 1.64, whose criterion moves by a number of d'
units in 100 trials and varies beside that from run to run, normal and without any order. Then simulated people of
rehearsals through the published staircase. "Alone": each session is the only one of its study. "All ten": studies of
ten of a kind. "One of ten": the other nine are of the first kind, which neither moves nor varies. "Or leaning": one of
ten, or one of its runs has a strong bias.
"""

import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[2]))

from analysis.psychophysics.bias import estimate_response_bias
from analysis.psychophysics.catch_trials import compute_wilson_interval
from analysis.psychophysics.criterion_drift import estimate_criterion_drifts
from analysis.psychophysics.study_warnings import DRIFT_LEVEL, LEAVE_ONE_OUT_LEVEL, STRONG_BIAS
from protocols.trial import Trial
from study.participants.observer_catalogue import find_observer
from study.participants.population import make_member
from tests.study.participants.test_flagged_people import session

Run = tuple[list[int], list[bool]]
D_PRIME, RUNS, TRIALS, PEOPLE = 1.64, 5, 70, 10
KINDS = ((0.0, 0.0), (0.0, 0.2), (0.0, 0.3), (0.3, 0.0), (0.3, 0.2))
"""(criterion per 100 trials, standard deviation of the runs' criteria)"""


def simulated_session(per_100_trials: float, criterion_sd: float, seed: tuple[int, ...]) -> list[Run]:
    """Answers of an equal-variance observer, by run: directions shown, and whether the answer was right."""
    rng = np.random.default_rng(seed)
    runs = []
    for run in range(RUNS):
        criterion = per_100_trials * (run + 0.5) * TRIALS / 100.0 + criterion_sd * rng.standard_normal()
        shown = rng.integers(1, 3, TRIALS)
        said = np.where(rng.normal(np.where(shown == 1, D_PRIME / 2, -D_PRIME / 2)) > criterion, 1, 2)
        runs.append((shown.tolist(), (said == shown).tolist()))
    return runs


def staircase_session(kind: str, number: int, seed: int) -> list[Run]:
    """kind: "honest", of a simulated population, or "drifting" by 0.3 in 100 trials."""
    observer = (
        find_observer("criterion_drift", number) if kind == "drifting" else make_member("person", 1 + number, seed)
    )
    return answers_by_run(session(observer, "P01", 100_000 * seed + number))


def answers_by_run(trials: list[Trial]) -> list[Run]:
    """Of the trials that count."""
    runs: dict[int, Run] = {}
    for trial in trials:
        if trial.is_valid:
            shown, correct = runs.setdefault(trial.run, ([], []))
            shown.append(trial.direction_shown)
            correct.append(bool(trial.correct))
    return [runs[run] for run in sorted(runs)]


def named(sessions: list[list[Run]]) -> list[bool]:
    """Whether the report on a study of these sessions names each."""
    return [
        drift is not None and drift.p < DRIFT_LEVEL and drift.p_without_a_run < LEAVE_ONE_OUT_LEVEL
        for drift in estimate_criterion_drifts(sessions)
    ]


def leans(runs: list[Run]) -> bool:
    """Whether the report names the bias of a run."""
    return any((bias := estimate_response_bias(*run)) is not None and abs(bias.criterion) > STRONG_BIAS for run in runs)


def flags(sessions: list[list[Run]], quiet: list[list[Run]]) -> dict[str, list[bool]]:
    """By the company in which a session is analysed. quiet: sessions that neither move nor vary."""
    tens = [sessions[start : start + PEOPLE] for start in range(0, len(sessions), PEOPLE)]
    others = [[quiet[(place + step) % len(quiet)] for step in range(1, PEOPLE)] for place in range(len(sessions))]
    one_of_ten = [named([each, *nine])[0] for each, nine in zip(sessions, others, strict=True)]
    return {
        "alone": [flag for each in sessions for flag in named([each])],
        "all ten": [flag for ten in tens for flag in named(ten)],
        "one of ten": one_of_ten,
        "or leaning": [flag or leans(runs) for flag, runs in zip(one_of_ten, sessions, strict=True)],
    }


def main(studies: int, seed: int) -> None:
    numbers = range(PEOPLE * studies)
    quiet = [simulated_session(0.0, 0.0, (seed, 9, number)) for number in numbers]
    for place, (drift, sd) in enumerate(KINDS):
        found = [simulated_session(drift, sd, (seed, place, number)) for number in numbers]
        show(f"drift {drift:g}, SD {sd:g}", flags(found, quiet))
    honest = [staircase_session("honest", number, seed) for number in numbers]
    show("staircase, honest", flags(honest, honest))
    show("staircase, drifting", flags([staircase_session("drifting", number, seed) for number in numbers], honest))


def show(kind: str, found: dict[str, list[bool]]) -> None:
    cells = []
    for company, flagged in found.items():
        lower, upper = compute_wilson_interval(sum(flagged), len(flagged))
        share = 100 * np.mean(flagged)
        cells.append(f"{company} {share:.1f} % ({100 * lower:.1f} to {100 * upper:.1f})")
    sys.stdout.write(f"{kind:22} {len(flagged)} sessions: {', '.join(cells)}\n")
    sys.stdout.flush()


if __name__ == "__main__":
    given = [int(text) for text in sys.argv[1:3]]
    main(*given, *(60, 7)[len(given) :])
