"""Keys that arrive together: each finds the screen as the one before it has left it."""

import time

import pytest
from textual.events import Key, Paste
from textual.widgets import Input

from study.tui.screens.browse import BrowseScreen
from study.tui.screens.diagnose_form import DiagnoseForm
from study.tui.screens.home import HomeScreen
from study.tui.screens.note import NoteScreen
from study.tui.screens.session import SessionScreen
from study.tui.screens.withdraw_prompt import WithdrawPrompt


def burst(sight, *keys: str, read_s: float | None = None) -> None:
    for key in keys:
        event = Key(key, key if len(key) == 1 else None)
        event.time = event.time if read_s is None else read_s
        sight.app._driver.send_message(event)


@pytest.mark.slow
def test_tab_in_a_burst_takes_the_keys_behind_it_to_the_next_field(on_screen):
    async def story(sight):
        burst(sight, *"rec", "tab", *"mod", "tab", *"ok", "tab", *"out", "shift+tab", "end", "2")
        await sight.pilot.pause()
        values = {field.id: field.value for field in sight.app.screen.query(Input)}
        assert values == {"sources": "rec", "model": "mod", "clean": "ok2", "out": "out"}

    on_screen(DiagnoseForm(), story)


@pytest.mark.slow
def test_a_code_and_begin_in_a_burst_begin_that_session(on_screen, home):
    async def story(sight):
        burst(sight, *"P77", "tab", "f5", "f5")
        await sight.pilot.pause()

    assert [wanted.subject for wanted in on_screen(HomeScreen(home), story).asked][:1] == ["P77"]


@pytest.mark.slow
def test_what_follows_the_key_of_a_prompt_is_written_into_the_prompt(on_screen, session):
    """Of the prompt that erases: none of its letters is a key of the screen below, such as r, a or d."""

    async def story(sight):
        burst(sight, "x", *"arad")
        await sight.pilot.pause()
        assert isinstance(sight.app.screen, WithdrawPrompt)
        assert sight.app.screen.query_one(Input).value == "arad"

    assert on_screen(SessionScreen(session), story).asked == []


@pytest.mark.slow
def test_a_note_in_a_burst_keeps_its_words_and_its_writer(on_screen):
    notes = []

    async def story(sight):
        sight.app.push_screen(NoteScreen(), notes.append)
        await sight.pilot.pause()
        burst(sight, *"1 2", "tab", "2", "enter", "2", "enter", "ctrl+s")
        await sight.pilot.pause()

    on_screen(HomeScreen(), story)
    assert [(note.text, note.who, note.adverse) for note in notes] == [("1 2", "experimenter", True)]


def test_a_path_typed_in_a_burst_opens_nothing_else(on_screen, tmp_path):
    async def story(sight):
        burst(sight, "shift+tab", "end", *"/none", "enter", "enter")
        await sight.pilot.pause()
        assert "There is nothing at" in sight.words and "/none" in sight.words

    assert on_screen(BrowseScreen(str(tmp_path)), story).asked == []


@pytest.mark.parametrize("paste", [False, True])
def test_a_click_or_paste_waits_for_the_keys_before_it(on_screen, paste):
    async def story(sight):
        burst(sight, *"rec", "tab")
        if paste:
            sight.app._driver.send_message(Paste("mod"))
        else:
            burst(sight, *"mod")
        await sight.pilot.pause()
        assert sight.app.screen.query_one("#model", Input).value == "mod"

    on_screen(DiagnoseForm(), story)


def test_keys_that_were_read_before_something_new_was_asked_do_nothing(on_screen):
    async def story(sight):
        sight.app._keys.discard_earlier_keys()
        burst(sight, *"old", read_s=time.monotonic() - 0.5)
        burst(sight, *"new")
        await sight.pilot.pause()
        assert sight.app.screen.query_one("#sources", Input).value == "new"

    on_screen(DiagnoseForm(), story)
