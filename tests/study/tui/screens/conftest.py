"""A bare application around one of the participant's screens, and pictures to compare it with.

HAPTEQ_REWRITE_SCREENS=1 writes the pictures anew; look at the difference before committing it.
"""

import asyncio
import os
import re
import time
from collections.abc import Awaitable, Callable
from pathlib import Path

import pytest
from textual.app import App
from textual.binding import Binding
from textual.events import Key
from textual.pilot import Pilot
from textual.screen import Screen

from study.tui.screens.demo import DemoScreen
from study.tui.screens.pause import PauseScreen
from study.tui.screens.trial import TrialScreen
from study.tui.themes import register_themes

SNAPSHOTS = Path(__file__).parent / "snapshots"
Story = Callable[["Stage"], Awaitable[None]]


class Bare(App[None]):
    BINDINGS = [Binding("f1,question_mark", "help", "Help", key_display="F1")]  # noqa: RUF012
    ENABLE_COMMAND_PALETTE = False

    def __init__(self, screen: Screen, theme: str) -> None:
        super().__init__()
        self.first = screen
        self.heard: list[object] = []
        """Results of the screen and what it posts, in order."""
        self.animation_level = "none"
        register_themes(self, theme)

    def on_mount(self) -> None:
        self.push_screen(self.first, self.heard.append)

    def on_trial_screen_replied(self, message: TrialScreen.Replied) -> None:
        self.heard.append(message.reply)

    def on_pause_screen_note_written(self, message: PauseScreen.NoteWritten) -> None:
        self.heard.append(message.note)

    def on_demo_screen_pause_wanted(self, message: DemoScreen.PauseWanted) -> None:
        self.heard.append(message)

    def action_help(self) -> None:
        self.heard.append("help")


class Stage:
    """What one reads on the screen, and whose keys one presses."""

    def __init__(self, app: Bare, pilot: Pilot) -> None:
        self.app, self.pilot = app, pilot
        self.heard = app.heard

    async def press(self, *keys: str) -> None:
        await self.pilot.press(*keys)
        await self.pilot.pause()

    def burst(self, *keys: str) -> None:
        """All at once, as a terminal hands them over: nothing is waited for in between."""
        for key in keys:
            character = key if len(key) == 1 else " " if key == "space" else None
            self.app._driver.send_message(Key(key, character))

    async def until(self, there: Callable[[], bool], patience_s: float = 20.0) -> None:
        """What takes time takes longer on a busy machine; what never comes fails with what is on the screen."""
        until_s = time.monotonic() + patience_s
        while not there():
            assert time.monotonic() < until_s, self.text
            await self.pilot.pause(0.02)

    async def reads(self, words: str) -> None:
        await self.until(lambda: words in self.words)

    @property
    def text(self) -> str:
        strips = self.app.screen._compositor.render_strips(self.app.size)
        return "".join(f"{strip.text.rstrip()}\n" for strip in strips)

    @property
    def words(self) -> str:
        """As sentences: line breaks and frames count as spaces."""
        return " ".join(re.sub(r"[│┃╭╮╰╯━─]", " ", self.text).split())

    @property
    def svg(self) -> str:
        """Without what differs from run to run, and without a font from elsewhere."""
        drawn = re.sub(r"@font-face \{[^}]*\}\s*", "", self.app.export_screenshot(title="hapteq"))
        return re.sub(r"terminal-\d+", "terminal", drawn)


@pytest.fixture
def on_stage():
    """Plays a story with a screen; returns what was heard."""

    def play(
        screen: Screen, story: Story, size: tuple[int, int] = (80, 24), theme: str = "hapteq-dark"
    ) -> list[object]:
        async def run() -> list[object]:
            app = Bare(screen, theme)
            async with app.run_test(size=size) as pilot:
                await pilot.pause()
                await story(Stage(app, pilot))
                await pilot.pause()
                return list(app.heard)

        return asyncio.run(run())

    return play


@pytest.fixture
def same_as_before():
    def compare(name: str, drawn: str) -> None:
        path = SNAPSHOTS / name
        if os.environ.get("HAPTEQ_REWRITE_SCREENS"):
            path.parent.mkdir(exist_ok=True)
            path.write_text(drawn, encoding="utf-8")
        assert drawn == path.read_text(encoding="utf-8"), f"{name} looks different; HAPTEQ_REWRITE_SCREENS=1 accepts it"

    return compare
