"""Two keys that arrive together take one screen off."""

import asyncio
from pathlib import Path

from textual.app import App
from textual.events import Key
from textual.screen import Screen

import study.tui
from study.session.views.participant_views import DemoMenu, PlayDemo, make_direction_picture
from study.tui.dismiss_screen import dismiss_screen
from study.tui.screens.demo import DemoScreen


def test_what_is_taken_off_twice_leaves_the_screen_below_and_replies_once():
    async def story():
        app, replies = App(), []
        async with app.run_test() as pilot:
            below, above = Screen(), Screen()
            await app.push_screen(below)
            await app.push_screen(above, replies.append)
            dismiss_screen(above, 1)
            dismiss_screen(above, 2)
            await pilot.pause()
            assert app.screen is below
            assert replies == [1]

    asyncio.run(story())


def test_a_burst_of_keys_plays_one_demonstration(small_protocol):
    menu = DemoMenu(make_direction_picture(small_protocol.directions, False), 3, 1, (), True)

    async def story():
        app, replies = App(), []
        async with app.run_test() as pilot:
            screen = DemoScreen(menu)
            await app.push_screen(screen, replies.append)
            for key in ("1", "2", "enter"):
                screen.post_message(Key(key, key if key != "enter" else None))
            await pilot.pause(0.1)
            assert replies == [PlayDemo(1, 1)]
            assert len(app.screen_stack) == 1

    asyncio.run(story())


def test_every_screen_leaves_this_way():
    sources = Path(study.tui.__file__).parent.rglob("*.py")
    assert [path.name for path in sources if ".dismiss(" in path.read_text()] == ["dismiss_screen.py"]
