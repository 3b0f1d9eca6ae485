import asyncio
import gc

from textual._styles_cache import StylesCache
from textual.app import App

from study.session.views import PlayingNotice
from study.tui.drawn_before import forget_drawn_before
from study.tui.screens.playing import PlayingScreen


def test_of_a_screen_that_is_gone_nothing_drawn_is_kept():
    drawings = []

    async def story():
        app = App()
        async with app.run_test(size=(80, 24)) as pilot:
            for _ in range(3):
                await app.push_screen(PlayingScreen(PlayingNotice("Interval 1", 1, 0.5, picture=None)))
                await pilot.pause()
                app.pop_screen()
                await pilot.pause()
                forget_drawn_before()
                gc.collect()
                drawings.append(sum(isinstance(one, StylesCache) for one in gc.get_objects()))

    asyncio.run(story())
    assert drawings[0] == drawings[-1]
