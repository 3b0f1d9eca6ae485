"""An effect that crashes is left out, the rest is found all the same; without the guard the crash is an error."""

from dataclasses import replace
from types import SimpleNamespace

import pytest

from analysis.diagnosis.diagnosis_settings import DiagnosisSettings
from analysis.diagnosis.errors.hypothesis import NO_EFFECTS
from analysis.diagnosis.search.explain import explain
from analysis.diagnosis.search.guard import Guard, WorkPart
from analysis.diagnosis.search.time_budget import OutOfTimeError
from analysis.diagnosis.search.verdict import Judgement, SearchResult
from analysis.diagnosis.search_by_simulation import _ImpactSearch
from equalizer.effects.catalogue import EFFECTS


def raise_value_error(*arguments):
    raise ValueError("operands could not be broadcast together")


BROKEN = replace(EFFECTS["backlash"], starts=raise_value_error)
RUBS = EFFECTS["coulomb_friction"]


def ignore_progress(what, share):
    return None


def test_the_others_are_searched_and_the_crash_is_reported(diagnosed, make_context):
    context = replace(make_context(diagnosed.RUBBING), guard=Guard(enabled=True))
    found = explain(context, [BROKEN, RUBS], ignore_progress)
    assert found.after.newest == "coulomb_friction"
    (said,) = context.guard.sentences
    assert said.startswith("Play (backlash) was left out")
    assert "its starting values" in said and "operands could not be broadcast" in said


def test_without_the_guard_a_crash_is_an_error(diagnosed, make_context):
    with pytest.raises(ValueError, match="broadcast"):
        explain(make_context(diagnosed.RUBBING), [BROKEN, RUBS], ignore_progress)


def test_each_item_that_crashes_is_dropped_and_named_once():
    guard = Guard(enabled=True)
    effects = [EFFECTS["backlash"], RUBS, EFFECTS["backlash"]]

    def work(effect):
        return raise_value_error() if effect.name == "backlash" else effect.name

    assert list(guard.wrap(map, "its fit")(work, effects)) == ["coulomb_friction"]
    assert len(guard.crashes) == 2 and len(guard.sentences) == 1
    assert guard.run("coulomb_friction", "the final check", raise_value_error, "instead") == "instead"
    assert len(guard.sentences) == 2


def test_of_pieces_beside_each_other_the_crashed_one_is_replaced_and_said():
    pieces = [
        WorkPart("the black box", "its fit", raise_value_error, "none"),
        WorkPart("the curves", "their making", lambda: 7, 0),
    ]
    guard = Guard(enabled=True)
    assert guard.run_parts(map, pieces) == ["none", 7]
    assert len(guard.sentences) == 1 and guard.sentences[0].startswith("The black box was left out")
    with pytest.raises(ValueError, match="broadcast"):
        Guard().run_parts(map, pieces)


def test_a_crash_of_the_search_for_play_is_named_and_ends_no_diagnosis(monkeypatch):
    monkeypatch.setattr("analysis.diagnosis.search.impacts.explain_impacts", lambda *given: raise_value_error())
    guard = Guard(enabled=True)
    found = SimpleNamespace(steps=(), after=SimpleNamespace(fitted=SimpleNamespace(hypothesis=NO_EFFECTS)))
    result = SearchResult(SimpleNamespace(guard=guard, certain=()), found, Judgement("unexplained", False))
    fitting = SimpleNamespace(chosen=SimpleNamespace(floors=()))
    search = _ImpactSearch(fitting, (), DiagnosisSettings(), ignore_progress)
    assert search.explain_at_end(result) is result
    (said,) = guard.sentences
    assert said.startswith("Rattling play was left out because of a program error at its search")


def test_a_search_that_ends_for_lack_of_time_is_no_crash():
    def late():
        raise OutOfTimeError

    guard = Guard(enabled=True)
    with pytest.raises(OutOfTimeError):
        guard.run("backlash", "its fit", late, None)
    assert guard.sentences == ()
