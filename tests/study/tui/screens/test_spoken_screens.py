"""Every screen of a participant in German and Spanish: nothing English on it, and nothing cut off at 80 x 24.

The oracle is the table itself: a table that notes what was asked of it says what must be on the screen.
"""

import re
import tomllib
from dataclasses import replace
from functools import cache
from importlib.resources import files

import pytest

from protocols.document.loading import protocol_from_values
from protocols.wording.english import ENGLISH
from protocols.wording.translation import translate_protocol
from protocols.wording.words import Words
from study.session.facts.void_reasons import SCREEN_DELAYED_BY_LOAD, SCREEN_UNRESPONSIVE
from study.session.views.form_views import FormKind
from study.session.views.forms import make_form
from study.session.views.participant_views import (
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
    RestNotice,
    Welcome,
)
from study.store.formats.protocol_files import read_protocol
from study.tui.app import outcomes
from study.tui.drawing.direction_picture import describe_direction
from study.tui.screens.await_return import AwaitReturnScreen
from study.tui.screens.confirm_withdrawal import ConfirmWithdrawal
from study.tui.screens.demo import DemoScreen
from study.tui.screens.device_check import DeviceCheckScreen
from study.tui.screens.form import FormScreen
from study.tui.screens.goodbye import GoodbyeScreen
from study.tui.screens.handle import HandleScreen
from study.tui.screens.help import HelpScreen
from study.tui.screens.instructions import InstructionsScreen
from study.tui.screens.note import NoteScreen
from study.tui.screens.outcome import OutcomeScreen
from study.tui.screens.pause import PauseScreen
from study.tui.screens.playing import PlayingScreen
from study.tui.screens.practice_over import PracticeOverScreen
from study.tui.screens.preparing import PreparingScreen
from study.tui.screens.rest import RestScreen
from study.tui.screens.trial import TrialScreen
from tests.slow_instances import slow_after, slow_rows
from tests.study.tui.screens.test_snapshots import INTERVAL, PICTURE, QUESTION

LANGUAGES = ("de", "es")


def in_turn(values) -> list:
    """Rows of a value and a language: of each value a language in turn; the others have the marker `slow`."""
    turns = (LANGUAGES, LANGUAGES[::-1])
    rows = [[(value, code) for code in turns[number % 2]] for number, value in enumerate(values)]
    return [each for quick, *others in rows for each in (quick, *slow_rows(*others))]


SHOWN_LATER = ("help_", "form_more", "key_")
"""Pages of their own; and the footer, see `check_footer`."""


class Noting(dict):
    """A table that notes which texts were asked for."""

    def __init__(self, table):
        super().__init__(table)
        self.asked = set()

    def get(self, key, default=None):
        self.asked.add(key)
        return super().get(key, default)


@cache
def table_of(code):
    return tomllib.loads(files("protocols").joinpath("wording", f"{code}.toml").read_text("utf-8"))


def armed(words, question):
    screen = TrialScreen(words=words)
    screen.arm(question)
    return screen


SCREENS = {
    "trial": lambda words: armed(words, QUESTION),
    "trial again": lambda words: armed(words, replace(QUESTION, repeated=True)),
    "interval": lambda words: armed(words, INTERVAL),
    "wait": lambda words: TrialScreen(words=words),
    "demo": lambda words: DemoScreen(DemoMenu(PICTURE, 5, 2, ((1, 1), (2, 1)), handle_moves=False), words=words),
    "playing": lambda words: PlayingScreen(PlayingNotice("Direction 2", 2, 2.0, PICTURE), words),
    "playing interval": lambda words: PlayingScreen(PlayingNotice("Interval 1", 1, 2.0, None), words),
    "gap": lambda words: PlayingScreen(PlayingNotice("", 0, 2.0, None), words),
    "probe": lambda words: PlayingScreen(
        PlayingNotice("Nothing to answer: the device is measured", 0, 2.0, None), words
    ),
    "handle": lambda words: HandleScreen(
        HandleView(False, "Bring the handle 12 mm back to the centre.", (11.0, 5.0), 8.0), words
    ),
    "practice": lambda words: PracticeOverScreen(PracticeResult(False, 6, 10), words),
    "rest": lambda words: RestScreen(RestNotice(75.0, 3, Progress(0.4, 14)), words),
    "pause": lambda words: PauseScreen(PauseNotice("the experimenter asked for a pause", 37), words=words),
    "void": lambda words: AwaitReturnScreen("no answer within the time limit", words),
    "void, busy": lambda words: AwaitReturnScreen(SCREEN_DELAYED_BY_LOAD, words),
    "void, silent": lambda words: AwaitReturnScreen(SCREEN_UNRESPONSIVE, words),
    "left": lambda words: GoodbyeScreen(Goodbye(False, 37, "the participant left"), words),
    "finished": lambda words: GoodbyeScreen(Goodbye(True, 1), words),
    "excluded": lambda words: GoodbyeScreen(Goodbye(False, 0, "", "excluded"), words),
    "refused": lambda words: GoodbyeScreen(Goodbye(False, 0, "", "refused"), words),
    "note": lambda words: NoteScreen(adverse=True, words=words),
    "withdrawal": lambda words: ConfirmWithdrawal(words),
    "preparing": lambda words: PreparingScreen(words["preparing_device"], words=words),
    "device": lambda words: DeviceCheckScreen(
        DeviceReport("simulated omega.3", True, (DeviceFinding("Handle", "0.1 mm", True),)), words
    ),
    "instructions": lambda words: InstructionsScreen(Welcome("Titel", PICTURE, 5, 1, "omega.3", True, 0), words=words),
}


def parts(text):
    """What of a text does not depend on what is filled in, in words."""
    return [" ".join(part.split()) for part in re.split(r"\{\w+\}", text) if len(part.split()) > 1]


