"""Errors against the noise, and how fast a model moves away by itself."""

from dataclasses import replace

import numpy as np
import pytest

from analysis.diagnosis.data.recorded_conditions import is_unstable_within
from analysis.diagnosis.errors.fit_score import FitScore, compute_fit_score, compute_residual_rms, compute_signal_rms
from equalizer.plant.linear_simulation import compute_growth_rate
from equalizer.plant.mechanical_model import MechanicalModel


def make_model(damping, stiffness):
    one = [[1.0]]
    return MechanicalModel("one", "position", one, [[damping]], [[stiffness]], one, one)


def test_noise_alone_stands_at_one(make_context):
    measure = make_context().full_measure
    score = compute_fit_score(measure, measure.residuals(make_context().tuning.model, ()))
    for part in (score.fit, score.choose, score.test):
        assert part == pytest.approx(np.ones(2), abs=0.06)


def test_only_its_own_samples_count_for_each_part(make_context):
    measure = make_context().full_measure
    (left,) = measure.residuals(make_context().tuning.model, ())
    (record,) = measure.records
    louder = left.copy()
    louder[record.test] *= 10
    one, other = compute_fit_score(measure, (left,)), compute_fit_score(measure, (louder,))
    assert np.array_equal(one.fit, other.fit) and np.array_equal(one.choose, other.choose)
    assert other.test == pytest.approx(10 * one.test)


def test_where_nothing_was_sealed_nothing_is_reported(make_context):
    measure = make_context().measure
    assert np.isnan(compute_fit_score(measure, measure.residuals(make_context().tuning.model, ())).test).all()


def test_recordings_count_by_their_samples():
    n = 500
    long, short = np.ones((n, 1)), np.full((10, 1), 3.0)
    masks = [np.ones(n, dtype=bool), np.ones(10, dtype=bool)]
    assert compute_residual_rms((long, short), masks) == pytest.approx(np.sqrt((n + 90) / (n + 10)))


@pytest.mark.parametrize(("quantity", "expected"), [("velocity", np.hypot(5.0, 1.0)), ("position", 1.0)])
def test_takes_at_their_own_speeds_differ_by_their_means_and_encoders_begin_anywhere(make_context, quantity, expected):
    (record,) = make_context().full_measure.records
    n, channels = record.measured.shape
    response = replace(record.recording.response, quantity=quantity)
    ripple = np.tile(np.where(np.arange(n) % 2, 1.0, -1.0)[:, None], (1, channels))
    takes = tuple(
        replace(record, measured=level + ripple, recording=replace(record.recording, response=response, position=None))
        for level in (5.0, -5.0)
    )
    masks = [np.arange(n) < 200 for _ in takes]
    assert compute_signal_rms(takes, masks) == pytest.approx(np.full(channels, expected))


def test_the_worst_channel_and_the_mean_of_all():
    score = FitScore(np.array([1.0, np.e]), np.array([1.0, 1.0]), np.array([9.0, 9.0]))
    assert score.worst_channel == pytest.approx(np.e)
    assert score.mean_log_error == pytest.approx(0.5)


@pytest.mark.parametrize(
    ("damping", "stiffness", "grows"), [(2.0, 100.0, False), (0.0, 0.0, False), (-2.0, 100.0, True)]
)
def test_a_model_that_gains_energy_runs_away(damping, stiffness, grows):
    assert is_unstable_within(make_model(damping, stiffness), 10.0) == grows


def test_the_rate_is_that_of_the_slowest_motion():
    assert compute_growth_rate(make_model(2.0, 100.0)) == pytest.approx(-1.0)
    assert compute_growth_rate(make_model(0.0, -4.0)) == pytest.approx(2.0)
