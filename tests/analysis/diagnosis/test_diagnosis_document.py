import copy
import json

import pytest

from analysis.diagnosis.document import (
    DiagnosisError,
    Estimate,
    FoundLaw,
    NamedEffect,
    build_diagnosis_schema,
    diagnosis_from_json,
    diagnosis_to_json,
)
from analysis.diagnosis.result.candidate_wording import DeviceWording
from analysis.diagnosis.result.wording import describe_effect
from equalizer.signals.unit_system import LINEAR, ROTATIONAL, UnitSystem

ERRORS = {"before": 0.4, "retuned": 0.3, "after": 0.011, "noise": 0.01}
DOCUMENT = {
    "verdict": "explained",
    "mismatch": [
        {"output": "ax", "input": "fx", "band_hz": [0.5, 6.0], "amplitude": 1.5, "state": "near v = 0",
         "share": 0.8, "p_value": 1e-9}
    ],
    "effects": [
        {"effect": "coulomb_friction", "place": "mechanism", "axis": "x", "share": 0.9, "probability": 0.97,
         "parameters": {"level": {"value": 0.21, "unit": "N", "ci95": [0.2, 0.22]}},
         "rivals": [
             {"effect": "stribeck_friction", "probability": 0.03, "inseparable": False, "why_not": "no slow motion"},
             {"effect": "body_in_a_box", "probability": 0.02, "inseparable": True, "why_not": "the same at all levels"},
         ]}
    ],
    "retuned": {"mass_kg": 0.29},
    "remainder": [],
    "fit": {"fit": ERRORS, "test": {**ERRORS, "noise": None}},
    "error": "free simulation",
    "next_experiment": {"command": "hapteq record slow", "splits": ["a", "b"], "why": "slow motion tells them apart"},
}  # fmt: skip


def change_document(place, value):
    document = copy.deepcopy(DOCUMENT)
    *way, last = place
    inner = document
    for step in way:
        inner = inner[step]
    inner[last] = value
    return document


def test_a_diagnosis_goes_to_json_and_back():
    diagnosis = diagnosis_from_json(DOCUMENT)
    assert json.loads(json.dumps(diagnosis_to_json(diagnosis))) == DOCUMENT
    assert diagnosis_from_json(diagnosis_to_json(diagnosis)) == diagnosis


def test_the_schema_says_that_the_retuned_parameters_are_changes():
    assert build_diagnosis_schema()["properties"]["retuned"]["description"].startswith("Changes of the model's own")


def test_the_returned_set_is_the_effect_and_its_inseparable_rivals():
    assert diagnosis_from_json(DOCUMENT).returned_set == ("coulomb_friction", "body_in_a_box")


def test_an_effect_outside_the_vocabulary_may_be_named():
    assert (
        diagnosis_from_json(change_document(("effects", 0, "effect"), "joint_slip")).effects[0].effect == "joint_slip"
    )


@pytest.mark.parametrize("error", ["free simulation", "windows of 1 s", "windows of 0.5 s", "predicted force"])
def test_the_ways_to_measure_errors(error):
    assert diagnosis_from_json(change_document(("error",), error)).error == error


