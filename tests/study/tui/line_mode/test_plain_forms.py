import io
import os
import pty
import threading
import time
from dataclasses import replace

import pytest

from protocols.wording.words import Words
from study.devices.clock import RealClock, VirtualClock
from study.session.views.form_views import Form, FormField, FormKind, find_missing_fields
from study.session.views.participant_views import DeviceFinding, DeviceReport
from study.tui.line_mode.line_input import LineInput
from study.tui.line_mode.plain_display import PlainDisplay

CONSENT = FormField("hands", "Are both hands well?", ("yes", "no"))
SCALE = FormField("sure", "How sure were you?", ("0", "1", "2"))
STRATEGY = FormField("strategy", "What did you go by?", needed=False)
GRIP = FormField("grip", "How was the handle held?")


def form(*fields: FormField) -> Form:
    return Form(FormKind.DEBRIEF, "A form", "Some words before it.", fields, version="3", ethics_id="EK 12/34")


def filled(typed, *fields: FormField) -> dict[str, str]:
    reply = typed.display.fill_in(form(*fields))
    assert find_missing_fields(form(*fields), reply) == ()
    return reply.answers


def test_title_introduction_version_and_approval_are_reported(typed):
    typed.type("yes")
    filled(typed, CONSENT)
    assert "A form Some words before it. Version 3. Ethics approval EK 12/34. 1 question." in typed.said
    assert "1 of 1: Are both hands well?" in typed.said


def test_without_version_or_approval_nothing_is_said_of_them(typed):
    typed.type("yes")
    typed.display.fill_in(replace(form(CONSENT), version="", ethics_id=""))
    assert "Version" not in typed.said
    assert "Ethics" not in typed.said


@pytest.mark.parametrize(("line", "answer"), [("1", "yes"), ("2", "no"), ("yes", "yes"), ("No", "no")])
def test_a_choice_is_its_number_or_its_word(typed, line, answer):
    typed.type(line)
    assert filled(typed, CONSENT) == {"hands": answer}


def test_choices_that_are_numbers_are_not_numbered_again(typed):
    typed.type("3", "1")
    assert filled(typed, SCALE) == {"sure": "1"}
    assert "'3' is none of the answers. Type 0 or 1 or 2." in typed.said


def test_b_goes_back_also_where_a_choice_begins_with_it(typed):
    blind = FormField("sight", "What did you see?", ("both", "none"))
    typed.type("1", "b", "no", "both")
    assert filled(typed, CONSENT, blind) == {"hands": "no", "sight": "both"}


def test_q_leaves_also_where_a_choice_begins_with_it(typed):
    typed.type("q")
    with pytest.raises(KeyboardInterrupt):
        typed.display.fill_in(form(FormField("noise", "How loud was it?", ("quiet", "loud"))))


@pytest.mark.parametrize("line", ["3", "0", "maybe", "", "-1", "\x1b[A"])
def test_an_answer_that_is_no_choice_is_named_and_asked_again(typed, line):
    typed.type(line, "2")
    assert filled(typed, CONSENT) == {"hands": "no"}
    assert "is none of the answers. Type yes or no, or its number, 1 to 2." in typed.said


def test_free_text_may_stay_empty_where_it_is_not_needed_only(typed):
    typed.type("", "", "with two fingers")
    assert filled(typed, STRATEGY, GRIP) == {"strategy": "", "grip": "with two fingers"}
    assert typed.said.count("An answer is needed here.") == 1


def test_a_choice_that_is_not_needed_may_be_passed_over(typed):
    typed.type("")
    assert filled(typed, replace(CONSENT, needed=False)) == {"hands": ""}


def test_control_characters_stay_out_of_free_text(typed):
    typed.type("\x1b[31mred\x07 \x00one")
    assert filled(typed, GRIP) == {"grip": "[31mred one"}


def test_a_mistake_can_be_mended_by_going_back(typed):
    typed.type("no", "b", "yes", "firmly")
    assert filled(typed, CONSENT, GRIP) == {"hands": "yes", "grip": "firmly"}
    assert typed.said.count("1 of 2: Are both hands well?") == 2


def test_back_from_the_first_question_asks_it_again(typed):
    typed.type("b", "yes")
    assert filled(typed, CONSENT) == {"hands": "yes"}


