import pytest

from study.session.views.participant_views import AfterPause, PauseNotice
from study.session.watching.requests import NoteAsked
from study.tui.screens.note import NoteScreen
from study.tui.screens.pause import PauseScreen

NOTICE = PauseNotice("asked for a pause", 37)


@pytest.fixture
def paused(on_stage):
    def pause(*keys, leaving=False):
        seen = []

        async def story(stage):
            await stage.press(*keys)
            seen.append(stage.words)

        return on_stage(PauseScreen(NOTICE, leaving), story), seen[0]

    return pause


def test_enter_continues(paused):
    assert paused("enter")[0] == [AfterPause.CONTINUE_SITTING]


@pytest.mark.slow
def test_leaving_is_the_second_choice_and_the_first_after_a_request_to_leave(paused):
    assert paused("down", "enter")[0] == [AfterPause.END_SITTING]
    assert paused("enter", leaving=True)[0] == [AfterPause.END_SITTING]


def test_reason_and_answers_are_reported(paused):
    words = paused()[1]
    assert "Reason: asked for a pause. 37 answers are on the disk." in words


@pytest.mark.slow
def test_the_consent_is_taken_back_by_a_whole_word_only(paused):
    assert paused("down", "down", "enter", *"Withdraw", "enter")[0] == [AfterPause.WITHDRAW]
    heard, words = paused("down", "down", "enter", *"yes", "enter")
    assert heard == []
    assert "That is not the word withdraw. Nothing is erased." in words
    heard, words = paused("down", "down", "enter", "escape")
    assert heard == [] and "Nothing is erased." in words


@pytest.mark.slow
def test_a_note_goes_to_the_session_and_the_pause_continues(paused):
    heard, words = paused("n", *"cold hand", "ctrl+s")
    assert heard == [NoteAsked("participant", "cold hand", adverse=False)]
    assert "It goes into the log." in words


@pytest.mark.slow
def test_something_that_happened_is_an_adverse_event_by_whom_one_says(paused):
    heard, _ = paused("e", *"pain", "tab", "2", "enter", "enter", "enter")
    assert heard == [NoteAsked("experimenter", "pain", adverse=True)]


@pytest.mark.slow
def test_a_note_that_turns_out_to_be_an_adverse_event_can_say_so(paused):
    assert paused("n", *"pain", "tab", "tab", "y", "tab", "enter")[0] == [
        NoteAsked("participant", "pain", adverse=True)
    ]


def test_a_note_that_is_left_writes_nothing(paused):
    heard, words = paused("n", *"abc", "escape")
    assert heard == [] and "Nothing was written." in words


def test_an_empty_note_is_refused_with_what_to_do(paused):
    heard, words = paused("n", "space", "ctrl+s")
    assert heard == []
    assert "Nothing is written yet. Type what happened, or press Esc to leave." in words


def test_a_note_too_long_for_the_log_says_by_how_much(on_stage):
    async def story(stage):
        stage.app.screen.query_one("TextArea").text = "x" * 501
        await stage.press("ctrl+s")
        assert "At most 500 characters fit; these are 501." in stage.words

    assert on_stage(NoteScreen(), story) == []


def test_a_note_without_an_author_asks_who_writes_it(on_stage):
    async def story(stage):
        await stage.press(*"abc", "ctrl+s")
        assert "Please choose who writes this." in stage.words

    assert on_stage(NoteScreen(writer="program"), story) == []


def test_lines_of_a_note_become_one(on_stage):
    async def story(stage):
        await stage.press(*"ab", "enter", *"cd", "ctrl+s")

    assert on_stage(NoteScreen(), story) == [NoteAsked("participant", "ab cd")]
