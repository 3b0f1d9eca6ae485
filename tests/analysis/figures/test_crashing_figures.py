"""A figure whose drawing crashes is left out and named; the others are drawn."""

import pytest

from analysis.diagnosis.search.guard import Guard
from analysis.figures.diagnosis import diagnosis_pictures as module


def raise_value_error(*arguments):
    raise ValueError("operands could not be broadcast together")


def test_the_others_are_drawn_and_the_crash_is_reported(friction_findings, friction_pictures, monkeypatch):
    monkeypatch.setattr(module, "make_held_out_picture", raise_value_error)
    guard = Guard(enabled=True)
    drawn = module.draw_diagnosis_pictures(friction_findings, guard)
    assert len(drawn) == len(friction_pictures) - 1
    (said,) = guard.sentences
    assert said.startswith("The figure of held-out errors was left out") and "broadcast" in said


def test_without_the_guard_a_crash_is_an_error(friction_findings, monkeypatch):
    monkeypatch.setattr(module, "make_held_out_picture", raise_value_error)
    with pytest.raises(ValueError, match="broadcast"):
        module.draw_diagnosis_pictures(friction_findings)