@pytest.mark.parametrize("field", [CONSENT, GRIP, STRATEGY])
def test_a_form_can_be_left(typed, field):
    typed.type("q")
    with pytest.raises(KeyboardInterrupt):
        filled(typed, field)
    typed.end()
    with pytest.raises(KeyboardInterrupt):
        filled(typed, field)


def report(fine: bool) -> DeviceReport:
    findings = (
        DeviceFinding("sample rate", "1000 Hz", fine=True, advice="never said"),
        DeviceFinding("handle", "42 mm from its place", fine, advice="Bring it back."),
    )
    return DeviceReport("omega.3", simulated=True, findings=findings)


@pytest.mark.parametrize(("line", "goes_on"), [("", True), ("c", False)])
def test_the_device_check_continues_or_is_made_again(typed, line, goes_on):
    typed.type("x", line)
    assert typed.display.device_checked(report(fine=True)) is goes_on
    assert "'x' is no answer." in typed.said


def test_each_finding_is_a_line_that_begins_with_its_verdict(typed):
    typed.type("")
    typed.display.device_checked(report(fine=False))
    lines = typed.out.getvalue().splitlines()
    assert "Device: omega.3. The device is a simulation: nothing moves." in lines
    assert "ok: sample rate, 1000 Hz" in lines
    assert "look: handle, 42 mm from its place. Bring it back." in lines
    assert "Something needs a look before you go on." in lines


def test_the_device_check_can_be_left(typed):
    typed.type("q")
    with pytest.raises(KeyboardInterrupt):
        typed.display.device_checked(report(fine=True))


def test_a_warning_is_reported_and_hinders_nothing(typed):
    typed.type("")
    late = DeviceFinding("Lateness", "too late for a real device", fine=False, advice="Close others.", warning=True)
    assert typed.display.device_checked(DeviceReport("omega.3", simulated=True, findings=(late,)))
    lines = typed.out.getvalue().splitlines()
    assert "warn: Lateness, too late for a real device. Close others." in lines
    assert "The device is ready; mind the warning above." in lines


def test_a_changed_answer_to_an_exclusion_is_read_back_before_it_counts(typed):
    typed.type("yes", "b", "no", "no", "x", "b", "yes", "no", "y")
    exclusion = replace(form(CONSENT, replace(CONSENT, key="arm")), kind=FormKind.EXCLUSION)
    assert typed.display.fill_in(exclusion).answers == {"hands": "yes", "arm": "no"}
    assert "You changed an answer. Your answers are now: 1 no, 2 no." in typed.said
    assert "You changed an answer. Your answers are now: 1 yes, 2 no." in typed.said


@pytest.mark.parametrize("line", ["O", "o", "Oui", "oui"])
def test_the_letter_and_the_word_of_a_translation_confirm_in_either_case(line):
    read, write = os.pipe()
    out, words = io.StringIO(), Words({"yes": "Oui", "line_form_confirm_letter": "O"})
    display = PlainDisplay(LineInput(read), out, VirtualClock(), words=words)
    os.write(write, f"1\nb\n2\n1\n{line}\nb\n2\n1\n".encode())
    consent = replace(form(CONSENT, replace(CONSENT, key="arm")), kind=FormKind.CONSENT)
    assert display.fill_in(consent).answers == {"hands": "no", "arm": "yes"}
    assert "is no answer" not in out.getvalue()


def test_lines_typed_ahead_of_a_refusal_answer_no_other_question():
    """They were typed for the questions that follow, not for the one that is asked again."""
    screen, keyboard = pty.openpty()
    out, replies = io.StringIO(), []
    display = PlainDisplay(LineInput(keyboard), out, RealClock())
    three = form(*(replace(CONSENT, key=key) for key in "abc"))
    person = threading.Thread(target=lambda: replies.append(display.fill_in(three)), daemon=True)
    person.start()
    wait_for(lambda: out.getvalue().endswith("Number or word: "))
    os.write(screen, b"1\nmaybe\n1\n1\n")
    wait_for(lambda: "is none of the answers" in out.getvalue())
    wait_for(lambda: out.getvalue().endswith("Number or word: "))
    assert not replies
    os.write(screen, b"2\n1\n")
    person.join(20.0)
    assert [reply.answers for reply in replies] == [{"a": "yes", "b": "no", "c": "yes"}]


def wait_for(there):
    until_s = time.monotonic() + 20.0
    while not there():
        assert time.monotonic() < until_s
        time.sleep(0.01)
