from dataclasses import replace

import pytest

from analysis.reports.methods_text import compose_methods_text
from protocols.definition.staircase_rule import StepChange


def methods_paragraphs(protocol):
    return " ".join(compose_methods_text(protocol))


def test_the_numbers_of_the_protocol_are_in_the_text(protocol):
    text = methods_paragraphs(protocol)
    for words in (
        "at 135° (1) and 45° (2) in the yz plane",
        "5, 15, 25, 35 and 45 Hz",
        "began at 1 N, rose after every wrong answer and fell after 3 right answers in a row",
        "4 dB for 3 reversals and 1 dB for 10 reversals",
        "never passed 3 N",
        "ended at once with reversal 13.",
        "converges where 79.4 % are right",
        "the last 10 reversals",
        "without a limit of time, and was not told",
        "at least 60 s apart",
        "There was no training.",
    ):
        assert words in text


@pytest.mark.parametrize(
    ("part", "change", "words"),
    [
        ("staircase", {"step_change": StepChange.AT_REVERSAL}, "already moved by the next step"),
        ("staircase", {"trial_limit": 200}, "or without a threshold after 200 trials."),
        ("staircase", {"initial_one_up_one_down": True}, "Until the first reversal it moved after every answer."),
        ("staircase", {"up_after_wrong": 2}, "rose after 2 wrong answers in a row"),
        ("staircase", {"down_after_right": 1}, "fell after every right answer"),
        ("trial", {"time_limit_s": 8.0}, "within 8 s"),
        ("trial", {"feedback": "after_answer"}, "and was told whether"),
        ("stimulus", {"onset_polarity": "positive"}, "always to the same side"),
        (
            "stimulus",
            {"quantity": "delivered_acceleration"},
            "Stimuli were accelerations of the handle, equal for both directions",
        ),
        ("schedule", {"order": "williams"}, "balanced for carry-over"),
        ("schedule", {"directions": "balanced"}, "equally often within every 8 trials"),
        ("training", {"frequencies_hz": (5.0,)}, "Training came first (5 Hz) and enters no result."),
        ("rests", {"after_run_s": 0.0}, "in random order. "),
        ("demo", {"level_n": 2.0}, "labelled, for 2 s each at 2 N."),
        ("gate", {"radius_mm": 10.0}, "began with the handle within 10 mm of its place."),
        ("practice", {"frequencies_hz": (15.0,)}, "2 N, with feedback, until 4 of the last 5 answers were right or 10"),
        ("practice", {"frequencies_hz": (15.0,), "feedback": "none"}, "2 N, without feedback, until"),
        ("catch", {"one_in": 20}, "One in 20 trials of a test run, at a place drawn by lot, was a catch trial at 3 N."),
        ("detection", {"frequencies_hz": (35.0, 45.0)}, "35 and 45 Hz: one of two intervals of 1.5 s, 0.5 s apart,"),
    ],
)
def test_another_choice_gives_another_sentence(protocol, part, change, words):
    changed = replace(protocol, **{part: replace(getattr(protocol, part), **change)})
    assert words in methods_paragraphs(changed)
    assert words not in methods_paragraphs(protocol)


def test_two_wrong_answers_for_a_step_claim_no_convergence(protocol):
    changed = replace(protocol, staircase=replace(protocol.staircase, up_after_wrong=2))
    assert "converges" not in methods_paragraphs(changed)
