"""Tobit model of reversal means: textbook results where nothing is cut, scipy's where all else is nothing, recovery."""

import numpy as np
import pytest
from scipy.optimize import OptimizeResult
from scipy.stats import CensoredData, norm

from analysis.psychophysics import tobit
from analysis.psychophysics.tobit import compute_tobit_contrasts, fit_tobit

HZ = (5.0, 35.0, 45.0)


def simulate_people(seed: int, n: int = 10, means=(-6.0, 6.0, 8.0), person: float = 2.0, error: float = 1.5):
    random = np.random.default_rng(seed)
    return np.array(means) + person * random.standard_normal((n, 1)) + error * random.standard_normal((n, len(means)))


def test_without_a_cut_it_is_the_balanced_model_of_the_textbook():
    values = simulate_people(1)
    fit = fit_tobit(values, np.zeros_like(values, dtype=bool))
    np.testing.assert_allclose(fit.parameters[:3], values.mean(axis=0), atol=1e-3)
    centred = values - values.mean(axis=0) - values.mean(axis=1, keepdims=True) + values.mean()
    error = (centred**2).sum() / (10 * 2)  # maximum likelihood: over n (k - 1)
    assert np.exp(2 * fit.parameters[4]) == pytest.approx(error, rel=1e-3)
    variance = fit.covariance[0, 0] + fit.covariance[1, 1] - 2 * fit.covariance[0, 1]
    assert variance == pytest.approx(2 * error / 10, rel=1e-3)


def test_with_a_single_frequency_it_is_scipys_fit_of_censored_values():
    values = simulate_people(2, n=200, means=(0.0,))
    cut = values > 1.0
    values = np.minimum(values, 1.0)
    mean, sd = norm.fit(CensoredData(uncensored=values[~cut], right=values[cut]))
    fit = fit_tobit(values, cut)
    assert fit.parameters[0] == pytest.approx(mean, abs=5e-3)
    assert np.exp(2 * fit.parameters[1]) + np.exp(2 * fit.parameters[2]) == pytest.approx(sd**2, rel=5e-3)


@pytest.mark.slow
def test_differences_that_the_cap_cut_are_recovered_where_cuts_are_clean():
    found, covered = [], 0
    for seed in range(40):
        values = simulate_people(seed)
        cut = values > 7.0
        (_, contrast) = compute_tobit_contrasts(HZ, np.minimum(values, 7.0), cut, 0.95)
        found.append(contrast.difference_db)
        covered += contrast.lower_db <= 14.0 <= contrast.upper_db
    assert np.mean(found) == pytest.approx(14.0, abs=0.3)
    # As plain numbers the cut values lose far more: the negative control.
    plain = np.mean([np.diff(np.minimum(simulate_people(seed), 7.0).mean(axis=0)[[0, 2]]) for seed in range(40)])
    assert plain < 12.7
    assert covered >= 34  # of 40 at 95 %: fewer has a probability of 1 %


def test_gaps_are_left_out_and_where_it_says_nothing_it_is_silent():
    values = simulate_people(3)
    cut = values > 7.0
    whole = compute_tobit_contrasts(HZ, values, cut, 0.95)
    values[0, 1] = np.nan
    gapped = compute_tobit_contrasts(HZ, values, cut & np.isfinite(values), 0.95)
    assert [c.participants for c in gapped] == [9, 10]
    assert gapped[1].difference_db == pytest.approx(whole[1].difference_db, abs=0.6)
    assert compute_tobit_contrasts(HZ, values, np.zeros_like(cut), 0.95) == ()
    assert compute_tobit_contrasts(HZ, values[:2], cut[:2], 0.95) == ()
    none_known = cut.copy()
    none_known[:, 2] = True
    assert [contrast.frequency_hz for contrast in compute_tobit_contrasts(HZ, values, none_known, 0.95)] == [35.0]
    none_known[:, 0] = True
    assert compute_tobit_contrasts(HZ, values, none_known, 0.95) == ()


def test_people_who_differ_much_more_than_the_errors_are_integrated_exactly():
    # Five frequencies: each person's effect is known to 0.4 dB, six times more closely than the people differ.
    values = simulate_people(4, means=(-6.0, -3.0, 0.0, 3.0, 5.0), person=4.0, error=1.0)
    cut = values > 6.0
    values[0, 1] = np.nan
    parameters = np.array([-6.0, -3.0, 0.0, 3.0, 5.0, np.log(4.0), np.log(1.0)])
    effect_db = np.linspace(-40.0, 40.0, 40001)
    likelihoods = np.ones((len(values), len(effect_db)))
    for (person, column), value in np.ndenumerate(values):
        if np.isfinite(value):
            law = norm(parameters[column] + effect_db, 1.0)
            likelihoods[person] *= law.sf(value) if cut[person, column] else law.pdf(value)
    exact = np.log(np.trapezoid(likelihoods * norm(0.0, 4.0).pdf(effect_db), effect_db, axis=1)).sum()
    assert tobit._compute_log_likelihood(parameters, values, cut) == pytest.approx(exact, abs=1e-6)


def test_a_fit_that_did_not_converge_is_no_result(monkeypatch):
    values = simulate_people(3)
    assert len(compute_tobit_contrasts(HZ, values, values > 7.0, 0.95)) == 2
    monkeypatch.setattr(tobit, "minimize", lambda cost, start, **_: OptimizeResult(x=start, fun=cost(start)))
    assert compute_tobit_contrasts(HZ, values, values > 7.0, 0.95) == ()


def test_people_with_equal_thresholds_give_no_result():
    values = np.array([[-3.5, -3.1, 4.0]] * 3)
    assert compute_tobit_contrasts(HZ, values, values == 4.0, 0.95) == ()


def test_a_person_without_a_threshold_adds_no_degree_of_freedom():
    values = simulate_people(3)
    with_gaps = np.vstack([values, np.full((2, 3), np.nan)])
    expected = compute_tobit_contrasts(HZ, values, values > 7.0, 0.95)
    assert compute_tobit_contrasts(HZ, with_gaps, with_gaps > 7.0, 0.95) == expected
    assert compute_tobit_contrasts(HZ, with_gaps[8:], with_gaps[8:] > 6.0, 0.95) == ()  # two people have values


def test_a_frequency_that_is_left_out_counts_in_holms_family():
    values = simulate_people(3)
    cut = values > 7.0
    cut[:, 2] = True
    (contrast,) = compute_tobit_contrasts(HZ, values, cut, 0.95)
    assert contrast.p_holm == min(1.0, 2.0 * contrast.p)