ENGLISH_PARTS = {part for key, text in ENGLISH.items() if not key.startswith("help_") for part in parts(text)}


def english_in(words, table):
    """English texts of two or more words on a screen; what is the same in the other language is not English."""
    own = " ".join(" ".join(text.split()) for text in table.values())
    return [part for part in ENGLISH_PARTS if part in words and part not in own]


@pytest.mark.parametrize(("name", "code"), in_turn(SCREENS))
def test_a_screen_says_all_of_it_and_nothing_in_english(on_stage, name, code):
    table = table_of(code)
    noting = Noting(table)
    screen = SCREENS[name](Words(noting))

    async def story(stage):
        words = re.sub(r"\s+", " ", re.sub(r"[▏▎▍▌▋▊▉█▁▔▕▊]", " ", stage.words))
        assert english_in(words, table) == []
        asked = [key for key in noting.asked if not key.startswith(SHOWN_LATER)]
        assert asked
        cut = [(key, part) for key in asked for part in parts(table[key]) if part not in words]
        assert cut == [], stage.text
        check_footer(screen, stage, table)

    on_stage(screen, story)


def check_footer(screen, stage, table):
    """It fits and is not English."""
    footer = stage.text.splitlines()[-1]
    shown = [active.binding for active in screen.active_bindings.values() if active.binding.show]
    assert [b.description for b in shown if b.description and b.description not in footer] == []
    english = {ENGLISH[key]: text for key, text in table.items() if key.startswith("key_")}
    left = {b.description for b in shown} & {word for word, text in english.items() if word != text}
    assert left - {text for text in english.values()} == set()


@pytest.mark.parametrize(("plane", "code"), in_turn(["yz", "zx", "xy"]))
def test_directions_are_told_to_the_last_word(on_stage, plane, code):
    words = Words(table_of(code))
    picture = DirectionPicture(plane, (135.0, 45.0))

    async def story(stage):
        lines = [line.ljust(80) for line in stage.text.splitlines()]
        for number, half in ((1, slice(0, 40)), (2, slice(40, 80))):
            inside = " ".join(re.sub(r"[│┃⠀-⣿]", " ", line[half]) for line in lines)
            assert describe_direction(picture, number, words) in " ".join(inside.split())

    on_stage(armed(words, replace(QUESTION, picture=picture)), story)


@pytest.mark.parametrize("code", slow_after(1, LANGUAGES))
def test_what_a_stop_tells_is_in_the_language(on_stage, code):
    words = Words(table_of(code))

    async def story(stage):
        assert english_in(stage.words, words.protocol_texts) == []
        assert words["key_quit"] in stage.words
        assert words["key_leave"] in stage.text.splitlines()[-1]
        stage.app.screen.show_outcome(outcomes.make_stop_unanswered_outcome(words))
        await stage.pilot.pause()
        assert english_in(stage.words, words.protocol_texts) == []
        assert words["stop_do_now"].split(":")[0] in re.sub(r"[\s│┃]+", " ", stage.words)

    on_stage(OutcomeScreen(outcomes.make_stop_sent_outcome(words)), story)


@pytest.mark.parametrize(("kind", "code"), in_turn([kind for kind in FormKind if kind is not FormKind.HANDLE]))
def test_a_form_is_in_the_language_from_top_to_bottom(on_stage, kind, code):
    table = table_of(code)
    before = [
        {"key": "age", "question": "How old are you?", "number": [18.0, 99.0]},
        {"key": "tired", "question": "How tired are you?", "scale": [1, 5], "ends": ["not at all", "very"]},
    ]
    values = {**tomllib.loads(read_protocol("direction_threshold").text), "before": before}
    form = make_form(protocol_from_values(translate_protocol(values, table, code), "mine"), kind)

    async def story(stage):
        for _ in range(len(form.fields) * 6 + 1):
            assert english_in(stage.words, table) == []
            if stage.app.screen.entry.field is None:
                break
            await stage.press("down")
        assert stage.app.screen.entry.field is None
        assert table["key_continue"] in stage.words

    on_stage(FormScreen(form, Words(table)), story)


@pytest.mark.parametrize("code", slow_after(1, LANGUAGES))
def test_help_is_in_the_language_too(on_stage, code):
    table = table_of(code)
    screen = RestScreen(RestNotice(75.0, 3), Words(table))
    assert table["help_rest"] == screen.HELP
    assert len(re.findall(r"^- ", screen.HELP, re.MULTILINE)) == len(re.findall(r"^- ", ENGLISH["help_rest"], re.M))

    async def story(stage):
        assert table["help_title"] in stage.words
        assert table["key_back"] in stage.text.splitlines()[-1]

    on_stage(HelpScreen(screen.HELP, Words(table)), story)


@pytest.mark.parametrize(("size", "code"), in_turn([(80, 24), (60, 20)]))
def test_why_a_note_is_refused_is_shown_to_its_last_word(on_stage, code, size):
    words = Words(table_of(code))

    async def story(stage):
        await stage.press("ctrl+s")
        await stage.reads(words["note_empty"])

    on_stage(NoteScreen(adverse=True, words=words), story, size)


@pytest.mark.parametrize("code", slow_after(1, LANGUAGES))
def test_the_word_that_confirms_a_withdrawal_is_that_of_the_language(on_stage, code):
    word = table_of(code)["withdraw_word"]

    async def english(stage):
        await stage.press(*"withdraw", "enter")
        assert stage.heard == []

    on_stage(ConfirmWithdrawal(Words(table_of(code))), english)

    async def own(stage):
        await stage.press(*word, "enter")

    assert on_stage(ConfirmWithdrawal(Words(table_of(code))), own) == [True]
