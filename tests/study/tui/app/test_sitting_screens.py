"""The screens of a sitting while a note is typed above them."""

import asyncio

import pytest
from textual.app import App
from textual.command import CommandPalette
from textual.widgets import Input, TextArea

from protocols.wording.words import ENGLISH_WORDS
from study.session.views.participant_views import HandleView, PauseNotice, PlayingNotice
from study.tui.app.app import HapteqApp
from study.tui.app.sitting_screens import SittingScreens
from study.tui.app.start_options import StartOptions
from study.tui.engine.from_engine import CloseRequest, DisplayCall, PreparationStarted, ScreenRequest
from study.tui.engine.to_engine import Reply
from study.tui.keys.answer_keys import DIGITS
from study.tui.screens.confirm_withdrawal import ConfirmWithdrawal
from study.tui.screens.note import NoteScreen
from study.tui.screens.pause import PauseScreen
from study.tui.screens.playing import PlayingScreen
from study.tui.screens.preparing import PreparingScreen
from study.tui.trial_replies import PAUSE
from tests.study.tui.screens.trial.questions import QUESTION

AWAY = HandleView(False, "Bring the handle 12 mm back to the centre.", (11.0, 5.0), 8.0)
PLAYING = PlayingNotice("Interval 1", 1, 2.0, None)
WAITS = {DisplayCall.AWAIT_HANDLE: AWAY, DisplayCall.SHOW_PLAYING: PLAYING}
STIMULI = {DisplayCall.SHOW_PLAYING: PLAYING, DisplayCall.ASK: QUESTION}


@pytest.mark.parametrize("stimulus", STIMULI)
@pytest.mark.parametrize("call", WAITS)
def test_while_a_note_is_typed_no_trial_is_answered_or_played_on(call, stimulus):
    async def story():
        app, sent = App(), []
        async with app.run_test() as pilot:
            sitting = SittingScreens(app, sent.append, DIGITS, lambda: None)
            await sitting.handle_message(ScreenRequest(1, call, WAITS[call]))
            await app.push_screen(NoteScreen())
            await pilot.press(*"pain in ")
            await sitting.handle_message(CloseRequest(1))
            await sitting.handle_message(ScreenRequest(2, stimulus, STIMULI[stimulus]))
            assert sent == [Reply(2, PAUSE)]
            await sitting.handle_message(ScreenRequest(3, DisplayCall.PAUSE, PauseNotice(PAUSE.reason, 4)))
            await sitting.release_held_messages()
            await pilot.press(*"2 fingers")
            assert app.screen.query_one(TextArea).text == "pain in 2 fingers"
            assert sent == [Reply(2, PAUSE)]
            await pilot.press("escape")
            await sitting.release_held_messages()
            assert isinstance(app.screen, PauseScreen)
            await pilot.pause(0.05)

    asyncio.run(story())


def test_what_was_held_back_comes_before_later_messages_and_not_after_the_sitting():
    async def story():
        app, sent = App(), []
        async with app.run_test() as pilot:
            sitting = SittingScreens(app, sent.append, DIGITS, lambda: None)
            await sitting.show_preparing("ready")
            await app.push_screen(NoteScreen())
            await sitting.handle_message(ScreenRequest(1, DisplayCall.AWAIT_HANDLE, AWAY))
            await pilot.press("escape")
            await sitting.handle_message(ScreenRequest(2, DisplayCall.SHOW_PLAYING, PLAYING))
            assert [type(screen) for screen in app.screen_stack[-1:]] == [PlayingScreen]
            await app.push_screen(NoteScreen())
            await sitting.handle_message(ScreenRequest(3, DisplayCall.AWAIT_HANDLE, AWAY))
            await sitting.handle_message(PreparationStarted("report"))
            await sitting.release_held_messages()
            assert isinstance(app.screen, PreparingScreen)
            assert sent == []

    asyncio.run(story())


def test_held_messages_are_released_in_turn_with_the_messages_of_the_engine(tmp_path, monkeypatch):
    """Not while a message is handled: two screens that are opened at once would replace each other."""
    monkeypatch.setattr(HapteqApp, "_start_engine", lambda _: None)
    released_by = []

    class Sitting:
        words = ENGLISH_WORDS

        async def release_held_messages(self):
            released_by.append(asyncio.current_task())

    async def story():
        app, handled_by = HapteqApp(StartOptions(str(tmp_path), "simulated")), []
        async with app.run_test() as pilot:
            app._sitting = Sitting()
            app.call_later(lambda: handled_by.append(asyncio.current_task()))
            await app.push_screen(NoteScreen())
            await pilot.press("escape")
            await pilot.pause()
            app._sitting = None
        assert len(released_by) == 2
        assert {*released_by} == {*handled_by}

    asyncio.run(story())


def test_what_is_typed_into_the_command_palette_answers_nothing():
    async def story():
        app, sent = App(), []
        async with app.run_test() as pilot:
            sitting = SittingScreens(app, sent.append, DIGITS, lambda: None)
            await sitting.handle_message(ScreenRequest(1, DisplayCall.AWAIT_HANDLE, AWAY))
            await pilot.press("ctrl+p", "q")
            assert CommandPalette.is_open(app)
            await sitting.handle_message(CloseRequest(1))
            await sitting.handle_message(ScreenRequest(2, DisplayCall.ASK, QUESTION))
            await pilot.press("1")
            assert sent == [Reply(2, PAUSE)]
            assert app.screen.query_one(Input).value == "q1"

    asyncio.run(story())


def test_a_withdrawal_that_a_stop_cuts_short_is_said_to_erase_nothing():
    async def story():
        app, sent = App(), []
        async with app.run_test() as pilot:
            sitting = SittingScreens(app, sent.append, DIGITS, lambda: None)
            await sitting.handle_message(ScreenRequest(1, DisplayCall.PAUSE, PauseNotice("a reason", 4)))
            await pilot.press("down", "down", "enter", *"withdr")
            assert isinstance(app.screen, ConfirmWithdrawal)
            await sitting.handle_message(CloseRequest(1))
            await pilot.pause()
            assert [type(screen) for screen in app.screen_stack if isinstance(screen, ConfirmWithdrawal)] == []
            assert [notification.message for notification in app._notifications] == ["Nothing is erased."]
            assert sent == []

    asyncio.run(story())
