"""What the engine tells of past and of running sessions, and the screen that shows it."""

from dataclasses import replace

import pytest

from study.session.views.archive_views import SessionView
from study.tui.app.archive_screens import ArchiveScreens
from study.tui.app.start_options import StartOptions
from study.tui.engine.from_engine import SessionContent
from study.tui.screens.confirm_view import ConfirmView
from study.tui.screens.home import HomeScreen
from study.tui.screens.session import SessionScreen


@pytest.mark.parametrize(
    ("changes", "asks_first"),
    [
        pytest.param({"standing": "running"}, True, marks=pytest.mark.slow),
        ({"standing": "running", "observer": "ideal"}, False),
        pytest.param({"standing": "unfinished"}, False, marks=pytest.mark.slow),
    ],
    ids=["a person", "a simulated participant", "not running"],
)
def test_a_session_that_a_person_takes_now_is_shown_after_its_name_was_typed(on_screen, session, changes, asks_first):
    view: SessionView = replace(session, line=replace(session.line, **changes))

    async def story(sight):
        archive = ArchiveScreens(sight.app, lambda _: None, StartOptions("data", "simulated"))
        for _ in range(2):  # Enter was pressed twice
            await archive.handle_message(SessionContent(view))
        await sight.pilot.pause()
        assert [type(screen) for screen in sight.app.screen_stack].count(ConfirmView) == int(asks_first)
        assert isinstance(sight.app.screen, ConfirmView) is asks_first
        if asks_first:
            await sight.press(*"P01_002", "enter")
            assert isinstance(sight.app.screen, ConfirmView)
            await sight.press(*["backspace"] * 7, *view.line.name, "enter")
        assert isinstance(sight.app.screen, SessionScreen)

    on_screen(HomeScreen(), story)
