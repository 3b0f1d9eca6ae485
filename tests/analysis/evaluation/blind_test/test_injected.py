"""What counts as right for a fault that was injected."""

import pytest

from analysis.evaluation.blind_test.injected_faults import (
    LEAST_DETECTABLE_CHANGE,
    make_tallies,
    read_outcome,
    score_injections,
)
from analysis.reports.injected_section import classify_injection, format_rate, make_injected_section

PLACES = {"sensor_lag": "sensor", "sensor_gain": "sensor", "amplifier_lag": "actuator", "added_mass": "mechanism"}


def make_outcome(effects=("sensor_lag",), named=("sensor_lag",), rivals=(), change=3.0):
    label = {
        "recording": "rig",
        "effects": list(effects),
        "places": [PLACES[effect] for effect in effects],
        "strength": 0.5,
        "values": {"bandwidth": 80.0},
        "change": change,
    }
    said = [
        {"effect": each, "place": PLACES[each], "rivals": [{"effect": other, "inseparable": True} for other in rivals]}
        for each in named
    ]
    return read_outcome(label, {"seconds": 2.0, "diagnosis": {"verdict": "partly_explained", "effects": said}})


def figures_by_name(outcomes):
    return {injected_figure.name: injected_figure for injected_figure in score_injections(outcomes)}


@pytest.mark.parametrize(
    ("named", "rivals", "judged"),
    [
        (("sensor_lag",), (), "named"),
        (("amplifier_lag",), ("sensor_lag",), "in class"),
        (("sensor_gain",), (), "other name, right place"),
        (("added_mass",), (), "wrong"),
        (("sensor_lag", "added_mass"), (), "wrong"),
        ((), (), "unnamed"),
    ],
)
def test_what_is_said_of_a_fault_is_judged_by_its_worst_name(named, rivals, judged):
    assert make_outcome(named=named, rivals=rivals).answer_class == judged


def test_of_two_faults_one_may_be_left_open():
    both = ("added_mass", "sensor_gain")
    assert make_outcome(both, ("added_mass",)).answer_class == "named"
    assert make_outcome(both, ("amplifier_lag",)).answer_class == "wrong"
    assert classify_injection(make_outcome(both)) == "two at once"


def test_nothing_injected_is_right_where_nothing_is_named():
    assert make_outcome(effects=(), named=()).is_correct
    assert make_outcome(effects=()).answer_class == "wrong"


def test_an_answer_that_failed_is_no_right_answer():
    label = {"recording": "rig", "effects": [], "places": [], "strength": 0.0, "values": {}, "change": 1.0}
    failed = read_outcome(label, {"failed": "it broke"})
    assert failed.verdict == "failed"
    assert not failed.is_correct


def test_only_detectable_faults_are_asked_for():
    outcomes = [
        make_outcome(),
        make_outcome(named=()),
        make_outcome(change=0.5 / LEAST_DETECTABLE_CHANGE),
        make_outcome(named=(), change=0.99 * LEAST_DETECTABLE_CHANGE),
        make_outcome(change=None),
        make_outcome((), ()),
    ]
    figures = figures_by_name(outcomes)
    asked = figures["detectable faults named, or in the class"]
    assert (asked.hits, asked.of) == (2, 3)
    assert figures["nothing injected, nothing named"].hits == 1
    assert format_rate(figures_by_name([])["nothing injected, nothing named"]) == "none was drawn"
    (row,) = make_tallies(outcomes, classify_injection)
    assert (row.name, row.fault_count, row.counts) == ("sensor_lag", 5, (2, 0, 0, 0, 1))


def test_every_miss_and_every_wrong_story_is_listed():
    said = [
        make_outcome(),
        make_outcome(named=("sensor_gain",)),
        make_outcome((), ("added_mass",)),
        make_outcome(named=(), change=1.0),
    ]
    listed = make_injected_section(said).tables[-1]
    assert [row[1] for row in listed.rows] == ["sensor_lag", "nothing"]
