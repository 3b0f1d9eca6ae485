"""Laws that move a device nearly alike share what the model's own parameters do, and end where they end by
themselves."""

from dataclasses import replace

import numpy as np
import pytest

from analysis.diagnosis.errors.hypothesis import Claim, make_claim_hypothesis
from analysis.diagnosis.errors.output_error import evaluate_fit, fit
from analysis.diagnosis.search.compare_candidates import (
    FULL_FIT_STEPS,
    _fit_full_record,
    _polish,
    refine_with_sensitivity,
)
from analysis.diagnosis.search.search_context import compute_sensitivity
from equalizer.effects.catalogue import EFFECTS
from equalizer.effects.effect import PlacedEffect


@pytest.fixture(scope="module")
def friction_fit(diagnosed, make_context):
    """A device with dry friction whose given damping is 2 % off; the plain law's fit, and its sensitivities."""
    model = diagnosed.device(1)
    context = make_context(diagnosed.RUBBING, replace(model, damping=1.02 * model.damping))
    plain, known = refine_with_sensitivity(context, start_fit(context, "coulomb_friction", {"level": 0.02}))
    return context, _polish(context, [plain])[0], known


def refine_law(context, law, known):
    return _polish(context, [refine_with_sensitivity(context, law, known)[0]])[0]


def start_fit(context, name, values):
    law = make_claim_hypothesis(Claim(EFFECTS[name], "one", (0,)), [values])
    return evaluate_fit(context.measure, context.tuning, np.zeros(len(context.tuning.names)), law)


@pytest.mark.slow
def test_a_rival_started_from_shared_sensitivities_converges_to_its_own_fit(friction_fit):
    context, plain, known = friction_fit
    rival = start_fit(context, "asymmetric_friction", {"level_positive": 0.02, "level_negative": 0.03})
    alone, shared = (refine_law(context, rival, given) for given in (None, known))
    assert shared.cost == pytest.approx(alone.cost, rel=1e-3)
    assert shared.cost < 1.001 * plain.cost
    assert shared.hypothesis.point == pytest.approx(alone.hypothesis.point, abs=0.01)
    assert shared.deviations == pytest.approx(alone.deviations, abs=0.1)


@pytest.mark.slow
def test_sensitivities_that_say_nothing_do_not_leave_the_model_as_it_was_given(friction_fit):
    """Nothing moves it where they are nought; then they are taken anew."""
    context, plain, known = friction_fit
    nought = replace(known, base_deviations=known.base_deviations + 1.0, columns=0 * known.columns, gram=0 * known.gram)
    found = refine_law(context, start_fit(context, "coulomb_friction", {"level": 0.02}), nought)
    assert found.cost == pytest.approx(plain.cost, rel=1e-3)


def test_a_fit_to_all_periods_goes_on_while_it_gains(make_context):
    """From a start far off, the first steps leave more than further ones do."""
    context = make_context((PlacedEffect(EFFECTS["hardening_stiffness"], (0,), {"k3": 2e7}),))
    start = start_fit(context, "hardening_stiffness", {"k3": 4e6})
    known = compute_sensitivity(context, start.deviations, start.hypothesis)
    two = fit(context.measure, context.tuning, start, known, FULL_FIT_STEPS)
    whole = _fit_full_record(context, start, known)
    assert whole.cost < 0.7 * two.cost
