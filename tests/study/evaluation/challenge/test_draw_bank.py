"""Which cases a bank holds, and that they hang on nothing but seed and number."""

from collections import Counter

import numpy as np
import pytest

from study.evaluation.challenge.case_settings import CaseSettings
from study.evaluation.challenge.draw_bank import (
    CASE_BLOCK,
    CASE_COUNTS,
    EXCLUSIVE_EFFECTS,
    draw_case_plan,
    generate_case,
)
from study.evaluation.challenge.draw_case import DECOYS, EFFECTS, draw_case

WHOLE_TURNS = 15


@pytest.fixture(scope="module")
def bank():
    return [draw_case_plan(50_000, number) for number in range(WHOLE_TURNS * len(CASE_BLOCK))]


def test_six_hundred_draws_hold_what_the_protocol_asks_for(bank):
    kinds = Counter(each.kind for each in bank)
    assert len(bank) == 600
    assert kinds["nothing"] >= 150
    assert kinds["outside"] + kinds["without"] >= 120
    assert Counter((each.kind, each.bank) for each in bank) == {key: WHOLE_TURNS * n for key, n in CASE_COUNTS.items()}


def test_every_effect_takes_its_turn_as_what_is_missing_and_as_what_must_not_be_named(bank):
    for kind, names in (("single", EFFECTS), ("without", EFFECTS), ("outside", DECOYS)):
        assert {each.effects[0] for each in bank if each.kind == kind and each.bank == "main"} == set(names)


def test_a_part_of_a_bank_is_a_fair_sample_of_it(bank):
    first = Counter(each.kind for each in bank[:40])
    assert first == Counter(kind for kind, _ in CASE_BLOCK)


def test_a_case_is_drawn_alike_in_banks_of_any_length(bank):
    assert [draw_case_plan(50_000, number) for number in range(7)] == bank[:7]
    assert draw_case_plan(50_001, 3) != bank[3]


def test_strengths_spread_from_invisible_to_strong(bank):
    drawn = [each.strengths[0] for each in bank if each.kind == "single"]
    assert min(drawn) < 0.05 and max(drawn) > 0.95
    assert abs(np.mean(drawn) - 0.5) < 0.05


def test_what_a_device_can_have_only_one_of_is_never_paired(bank):
    pairs = [set(each.effects) for each in bank if each.kind == "pair"]
    assert not any(pair <= row for pair in pairs for row in EXCLUSIVE_EFFECTS)


def test_most_rigs_have_one_axis_and_some_have_three(bank):
    axes = Counter(len(each.settings.axes) for each in bank)
    assert axes[1] > 300 and axes[2] > 50 and axes[3] > 60


def test_a_hand_is_concealed_from_calibrated_models_alone(bank):
    assert all(
        each.concealed == "calibrated" and 0 in each.settings.axes for each in bank if "hand_impedance" in each.effects
    )


@pytest.mark.slow
def test_a_small_rig_records_its_axes_alone():
    settings = CaseSettings((2,), 1000, 3)
    case = draw_case(50_011, ("mains_hum",), "retuned", 0.8, "bench", settings)
    assert case.recording.response.channels == ("az",)
    assert case.recording.command.samples.shape[1] == case.model.inputs == case.model.outputs == 1
    assert len(case.recording) < 20_000
    assert abs(case.truth[0].values["amplitude"]) > 0.0
    assert case.detectability > 1.0


def test_extras_change_the_readings_by_less_than_the_noise_and_are_the_same_for_the_same_seed():
    settings = CaseSettings((0,), 1000, 3, 1.0)
    bare, first, again = (
        draw_case(50_012, (), "calibrated", None, "", each).recording.position.samples
        for each in (CaseSettings((0,), 1000, 3), settings, settings)
    )
    assert np.array_equal(first, again)
    assert 0.0 < np.std(first - bare) < 1e-5


@pytest.mark.slow
def test_cases_of_a_bank_are_called_what_they_are_told():
    one = draw_case_plan(50_000, next(n for n in range(40) if draw_case_plan(50_000, n, True).bank == "main"), True)
    case = generate_case(one, "a0b1")
    assert case.recording.device == case.model.name == "a0b1"
