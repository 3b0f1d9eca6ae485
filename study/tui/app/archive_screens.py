"""Screens of the terminal interface outside sittings: start screen, past sessions, diagnoses; used by `app`.

Screens exchange messages with the engine, a separate process that reads files and computes (`study.tui.engine`). They
are imported when they are first shown, so that the program starts quickly.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from textual.app import App

from study.session.views.archive_views import DiagnosisView, SessionView
from study.tui.app.start_options import StartOptions
from study.tui.engine.from_engine import (
    CalibrationComputed,
    CalibrationStored,
    DiagnosisContent,
    DiagnosisProgress,
    FromEngine,
    HomeContent,
    PlacementRequest,
    PreparationStarted,
    SessionContent,
    UserNotice,
    Withdrawn,
)
from study.tui.engine.to_engine import Diagnose, LetGo, ShowHome, ToEngine

if TYPE_CHECKING:
    from study.tui.screens.diagnosing import DiagnosingScreen
    from study.tui.screens.home import HomeScreen
    from study.tui.screens.sensor import SensorScreen
    from study.tui.screens.session import SessionScreen


class ArchiveScreens:
    """Shows the start screen, past sessions and diagnoses, and sends their requests to the engine."""

    def __init__(self, app: App[Any], send: Callable[[ToEngine], None], start: StartOptions) -> None:
        self._app = app
        self._send = send
        self._start = start
        self._home: HomeScreen | None = None
        self._session: SessionScreen | None = None
        self._session_path = ""
        self._diagnosing: DiagnosingScreen | None = None

    async def show_home(self) -> None:
        """Show the start screen at once, and request its list, which is shown when the engine has read it."""
        from study.tui.screens.home import HomeScreen

        self.clear()
        if self._home is None:
            self._home = HomeScreen()
            await self._app.push_screen(self._home)
        self._send(ShowHome(self._start.data, self._start.protocol, self._start.device, self._start.model))

    def clear(self) -> None:
        """Remove all screens above the start screen."""
        self._session = None
        while len(self._app.screen_stack) > 1 and self._app.screen is not self._home:
            self._app.pop_screen()

    async def handle_message(self, message: FromEngine) -> None:
        """Display the content of a message from the engine. Called only outside sittings."""
        match message:
            case HomeContent(view=view) if self._home is not None:
                self._home.show(view)
            case SessionContent(view=view):
                await self._show_session(view)
            case DiagnosisProgress(step=step, share=share) if self._diagnosing is not None:
                self._diagnosing.show_progress(step, share)
            case DiagnosisContent(view=view):
                self.close_diagnosis_progress()
                await self._show_diagnosis(view)
            case PlacementRequest() | CalibrationComputed() | CalibrationStored():
                if (screen := self._find_sensor_screen()) is not None:
                    screen.handle_message(message)
            case Withdrawn(sessions=sessions):
                self._app.notify(f"Everything of the participant was erased: {', '.join(sessions)}.", markup=False)
                await self.show_home()
            case UserNotice(sentence=sentence) | PreparationStarted(sentence=sentence):
                self._app.notify(sentence, markup=False)

    async def diagnose(self, command: Diagnose) -> None:
        """Start a diagnosis and show its progress. If the user stops it, the engine is told to stop."""
        from study.tui.screens.diagnosing import DiagnosingScreen

        def on_closed(is_stopped: bool | None) -> None:
            self._diagnosing = None
            if is_stopped:
                self._send(LetGo())

        self._send(command)
        self._diagnosing = DiagnosingScreen("Getting ready.")
        await self._app.push_screen(self._diagnosing, on_closed)

    def close_diagnosis_progress(self) -> None:
        """Remove the diagnosis screen and everything above it."""
        diagnosing_screen, self._diagnosing = self._diagnosing, None
        while diagnosing_screen is not None and diagnosing_screen in self._app.screen_stack:
            self._app.pop_screen()

    def reset_sensor_screen(self) -> None:
        """Allow the calibration of the sensor to be started again after an error."""
        if (screen := self._find_sensor_screen()) is not None:
            screen.reset_after_error()

    def _find_sensor_screen(self) -> SensorScreen | None:
        """The sensor screen, if it is open."""
        from study.tui.screens.sensor import SensorScreen

        return next((screen for screen in self._app.screen_stack if isinstance(screen, SensorScreen)), None)

    async def _show_session(self, view: SessionView) -> None:
        """Show a session, in its screen if that is open already."""
        from study.tui.screens.confirm_view import confirm_view
        from study.tui.screens.session import SessionScreen

        if (
            self._session is not None
            and self._session in self._app.screen_stack
            and self._session_path == view.line.path
        ):
            self._session.show(view)
            return
        screen = SessionScreen(view)
        self._session, self._session_path = screen, view.line.path
        if view.line.standing == "running" and view.line.observer is None:
            # The staircases and the log of a running session would show a participant which answers were correct, so
            # that a confirmation is required first.
            confirm_view(self._app, view.line.name, lambda: self._app.push_screen(screen))
            return
        await self._app.push_screen(screen)

    async def _show_diagnosis(self, view: DiagnosisView) -> None:
        """Show a diagnosis on a new screen."""
        from study.tui.screens.diagnosis import DiagnosisScreen

        await self._app.push_screen(DiagnosisScreen(view))
