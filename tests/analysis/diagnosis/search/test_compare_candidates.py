"""Laws that move a device nearly alike share what the model's own numbers do, and end where they end by themselves."""

from dataclasses import replace

import numpy as np
import pytest

from analysis.diagnosis.errors.hypothesis import Claim, hypothesis_of_claim
from analysis.diagnosis.errors.output_error import evaluate_fit
from analysis.diagnosis.search.compare_candidates import refine_with_sensitivity
from equalizer.effects.catalogue import EFFECTS


@pytest.fixture(scope="module")
def rubbing(diagnosed, arena_of):
    """A device with dry friction whose given damping is 2 % off; the plain law's fit, and its sensitivities."""
    model = diagnosed.device(1)
    context = arena_of(diagnosed.RUBBING, replace(model, damping=1.02 * model.damping))
    return context, *refine_with_sensitivity(context, started(context, "coulomb_friction", {"level": 0.02}))


def started(context, name, values):
    law = hypothesis_of_claim(Claim(EFFECTS[name], "one", (0,)), [values])
    return evaluate_fit(context.measure, context.tuning, np.zeros(len(context.tuning.names)), law)


def test_a_rival_started_from_shared_sensitivities_converges_to_its_own_fit(rubbing):
    context, plain, known = rubbing
    rival = started(context, "asymmetric_friction", {"level_positive": 0.02, "level_negative": 0.03})
    alone, shared = (refine_with_sensitivity(context, rival, given)[0] for given in (None, known))
    assert shared.cost == pytest.approx(alone.cost, rel=1e-3)
    assert shared.cost < 1.001 * plain.cost
    assert shared.hypothesis.point == pytest.approx(alone.hypothesis.point, abs=0.01)
    assert shared.deviations == pytest.approx(alone.deviations, abs=0.1)


def test_sensitivities_that_say_nothing_do_not_leave_the_model_as_it_was_given(rubbing):
    """Nothing moves it where they are nought; then they are taken anew."""
    context, plain, known = rubbing
    nought = replace(known, at=known.at + 1.0, columns=0 * known.columns, squares=0 * known.squares)
    found = refine_with_sensitivity(context, started(context, "coulomb_friction", {"level": 0.02}), nought)[0]
    assert found.cost == pytest.approx(plain.cost, rel=1e-3)
