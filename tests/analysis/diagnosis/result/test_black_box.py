"""A correction without physics beats wrong physics, and loses to right physics."""

from dataclasses import replace

import numpy as np
import pytest

from analysis.diagnosis.errors.hypothesis import NOTHING, Claim, hypothesis_of_claim
from analysis.diagnosis.errors.output_error import evaluate_fit, fit, sensitivity
from analysis.diagnosis.result.black_box import black_box
from analysis.diagnosis.result.error_table import errors_of
from analysis.diagnosis.search.compare_candidates import refine
from analysis.diagnosis.search.explain import Explanation
from equalizer.effects.catalogue import EFFECTS
from equalizer.effects.effect import PlacedEffect


@pytest.fixture(scope="module")
def bent(arena_of):
    """A sensor with a curve: a polynomial can say that, too."""
    effect = EFFECTS["sensor_nonlinearity"]
    values = {p.name: -2e-3 if p.name == effect.parameters[0].name else 0.0 for p in effect.parameters}
    return arena_of((PlacedEffect(effect, (0,), values),)), values


def compared(context, name, values):
    """The black box beside one effect, fitted to the end."""
    zero = np.zeros(len(context.tuning.names))
    whole = hypothesis_of_claim(Claim(EFFECTS[name], "one", (0,)), [values])
    bare = evaluate_fit(context.measure, context.tuning, zero, NOTHING)
    known = sensitivity(context.measure, context.tuning, zero, NOTHING)
    start = evaluate_fit(context.measure, context.tuning, zero, whole)
    after = refine(context, fit(context.measure, context.tuning, start, known, 4))
    retuned, ended = (context.with_test_score(context.candidate(each)) for each in (bare, after))
    found = Explanation(retuned, retuned, ended, (), ())
    physics = errors_of(context.whole, found).test.after
    return black_box(context.whole, retuned, len(whole.point), physics), errors_of(context.whole, found).test


def test_right_physics_beats_the_black_box(bent):
    context, values = bent
    box, errors = compared(context, "sensor_nonlinearity", values)
    assert box.physics == errors.after == pytest.approx(errors.noise, rel=0.05)
    assert box.physics < box.test


def test_the_black_box_beats_wrong_physics(bent):
    context, _ = bent
    box, errors = compared(context, "coulomb_friction", {"level": 0.05})
    assert box.test < 0.9 * box.physics
    assert box.test < errors.retuned


def test_the_black_box_has_as_many_numbers_per_channel_as_physics(bent):
    context, values = bent
    box, _ = compared(context, "sensor_nonlinearity", values)
    channels = context.whole.records[0].measured.shape[1]
    free = sum(not p.fixed for p in EFFECTS["sensor_nonlinearity"].parameters)
    assert box.numbers == free * channels


def test_where_nothing_is_missing_the_black_box_finds_nothing(arena_of):
    context = arena_of()
    bare = evaluate_fit(context.measure, context.tuning, np.zeros(len(context.tuning.names)), NOTHING)
    retuned = context.with_test_score(context.candidate(bare))
    error = errors_of(context.whole, Explanation(retuned, retuned, retuned, (), ())).test.after
    assert black_box(context.whole, retuned, 3, error).test == pytest.approx(error, rel=0.01)


def test_without_sealed_samples_there_is_nothing_to_compare_on(arena_of):
    context = arena_of()
    bare = evaluate_fit(context.measure, context.tuning, np.zeros(len(context.tuning.names)), NOTHING)
    retuned = context.candidate(bare)
    assert black_box(context.measure, retuned, 3, 0.1) is None
    assert black_box(context.whole, replace(retuned), 3, None) is None


def test_the_black_box_is_judged_fairly_beyond_its_fitted_levels(bent):
    """Fitted to the quietest level, tested on one six times as loud."""
    context, _ = bent
    (record,) = context.whole.records
    quiet, _, loud, *_ = record.recording.segments
    masks = [np.zeros(len(record.fit), dtype=bool) for _ in range(2)]
    masks[0][quiet.start : quiet.stop] = masks[1][loud.start : loud.stop] = True
    whole = context.whole.with_records((replace(record, fit=masks[0], test=masks[1]),))
    context = replace(context, measure=whole, whole=whole)
    retuned = context.candidate(evaluate_fit(whole, context.tuning, np.zeros(len(context.tuning.names)), NOTHING))
    alone = black_box(whole, retuned, 0, 0.0)
    assert black_box(whole, retuned, 4, 0.0).test < 1.5 * alone.test
