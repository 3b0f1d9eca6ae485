"""The application with its engine, through a whole sitting and through what can go wrong in one."""

import asyncio
import json
import os
import signal
import time
from collections.abc import Awaitable, Callable
from pathlib import Path

import pytest
from textual.widgets import Input

from study.store.sessions.log_lock import is_log_locked
from study.tui.app.app import HapteqApp
from study.tui.app.start_options import StartOptions
from study.tui.engine.from_engine import Failed, Finished
from study.tui.engine.to_engine import BeginSession, SessionOrder
from study.tui.home_messages import BeginRequested
from study.tui.screens.confirm_view import VIEW_SHOWN_NOTE
from tests.slow_instances import slow

pytestmark = [pytest.mark.real_time, pytest.mark.may_be_late]

SIZE = (100, 30)
SHORT = {
    "frequencies_hz = [25.0, 35.0]": "frequencies_hz = [25.0]",
    "trial_limit = 4": "trial_limit = 1",
    "[{ step_db = 4.0, reversals = 2 }, { step_db = 1.0, reversals = 3 }]": "[{ step_db = 4.0, reversals = 3 }]",
    "\nreversals = 5": "\nreversals = 3",
    "averaged_reversals = 3": "averaged_reversals = 2",
}
GO_ON = {"DeviceCheckScreen", "InstructionsScreen", "RestScreen", "GoodbyeScreen", "AwaitReturnScreen"}


class Person:
    """Sits before the application and does what the screens say."""

    def __init__(self, app: HapteqApp, pilot) -> None:
        self.app = app
        self.pilot = pilot
        self.answers = 0

    @property
    def at(self) -> str:
        return type(self.app.screen).__name__

    async def until(self, *screens: str, patience_s: float = 30.0) -> None:
        until_s = time.monotonic() + patience_s
        while self.at not in screens:
            assert time.monotonic() < until_s, f"at {self.at}, not at {screens}"
            await self.pilot.pause(0.03)
            if self.at in GO_ON and self.at not in screens:
                await self.pilot.press("enter")
            elif self.at == "TrialScreen" and self.at not in screens:
                await self.answer()

    async def answer(self) -> None:
        await self.pilot.press("12"[self.answers % 2])
        self.answers += 1
        await self.pilot.pause(0.22)

    async def press(self, *keys: str) -> None:
        await self.pilot.press(*keys)
        await self.pilot.pause(0.05)

    async def reads(self, words: str) -> None:
        """Until they are on the screen."""
        await self.sees(lambda: words in self.text())

    async def sees(self, there: Callable[[], bool]) -> None:
        until_s = time.monotonic() + 30.0
        while not there():
            assert time.monotonic() < until_s, self.text()
            await self.pilot.pause(0.03)

    def text(self) -> str:
        strips = self.app.screen._compositor.render_strips()
        lines = ("".join(segment.text for segment in strip) for strip in strips)
        return " ".join(" ".join(lines).split())


@pytest.fixture
def order(tmp_path, small_text) -> SessionOrder:
    path = tmp_path / "small.toml"
    path.write_text(small_text.replace("after_run_s = 2.0", "after_run_s = 0.1"))
    return SessionOrder(str(path), "simulated", "P01", str(tmp_path / "data"), seed=4)


def run(start: StartOptions, story: Callable[[Person], Awaitable[None]]) -> HapteqApp:
    app = HapteqApp(start)

    async def play() -> None:
        async with app.run_test(size=SIZE) as pilot:
            await story(Person(app, pilot))

    try:
        asyncio.run(play())
    finally:
        app.close_engine()
    return app


@pytest.fixture
def sitting(order) -> Callable[[Callable[[Person], Awaitable[None]]], HapteqApp]:
    return lambda story: run(StartOptions(order.data, "simulated", first_sitting=BeginSession(order)), story)


@pytest.fixture
def log(order) -> Path:
    return Path(order.data) / "P01_001" / "events.jsonl"


@pytest.mark.slow
@pytest.mark.timeout(120)
def test_from_the_start_screen_to_the_report_and_back(order, tmp_path):
    path = tmp_path / "short.toml"
    text = Path(order.protocol).read_text()
    for there, wanted in SHORT.items():
        assert there in text
        text = text.replace(there, wanted)
    path.write_text(text)

    async def story(person: Person) -> None:
        await person.until("HomeScreen")
        await person.sees(lambda: person.app.focused is not None and person.app.focused.id == "code")
        await person.pilot.press(*"P01")
        await person.sees(lambda: person.app.screen.query_one("#code", Input).value == "P01")
        until_s = time.monotonic() + 30.0
        while person.at == "HomeScreen":
            assert time.monotonic() < until_s, person.text()
            await person.press("f5")
        await person.until("OutcomeScreen", patience_s=90.0)
        await person.reads("The session is finished")
        await person.press("enter")
        await person.until("SessionScreen")
        await person.press("escape")
        await person.until("HomeScreen")

    app = run(StartOptions(order.data, "simulated", protocol=str(path), seed=4), story)
    assert isinstance(app.outcome, Finished)
    assert Path(app.outcome.results.report).is_file()


@pytest.mark.slow
def test_beginning_twice_at_once_begins_one_sitting(order):
    async def story(person: Person) -> None:
        await person.until("HomeScreen")
        for _ in range(2):
            person.app.post_message(BeginRequested("P01", "no_such_protocol", "simulated"))
        await person.until("OutcomeScreen")
        await person.pilot.pause(1.5)
        assert [type(screen).__name__ for screen in person.app.screen_stack].count("OutcomeScreen") == 1

    run(StartOptions(order.data, "simulated"), story)


