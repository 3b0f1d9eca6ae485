from dataclasses import replace
from types import SimpleNamespace

import pytest

from analysis.diagnosis.limits import FALSE_DISCOVERY_RATE
from analysis.diagnosis.localisation.entry_point import EntryPoint, EntryScore, SensorComparison
from analysis.diagnosis.localisation.localisation import find_state_dependences
from analysis.diagnosis.localisation.localisation_words import (
    write_entry_sentence,
    write_localisation_sentences,
    write_states_sentence,
)
from analysis.diagnosis.localisation.mismatch_rows import StateMismatch
from analysis.diagnosis.localisation.state_regions import StateRegion

ALONG_X = EntryScore("a force along x", "mechanism", "x", 1.0, 0.9, 1.0, ())
ALONG_ALL = EntryScore("forces along several axes", "mechanism", None, 0.9, 0.95, 1.0, ())
OF_AX = EntryScore("an error of the ax channel", "sensor", "ax", 1.6, 0.4, 1e-9, ())
MOVED, AT_SENSOR = SensorComparison("motion", 50.0, 49.0), SensorComparison("response sensor", 50.0, 0.1)
RUBS = StateRegion("velocity", "v", "sign", 0.86, 1.0, 1e-5, "by the sign of v")


@pytest.mark.slow
def test_friction_is_a_force_along_its_axis_tied_to_the_sign_of_velocity(friction_findings):
    local = friction_findings.localisation
    assert local.entry.ranking[0].name == "a force along x"
    assert local.entry.sensor_comparison.verdict == "motion"
    for stage in ("before", "retuned"):
        worst = local.states[stage][0]
        assert (worst.input, worst.region.description) == ("fx", "by the sign of v")
        assert worst.region.p_value <= FALSE_DISCOVERY_RATE
    assert not local.states["after"]


def test_rows_of_the_document_say_the_state(friction_findings):
    assert "by the sign of v" in {row.state for row in friction_findings.diagnosis.mismatch}


def test_distortion_is_told_per_channel_and_level(friction_findings):
    cells = friction_findings.localisation.distortions.cells
    assert {cell.amplitude for cell in cells} == {0.5, 1.5, 3.0}
    assert {"ax", "x"} <= {cell.output for cell in cells}


def test_the_entry_is_reported_with_what_comes_next():
    assert write_entry_sentence(EntryPoint((ALONG_X, ALONG_ALL, OF_AX), MOVED, 1200)) == (
        "The mismatch after re-tuning enters as a force along x (the drive, the mechanism and a hand all act there, "
        "and these channels do not distinguish them): this explains 90 % of it, at the median of 1200 frequency "
        "lines; the next best entry is an error of the ax channel with 40 % (p < 0.0001 for its being equally good). "
        "The position shows the mismatch, too: the motion of the device itself differs from the model, and no sensor "
        "of the response is at fault."
    )
    as_good = replace(OF_AX, p_value=0.3)
    assert "would explain it about equally well (40 %, p = 0.3000)" in write_entry_sentence(
        EntryPoint((ALONG_X, as_good), None, 60)
    )


def test_a_sensor_is_said_to_be_one():
    said = write_entry_sentence(EntryPoint((OF_AX, ALONG_X), AT_SENSOR, 60))
    assert said.startswith(
        "The mismatch after re-tuning enters as an error of the ax channel: this explains 40 % of it"
    )
    assert said.endswith("the fault is in the measurement of the response, not in the motion of the device.")


@pytest.mark.parametrize("entry", [None, EntryPoint((), None, 0), EntryPoint((ALONG_X,), None, 39)])
def test_where_too_little_is_there_no_entry_is_reported(entry):
    assert write_entry_sentence(entry) == ""


def test_an_error_of_the_position_is_not_sought_in_a_response_of_the_same_name(monkeypatch):
    monkeypatch.setattr("analysis.diagnosis.localisation.localisation.find_error_states", lambda *of: (RUBS,))
    measure = SimpleNamespace(records=(SimpleNamespace(recording=None),))
    for is_position_error, states in ((True, ()), (False, (RUBS,))):
        best = replace(OF_AX, axis="x", is_position_error=is_position_error)
        entry = EntryPoint((best, ALONG_X), None, 60)
        cells = (SimpleNamespace(beyond_noise=True, part=0, in_noise=9.0),)
        assert find_state_dependences(measure, None, None, cells, entry, (SimpleNamespace(),)) == states


def test_states_are_those_of_the_recording_with_the_largest_error_in_either_order(monkeypatch):
    monkeypatch.setattr("analysis.diagnosis.localisation.localisation.find_force_states", lambda *of: of[:2])
    small, large = ((SimpleNamespace(recording=name), f"evidence of {name}", name) for name in ("small", "large"))
    for order in ((small, large), (large, small)):
        measure = SimpleNamespace(records=tuple(record for record, _, _ in order))
        cells = tuple(
            SimpleNamespace(beyond_noise=True, part=part, in_noise={"small": 2.0, "large": 9.0}[name])
            for part, (_, _, name) in enumerate(order)
        )
        evidence = tuple(of_record for _, of_record, _ in order)
        tuning = SimpleNamespace(model=SimpleNamespace(system=None))
        assert find_state_dependences(measure, tuning, None, cells, None, evidence) == ("evidence of large", "large")


def test_states_are_said_with_share_and_chance():
    assert write_states_sentence([StateMismatch("ax", "fx", (1.0, 256.0), RUBS)]) == (
        "The mismatch depends on a state: ax, driven by fx, by the sign of v (86 % of the mismatch, p < 0.0001)."
    )
    assert write_states_sentence([]) == ""


def test_the_page_gets_both_sentences(friction_findings):
    entry, states = write_localisation_sentences(friction_findings.localisation)
    assert entry.startswith("The mismatch after re-tuning enters as a force along x")
    assert "by the sign of v" in states
