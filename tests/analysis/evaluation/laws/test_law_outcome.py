"""Found laws are scored by structure and by what they say along fresh motion."""

from dataclasses import replace

import numpy as np
import pytest

from analysis.diagnosis.document import diagnosis_from_json
from analysis.evaluation.laws.law_error import FreshMotion, compute_law_error
from analysis.evaluation.laws.law_outcome import LawOutcome, TrueLaw
from analysis.evaluation.laws.law_score import compute_law_score
from equalizer.laws.law import parse_law

RATE_HZ = 1000.0
T = np.arange(4000) / RATE_HZ
X = 0.01 * np.sin(2 * np.pi * 1.3 * T) + 0.002 * np.sin(2 * np.pi * 11 * T)
V = np.gradient(X, 1 / RATE_HZ)
COLUMNS = {"t": T, "y": X, "vy": V, "ay": np.gradient(V, 1 / RATE_HZ), "fy": np.cos(T)}
DRAG = FreshMotion(COLUMNS, {"y": -3.0 * np.abs(V) ** 1.5 * np.sign(V)}, False, RATE_HZ)
TRUTH = TrueLaw("drag of a power", "-k |v|^a sgn v", ("y",), ("force",), (("vy",),), False, {"k": 3.0, "a": 1.5})


def make_diagnosis(expression, verdict="explained", acts_on="force", key="effects"):
    law = {"expression": expression, "variables": sorted(parse_law(expression, acts_on, "y").variables),
           "acts_on": acts_on, "axis": "y"}  # fmt: skip
    entry = {"effect": "discovered_law", "place": "mechanism", "axis": "y", "law": law}
    effect = {**entry, "share": 1.0, "probability": 0.9, "parameters": {}, "rivals": []}
    candidate = {**entry, "parameters": {}, "held_out_gain": 0.9, "share_of_black_box": 0.9, "why_not": "not proved"}
    mismatch = [{"output": "ay", "input": "fy", "band_hz": [1, 2], "amplitude": None, "state": None, "share": 1.0,
                 "p_value": 0.0}]  # fmt: skip
    errors = {"before": 2.0, "retuned": 1.0, "after": 0.1, "noise": 0.1}
    return diagnosis_from_json(
        {"verdict": verdict, "mismatch": mismatch, "effects": [effect] if key == "effects" else [], "retuned": {},
         "remainder": [], "fit": {"fit": errors, "test": errors}, "error": "free simulation",
         "next_experiment": None, "candidates": [candidate] if key == "candidates" else []}
    )  # fmt: skip


def make_outcome(expression, errors=(0.01, 0.2), **how):
    return LawOutcome(
        number=1, seed=2, kind="law", concealed=TRUTH.law, axes=("y",), truth=TRUTH, adds=10.0,
        diagnosis=make_diagnosis(expression, **how), channel_errors={"retuned": {"ay": 9.0}}, seconds=3.0,
        errors=errors,
    )  # fmt: skip


def test_the_same_law_is_right_and_near():
    exact = parse_law("-3.0*abs(vy)**1.5*sign(vy)", "force", "y")
    assert compute_law_error((exact,), DRAG) < 1e-9
    assert compute_law_error((parse_law("-3.3*abs(vy)**1.5*sign(vy)", "force", "y"),), DRAG) == pytest.approx(
        0.1, rel=1e-6
    )


def test_what_the_model_fits_itself_counts_for_nothing():
    both = parse_law("-3.0*abs(vy)**1.5*sign(vy) + 2.0*vy - 5.0*y", "force", "y")
    assert compute_law_error((both,), DRAG) < 1e-6


def test_what_a_law_remembers_began_at_rest():
    lag = np.zeros(len(T))
    for k in range(1, len(T)):  # exact for a held signal
        lag[k] = lag[k - 1] + (1 - np.exp(-1 / (RATE_HZ * 0.5))) * (COLUMNS["fy"][k - 1] - lag[k - 1])
    remembers = FreshMotion(COLUMNS, {"y": -2.0 * lag}, False, RATE_HZ)
    assert compute_law_error((parse_law("-2.0*lag(fy, 0.5)", "force", "y"),), remembers) < 5e-3


def test_another_axis_or_place_is_all_off():
    for law in (parse_law("-3.0*abs(vy)**1.5*sign(vy)", "force", "x"), parse_law("0.9*ay", "response", "y")):
        assert compute_law_error((law,), DRAG) == pytest.approx(1.0)


def test_a_law_that_is_not_finite_has_an_infinite_error():
    assert compute_law_error((parse_law("log(y)", "force", "y"),), DRAG) == float("inf")


def test_structure_asks_for_variables_axis_place_and_memory():
    right = make_outcome("-3.0*abs(vy)**1.5*sign(vy)")
    assert right.structured
    assert right.close
    assert not right.close_louder
    assert not right.is_wrong
    for wrong in ("-3.0*abs(vy)*y", "-3.0*lag(vy, 0.01)"):
        assert not make_outcome(wrong).structured
        assert make_outcome(wrong).wrongly_explained
    assert not make_outcome("0.9*fy", acts_on="command").structured


def test_an_unnamed_candidate_does_not_count_as_a_wrong_explanation():
    held = make_outcome("-3.0*abs(vy)*y", verdict="unexplained", key="candidates")
    assert not held.wrongly_explained
    assert held.is_wrong


def test_a_law_on_a_null_is_false():
    null = replace(make_outcome("1.0*vy*abs(vy)"), kind="nothing", truth=None)
    assert null.false_law
    assert null.is_wrong
    figures = {
        each.name: each for each in compute_law_score([null, make_outcome("-3.0*abs(vy)**1.5*sign(vy)")]).figures
    }
    assert figures["a law named where nothing is missing"].hits == 1
    assert figures["structure right and named"].value == 1.0
