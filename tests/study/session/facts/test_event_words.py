"""The log in words: a sentence for each kind of fact, without health and without open directions."""

import typing
from datetime import timedelta, timezone

import pytest

from protocols.trial import Phase
from study.session.facts.event_words import describe_log
from study.session.facts.events import (
    AnswerGiven,
    DemoFinished,
    DemoPlayed,
    DeviceChecked,
    DeviceFacts,
    Event,
    FormFilled,
    MaskingPlayed,
    NoteTaken,
    OnsetPulsed,
    PauseTaken,
    PlaceTaken,
    ProbeMeasured,
    ProbePlayed,
    RestTaken,
    SessionClosed,
    SessionInterrupted,
    SessionOpened,
    SessionResumed,
    TrialMeasured,
    TrialPresented,
    TrialSpoiled,
)

UTC = "2026-05-04T09:30:12.000+00:00"
DEVICE = DeviceFacts("omega.3", simulated=False, sample_rate_hz=1000.0)
OPENED = SessionOpened(
    UTC, "hapteq-session", 1, "P01_001", "P01", 0, None, "", "0" * 64, False, 7, DEVICE, "none", {"hapteq": "1"}
)
PRESENTED = TrialPresented(UTC, 1, 4, 0, Phase.TEST, 35.0, 0.0, 1.0, 2, 45.0, 1)
ANSWER = AnswerGiven(UTC, 1, 4, 0, 2, 1.234)
MEASURED = TrialMeasured(UTC, 1, 4, 0, "ok", delivered_mps2=2.5, off_axis_mps2=0.25)

SENTENCES = [
    (OPENED, "Session P01_001 began: P01, a person, on omega.3."),
    (PRESENTED, "Run 2, trial 5 (test): 1.000 N at 35 Hz."),
    (ANSWER, "Answer 2 after 1.23 s."),
    (MEASURED, "Delivered 2.50 m/s² along the direction, 0.25 m/s² across."),
    (
        TrialMeasured(UTC, 1, 4, 0, "unmeasured", flags=("its recording was lost",)),
        "Counts, without a measurement. Its recording was lost.",
    ),
    (
        TrialSpoiled(UTC, 1, 4, 0, "the handle was let go"),
        "Run 2, trial 5 is void and is presented again: the handle was let go.",
    ),
    (RestTaken(UTC, 2, 0, 60.0), "Rested 60 s before trial 1 of run 3."),
    (
        SessionInterrupted(UTC, "the participant left"),
        "The sitting ended: the participant left.",
    ),
    (
        SessionResumed(UTC, DEVICE, {}, mended='{"utc'),
        "The session was continued, on omega.3. An incomplete last line, left by a crash, was removed.",
    ),
    (SessionClosed(UTC, "completed"), "The session is finished."),
    (
        SessionClosed(UTC, "refused"),
        "The session is over: consent was not given. The person does not take part.",
    ),
    (PlaceTaken(UTC, 6), "Takes part, as number 7 of this protocol."),
    (
        DeviceChecked(UTC, True, ("handle 2 mm from its place",)),
        "The device was checked: fine. Handle 2 mm from its place.",
    ),
    (DemoPlayed(UTC, 5.0, 2.0, 1, 135.0, 2.0), "Demonstration: direction 1 at 5 Hz, 2 N, for 2 s."),
    (DemoFinished(UTC), "The demonstration is over."),
    (PauseTaken(UTC, "participant", 185.0), "A pause of 3 min, asked for by the participant."),
    (
        MaskingPlayed(UTC, True, "Headphones", -20.0, 40.0, 8000.0, 3),
        "Masking noise on Headphones: -20 dB, 40 to 8000 Hz, seed 3.",
    ),
    (MaskingPlayed(UTC, False, "Headphones", -20.0, 40.0, 8000.0, 3), "The masking noise was stopped."),
    (
        MaskingPlayed(UTC, False, "Headphones", -20.0, 40.0, 8000.0, 3, "unplugged"),
        "The masking noise fell silent: Unplugged.",
    ),
    (OnsetPulsed(UTC, 0, 1, 0, "DTR of COM3", 2.5), "Onset pulse, DTR of COM3: was sent."),
    (OnsetPulsed(UTC, 0, 1, 0, "DTR", None, "gone"), "Onset pulse, DTR: was lost: gone."),
    (ProbePlayed(UTC, 4, "hand", 0.4), "Probe with the hand on the handle, number 5: 0.4 N."),
    (ProbeMeasured(UTC, 4, 1.6, trouble="3 ticks late"), "The probe, number 5, was not kept: 3 ticks late."),
    (ProbeMeasured(UTC, 4, 1.6, "recordings/probe-004.h5"), "The probe, number 5, was kept."),
    (NoteTaken(UTC, "experimenter", "door\nslammed"), "Note by the experimenter: door slammed"),
    (NoteTaken(UTC, "experimenter", "numb thumb", adverse=True), "Adverse event by the experimenter: numb thumb"),
]


