"""A correction without physics beats wrong physics, and loses to right physics."""

from dataclasses import replace

import numpy as np
import pytest

from analysis.diagnosis.errors.hypothesis import NO_EFFECTS, Claim, make_claim_hypothesis
from analysis.diagnosis.errors.output_error import build_jacobian, evaluate_fit, fit
from analysis.diagnosis.result.black_box import fit_black_box
from analysis.diagnosis.result.error_table import compute_fit_errors
from analysis.diagnosis.search.compare_candidates import refine
from analysis.diagnosis.search.explain import Explanation
from equalizer.effects.catalogue import EFFECTS
from equalizer.effects.effect import PlacedEffect


@pytest.fixture(scope="module")
def nonlinear_sensor(make_context):
    """A sensor with a curve: a polynomial can say that, too."""
    effect = EFFECTS["sensor_nonlinearity"]
    values = {p.name: -2e-3 if p.name == effect.parameters[0].name else 0.0 for p in effect.parameters}
    return make_context((PlacedEffect(effect, (0,), values),)), values


def compare_with_black_box(context, name, values):
    """The black box beside one effect, fitted to the end."""
    zero = np.zeros(len(context.tuning.names))
    whole = make_claim_hypothesis(Claim(EFFECTS[name], "one", (0,)), [values])
    bare = evaluate_fit(context.measure, context.tuning, zero, NO_EFFECTS)
    known = build_jacobian(context.measure, context.tuning, zero, NO_EFFECTS)
    start = evaluate_fit(context.measure, context.tuning, zero, whole)
    after = refine(context, fit(context.measure, context.tuning, start, known, 4))
    retuned, ended = (context.with_test_score(context.score_fit(each)) for each in (bare, after))
    found = Explanation(retuned, retuned, ended, (), ())
    physics = compute_fit_errors(context.full_measure, found).test.after
    return fit_black_box(context.full_measure, retuned, len(whole.point), physics), compute_fit_errors(
        context.full_measure, found
    ).test


def test_right_physics_beats_the_black_box(nonlinear_sensor):
    context, values = nonlinear_sensor
    box, errors = compare_with_black_box(context, "sensor_nonlinearity", values)
    assert box.physics_error == errors.after == pytest.approx(errors.noise, rel=0.05)
    assert box.physics_error < box.test_error


def test_the_black_box_beats_wrong_physics(nonlinear_sensor):
    context, _ = nonlinear_sensor
    box, errors = compare_with_black_box(context, "coulomb_friction", {"level": 0.05})
    assert box.test_error < 0.9 * box.physics_error
    assert box.test_error < errors.retuned


def test_the_black_box_has_as_many_numbers_per_channel_as_physics(nonlinear_sensor):
    context, values = nonlinear_sensor
    box, _ = compare_with_black_box(context, "sensor_nonlinearity", values)
    channels = context.full_measure.records[0].measured.shape[1]
    free = sum(not p.fixed for p in EFFECTS["sensor_nonlinearity"].parameters)
    assert box.coefficient_count == free * channels


def test_where_nothing_is_missing_the_black_box_finds_nothing(make_context):
    context = make_context()
    bare = evaluate_fit(context.measure, context.tuning, np.zeros(len(context.tuning.names)), NO_EFFECTS)
    retuned = context.with_test_score(context.score_fit(bare))
    error = compute_fit_errors(context.full_measure, Explanation(retuned, retuned, retuned, (), ())).test.after
    assert fit_black_box(context.full_measure, retuned, 3, error).test_error == pytest.approx(error, rel=0.01)


def test_without_sealed_samples_there_is_nothing_to_compare_on(make_context):
    context = make_context()
    bare = evaluate_fit(context.measure, context.tuning, np.zeros(len(context.tuning.names)), NO_EFFECTS)
    retuned = context.score_fit(bare)
    assert fit_black_box(context.measure, retuned, 3, 0.1) is None
    assert fit_black_box(context.full_measure, replace(retuned), 3, None) is None


def test_the_black_box_is_judged_fairly_beyond_its_fitted_levels(nonlinear_sensor):
    """Fitted to the quietest level, tested on one six times as loud."""
    context, _ = nonlinear_sensor
    (record,) = context.full_measure.records
    quiet, _, loud, *_ = record.recording.segments
    masks = [np.zeros(len(record.fit), dtype=bool) for _ in range(2)]
    masks[0][quiet.start : quiet.stop] = masks[1][loud.start : loud.stop] = True
    whole = context.full_measure.with_records((replace(record, fit=masks[0], test=masks[1]),))
    context = replace(context, measure=whole, full_measure=whole)
    retuned = context.score_fit(evaluate_fit(whole, context.tuning, np.zeros(len(context.tuning.names)), NO_EFFECTS))
    alone = fit_black_box(whole, retuned, 0, 0.0)
    assert fit_black_box(whole, retuned, 4, 0.0).test_error < 1.5 * alone.test_error
