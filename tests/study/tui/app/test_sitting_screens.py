"""The screens of a sitting while a note is typed above them."""

import asyncio

import pytest
from textual.app import App
from textual.widgets import TextArea

from study.session.views.participant_views import HandleView, PlayingNotice
from study.tui.app.sitting_screens import SittingScreens
from study.tui.engine.from_engine import CloseRequest, DisplayCall, ScreenRequest
from study.tui.keys.answer_keys import DIGITS
from study.tui.screens.note import NoteScreen
from study.tui.screens.trial import TrialScreen
from tests.study.tui.screens.trial.questions import QUESTION

AWAY = HandleView(False, "Bring the handle 12 mm back to the centre.", (11.0, 5.0), 8.0)
WAITS = {DisplayCall.AWAIT_HANDLE: AWAY, DisplayCall.SHOW_PLAYING: PlayingNotice("Interval 1", 1, 2.0, None)}


@pytest.mark.parametrize("call", WAITS)
def test_what_is_typed_into_a_note_answers_no_trial_that_begins_meanwhile(call):
    async def story():
        app, sent = App(), []
        async with app.run_test() as pilot:
            sitting = SittingScreens(app, sent.append, DIGITS, lambda: None)
            await sitting.handle_message(ScreenRequest(1, call, WAITS[call]))
            await app.push_screen(NoteScreen())
            await pilot.press(*"pain in ")
            await sitting.handle_message(CloseRequest(1))
            await sitting.handle_message(ScreenRequest(2, DisplayCall.ASK, QUESTION))
            await sitting.release_held_messages()
            await pilot.press(*"2 fingers")
            assert app.screen.query_one(TextArea).text == "pain in 2 fingers"
            assert sent == []
            await pilot.press("escape")
            await sitting.release_held_messages()
            assert isinstance(app.screen, TrialScreen)
            await pilot.pause(0.05)

    asyncio.run(story())
