"""A figure whose drawing crashes is left out and named; the others are drawn."""

import pytest

from analysis.diagnosis.search.guard import Guard
from analysis.figures.diagnosis import diagnosis_pictures as module


def broken(*arguments):
    raise ValueError("operands could not be broadcast together")


def test_the_others_are_drawn_and_the_crash_is_reported(friction_found, friction_pictures, monkeypatch):
    monkeypatch.setattr(module, "held_out_picture", broken)
    guard = Guard(on=True)
    drawn = module.diagnosis_pictures(friction_found, guard)
    assert len(drawn) == len(friction_pictures) - 1
    (said,) = guard.sentences
    assert said.startswith("The figure of held-out errors was left out") and "broadcast" in said


def test_without_the_guard_a_crash_is_an_error(friction_found, monkeypatch):
    monkeypatch.setattr(module, "held_out_picture", broken)
    with pytest.raises(ValueError, match="broadcast"):
        module.diagnosis_pictures(friction_found)
