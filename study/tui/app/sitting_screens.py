"""Show the screens of one sitting in the terminal, on request of the engine, and send the replies.

The engine runs the session in another process. A request (`ScreenRequest`) for a trial arms the trial's screen, which
is opened at the first; each other request opens a screen on top. The result is sent back with the number of the
request.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

from textual._styles_cache import StylesCache
from textual.app import App
from textual.command import CommandPalette
from textual.screen import Screen
from textual.widgets import Footer

from protocols.wording.words import ENGLISH_WORDS, Words
from study.tui.engine.from_engine import (
    CloseRequest,
    DisplayCall,
    Feedback,
    FromEngine,
    HandleUpdate,
    ParticipantWords,
    PreparationStarted,
    ScreenRequest,
    SessionReady,
    UserNotice,
)
from study.tui.engine.to_engine import Reply, ToEngine
from study.tui.keys.answer_keys import AnswerKeys
from study.tui.screens.await_return import AwaitReturnScreen
from study.tui.screens.confirm_view import ConfirmView
from study.tui.screens.confirm_withdrawal import ConfirmWithdrawal
from study.tui.screens.demo import DemoScreen
from study.tui.screens.device_check import DeviceCheckScreen
from study.tui.screens.form import FormScreen
from study.tui.screens.goodbye import GoodbyeScreen
from study.tui.screens.handle import HandleScreen
from study.tui.screens.instructions import InstructionsScreen
from study.tui.screens.note import NoteScreen
from study.tui.screens.note_prompt import NotePrompt
from study.tui.screens.pause import PauseScreen
from study.tui.screens.playing import PlayingScreen
from study.tui.screens.practice_over import PracticeOverScreen
from study.tui.screens.preparing import PreparingScreen
from study.tui.screens.rest import RestScreen
from study.tui.screens.trial import TrialScreen
from study.tui.trial_replies import LEAVING, PAUSE

SCREENS: dict[DisplayCall, Callable[[Any, Words], Screen[Any]]] = {
    DisplayCall.FILL_IN: FormScreen,
    DisplayCall.DEVICE_CHECKED: DeviceCheckScreen,
    DisplayCall.SHOW_PLAYING: PlayingScreen,
    DisplayCall.AWAIT_HANDLE: HandleScreen,
    DisplayCall.PRACTICE_OVER: PracticeOverScreen,
    DisplayCall.REST: RestScreen,
    DisplayCall.AWAIT_RETURN: AwaitReturnScreen,
    DisplayCall.GOODBYE: GoodbyeScreen,
}
"""Screen for each request of the engine that needs only the content and the texts. `make_screen` makes the screens of
the other requests, except that of a trial."""

TEXT_DIALOGS = (NoteScreen, ConfirmView, NotePrompt, CommandPalette)
"""Dialogs that may be opened above any screen of a sitting, and into which text is typed."""
STIMULUS_CALLS = (DisplayCall.SHOW_PLAYING, DisplayCall.ASK)
"""Requests during which a stimulus may play."""


def make_screen(request: ScreenRequest, keys: AnswerKeys, words: Words) -> Screen[Any]:
    """Make a new screen for a request other than a trial, whose screen is kept between requests. The screen is
    dismissed with the reply as its result."""
    if request.call is DisplayCall.WELCOME:
        return InstructionsScreen(request.content, keys, words)
    if request.call is DisplayCall.CHOOSE_DEMO:
        return DemoScreen(request.content, keys, words)
    if request.call is DisplayCall.PAUSE:
        return PauseScreen(request.content, request.content.reason == LEAVING.reason, words)
    return SCREENS[request.call](request.content, words)


def clear_render_caches(app: App[Any]) -> None:
    """Clear caches of Textual 8.2 that hold references to removed widgets; call it when screens change. Otherwise
    garbage collection of these widgets blocks the event loop for longer with every trial, finally for more than the
    time after which the engine treats the screen as unresponsive (`remote_display.HEARTBEAT_TIMEOUT_S`)."""
    # Textual caches 1024 lookups of two colours, each with the whole rendering of a widget as key.
    StylesCache.get_inner_outer.cache_clear()
    for screen in app.screen_stack:
        for footer in screen.query(Footer):
            # A recomposed footer keeps watchers of its old keys until the watched attribute changes.
            footer.mutate_reactive(Footer.compact)


WARNING_DURATION_S = 8.0
"""Time for which a warning is shown (s). Chosen: long enough to read one sentence."""
UNERASED_DURATION_S = 20.0
"""Time for which it is shown that a withdrawal was cut short and erased nothing (s). Chosen: the participant may still
look at the keyboard, and must tell the experimenter."""


class SittingScreens:
    """Controller of the screens that the engine requests in one sitting. Every reply carries the number of its request
    and is sent only once."""

    def __init__(
        self,
        app: App[Any],
        send: Callable[[ToEngine], None],
        keys: AnswerKeys,
        discard_earlier_keys: Callable[[], None],
    ) -> None:
        """send: sends a message to the engine. discard_earlier_keys: discards keys pressed before the call."""
        self.path = ""
        """Folder of the session, once it is opened."""
        self.words = ENGLISH_WORDS
        """The participant's texts, once the engine has read the protocol."""
        self._app = app
        self._send = send
        self._keys = keys
        self._discard_earlier_keys = discard_earlier_keys
        self._held_messages: list[FromEngine] = []
        self._pending_number = 0
        """Number of the request that waits for a reply; 0 where none does."""
        self._request_screen: Screen[Any] | None = None
        self._trial_screen: TrialScreen | None = None
        self._preparing_screen: PreparingScreen | None = None

    async def handle_message(self, message: FromEngine) -> None:
        """Handle one message of the engine; those that do not concern a sitting are ignored. While a person types into
        a dialog, other screens wait (`release_held_messages`): the next characters must not be answers or commands. A
        stimulus does not wait: a pause is requested in its place, so that none is played without its screen."""
        await self.release_held_messages()
        if not isinstance(message, ScreenRequest | CloseRequest | Feedback) or not self._is_dialog_open:
            await self._perform(message)
        elif isinstance(message, ScreenRequest) and message.call in STIMULUS_CALLS:
            self._send(Reply(message.number, PAUSE))
        else:
            self._held_messages.append(message)

    async def release_held_messages(self) -> None:
        """Handle the messages that were held back, once no dialog is open. Called when the screen changes, never during
        `handle_message`."""
        while self._held_messages and not self._is_dialog_open:
            await self._perform(self._held_messages.pop(0))

    @property
    def _is_dialog_open(self) -> bool:
        """Whether a dialog into which text is typed is on the screen, possibly below another one."""
        return any(isinstance(screen, TEXT_DIALOGS) for screen in self._app.screen_stack)

    async def _perform(self, message: FromEngine) -> None:
        """Show what the message requests."""
        match message:
            case ScreenRequest():
                await self._open_request_screen(message)
            case CloseRequest(number=number) if number == self._pending_number:
                self._close_request_screen()
            case HandleUpdate():
                self._update_handle(message)
            case Feedback(correct=correct) if self._trial_screen is not None:
                self._trial_screen.show_saved()
                self._trial_screen.show_feedback(correct)
            case UserNotice(sentence=sentence):
                self._show_warning(sentence)
            case SessionReady(path=path):
                self.path = path
            case ParticipantWords(words=words):
                self.words = words
                if self._preparing_screen is not None:
                    self._preparing_screen.set_language(words)
            case PreparationStarted(sentence=sentence):
                await self.show_preparing(sentence)

    async def show_preparing(self, sentence: str = "") -> None:
        """Show that a slow step is under way (device, report), while no request is open. sentence: current step, empty
        before the language is known."""
        self._pending_number, self._request_screen, self._trial_screen = 0, None, None
        self._held_messages.clear()
        if self._preparing_screen is None:
            self._preparing_screen = PreparingScreen(sentence)
            await self._app.push_screen(self._preparing_screen)
            return
        was_covered = self._app.screen is not self._preparing_screen
        while self._app.screen is not self._preparing_screen and self._preparing_screen in self._app.screen_stack:
            self._app.pop_screen()
        self._preparing_screen.show_step(sentence, is_new_wait=was_covered)

    async def _open_request_screen(self, request: ScreenRequest) -> None:
        """Replace the screen of the previous request by that of a new request."""
        self._close_request_screen()
        self._pending_number = request.number
        if self._preparing_screen is not None and self._app.screen is self._preparing_screen:
            # Cover the preparing screen: only an empty screen must show in the moment between two others.
            await self._app.push_screen(Screen())
        if request.call is DisplayCall.ASK:
            trial_screen = self._trial_screen if self._trial_screen is not None else await self._open_trial_screen()
            trial_screen.arm(request.content)
            return
        self._request_screen = make_screen(request, self._keys, self.words)
        await self._app.push_screen(self._request_screen, partial(self._send_screen_result, request.number))
        # Keys pressed before this screen could be read must not answer it.
        self._discard_earlier_keys()

    async def _open_trial_screen(self) -> TrialScreen:
        """Open the screen of all trials; it stays open until `show_preparing` removes it."""
        self._trial_screen = TrialScreen(self._keys, self.words)
        await self._app.push_screen(self._trial_screen)
        return self._trial_screen

    def _update_handle(self, update: HandleUpdate) -> None:
        """Show a new position of the handle, unless its request was closed in the meantime."""
        if update.number == self._pending_number and isinstance(self._request_screen, HandleScreen):
            self._request_screen.update_view(update.view)

    def _show_warning(self, sentence: str) -> None:
        """Show a warning on the trial's screen, and as a notification where that screen is not open or is covered."""
        sentence = self.words.translate_fact(sentence)
        if self._trial_screen is not None:
            self._trial_screen.show_trouble(sentence)
        if self._trial_screen is None or self._request_screen is not None:
            self._app.notify(sentence, severity="warning", timeout=WARNING_DURATION_S, markup=False)

    def _send_screen_result(self, number: int, result: Any) -> None:
        """Send the result of a dismissed screen as the reply, if its request (`number`) is still open."""
        if number == self._pending_number:
            self._request_screen = None
            self.send_reply(result)

    def send_reply(self, reply_value: Any) -> None:
        """Send the reply to the open request, if there is one, and close the request."""
        if self._pending_number:
            self._send(Reply(self._pending_number, reply_value))
        self._pending_number = 0

    def _close_request_screen(self) -> None:
        """Close the screen of the previous request and every screen above it (help, a withdrawal that is not confirmed
        yet, which is said to erase nothing), and take no further answer on the trial's screen."""
        self._pending_number = 0
        if self._trial_screen is not None:
            self._trial_screen.show_saved()  # the engine continues only after the answer is on disk
            self._trial_screen.disarm()
        request_screen, self._request_screen = self._request_screen, None
        while request_screen is not None and request_screen in self._app.screen_stack:
            if isinstance(self._app.screen, ConfirmWithdrawal):
                title, sentence = self.words["withdraw_title"], self.words["nothing_erased"]
                self._app.notify(sentence, title=title, severity="warning", timeout=UNERASED_DURATION_S, markup=False)
            self._app.pop_screen()
        clear_render_caches(self._app)