def describe_event(event: Event) -> str:
    """The only line of a log, without its time."""
    return describe_log((event,))[-1].removeprefix("09:30:12  ")


@pytest.mark.parametrize(("event", "sentence"), SENTENCES, ids=lambda value: getattr(value, "event", ""))
def test_each_fact_is_a_plain_sentence(event, sentence):
    assert describe_event(event) == sentence


def test_no_kind_of_fact_is_without_words():
    tried = {type(event) for event, _ in SENTENCES} | {FormFilled}
    assert tried == set(typing.get_args(Event))


@pytest.mark.parametrize(
    ("form", "passed", "answers", "expected"),
    [
        ("consent", True, {"statement_1": "yes"}, "Consent was given, version 1 (ethics approval E7)."),
        ("consent", False, {}, "Consent was not given, version 1 (ethics approval E7)."),
        ("exclusion", False, {"question_2": "yes"}, "the sitting cannot go on"),
        ("exclusion", True, {}, "nothing speaks against taking part"),
        ("setup", True, {"hearing": "ear plugs", "hand_hidden": "yes"}, "Hearing: ear plugs; hand hidden: yes."),
        ("debrief", True, {"discomfort": "a numb thumb"}, "1 question answered; the answers stay in the log file."),
    ],
)
def test_forms_are_told_by_their_outcome(form, passed, answers, expected):
    assert expected in describe_event(FormFilled(UTC, form, "1", "E7", passed, answers))


@pytest.mark.parametrize("form", ["exclusion", "debrief"])
def test_nothing_about_health_is_in_the_words(form):
    said = describe_event(FormFilled(UTC, form, "1", "", False, {"question_1": "white fingers"}))
    assert "white fingers" not in said
    assert "question_1" not in said


def test_the_direction_is_reported_once_the_answer_counts():
    (_, presented, answer, _) = describe_log((PRESENTED, ANSWER, MEASURED))
    assert presented == "09:30:12  Run 2, trial 5 (test): direction 2, 1.000 N at 35 Hz."
    assert answer == "09:30:12  Answer 2 after 1.23 s: right."


VOID = TrialSpoiled(UTC, 1, 4, 0, "no answer")


@pytest.mark.parametrize("end", [(), (VOID,), (ANSWER,), (ANSWER, VOID)])
def test_the_direction_of_a_trial_that_does_not_count_is_told_nowhere(end):
    """It may come again, or was told to be void: the same stimulus is played again."""
    words = " ".join(describe_log((PRESENTED, *end)))
    assert "direction" not in words
    assert "right" not in words
    assert "wrong" not in words
    assert "45" not in words


def test_another_attempt_of_the_same_trial_keeps_its_own_direction_hidden():
    again = TrialPresented(UTC, 1, 4, 1, Phase.TEST, 35.0, 0.0, 1.0, 1, 135.0, 1)
    words = describe_log((PRESENTED, ANSWER, MEASURED, again))
    assert "direction 2" in words[1]
    assert words[4] == "09:30:12  Run 2, trial 5 (test, attempt 2): 1.000 N at 35 Hz."


def test_a_detection_trial_has_an_interval():
    shown = TrialPresented(UTC, 1, 4, 0, Phase.DETECTION, 35.0, 0.0, 1.0, 2, 45.0, 1)
    assert "interval 2" in describe_log((shown, ANSWER, MEASURED))[1]


def test_each_day_has_a_line_of_its_own():
    later = SessionClosed("2026-05-05T10:00:00+00:00", "completed")
    dates = [line for line in describe_log((OPENED, MEASURED, later)) if "times are UTC" in line]
    assert dates == ["2026-05-04 (times are UTC +00:00)", "2026-05-05 (times are UTC +00:00)"]


def test_times_are_those_of_the_place_and_a_change_of_its_clock_has_a_line_of_its_own():
    def zone(time):
        """Clocks go back at 01:00 UTC."""
        return time.astimezone(timezone(timedelta(hours=2 if time.hour < 1 else 1)))

    told = [RestTaken(f"2026-10-25T{utc}:00.000+00:00", 0, 0, 60.0) for utc in ("00:30", "01:30")]
    lines = describe_log(told, zone)
    assert [line[:8] for line in lines] == ["2026-10-", "02:30:00", "2026-10-", "02:30:00"]
    assert [lines[0][11:], lines[2][11:]] == ["(times are UTC +02:00)", "(times are UTC +01:00)"]


def test_a_time_that_cannot_be_converted_stays_as_it_is():
    def none(time):
        raise OverflowError

    assert describe_log([DemoFinished(UTC)], none) == (f"{UTC}  The demonstration is over.",)


def test_control_characters_of_a_note_do_not_reach_the_terminal():
    assert "\x1b" not in describe_event(NoteTaken(UTC, "participant", "a\x1b[2Jb"))


def test_a_line_break_in_a_reason_begins_no_line():
    assert "\n" not in describe_event(SessionInterrupted(UTC, "the power failed\nP02 is fine"))