@pytest.mark.slow
def test_ctrl_c_lets_go_says_what_is_safe_and_the_session_continues(sitting, log):
    async def story(person: Person) -> None:
        await person.until("TrialScreen")
        await person.answer()
        await person.press("ctrl+c")
        await person.until("OutcomeScreen")
        await person.reads("! Interrupted")
        said = person.text()
        assert "1 answer is on disk." in said
        assert "Resume the session" in said
        assert json.loads(log.read_text().splitlines()[-1])["event"] == "session_interrupted"
        await person.press("r")
        await person.until("InstructionsScreen")
        await person.reads("1 answer is on the disk")
        await person.until("TrialScreen")
        await person.press("ctrl+c", "ctrl+c")

    app = sitting(story)
    assert app.return_code == 130
    assert is_log_locked(log) is False


@pytest.mark.parametrize("resumed", [False, *slow(True)])
def test_an_engine_that_dies_leaves_a_panel_and_a_way_on(sitting, log, resumed):
    async def story(person: Person) -> None:
        await person.until("TrialScreen")
        await person.answer()
        os.kill(person.app.engine_pid, signal.SIGKILL)
        await person.until("OutcomeScreen")
        await person.reads("! The device program ended")
        await person.reads("Every answer that was given is on disk.")
        if resumed:
            await person.press("r")
            await person.until("TrialScreen")
            await person.press("ctrl+c")
            await person.reads("! Interrupted")
        await person.press("q")

    app = sitting(story)
    assert isinstance(app.outcome, Failed)
    assert app.outcome.error.saved == ("1 answer" if resumed else "Every answer that was given") + " is on disk."
    assert log.read_text().count('"answer_given"') == 1


def test_an_event_loop_that_hangs_frees_the_hand(sitting, log):
    async def story(person: Person) -> None:
        await person.until("TrialScreen")
        time.sleep(1.0)
        await person.until("AwaitReturnScreen")
        await person.press("1", "enter")
        await person.until("TrialScreen")
        await person.press("ctrl+c", "ctrl+c")

    sitting(story)
    assert "the screen gave no sign of life" in log.read_text()
    assert "answer_given" not in log.read_text()


@pytest.mark.slow
def test_a_pause_a_note_and_the_watchers_view_in_one_terminal(sitting, log):
    async def story(person: Person) -> None:
        await person.until("TrialScreen")
        await person.press("f4")
        await person.until("NoteScreen")
        await person.press(*"cough", "ctrl+s")
        await person.press("f2")
        await person.until("ConfirmView")
        await person.press(*"P01_001", "enter")
        await person.until("WatchScreen")
        await person.press("q")
        await person.until("TrialScreen")
        await person.press("f7")
        await person.until("PauseScreen")
        # A key that comes before the screen was drawn does nothing: a person looks, and presses again.
        while person.at == "PauseScreen":
            await person.press("enter")
        await person.until("TrialScreen")
        assert '"text":"cough"' in log.read_text()
        assert VIEW_SHOWN_NOTE in log.read_text()
        await person.press("ctrl+c", "ctrl+c")

    sitting(story)
    assert "pause_taken" in log.read_text()


@pytest.mark.parametrize("way", ["key", *slow("command")])
def test_a_participant_does_not_open_the_experimenters_view_by_accident(sitting, log, way):
    async def story(person: Person) -> None:
        await person.until("TrialScreen")
        if way == "key":
            await person.press("f2")
        else:
            commands = {
                command.title: command.callback for command in person.app.get_system_commands(person.app.screen)
            }
            await commands["Watch this session"]()
        await person.until("ConfirmView")
        await person.press("1", "2", "enter", "enter", "f2", "y", "enter")
        assert "That is not P01_001. Nothing is opened." in person.text()
        await person.press("escape")
        assert person.at in ("TrialScreen", "AwaitReturnScreen")
        await person.press("ctrl+c", "ctrl+c")

    sitting(story)
    assert VIEW_SHOWN_NOTE not in log.read_text()


def test_help_themes_and_commands_are_there_on_every_screen(tmp_path):
    async def story(person: Person) -> None:
        await person.until("HomeScreen")
        await person.press("f1")
        await person.until("HelpScreen")
        await person.press("escape")
        await person.until("HomeScreen")
        before = person.app.theme
        await person.press("f9")
        assert person.app.theme != before
        commands = {command.title: command.help for command in person.app.get_system_commands(person.app.screen)}
        assert "hapteq study --subject CODE" in commands["Begin"]
        await person.press("ctrl+q")

    app = run(StartOptions(str(tmp_path), "simulated"), story)
    assert app.return_code == 0
    assert app.outcome is None


def test_what_the_command_line_asked_for_and_cannot_be_is_reported_by_the_command_line(tmp_path):
    async def story(person: Person) -> None:
        until_s = time.monotonic() + 20.0
        while person.app.is_running and time.monotonic() < until_s:
            await asyncio.sleep(0.05)

    order = SessionOrder("no_such_protocol", "simulated", "P01", str(tmp_path))
    app = run(StartOptions(str(tmp_path), "simulated", first_sitting=BeginSession(order)), story)
    assert isinstance(app.outcome, Failed)
    assert app.outcome.error.exit_code == 2
