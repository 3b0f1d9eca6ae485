"""A person who watches."""

import asyncio
import time

import pytest

from study.devices.clock import VirtualClock
from study.session.watching.watch_view import (
    WatchView,
)
from study.tui.watch.watch_app import WatchApp
from tests.study.tui.watch_screen.watched import Source, view

FRAMES = {ord(character): " " for character in "┏┓┗┛┃━╭╮╰╯│─"}


class Seat:
    """The person before the screen, by keys."""

    def __init__(self, app: WatchApp, clock: VirtualClock, source: Source, asked: list, bells: list) -> None:
        self.app, self.clock, self.source, self.asked, self.bells = app, clock, source, asked, bells
        self.pilot = None

    async def pass_time(self, seconds: float) -> None:
        """Of the alarms' clock; the screen then looks, as it does ten times a second."""
        self.clock.sleep(seconds)
        self.app.screen_stack[1].poll()
        await self.pilot.pause()

    @property
    def lines(self) -> list[str]:
        strips = self.app.screen._compositor.render_strips()
        return ["".join(segment.text for segment in strip).rstrip() for strip in strips]

    @property
    def text(self) -> str:
        """Without line breaks and frames."""
        return " ".join(" ".join(self.lines).translate(FRAMES).split())

    async def press(self, *keys: str) -> None:
        await self.pilot.press(*keys)
        await self.pilot.pause()

    async def show(self, shown: WatchView | None) -> None:
        self.source.view = shown
        await self.wait(lambda: self.app.screen_stack[1].view is shown)

    async def wait(self, until, most_s: float = 20.0) -> None:
        end_s = time.monotonic() + most_s
        while not until():
            assert time.monotonic() < end_s, "\n".join(self.lines)
            await asyncio.sleep(0.02)
        await self.pilot.pause()


@pytest.fixture
def seated(monkeypatch):
    """Runs `story(seat)` with the screen at a size."""
    monkeypatch.setenv("TZ", "UTC")
    time.tzset()

    def run(story, first=None, size=(80, 24), theme="hapteq-dark", ask=None) -> Seat:
        source, asked, bells = Source(view() if first is None else first), [], []
        clock = VirtualClock()
        app = WatchApp(source, ask or asked.append, theme, clock.now_s)
        app.bell = lambda: bells.append(clock.now_s())
        seat = Seat(app, clock, source, asked, bells)

        async def told() -> None:
            async with app.run_test(size=size) as pilot:
                seat.pilot = pilot
                await seat.wait(lambda: len(app.screen_stack) > 1 and app.screen_stack[1].view is not None)
                await story(seat)

        asyncio.run(told())
        return seat

    yield run
    monkeypatch.undo()
    time.tzset()
