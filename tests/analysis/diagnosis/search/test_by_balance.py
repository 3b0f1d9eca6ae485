"""Where named laws are fitted from, and which of several is dropped because the data leave its numbers open."""

from types import SimpleNamespace

import numpy as np
import pytest

from analysis.diagnosis.errors.hypothesis import Claim, claimed, together
from analysis.diagnosis.search import by_balance
from analysis.diagnosis.search.by_balance import VAGUE, _from_starts, _vague
from equalizer.effects.catalogue import EFFECTS

OPEN, SURE = 1.01 / VAGUE, 0.1 / VAGUE
"""Standard errors of a logarithm whose interval holds zero, and of one that is well known."""
DRY = ("coulomb_friction", {"level": 2.0})
BENDING = ("presliding_hysteresis", {"level": 0.5, "stiffness": 100.0})
RIPPLE = ("cogging", {"amplitude": 0.5, "pitch": 0.01, "phase": 0.0})


def explained(*laws):
    whole = claimed(Claim(EFFECTS["constant_force"], "one", (0,)), [{"force": 1.0}])
    for name, values in laws:
        whole = together(whole, claimed(Claim(EFFECTS[name], "one", (0,)), [values]))
    return SimpleNamespace(steps=(SimpleNamespace(fitted=SimpleNamespace(hypothesis=whole)),))


@pytest.mark.parametrize(
    ("laws", "errors", "dropped"),
    [
        ((DRY, BENDING), (SURE, SURE, SURE), None),
        ((DRY, BENDING), (SURE, SURE, OPEN), 1),
        ((BENDING,), (SURE, OPEN), None),
        ((BENDING,), (OPEN, SURE), 0),
        ((DRY, RIPPLE), (SURE, SURE, OPEN, OPEN), None),
        ((DRY, RIPPLE), (OPEN, SURE, SURE, SURE), 0),
    ],
    ids=["all known", "refinement open", "secondary open alone", "main open", "another family", "first open"],
)
def test_a_law_goes_by_its_main_number_and_a_refinement_by_any(laws, errors, dropped):
    assert _vague(explained(*laws), np.array([0.0, *errors]), 1) == dropped


def ends_at(error):
    return SimpleNamespace(standing=SimpleNamespace(test=np.array([error])))


@pytest.mark.parametrize(
    ("from_balance", "from_model", "end", "starts"),
    [(2.0, 1.0, 2.0, 1), (9.0, 1.0, 1.0, 2), (9.0, 20.0, 9.0, 2)],
    ids=["borne out at once", "ended beside the law", "neither start helps"],
)
def test_laws_are_fitted_from_the_model_s_own_numbers_where_the_balance_s_end_beside_them(
    monkeypatch, from_balance, from_model, end, starts
):
    tried = []

    def steps(arena, retuned, named, deviations):
        tried.append(deviations)
        return [ends_at(from_balance if np.any(deviations) else from_model)]

    monkeypatch.setattr(by_balance, "_steps", steps)
    monkeypatch.setattr(by_balance, "_released", lambda tuning, balances, laws: np.array([1.0, -2.0]))
    arena = SimpleNamespace(tuning=None, confirmed=lambda contender: contender)
    _, after = _from_starts(arena, (), (ends_at(8.0), ends_at(8.0)), ())
    assert after.standing.test[0] == end
    assert len(tried) == starts
