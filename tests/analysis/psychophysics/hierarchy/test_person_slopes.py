"""Slopes of people: a known median is recovered with the thresholds integrated out, and not at the common mode."""

import numpy as np
import pytest

from analysis.psychophysics.hierarchy.curve import STARTING_SLOPE, Family
from analysis.psychophysics.hierarchy.fit import fit_hierarchy
from analysis.psychophysics.hierarchy.primary import compute_primary_analysis
from analysis.psychophysics.power.simulated_study import Crowd, simulate_study
from analysis.psychophysics.two_analyses import SIMULATED_RULE

CROWD, PEOPLE, STUDIES = Crowd((5.0, 15.0, 25.0, 35.0), (0.35, 0.6, 0.85, 1.2)), 10, 8


@pytest.mark.slow
def test_slopes_are_those_of_the_people_and_not_steeper():
    studies = [simulate_study(CROWD, SIMULATED_RULE, PEOPLE, (501, number)) for number in range(STUDIES)]
    fits = [fit_hierarchy(study.answers) for study in studies]
    true = np.log(STARTING_SLOPE[Family.WEIBULL])
    means = np.mean([fit.shared_means[:, 0].mean() for fit in fits]) - true
    modes = np.mean([fit.latent[:, -2].mean() for fit in fits]) - true
    # 80 people whose slopes differ by 0.25, each known to 0.2: a standard error of 0.04.
    assert abs(means) < 0.1
    assert modes > 0.1


def test_a_run_is_averaged_over_what_its_persons_answers_leave_open():
    study = simulate_study(CROWD, SIMULATED_RULE, PEOPLE, (501, 0))
    primary, fit = compute_primary_analysis(study.answers, 3.0), fit_hierarchy(study.answers)
    assert [person.slope for person in primary.persons] == list(np.exp(fit.shared_means[:, 0]))
    assert np.all((fit.shared_errors > 0.0) & (fit.shared_errors < 0.5))
    held = [
        (-99.0 if run.lower_db is None else run.lower_db) <= true <= (99.0 if run.upper_db is None else run.upper_db)
        for run, true in zip(primary.runs, study.true_db.ravel(), strict=True)
    ]
    assert np.mean(held) >= 0.8
