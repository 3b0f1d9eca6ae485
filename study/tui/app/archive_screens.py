"""Screens of the terminal interface outside sittings: start screen, past sessions, diagnoses, calibration of the
sensor.

Screens exchange messages with the engine, a separate process that reads files and computes (`study.tui.engine`). Their
modules are imported when they are first shown, or before in the background (`load_screens`), so that the program starts
quickly.
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
from study.tui.engine.to_engine import Diagnose, Interrupt, ShowHome, ToEngine

if TYPE_CHECKING:
    from study.tui.screens.diagnosing import DiagnosingScreen
    from study.tui.screens.home import HomeScreen
    from study.tui.screens.sensor import SensorScreen
    from study.tui.screens.session import SessionScreen


class ArchiveScreens:
    """Controller of the start screen and of the screens of past sessions, diagnoses and calibration; it sends their
    requests to the engine. send: sends a message to the engine; start: options of the start screen."""

    def __init__(self, app: App[Any], send: Callable[[ToEngine], None], start: StartOptions) -> None:
        self._app = app
        self._send = send
        self._start_options = start
        self._home_screen: HomeScreen | None = None
        self._session_screen: SessionScreen | None = None
        self._session_path = ""
        self._diagnosing_screen: DiagnosingScreen | None = None

    async def show_home(self) -> None:
        """Show the start screen at once, and request its list, which is shown when the engine has read it."""
        from study.tui.screens.home import HomeScreen

        self.close_screens()
        if self._home_screen is None:
            self._home_screen = HomeScreen()
            await self._app.push_screen(self._home_screen)
        self._send(
            ShowHome(
                self._start_options.data,
                self._start_options.protocol,
                self._start_options.device,
                self._start_options.model,
            )
        )

    def close_screens(self) -> None:
        """Remove all screens above the start screen."""
        self._session_screen = None
        while len(self._app.screen_stack) > 1 and self._app.screen is not self._home_screen:
            self._app.pop_screen()

    async def handle_message(self, message: FromEngine) -> None:
        """Show the content of a message from the engine; other messages are ignored. Called only outside sittings."""
        match message:
            case HomeContent(view=view) if self._home_screen is not None:
                self._home_screen.show(view)
            case SessionContent(view=view):
                await self._show_session(view)
            case DiagnosisProgress(step=step, share=share) if self._diagnosing_screen is not None:
                self._diagnosing_screen.show_progress(step, share)
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

    async def start_diagnosis(self, command: Diagnose) -> None:
        """Start a diagnosis and show its progress. If the user stops it, the message `Interrupt` is sent to the
        engine."""
        from study.tui.screens.diagnosing import DiagnosingScreen

        def on_closed(is_stopped: bool | None) -> None:
            """Handle the closing of the screen; is_stopped: True if the user stopped the diagnosis."""
            self._diagnosing_screen = None
            if is_stopped:
                self._send(Interrupt())

        self._send(command)
        self._diagnosing_screen = DiagnosingScreen("Getting ready.")
        await self._app.push_screen(self._diagnosing_screen, on_closed)

    def close_diagnosis_progress(self) -> None:
        """Remove the diagnosis screen and everything above it."""
        diagnosing_screen, self._diagnosing_screen = self._diagnosing_screen, None
        while diagnosing_screen is not None and diagnosing_screen in self._app.screen_stack:
            self._app.pop_screen()

    def reset_sensor_screen(self) -> None:
        """Reset the sensor screen, if it is open, after an error, so that the calibration can be started again."""
        if (screen := self._find_sensor_screen()) is not None:
            screen.reset_after_error()

    def _find_sensor_screen(self) -> SensorScreen | None:
        """Find the open sensor screen; None where there is none."""
        from study.tui.screens.sensor import SensorScreen

        return next((screen for screen in self._app.screen_stack if isinstance(screen, SensorScreen)), None)

    async def _show_session(self, view: SessionView) -> None:
        """Show a session in its open screen, or else in a new one."""
        from study.tui.screens.confirm_view import confirm_view
        from study.tui.screens.session import SessionScreen

        if (
            self._session_screen is not None
            and self._session_screen in self._app.screen_stack
            and self._session_path == view.line.path
        ):
            self._session_screen.show(view)
            return
        screen = SessionScreen(view)
        self._session_screen, self._session_path = screen, view.line.path
        if view.line.standing == "running" and view.line.observer is None:
            # Confirmation is required, because staircases and log of a running session would show a participant which
            # answers were correct.
            confirm_view(self._app, view.line.name, lambda: self._app.push_screen(screen))
            return
        await self._app.push_screen(screen)

    async def _show_diagnosis(self, view: DiagnosisView) -> None:
        """Show a diagnosis on a new screen."""
        from study.tui.screens.diagnosis import DiagnosisScreen

        await self._app.push_screen(DiagnosisScreen(view))
