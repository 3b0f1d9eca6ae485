"""Calibration of the primary analysis: type-1 errors over null studies, and ranks of the truth in its intervals.

    python tests/references/primary_analysis_calibration.py FOLDER [SECONDS [SEED]]     again, it goes on
    python tests/references/primary_analysis_calibration.py FOLDER 0     only prints what is there

The numbers in docs/statistics.md are from it; some 0.1 s of processor time per study of ten participants. Two parts:

Nulls: all frequencies have the same median, at 0.7, 2.2 or 3.5 N, with equal or unequal spread between people.

Ranks: every study has a population of its own, drawn from a wide prior (`drawn_crowd`). The rank of a true value in
the analysis's confidence distribution, Student's t around the estimate, is uniform where its intervals are right at
every level at once: the check of S. Talts et al., arXiv:1804.06788 (simulation-based calibration), for intervals that
come from a marginal likelihood and not from a posterior. It is told for medians and contrasts below the cap alone:
above it the analysis gives bounds.
"""

import json
import os
import sys
import time
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np
from scipy.stats import chi2
from scipy.stats import t as student

from analysis.psychophysics.catch_trials import compute_wilson_interval
from analysis.psychophysics.group_contrasts import compute_contrasts
from analysis.psychophysics.hierarchy.fit import fit_hierarchy
from analysis.psychophysics.hierarchy.inference import compute_pseudo_thresholds
from analysis.psychophysics.power.simulated_study import FAMILIES, Crowd, simulate_study
from analysis.psychophysics.repeated_measures import analyse_repeated_measures
from protocols.definition.staircase_rule import StaircaseRule, StepPhase

PEOPLE, SEED, BINS = 10, 20, 20
RULE = StaircaseRule(1.0, 3.0, 1, 3, (StepPhase(4.0, 3), StepPhase(1.0, 10)), 13, 10)
HZ = (5.0, 15.0, 25.0, 35.0, 45.0)
UNEQUAL = (1.0, 1.0, 1.7, 2.5, 3.5)
NULLS = {
    f"{median_n:g} N{', unequal spread' if spread is UNEQUAL else ''}": Crowd(
        HZ, (median_n,) * 5, frequency_sd_db=spread
    )
    for median_n in (0.7, 2.2, 3.5)
    for spread in (1.7, UNEQUAL)
}


def drawn_crowd(number: int, seed: int = SEED) -> Crowd:
    """A population from the prior: medians 0.2 to 2.2 N each, spreads, slope, lapses and curve, all drawn."""
    random = np.random.default_rng([seed, number])
    return Crowd(
        HZ,
        tuple(float(n) for n in 10.0 ** random.uniform(np.log10(0.2), np.log10(2.2), 5)),
        person_sd_db=float(random.uniform(1.5, 3.5)),
        frequency_sd_db=float(random.uniform(1.0, 2.5)),
        slope_log_sd=float(random.uniform(0.1, 0.4)),
        lapse=float(random.uniform(0.0, 0.05)),
        criterion_sd=float(random.uniform(0.0, 0.3)),
        family=FAMILIES[int(random.integers(0, 3))],
    )


def judge(crowd: Crowd, seed: tuple[int, ...]) -> dict[str, list[float]]:
    study = simulate_study(crowd, RULE, PEOPLE, seed)
    pseudo = compute_pseudo_thresholds(fit_hierarchy(study.answers))
    true_db = 20.0 * np.log10(crowd.medians_n)
    within = analyse_repeated_measures(study.answers.subjects, pseudo.tolist())
    found = compute_contrasts(HZ, pseudo, 0.95)
    against = pseudo[:, 1:] - pseudo[:, :1]
    return {
        "overall": [within.p_huynh_feldt if within.p_huynh_feldt is not None else 1.0],
        "contrast": [contrast.p for contrast in found],
        "rank of median": _ranks(pseudo, true_db),
        "rank of contrast": _ranks(against, true_db[1:] - true_db[0]),
        "median error": (pseudo.mean(axis=0) - true_db).tolist(),
    }


def _ranks(values, truth) -> list[float]:
    error = values.std(axis=0, ddof=1) / np.sqrt(len(values))
    return student.cdf((truth - values.mean(axis=0)) / error, len(values) - 1).tolist()


def simulate(folder: Path, seconds: float, seed: int = SEED) -> None:
    """In turn one study of each null and three of the ranks, so that at any time all parts are equally far."""
    folder.mkdir(parents=True, exist_ok=True)
    path, until = folder / "studies.jsonl", time.monotonic() + seconds
    done = len(path.read_text().splitlines()) if path.exists() else 0
    jobs = [*NULLS, *["ranks"] * 3]
    with path.open("a") as file:
        while time.monotonic() < until:
            turn, place = divmod(done, len(jobs))
            number = turn if jobs[place] in NULLS else 3 * turn + place - len(NULLS)
            crowd = NULLS[jobs[place]] if jobs[place] in NULLS else drawn_crowd(number, seed)
            row = {"part": jobs[place], "number": number, **judge(crowd, (seed, place, number))}
            file.write(json.dumps(row) + "\n")
            file.flush()
            done += 1


def print_results(folder: Path) -> None:
    rows = [json.loads(line) for line in (folder / "studies.jsonl").read_text().splitlines()]
    for part in (*NULLS, "all nulls"):
        mine = [row for row in rows if row["part"] == part or (part == "all nulls" and row["part"] in NULLS)]
        shares = [_share([row["overall"][0] < 0.05 for row in mine])]
        shares += [_share([row["contrast"][place] < 0.05 for row in mine]) for place in range(4)]
        print(f"{part:22} {len(mine):6} studies; overall {shares[0]}; contrasts {'; '.join(shares[1:])}")  # noqa: T201
    for kind in ("rank of median", "rank of contrast"):
        ranks = np.array([row[kind] for row in rows if row["part"] == "ranks"])
        for place in range(ranks.shape[1]):
            print(f"{kind} {place}: {_uniformity(ranks[:, place])}")  # noqa: T201
    errors = np.array([row["median error"] for row in rows if row["part"] == "ranks"])
    print(f"bias of medians (dB): {errors.mean(axis=0).round(2)}")  # noqa: T201


def _share(found: list[bool]) -> str:
    lower, upper = compute_wilson_interval(sum(found), len(found))
    return f"{100 * sum(found) / len(found):.1f} % ({100 * lower:.1f} to {100 * upper:.1f})"


def _uniformity(ranks) -> str:
    """Pearson's chi-squared over equal bins, and the shares within the 50 and 95 % intervals."""
    counts = np.histogram(ranks, bins=BINS, range=(0.0, 1.0))[0]
    statistic = float(((counts - len(ranks) / BINS) ** 2).sum() / (len(ranks) / BINS))
    half, most = (np.mean(np.abs(ranks - 0.5) < share / 2) for share in (0.5, 0.95))
    p = chi2.sf(statistic, BINS - 1)
    return f"{len(ranks)} ranks, mean {ranks.mean():.3f}, chi2 p {p:.3g}; within 50 %: {half:.3f}, 95 %: {most:.3f}"


if __name__ == "__main__":
    where = Path(sys.argv[1])
    asked = sys.argv[2:]
    simulate(where, float(asked[0]) if asked else 600.0, int(asked[1]) if len(asked) > 1 else SEED)
    print_results(where)
