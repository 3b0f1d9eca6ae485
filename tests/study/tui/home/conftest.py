"""A bare application around one screen, which writes down what the screen asks for; and views to show."""

import asyncio
import os
import time
from collections.abc import Awaitable, Callable
from dataclasses import replace
from pathlib import Path

import pytest
from textual.app import App
from textual.binding import Binding
from textual.events import Event
from textual.message import Message
from textual.pilot import Pilot
from textual.screen import Screen

from study.session.views.archive_views import DiagnosisView, HomeView, ProtocolLine, SessionLine, SessionView, Staircase
from study.tui import home_messages
from study.tui.keys.input_queue import InputQueue
from study.tui.screens.help import HelpScreen
from study.tui.themes import register_themes

MESSAGES = tuple(
    kind
    for kind in vars(home_messages).values()
    if isinstance(kind, type) and issubclass(kind, Message) and kind is not Message
)


class Bare(App[None]):
    BINDINGS = [Binding("f1", "help", "Help"), Binding("ctrl+q", "quit", "Quit")]  # noqa: RUF012

    def __init__(self, screen: Screen[None], theme: str) -> None:
        super().__init__()
        self.first = screen
        self.asked: list[Message] = []
        self.opened: list[str] = []
        self.animation_level = "none"
        register_themes(self, theme)
        self._keys = InputQueue(self, super().on_event)

    async def on_event(self, event: Event) -> None:
        await self._keys.handle_event(event)

    def on_mount(self) -> None:
        self.push_screen(self.first)

    def action_help(self) -> None:
        self.push_screen(HelpScreen(getattr(self.screen, "HELP", "")))

    def open_url(self, url: str, *, new_tab: bool = True) -> None:
        self.opened.append(url)

    async def _on_message(self, message: Message) -> None:
        if isinstance(message, MESSAGES):
            self.asked.append(message)
        await super()._on_message(message)


def messages_of(app: Bare) -> list[tuple[object, ...]]:
    """What the screen asked for: the name and the fields of each message, or of the engine's command in it."""
    asked = [getattr(each, "command", each) for each in app.asked]
    return [(type(each).__name__, *(getattr(each, name) for name in each.__dataclass_fields__)) for each in asked]


class Sight:
    """What one reads on the screen."""

    def __init__(self, app: Bare, pilot: Pilot) -> None:
        self.app, self.pilot = app, pilot

    @property
    def lines(self) -> list[str]:
        return [
            "".join(segment.text for segment in strip).rstrip() for strip in self.app.screen._compositor.render_strips()
        ]

    @property
    def text(self) -> str:
        return "\n".join(self.lines)

    @property
    def words(self) -> str:
        """Without breaks and frames: for sentences that wrap."""
        return " ".join(self.text.translate({ord(c): " " for c in "│╭╮╰╯─"}).split())

    async def until(self, there: Callable[[], bool], patience_s: float = 20.0) -> None:
        """What takes time takes longer on a busy machine; what never comes fails with what is on the screen."""
        until_s = time.monotonic() + patience_s
        while not there():
            assert time.monotonic() < until_s, self.text
            await self.pilot.pause(0.02)

    async def press(self, *keys: str) -> None:
        await self.pilot.press(*keys)
        await self.pilot.pause()


@pytest.fixture
def on_screen():
    """Runs `story(sight)` with the screen at a size."""

    def run(
        screen: Screen[None], story: Callable[[Sight], Awaitable[None]], size=(80, 24), theme="hapteq-dark"
    ) -> Bare:
        app = Bare(screen, theme)

        async def told() -> None:
            async with app.run_test(size=size) as pilot:
                await pilot.pause()
                await story(Sight(app, pilot))

        asyncio.run(told())
        return app

    return run


LINE = SessionLine(
    name="P01_001", path="/data/P01_001", subject="P01", protocol="direction_threshold",
    begun_utc="2026-05-04T09:30:12+00:00", observer=None, answers=365, runs_done=6, runs=6, standing="finished",
)  # fmt: skip
PROTOCOLS = (
    ProtocolLine("direction_threshold", "Force thresholds for telling two directions apart, 5 to 45 Hz", True),
    ProtocolLine("direction_training", "Practice run at 5 Hz", False),
)


@pytest.fixture
def line() -> SessionLine:
    return LINE


