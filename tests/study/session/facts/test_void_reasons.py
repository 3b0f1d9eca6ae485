"""Which void trials the computer is to blame for, and what people read of them."""

from dataclasses import replace

import pytest

from study.devices.device import Fault, Health
from study.session.facts.void_reasons import (
    SCREEN_DELAYED_BY_LOAD,
    SCREEN_UNRESPONSIVE,
    describe_busy_voids,
    explain_many_voids,
    explain_silent_screen,
    is_computer_busy,
)
from study.tui.trial_words import describe_void_trial
from study.workflows.trial.judge_trial import judge_trial

MISSED = "12.0 % of the 1 kHz ticks were missed"


@pytest.mark.parametrize(
    ("engine_late_s", "load", "why"),
    [
        (0.0, 0.1, SCREEN_UNRESPONSIVE),
        (0.0, None, SCREEN_UNRESPONSIVE),
        (0.0, 2.0, SCREEN_DELAYED_BY_LOAD),
        (0.3, 0.1, SCREEN_DELAYED_BY_LOAD),
        (0.3, None, SCREEN_DELAYED_BY_LOAD),
    ],
)
def test_a_silent_screen_is_put_down_to_the_computer_only_where_something_shows_it(engine_late_s, load, why):
    assert explain_silent_screen(engine_late_s, load) == why


def test_what_a_busy_computer_does_to_a_trial_is_counted_as_that(small_protocol):
    late = judge_trial(Health(Fault.NONE, 1000, 120, 0, 0, 0, 0, 1.0), small_protocol.measurement, True)
    assert late.void_reason == MISSED
    for reason in (SCREEN_DELAYED_BY_LOAD, Fault.STALLED.value, late.void_reason):
        assert is_computer_busy(reason)
        words = describe_void_trial(reason)
        assert words.startswith("The computer was too busy for a moment")
        assert words.endswith("This was not your fault, and the trial is repeated.")
    for reason in (SCREEN_UNRESPONSIVE, Fault.LOST.value, "the participant asked for it again", ""):
        assert not is_computer_busy(reason)


@pytest.mark.parametrize(
    ("missed", "late", "latest_s", "spoiled"),
    [
        (20, 0, 0.005, ""),
        (21, 0, 0.005, "2.1 % of the 1 kHz ticks were missed"),
        (0, 20, 0.005, ""),
        (0, 21, 0.005, "2.1 % of the 1 kHz ticks were late or missed"),
        (11, 10, 0.005, "2.1 % of the 1 kHz ticks were late or missed"),
        (0, 1, 0.010, ""),
        (0, 1, 0.0112, "11.2 ms late was the latest 1 kHz tick"),
    ],
)
def test_above_a_limit_of_the_protocol_late_ticks_make_a_trial_void(small_protocol, missed, late, latest_s, spoiled):
    health = Health(Fault.NONE, 1000, missed, 0, 0, 0, 0, 1.0, late_ticks=late, latest_s=latest_s)
    limited = replace(small_protocol.measurement, late_ticks_limit=0.02, longest_late_ms=10.0)
    found = judge_trial(health, limited, True)
    assert found.void_reason == spoiled
    assert is_computer_busy(found.void_reason) is bool(spoiled)


def test_late_ticks_are_judged_as_they_were_at_the_answer(small_protocol):
    at_answer = Health(Fault.NONE, 1000, 0, 0, 0, 0, 0, 1.0, late_ticks=1, latest_s=0.002)
    released = replace(at_answer, ticks=1100, late_ticks=50, latest_s=0.05)
    limited = replace(small_protocol.measurement, late_ticks_limit=0.02, longest_late_ms=10.0)
    assert judge_trial(released, limited, True, at_answer).void_reason == ""
    assert judge_trial(released, limited, True).void_reason != ""


def test_a_protocol_that_limits_no_late_ticks_counts_such_trials(small_protocol):
    late = Health(Fault.NONE, 1000, 0, 0, 0, 0, 0, 1.0, late_ticks=900, latest_s=0.09)
    assert judge_trial(late, small_protocol.measurement, True).void_reason == ""


def test_a_silent_screen_is_not_the_participants_fault_either():
    words = describe_void_trial(SCREEN_UNRESPONSIVE)
    assert "it was stopped, or the computer was too busy" in words
    assert words.endswith("This was not your fault, and the trial is repeated.")
    assert describe_void_trial("the handle was let go") == "It is void: the handle was let go."


def test_three_void_trials_end_a_sitting_for_the_reason_that_they_had():
    busy = "the computer is too busy: 3 trials in a row were void because of it, not because of the participant"
    assert (
        explain_many_voids((SCREEN_DELAYED_BY_LOAD, SCREEN_DELAYED_BY_LOAD, MISSED))
        == f"{busy} (the last because {MISSED})"
    )
    assert explain_many_voids((SCREEN_DELAYED_BY_LOAD, MISSED, Fault.STALLED.value)).startswith(busy)
    mixed = explain_many_voids((SCREEN_DELAYED_BY_LOAD, SCREEN_DELAYED_BY_LOAD, SCREEN_UNRESPONSIVE))
    assert mixed.endswith("the last because the screen gave no sign of life: the computer may be too busy")
    away = explain_many_voids((SCREEN_DELAYED_BY_LOAD, MISSED, "no answer within the time limit"))
    assert away == "3 trials in a row were void, the last because no answer within the time limit"


def test_the_experimenter_reads_how_many():
    assert describe_busy_voids(1).startswith(
        "The computer was too busy: 1 trial was void because of it in this sitting"
    )
    assert "3 trials were void" in describe_busy_voids(3)
    assert describe_busy_voids(3).endswith("hapteq doctor measures how late it is.")
