"""What counts as right for a fault that was injected."""

import pytest

from analysis.proof.injected import DETECTABLE, injected_figures, outcome_of
from analysis.reports.injected_section import figure_text, injected_section


def outcome(effect="sensor_lag", named=("sensor_lag",), rivals=(), adds=3.0):
    label = {"recording": "rig", "effect": effect, "strength": 0.5, "values": {"bandwidth": 80.0}, "adds": adds}
    effects = [{"effect": one, "rivals": [{"effect": other, "inseparable": True} for other in rivals]} for one in named]
    return outcome_of(label, {"seconds": 2.0, "diagnosis": {"verdict": "explained", "effects": effects}})


def by_name(outcomes):
    return {one.name: one for one in injected_figures(outcomes)}


def test_a_fault_is_found_where_it_is_in_the_returned_set():
    assert outcome().right
    assert outcome(named=("amplifier_lag",), rivals=("sensor_lag",)).right
    assert outcome(named=("coulomb_friction", "sensor_lag")).right
    assert not outcome(named=("sensor_gain",)).right


def test_nothing_injected_is_right_where_nothing_is_named():
    assert outcome(effect="", named=()).right
    assert not outcome(effect="").right


def test_an_answer_that_failed_is_wrong():
    label = {"recording": "rig", "effect": "", "strength": 0.0, "values": {}, "adds": 1.0}
    failed = outcome_of(label, {"failed": "it broke"})
    assert failed.verdict == "failed" and not failed.right


def test_only_detectable_faults_are_asked_for():
    figures = by_name([outcome(), outcome(named=()), outcome(named=(), adds=0.99 * DETECTABLE), outcome("", ())])
    asked = figures["detectable faults named (in the returned set)"]
    assert (asked.hits, asked.of) == (1, 2)
    assert (asked.low, asked.high) == pytest.approx((0.0945, 0.9055), abs=1e-3)
    assert figures["nothing injected, something named"].hits == 0
    assert figures["sensor_lag"].of == 2
    assert figure_text(by_name([])["nothing injected, something named"]) == "none was drawn"


def test_every_miss_is_listed():
    section = injected_section([outcome(), outcome(named=("sensor_gain",)), outcome("", ("mains_hum",))])
    assert [row[1] for row in section.tables[1].rows] == ["sensor_lag", "nothing"]
