from dataclasses import replace

import numpy as np

from analysis.diagnosis.errors.hypothesis import NO_EFFECTS
from analysis.diagnosis.errors.output_error import evaluate_fit
from analysis.diagnosis.result.black_box import fit_black_box
from equalizer.effects.catalogue import EFFECTS
from equalizer.effects.effect import PlacedEffect


def test_commands_that_are_never_played_together_where_it_is_fitted_do_not_break_it(make_context):
    context = make_context((PlacedEffect(EFFECTS["coulomb_friction"], (0,), {"level": 0.2}),), axes=2)
    record = context.full_measure.records[0]
    command = record.command.copy()
    command[record.test] += 1.0
    whole = context.full_measure.with_records((replace(record, command=command),))
    bare = evaluate_fit(context.measure, context.tuning, np.zeros(len(context.tuning.names)), NO_EFFECTS)
    box = fit_black_box(whole, context.with_test_score(context.score_fit(bare)), 2, 0.02)
    assert np.isfinite(box.test_error)
    assert box.test_error < 10
