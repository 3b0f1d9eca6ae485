"""Bias and coverage of the primary analysis where people, or the data, are not as it assumes.

    python tests/references/coverage_outside_the_model.py STUDIES [NAME ...]

Studies of ten participants under the published staircase, medians of 0.35, 0.7 and 1.4 N at 5, 25 and 45 Hz. Of the
`few` kinds, 45 Hz has whole runs of a few people only, and eight answers of the others, drawn at random from
their runs (not by level or outcome), or none.
"""

import os
import sys
from dataclasses import replace

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np

from analysis.psychophysics.hierarchy.answers import Answers
from analysis.psychophysics.hierarchy.primary import PrimaryAnalysis, compute_primary_analysis
from analysis.psychophysics.power.simulated_study import Crowd, simulate_study
from analysis.psychophysics.two_analyses import SIMULATED_RULE

HZ, MEDIANS_N, PEOPLE, SEED = (5.0, 25.0, 45.0), (0.35, 0.7, 1.4), 10, 5
USUAL = Crowd(HZ, MEDIANS_N)
CROWDS = {
    "one in ten guesses": replace(USUAL, guessers=0.1),
    "lapses of 10 %": replace(USUAL, lapse=0.1),
    "biases of 0.6 (SD)": replace(USUAL, criterion_sd=0.6),
    "biases drift by 0.5 in 100 trials (SD)": replace(USUAL, criterion_drift_sd=0.5),
    "slopes differ by a factor of 2 (SD)": replace(USUAL, slope_log_sd=0.7),
    "ask again when unsure, 3 in a run": replace(USUAL, unsure=0.5, repeats=3),
}
FEW = {f"few: {people} of ten, {count} answers of others": (people, count) for people in (1, 2, 3) for count in (0, 8)}


def with_few(answers: Answers, people: int, count: int) -> Answers:
    """The last frequency as played by some people, and `count` answers of the others there, drawn from
    all of a run at random, so that neither level nor outcome chooses."""
    k, right, wrong = len(answers.frequencies_hz), answers.right.copy(), answers.wrong.copy()
    for person in range(people, answers.persons):
        cells = np.flatnonzero(answers.run == person * k + k - 1)
        asked = np.concatenate([right[cells], wrong[cells]]).astype(np.int64)
        drawn = np.random.default_rng((count, person)).multivariate_hypergeometric(asked, min(count, int(asked.sum())))
        right[cells], wrong[cells] = drawn.reshape(2, -1)
    kept = right + wrong > 0
    return replace(
        answers, run=answers.run[kept], level_db=answers.level_db[kept], side=answers.side[kept],
        right=right[kept], wrong=wrong[kept],
    )  # fmt: skip


def result_lines(name: str, found: list[PrimaryAnalysis]) -> list[str]:
    true_db, lines = 20.0 * np.log10(MEDIANS_N), [f"{name} ({len(found)} studies)"]
    for place, frequency_hz in enumerate(HZ):
        medians = [each.medians[place] for each in found]
        told = [(m.lower_db, m.upper_db) for m in medians if m.lower_db is not None and m.upper_db is not None]
        holds = [bool(lower <= true_db[place] <= upper) for lower, upper in told]
        bias = np.mean([m.db for m in medians]) - true_db[place]
        contrasts = [c for each in found for c in each.contrasts if c.frequency_hz == frequency_hz]
        inside = [bool(c.lower_db <= true_db[place] - true_db[0] <= c.upper_db) for c in contrasts]
        lines.append(
            f"  {frequency_hz:g} Hz: bias {bias:+.2f} dB; interval in {len(told)}, holds {_percent(holds)}; "
            f"difference to 5 Hz in {len(contrasts)}, holds {_percent(inside)}"
        )
    return lines


def _percent(shares: list[bool]) -> str:
    return f"{100.0 * float(np.mean(shares)):.1f} %" if shares else "-"


def main() -> None:
    studies, names = int(sys.argv[1]), sys.argv[2:] or [*CROWDS, *FEW]
    for name in names:
        found = []
        for number in range(studies):
            answers = simulate_study(CROWDS.get(name, USUAL), SIMULATED_RULE, PEOPLE, (SEED, number)).answers
            analysis = compute_primary_analysis(
                with_few(answers, *FEW[name]) if name in FEW else answers, SIMULATED_RULE.cap_n
            )
            assert analysis is not None
            found.append(analysis)
        sys.stdout.write("\n".join([*result_lines(name, found), ""]))


if __name__ == "__main__":
    main()
