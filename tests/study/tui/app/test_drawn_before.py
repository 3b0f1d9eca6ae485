import asyncio
import gc

from textual._styles_cache import StylesCache
from textual.app import App
from textual.widgets._footer import FooterKey

from study.session.views.participant_views import PlayingNotice
from study.tui.app.sitting_screens import clear_render_caches
from study.tui.screens.playing import PlayingScreen
from study.tui.screens.trial import TrialScreen


def test_of_screens_that_are_gone_nothing_drawn_is_kept():
    kept = []

    async def story():
        app = App()
        async with app.run_test(size=(80, 24)) as pilot:
            await app.push_screen(TrialScreen())
            for _ in range(4):
                await app.push_screen(PlayingScreen(PlayingNotice("Interval 1", 1, 0.5, picture=None)))
                await pilot.pause()
                app.pop_screen()
                await pilot.pause()
                await pilot.pause()
                clear_render_caches(app)
                gc.collect()
                kept.append(sum(isinstance(get_object, StylesCache | FooterKey) for get_object in gc.get_objects()))

    asyncio.run(story())
    assert kept[1] == kept[-1]
