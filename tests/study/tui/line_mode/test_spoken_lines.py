"""Line mode in German and Spanish: the whole of a participant's part, with nothing English in it."""

import io
import os
from dataclasses import replace

import pytest

from protocols.trial import Phase
from protocols.wording.english import ENGLISH
from protocols.wording.words import Words
from study.devices.clock import VirtualClock
from study.session.views.form_views import FormKind, FormReply
from study.session.views.forms import make_confirmation, make_form
from study.session.views.participant_views import (
    AfterPause,
    DemoDone,
    DemoMenu,
    DeviceFinding,
    DeviceReport,
    DirectionPicture,
    Goodbye,
    HandleView,
    PauseNotice,
    PlayingNotice,
    PracticeResult,
    Progress,
    Question,
    RestNotice,
    Task,
    Welcome,
)
from study.store.formats.participant_texts import load_in_language
from study.store.formats.protocol_files import read_protocol
from study.tui.line_mode.conversation import LINE_WIDTH
from study.tui.line_mode.line_input import LineInput
from study.tui.line_mode.plain_display import PlainDisplay
from tests.study.tui.screens.test_spoken_screens import english_in

PICTURE = DirectionPicture("yz", (135.0, 45.0))
QUESTION = Question(Phase.TEST, 2, 5, 7, True, 0.0, PICTURE, progress=Progress(0.42, 12), repeats_left=0)
BEFORE = """
[[before]]
key = "age"
question = "How old are you?"
number = [18, 99]

[[before]]
key = "handedness"
question = "Which hand do you write with?"
choices = ["right", "left", "either"]
"""


@pytest.fixture(params=["de", "es"])
def spoken(request):
    text = read_protocol("direction_threshold").text.replace('language = "en"', f'language = "{request.param}"')
    return load_in_language(text.replace("before = []", "") + BEFORE, "mine.toml", None)[0]


class Told:
    def __init__(self, protocol):
        read, self._write = os.pipe()
        self.out, self.table = io.StringIO(), protocol.text.words
        notes: list = []
        self.display = PlainDisplay(
            LineInput(read), self.out, VirtualClock(), note=notes.append, words=Words(self.table)
        )

    def type(self, *lines):
        os.write(self._write, "".join(f"{line}\n" for line in lines).encode())

    def check(self, *keys):
        flat = " ".join(self.out.getvalue().split())
        assert english_in(flat, self.table) == []
        for key in keys:
            for part in filter(None, " ".join(self.table[key].split()).replace("}", "{").split("{")[::2]):
                assert part.strip() in flat, key


def test_a_prompt_fits_a_line_with_room_for_its_answer(spoken):
    prompts = [key for key in ENGLISH if key.startswith("line_") and ENGLISH[key].endswith((": ", "? "))]
    assert len(prompts) > 8
    filled = {key: Words(spoken.text.words).fill(key, {"keys": "1 oder 2", "word": "widerrufen"}) for key in prompts}
    assert {key: text for key, text in filled.items() if len(text) > LINE_WIDTH or not text.endswith(" ")} == {}


@pytest.fixture
def told(spoken):
    return Told(spoken)


def test_the_trial_part_is_in_the_language(told):
    display = told.display
    for answers in (0, 12):
        told.type("")
        display.welcome(Welcome("Titel", PICTURE, 5, 1, "simulated omega.3", False, answers))
    told.type("x", "2", "?", "n", "n", "n", "b", "b", "b", "")
    menu = DemoMenu(PICTURE, 2, 1, ((1, 1),), handle_moves=False)
    display.choose_demo(menu, lambda: True)
    assert isinstance(display.choose_demo(menu, lambda: True), DemoDone)
    display.show_playing(PlayingNotice("Direction 2", 2, 0.2, PICTURE), lambda: True)
    views = iter([HandleView(False, "Bring the handle 12 mm back to the centre.", (1.0, 1.0), 5.0),
                  HandleView(True, "", (0.0, 0.0), 5.0)])  # fmt: skip
    display.await_handle(lambda: next(views), lambda: True)
    told.type("x", "r", "?", "1")
    display.ask(QUESTION, lambda: True)
    told.type("?", "1")
    display.ask(replace(QUESTION, task=Task.INTERVAL, repeated=False), lambda: True)
    told.type("r")
    display.ask(replace(QUESTION, repeats_left=2), lambda: True)
    display.feedback(True)
    display.feedback(False)
    assert "simulated" not in told.out.getvalue()
    told.check("line_hold", "line_how", "line_keys", "not_felt", "welcome_back_n", "plan_training_runs_n",
               "runs_left_n", "line_intervals", "fact_direction", "fact_bring_back", "no_repeats", "right",
               "wrong")  # fmt: skip


def test_the_rest_of_it_too(told):
    display, table = told.display, told.table
    told.type("")
    display.practice_over(PracticeResult(False, 2, 5))
    told.type("")
    display.rest(RestNotice(12.0, 1, Progress(0.4, None)), lambda: True)
    told.type("?", "x", "n", "", "e", "au", "w", "withdraw", "w", table["withdraw_word"])
    assert display.pause(PauseNotice("the program asked for a pause", 1), lambda: True) is AfterPause.WITHDRAW
    told.type("")
    display.await_return("no answer within the time limit")
    display.goodbye(Goodbye(True, 1))
    display.goodbye(Goodbye(False, 4, "the participant left"))
    display.goodbye(Goodbye(False, 4))
    display.goodbye(Goodbye(False, 0, outcome="excluded"))
    display.trouble("Hands off: the reference plays for 20 s.")
    told.type("x", "c", "")
    display.device_checked(DeviceReport("simulated omega.3", True, (DeviceFinding("Handle", "0.1 mm", True),)))
    assert "simulated" not in told.out.getvalue()
    told.check("for_experimenter", "practice_hard", "runs_left_1", "line_pause_keys", "withdraw_all", "nothing_erased",
               "line_noted", "saved_1", "void_title", "line_finished_1", "excluded", "excluded_kept",
               "fact_hands_off", "check_ready")  # fmt: skip


def test_forms_are_answered_in_the_language_by_word_letter_or_number(told, spoken):
    display, table = told.display, told.table
    consent = make_form(spoken, FormKind.CONSENT)
    yes, no = table["yes"], table["no"]
    told.type("xyz", no, "b", yes, yes[0], "1", yes, table["line_form_confirm_letter"])
    reply = display.fill_in(consent)
    assert set(reply.answers.values()) == {yes}
    left, right = table["quoted"].split("{text}")
    check = make_confirmation(consent, FormReply({**reply.answers, "statement_1": no}), Words(table))
    assert f"{left}{table['protocol_told']}{right}" in check.introduction
    assert left != ENGLISH["quoted"][0]
    questions = make_form(spoken, FormKind.QUESTIONNAIRE)
    told.type("abc", "7", "34,5", "")
    assert display.fill_in(questions).answers == {"age": "34,5", "handedness": ""}
    told.check("consent_intro", "line_form_n", "line_form_changed", "line_form_none_numbered", "form_number",
               "questions_intro", "protocol_age", "protocol_told")  # fmt: skip
