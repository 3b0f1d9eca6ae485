"""Full-screen terminal application of `hapteq study` and `hapteq resume` (textual): draws screens, reads keys, and
never blocks on work.

A second process, the engine (`study.tui.engine`), controls the device, writes to disk and analyses; both exchange
messages by `EngineConnection`.
"""

from __future__ import annotations

import os
from collections.abc import Iterable
from dataclasses import replace
from typing import Any, ClassVar

from textual.app import App, SystemCommand
from textual.binding import Binding, BindingType
from textual.events import Event
from textual.screen import Screen

from protocols.wording.words import ENGLISH_WORDS, Words
from study.errors import ExitCode
from study.session.watching.requests import NoteAsked, PauseAsked
from study.tui import home_messages
from study.tui.app import outcomes
from study.tui.app.archive_screens import ArchiveScreens
from study.tui.app.engine_connection import EngineConnection, EngineMessage
from study.tui.app.load_screens import load_screens
from study.tui.app.sitting_screens import SittingScreens
from study.tui.app.start_options import StartOptions
from study.tui.engine.from_engine import Failed, Finished
from study.tui.engine.to_engine import (
    BeginSession,
    ForwardRequest,
    Interrupt,
    Resume,
    SendRequest,
    SessionOrder,
    ShowSession,
)
from study.tui.exit_handlers import install_exit_handlers
from study.tui.keys.input_queue import InputQueue
from study.tui.keys.key_names import format_key_name
from study.tui.screens.outcome import Decision, Outcome, OutcomeScreen
from study.tui.themes import NEXT_THEME, register_themes
from study.tui.watch.watch_controller import WatchController