@pytest.mark.parametrize(
    ("place", "value", "problem"),
    [
        (("verdict",), "maybe", "verdict: Input should be 'no_mismatch', 'parameters', 'explained'"),
        (("verdict",), "parameters", "the verdict 'parameters' requires an empty list of effects"),
        (("verdict",), "partly_explained", "the verdict 'partly_explained' requires a remainder"),
        (("effects",), [], "the verdict 'explained' requires one effect or more"),
        (("mismatch", 0, "share"), 1.2, "mismatch.0.share: Input should be less than or equal to 1"),
        (("mismatch", 0, "p_value"), -0.1, "mismatch.0.p_value: Input should be greater than or equal to 0"),
        (("mismatch", 0, "band_hz"), [6.0, 0.5], "mismatch.0: band_hz must rise from 0 or more, not [6.0, 0.5]"),
        (("mismatch", 0, "amplitude"), "1.5", "mismatch.0.amplitude: Input should be a valid number"),
        (("effects", 0, "probability"), 97.0, "effects.0.probability: Input should be less than or equal to 1"),
        (("effects", 0, "effect"), "Coulomb friction", "effects.0.effect: String should match pattern"),
        (("effects", 0, "place"), "sensor", "effects.0: coulomb_friction belongs to the mechanism, not to the sensor"),
        (("effects", 0, "parameters"), {}, "effects.0: coulomb_friction lacks its main parameter, level (N)"),
        (("effects", 0, "parameters", "level", "ci95"), [0.3, 0.2], "effects.0.parameters.level: ci95 must rise"),
        (("effects", 0, "parameters", "level", "unit"), "", "effects.0.parameters.level.unit: String should have at"),
        (("fit", "fit", "after"), -1.0, "fit.fit.after: Input should be greater than or equal to 0"),
        (("error",), "by eye", "error: String should match pattern"),
        (("sure",), True, "sure: this key is unknown"),
    ],
)
def test_what_is_no_diagnosis_is_refused_by_its_place(place, value, problem):
    with pytest.raises(DiagnosisError) as refused:
        diagnosis_from_json(change_document(place, value))
    assert any(found.startswith(problem) for found in refused.value.problems), refused.value.problems


def test_a_key_that_is_left_out_is_missing():
    document = {key: value for key, value in DOCUMENT.items() if key != "fit"}
    with pytest.raises(DiagnosisError, match="fit: this is missing"):
        diagnosis_from_json(document)


def test_an_unexplained_mismatch_is_there():
    document = {**DOCUMENT, "verdict": "unexplained", "effects": [], "mismatch": []}
    with pytest.raises(DiagnosisError, match="the verdict 'unexplained' requires a mismatch"):
        diagnosis_from_json(document)


def test_the_schema_asks_for_every_key_of_the_contract():
    assert set(build_diagnosis_schema()["required"]) == set(DOCUMENT)


LAW = {"expression": "-4.1*abs(vy)**1.5*sign(vy)", "variables": ["vy"], "acts_on": "force", "axis": "y"}
DISCOVERED = {
    **DOCUMENT["effects"][0], "effect": "discovered_law", "axis": "y", "law": LAW,
    "parameters": {"p0": {"value": 4.1, "unit": "N s^1.5/m^1.5", "ci95": [3.9, 4.3]}},
}  # fmt: skip


def test_a_law_without_a_name_goes_to_json_and_back():
    document = change_document(("effects",), [DISCOVERED])
    assert diagnosis_to_json(diagnosis_from_json(document)) == document


@pytest.mark.parametrize(
    ("effect", "problem"),
    [
        ({**DISCOVERED, "effect": "cogging"}, "cogging is an effect of the catalogue, so it must not have a law"),
        ({**DISCOVERED, "law": None}, "discovered_law lacks its law"),
        (
            {**DISCOVERED, "law": {**LAW, "expression": "-4.1*vy.T"}},
            "'vy.T' at character 6 is not part of the language",
        ),
        ({**DISCOVERED, "law": {**LAW, "variables": ["vx"]}}, "needs vy, but its variables list others"),
        ({**DISCOVERED, "law": {**LAW, "acts_on": "motion"}}, "Input should be 'force', 'command' or 'response'"),
    ],
)
def test_a_law_that_contradicts_itself_is_refused(effect, problem):
    with pytest.raises(DiagnosisError) as error:
        diagnosis_from_json(change_document(("effects",), [effect]))
    assert problem in str(error.value)


def test_a_law_has_the_unit_of_the_force_or_torque_that_it_adds():
    law = FoundLaw("-0.2*vx", ("vx",), "force", "x")
    effect = NamedEffect("discovered_law", "mechanism", "x", 1.0, 1.0, {"p0": Estimate(0.2, "1")}, law=law)
    systems = {LINEAR: "*vx N.", ROTATIONAL: "*vx N m.", UnitSystem("A", "rad"): "*vx A.", UnitSystem("1"): "*vx."}
    for system, end in systems.items():
        assert describe_effect(effect, device=DeviceWording(False, system)).endswith(end)
    assert describe_effect(effect).endswith("*vx.")