@pytest.fixture
def lines() -> tuple[SessionLine, ...]:
    return (
        replace(LINE, name="P05_001", path="/data/P05_001", subject="P05", answers=12, runs_done=0, standing="running",
                begun_utc="2026-05-05T10:02:00+00:00"),
        replace(LINE, name="P04_001", path="/data/P04_001", subject="P04", answers=0, runs_done=0, runs=0, protocol="",
                standing="unreadable", remark="Line 7 of events.jsonl is not an event that this version knows.",
                begun_utc="2026-05-05T08:40:00+00:00"),
        replace(LINE, name="P03_001", path="/data/P03_001", subject="P03", answers=101, runs_done=2,
                standing="unfinished", begun_utc="2026-05-04T14:10:00+00:00"),
        replace(LINE, name="P02_001", path="/data/P02_001", subject="P02", answers=0, runs_done=0, runs=0,
                standing="withdrawn", remark="The participant withdrew; the data were erased."),
        LINE,
    )  # fmt: skip


@pytest.fixture
def home(lines) -> HomeView:
    return HomeView("data", lines, PROTOCOLS, ("simulated",))


@pytest.fixture
def staircase() -> Staircase:
    levels = (1.0, 1.0, 1.0, 0.631, 0.631, 1.0, 1.0, 1.0, 0.631, 0.631, 0.631, 0.398, 0.447, 0.447, 0.447, 0.398)
    correct = (True, True, True, True, False, True, True, True, True, True, True, False, True, True, True, False)
    turns = (False, False, False, False, True, False, False, True, False, False, False, True, False, False, True, False)
    return Staircase("Run 2: 25 Hz, test", levels, correct, turns, 0.52, 3.0)


@pytest.fixture
def session(line, staircase) -> SessionView:
    return SessionView(
        line=line,
        facts=(("participant", "P01, a person, number 1 of this protocol"),
               ("protocol", "direction_threshold (680ddede8420, locked)"), ("device", "omega.3, 1000 Hz"),
               ("begun", "2026-05-04 09:30:12 UTC"), ("runs", "6 of 6"), ("answers", "365"), ("seed", "62818196")),
        thresholds=(("run", "phase", "at", "threshold", "delivered", "rev.", "trials", "right", "remark"),
                    ("2", "test", "5 Hz", "0.475 N", "0.56 m/s²", "13", "68", "82 %", ""),
                    ("3", "test", "35 Hz", "2.681 N", "5.60 m/s²", "13", "53", "77 %", "cut by the cap")),
        warnings=("There is one participant: individual thresholds can be shown, nothing can be tested.",),
        staircases=tuple(replace(staircase, title=f"Run {n}: {f} Hz, test") for n, f in ((2, 5), (3, 35), (4, 15))),
        events=("2026-05-04 (times are UTC)", "09:30:12  Session P01_001 began: P01, a person, on omega.3.",
                *(f"09:31:{n:02}  Run 1, trial {n} (training): direction 1, 1.000 N at 5 Hz." for n in range(1, 60))),
        report="/data/P01_001/analysis/report.html",
        figures=("/data/P01_001/analysis/figures/thresholds.png",),
    )  # fmt: skip


@pytest.fixture
def diagnosis() -> DiagnosisView:
    return DiagnosisView(
        path="/data/out/diagnosis.json",
        verdict="The mismatch is explained in part: physics that the model lacks is named, and more remains.",
        sentences=("Coulomb friction in the mechanism, axis x: level 0.21 N (95 %: 0.2 to 0.22). It explains 90 % of "
                   "the mismatch that remains after re-tuning (probability 0.97).",),
        rivals=("stribeck friction (probability 0.03): its static level is no different from its coulomb level",),
        mismatch=(("output", "input", "band", "amplitude", "where", "share", "p"),
                  ("ax", "fx", "5 to 15 Hz", "1.5", "near v = 0", "80 %", "1.0e-09"),
                  ("ay", "fx", "25 to 35 Hz", "all", "", "20 %", "0.004")),
        fit=(("record", "given model", "re-tuned", "with effects", "repeats allow"),
             ("fit", "0.3120", "0.2900", "0.0510", "0.0480"), ("test", "0.3200", "0.3010", "0.0560", "0.0480")),
        remainder=(("output", "input", "band", "amplitude", "where", "share", "p"),
                   ("ay", "fx", "25 to 35 Hz", "all", "", "20 %", "0.004")),
        next_experiment="hapteq record slow --out NEXT.h5\nSlow movement shows friction alone.",
        report="/data/out/report.html",
        notes=("Errors are normalised root-mean-square over the channels, measured by free simulation.",),
    )  # fmt: skip


@pytest.fixture
def looks_like():
    """Compares what is on the screen with a text file beside this one; UPDATE_SCREENS=1 writes it anew."""

    def compare(sight: Sight, name: str) -> None:
        path = Path(__file__).parent / "looks" / f"{name}.txt"
        text = "\n".join(sight.lines) + "\n"
        if os.environ.get("UPDATE_SCREENS"):
            path.parent.mkdir(exist_ok=True)
            path.write_text(text)
        assert text == path.read_text()

    return compare
