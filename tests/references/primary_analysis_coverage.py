"""Bias, coverage and type-1 error of the primary analysis over simulated studies of ten participants.

`python tests/references/primary_analysis_coverage.py 1000` prints a table, some 0.1 s of processor time per study. The
numbers in docs/statistics.md are from it. Every row is a kind of people: whose thresholds rise with frequency, whose
curves have another shape than the analysis assumes, who lapse, who are alike at all frequencies (a null).
"""

import os
import sys

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np
from scipy.stats import t as student

from analysis.psychophysics.anova import compute_one_way_anova
from analysis.psychophysics.group_contrasts import compute_contrasts
from analysis.psychophysics.hierarchy.curve import Family
from analysis.psychophysics.hierarchy.fit import fit_hierarchy
from analysis.psychophysics.hierarchy.inference import compute_pseudo_thresholds, find_lower_bound
from analysis.psychophysics.hierarchy.objective import Prior
from analysis.psychophysics.power.simulated_study import Crowd, simulate_study
from analysis.psychophysics.repeated_measures import analyse_repeated_measures
from protocols.definition.staircase_rule import StaircaseRule, StepPhase

PEOPLE = 10
RULE = StaircaseRule(1.0, 3.0, 1, 3, (StepPhase(4.0, 3), StepPhase(1.0, 10)), 13, 10)
HZ = (5.0, 15.0, 25.0, 35.0, 45.0)
RISING, HALF, UNEQUAL = (0.35, 0.6, 0.85, 2.2, 2.2), (0.35, 0.6, 0.85, 3.0, 4.0), (1.0, 1.0, 1.7, 2.5, 3.5)
CROWDS = {
    "rising": Crowd(HZ, RISING),
    "rising, no lapse": Crowd(HZ, RISING, lapse=0.0),
    "rising, 5 % lapse": Crowd(HZ, RISING, lapse=0.05),
    "rising, logistic, no lapse": Crowd(HZ, RISING, family=Family.LOGISTIC, lapse=0.0),
    "rising, logistic, 5 %": Crowd(HZ, RISING, family=Family.LOGISTIC, lapse=0.05),
    "rising, Gauss, no lapse": Crowd(HZ, RISING, family=Family.GAUSS, lapse=0.0),
    "rising, Gauss, 5 %": Crowd(HZ, RISING, family=Family.GAUSS, lapse=0.05),
    "half above at 35, more at 45 Hz": Crowd(HZ, HALF),
    "null 0.7 N": Crowd(HZ, (0.7,) * 5),
    "null 2.2 N": Crowd(HZ, (2.2,) * 5),
    "null 3.5 N": Crowd(HZ, (3.5,) * 5),
    "null 0.7 N, unequal spread": Crowd(HZ, (0.7,) * 5, frequency_sd_db=UNEQUAL),
    "null 2.2 N, unequal spread": Crowd(HZ, (2.2,) * 5, frequency_sd_db=UNEQUAL),
}


def measure(crowd: Crowd, studies: int, bounds: bool) -> dict[str, list[float]]:
    true = 20.0 * np.log10(crowd.medians_n)
    difference = true[1:] - true[0]
    half, rows = student.ppf(0.975, PEOPLE - 1), []
    for number in range(studies):
        study = simulate_study(crowd, RULE, PEOPLE, (19, number))
        fit = fit_hierarchy(study.answers)
        pseudo = compute_pseudo_thresholds(fit)
        error = fit.means_db - true
        covered = np.abs(error) <= half * pseudo.std(axis=0, ddof=1) / PEOPLE**0.5
        found = compute_contrasts(HZ, pseudo, 0.95)
        within = analyse_repeated_measures(study.answers.subjects, pseudo.tolist())
        paper = compute_one_way_anova({f"{f}": list(column) for f, column in zip(HZ, study.threshold_n.T, strict=True)})
        rows.append({
            "bias": error,
            "cover": covered,
            "contrast bias": [c.difference_db for c in found] - difference,
            "contrast cover": [c.lower_db <= d <= c.upper_db for c, d in zip(found, difference, strict=True)],
            "contrast p < .05": [c.p < 0.05 for c in found],
            "any Holm": [min(c.p_holm for c in found) < 0.05],
            "Huynh-Feldt, Greenhouse-Geisser": [within.p_huynh_feldt < 0.05, within.p < 0.05],
            "one-way": [paper.p is not None and paper.p < 0.05],
            "bound": [(low := find_lower_bound(fit, 4, 0.95, Prior())) is None or low <= true[4]]
            if bounds else [np.nan],
        })  # fmt: skip
    return {key: np.mean([row[key] for row in rows], axis=0).round(4).tolist() for key in rows[0]}


def main(studies: int, wanted: list[str]) -> None:
    for name, crowd in CROWDS.items():
        if not wanted or any(word in name for word in wanted):
            bounds = "half" in name or "3.5" in name
            sys.stdout.write(f"{name} ({studies} studies)\n")
            for key, values in measure(crowd, studies, bounds).items():
                sys.stdout.write(f"    {key:32} {values}\n")
            sys.stdout.flush()


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 200, sys.argv[2:])