class HapteqApp(App[None]):
    """The application of `hapteq study` and `hapteq resume`; handlers `on_...` and `action_...` are called by textual.
    F1 shows help, F9 changes the colours, Ctrl-C and Ctrl-Q leave; in a sitting they switch the force off, F2 shows the
    experimenter's view once the session is open, F4 records a note (with Shift: an adverse event), F7 pauses."""

    TITLE = "hapteq"
    # Notifications are at the top, because the instructions and keys of a screen are at the bottom.
    CSS = "ToastRack { align: right top; } Toast { max-width: 76; }"
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("f1,question_mark", "help", "Help", key_display="F1"),
        Binding("f2", "watch", "Watch", show=False),
        Binding("f4", "note(False)", "Note", show=False),
        Binding("shift+f4", "note(True)", "Adverse event", show=False),
        Binding("f7", "pause", "Pause", show=False),
        Binding("f9", "next_theme", "Light or dark", show=False),
        Binding("ctrl+z", "suspend_process", "Suspend", show=False, priority=True),
        Binding("ctrl+c", "let_go", "Force off", show=False, priority=True),
        Binding("ctrl+q", "quit", "Leave", show=False, priority=True),
    ]

    def __init__(self, start: StartOptions) -> None:
        super().__init__()
        self.outcome: Finished | Failed | None = None
        """Result of the last sitting, which the command line prints after the screen has closed."""
        self._start_options = start
        self._started_from_terminal = start.first_sitting is not None
        self._engine = EngineConnection(self)
        self._archive = ArchiveScreens(self, self._engine.send, start)
        self._sitting: SittingScreens | None = None
        self._stop_screen: OutcomeScreen | None = None
        self._watch_controller = WatchController(self)
        self._keys = InputQueue(self, super().on_event)
        if "TEXTUAL_ANIMATIONS" not in os.environ:
            self.animation_level = "none"
        register_themes(self)

    async def on_event(self, event: Event) -> None:
        await self._keys.handle_event(event)

    def get_key_display(self, binding: Binding) -> str:
        return format_key_name(super().get_key_display(binding))

    async def on_mount(self) -> None:
        install_exit_handlers(self, lambda: self._leave_app(ExitCode.INTERRUPTED))
        if self._start_options.first_sitting is not None:
            await self._begin_sitting(self._start_options.first_sitting)
        else:
            await self._archive.show_home()
        self.screen_change_signal.subscribe(self, self._release_held_messages)
        self.call_after_refresh(self._start_engine)

    async def _release_held_messages(self, _: Screen[Any]) -> None:
        """Let the sitting show what waits for the end of a dialog; called in turn with the engine's messages."""
        if self._sitting is not None:
            await self._sitting.release_held_messages()

    def _start_engine(self) -> None:
        """Start the engine and import further screens, after the first screen is drawn."""
        self._engine.start()
        load_screens()

    @property
    def engine_pid(self) -> int | None:
        """Process identifier of the engine; None before it has started."""
        return self._engine.pid

    def close_engine(self) -> None:
        """Wait until the engine has ended, and store the outcome of a sitting that still ran. Called after `run`."""
        self._watch_controller.end_feed()
        self._engine.close()
        if self._sitting is not None:
            self.outcome = self._engine.last_end

    @property
    def _words(self) -> Words:
        """Texts in the language of this sitting's protocol; English outside a sitting."""
        return ENGLISH_WORDS if self._sitting is None else self._sitting.words

    async def _begin_sitting(self, command: BeginSession | Resume) -> None:
        """Show the first screen of a sitting, and send the engine the command to begin or resume a session."""
        self._started_from_terminal = self._started_from_terminal and command is self._start_options.first_sitting
        self.outcome = self._stop_screen = None
        self._archive.close_screens()
        self._sitting = SittingScreens(
            self, self._engine.send, self._start_options.keys, self._keys.discard_earlier_keys
        )
        await self._sitting.show_preparing()
        self._engine.send(command)

    async def on_engine_message(self, event: EngineMessage) -> None:
        message = event.message
        match message:
            case Finished():
                self._end_sitting(outcomes.make_completion_outcome(message, self._words), message)
            case Failed() if self._sitting is None:
                self._archive.close_diagnosis_progress()
                self._archive.reset_sensor_screen()
                self._show_outcome(outcomes.make_failure_outcome(message, at_home=True), message.path)
            case Failed():
                self._end_sitting(outcomes.make_failure_outcome(message, False, self._words), message)
            case _ if self._sitting is not None:
                await self._sitting.handle_message(message)
            case _:
                await self._archive.handle_message(message)

    def _end_sitting(self, outcome: Outcome, final_message: Finished | Failed) -> None:
        """End a sitting: show its outcome, or exit where a sitting requested on the command line could not be begun.
        final_message: the engine's last message of the sitting."""
        was_opened = self._sitting is not None and self._sitting.path
        self._sitting = self._stop_screen = None
        self.outcome = final_message
        if self._started_from_terminal and not was_opened:
            # The command line prints the reason after the application has closed.
            self.exit()
            return
        self._watch_controller.close()
        self._archive.close_screens()
        self._show_outcome(outcome, final_message.path)

    def _show_outcome(self, outcome: Outcome, path: str) -> OutcomeScreen:
        """Show the screen of an outcome, and carry out the decision made on it later. path: folder of the session to
        resume or show; empty if there is none. Returns the screen."""

        async def act_on_decision(decision: Decision | None) -> None:
            """Carry out the decision; nothing for None."""
            match decision:
                case "resume":
                    await self.on_resume_requested(home_messages.ResumeRequested(path))
                case "look":
                    self._engine.send(ShowSession(path))
                case "home":
                    await self._archive.show_home()
                case "quit":
                    self._leave_app(ExitCode.DONE)

        screen = OutcomeScreen(outcome)
        self.push_screen(screen, act_on_decision)
        self._keys.discard_earlier_keys()
        return screen

    def _leave_app(self, code: ExitCode) -> None:
        """Exit the application with this exit code; the caller of `run` then calls `close_engine`."""
        self.exit(return_code=int(code))

    def action_let_go(self) -> None:
        """Switch the force off and show the screen of the stop (Ctrl-C, or Ctrl-Q in a sitting). Without a sitting, or
        at a second press, leave the application."""
        if self._sitting is None or self._stop_screen is not None:
            self._leave_app(ExitCode.INTERRUPTED)
            return
        self._engine.send(Interrupt())
        stop_screen = self._stop_screen = self._show_outcome(outcomes.make_stop_sent_outcome(self._words), "")
        self.set_timer(outcomes.STOP_REPLY_TIMEOUT_S, lambda: self._report_unanswered_stop(stop_screen))

    def _report_unanswered_stop(self, stop_screen: OutcomeScreen) -> None:
        """Show that the engine did not answer the stop, if `stop_screen` is still the screen of the current stop."""
        if self._stop_screen is stop_screen:
            stop_screen.show_outcome(outcomes.make_stop_unanswered_outcome(self._words))
            self.bell()

    async def action_quit(self) -> None:
        if self._sitting is not None:
            self.action_let_go()
        else:
            self._leave_app(ExitCode.DONE)

    def action_help(self) -> None:
        from study.tui.screens.help import HelpScreen

        help_text: str = getattr(self.screen, "HELP", "")
        self.push_screen(HelpScreen(help_text.rstrip() + self._words["help_everywhere"], self._words))

    def action_next_theme(self) -> None:
        self.theme = NEXT_THEME[self.theme]

    def action_watch(self) -> None:
        if self._sitting is not None and self._sitting.path:
            self._watch_controller.toggle_view(
                self._sitting.path, lambda request: self._engine.send(ForwardRequest(request))
            )

    def action_pause(self) -> None:
        if self._sitting is not None:
            self._engine.send(ForwardRequest(PauseAsked("participant")))

    def action_note(self, adverse: bool) -> None:
        if self._sitting is None:
            return
        from study.tui.screens.note import NoteScreen

        self.push_screen(NoteScreen(adverse, "experimenter", self._sitting.words), self._send_note)

    def _send_note(self, note: NoteAsked | None) -> None:
        """Send a note to the engine for the session's log; None (cancelled): nothing is sent."""
        if note is not None:
            self._engine.send(ForwardRequest(note))
            self.notify(self._words["goes_into_log"], markup=False)

    def on_pause_screen_note_written(self, event: Any) -> None:
        self._engine.send(ForwardRequest(event.note))

    def check_action(self, action: str, parameters: tuple[object, ...]) -> bool | None:
        """Disable the actions of a sitting (watch, note, pause) outside one."""
        return action not in ("watch", "note", "pause") or self._sitting is not None

    def get_system_commands(self, screen: Screen[Any]) -> Iterable[SystemCommand]:
        from study.tui.app.app_commands import generate_commands

        return generate_commands(self, screen)

    def on_trial_screen_replied(self, event: Any) -> None:
        if self._sitting is not None:
            self._sitting.send_reply(event.reply)

    async def on_begin_requested(self, event: home_messages.BeginRequested) -> None:
        if self._sitting is not None:  # a second key press must not begin a second sitting
            return
        start = self._start_options = replace(self._start_options, device=event.device)
        order = SessionOrder(event.protocol, event.device, event.subject, start.data, start.seed, event.model)
        await self._begin_sitting(BeginSession(order))

    async def on_resume_requested(self, event: home_messages.ResumeRequested) -> None:
        if self._sitting is not None:
            return
        start = self._start_options
        await self._begin_sitting(Resume(event.path, start.device, start.data, follows_log=True))

    async def on_home_requested(self) -> None:
        await self._archive.show_home()

    def on_command_requested(self, event: home_messages.CommandRequested) -> None:
        self._engine.send(event.command)

    async def on_diagnose_requested(self, event: home_messages.DiagnoseRequested) -> None:
        await self._archive.start_diagnosis(event.command)

    def on_watch_requested(self, event: home_messages.WatchRequested) -> None:
        self._watch_controller.open_after_confirmation(
            event.path, lambda request: self._engine.send(SendRequest(event.path, request))
        )

    def on_demo_screen_pause_wanted(self) -> None:
        self.action_pause()

    def on_watch_screen_closed(self) -> None:
        self._watch_controller.close()
