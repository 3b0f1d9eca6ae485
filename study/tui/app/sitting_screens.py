"""Shows the screens of one sitting in the terminal, on request of the engine, and sends the replies.

The engine runs the session in another process. Each of its requests (`ScreenRequest`) opens a screen above the trial's
screen, which stays open underneath; the screen's result is sent back with the number of the request.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

from textual._styles_cache import StylesCache
from textual.app import App
from textual.screen import Screen
from textual.widgets import Footer

from protocols.wording.words import ENGLISH_WORDS, Words
from study.session.views.views import Reply as TrialReply
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
from study.tui.screens.demo import DemoScreen
from study.tui.screens.device_check import DeviceCheckScreen
from study.tui.screens.form import FormScreen
from study.tui.screens.goodbye import GoodbyeScreen
from study.tui.screens.handle import HandleScreen
from study.tui.screens.instructions import InstructionsScreen
from study.tui.screens.pause import PauseScreen
from study.tui.screens.playing import PlayingScreen
from study.tui.screens.practice_over import PracticeOverScreen
from study.tui.screens.preparing import PreparingScreen
from study.tui.screens.rest import RestScreen
from study.tui.screens.trial import TrialScreen
from study.tui.trial_replies import LEAVING

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
"""Screen of each request of the engine that needs only the content and the texts. `screen_for` makes those of the other
requests, except the trial's."""


def screen_for(ask: ScreenRequest, keys: AnswerKeys, words: Words) -> Screen[Any]:
    """A new screen for a request other than a trial, whose screen is kept between requests. The screen is dismissed
    with the reply as its result."""
    if ask.call is DisplayCall.WELCOME:
        return InstructionsScreen(ask.content, keys, words)
    if ask.call is DisplayCall.CHOOSE_DEMO:
        return DemoScreen(ask.content, keys, words)
    if ask.call is DisplayCall.PAUSE:
        return PauseScreen(ask.content, ask.content.reason == LEAVING.reason, words)
    return SCREENS[ask.call](ask.content, words)


def clear_render_caches(app: App[Any]) -> None:
    """Clear caches of Textual 8.2 that keep removed widgets alive; call it when screens change. Otherwise garbage
    collection of these widgets blocks the event loop for longer with every trial, finally for more than the half second
    after which a screen counts as dead."""
    # Textual caches 1024 lookups of two colours, each with the whole rendering of a widget as key.
    StylesCache.get_inner_outer.cache_clear()
    for screen in app.screen_stack:
        for footer in screen.query(Footer):
            # A recomposed footer keeps watchers of its old keys until the watched attribute changes.
            footer.mutate_reactive(Footer.compact)


TROUBLE_FOR_S = 8.0
"""Time for which a warning is shown (s)."""


class SittingScreens:
    """Shows the screens that the engine requests in one sitting, and sends the replies. Every reply carries the number
    of its request and is sent once."""

    def __init__(
        self,
        app: App[Any],
        send: Callable[[ToEngine], None],
        keys: AnswerKeys,
        forget_earlier: Callable[[], None],
    ) -> None:
        """send: sends a message to the engine. forget_earlier: discards keys that were pressed before the call."""
        self.path = ""
        """Folder of the session, once it is opened."""
        self.words = ENGLISH_WORDS
        """The participant's texts, once the engine has read the protocol."""
        self._app = app
        self._send = send
        self._keys = keys
        self._forget_earlier = forget_earlier
        self._number = 0
        """Number of the request that waits for a reply; 0 where none does."""
        self._request_screen: Screen[Any] | None = None
        self._trial: TrialScreen | None = None
        self._preparing: PreparingScreen | None = None

    async def handle_message(self, message: FromEngine) -> None:
        """Handle one message of the engine, in the order of arrival."""
        match message:
            case ScreenRequest():
                await self._ask(message)
            case CloseRequest(number=number) if number == self._number:
                self._drop()
            case HandleUpdate():
                self._update_handle(message)
            case Feedback(correct=correct) if self._trial is not None:
                self._trial.show_saved()
                self._trial.show_feedback(correct)
            case UserNotice(sentence=sentence):
                self._show_trouble(sentence)
            case SessionReady(path=path):
                self.path = path
            case ParticipantWords(words=words):
                self.words = words
                if self._preparing is not None:
                    self._preparing.set_language(words)
            case PreparationStarted(sentence=sentence):
                await self.prepare(sentence)

    def send_trial_reply(self, reply: TrialReply) -> None:
        """Send the answer to a trial. Called by the trial's screen, which then takes no further keys by itself."""
        self._reply(reply)

    async def prepare(self, sentence: str = "") -> None:
        """Show that the device is being prepared, while no request waits. sentence: empty before the language is
        known."""
        self._number, self._request_screen, self._trial = 0, None, None
        if self._preparing is None:
            self._preparing = PreparingScreen(sentence)
            await self._app.push_screen(self._preparing)
            return
        covered = self._app.screen is not self._preparing
        while self._app.screen is not self._preparing and self._preparing in self._app.screen_stack:
            self._app.pop_screen()
        self._preparing.say(sentence, afresh=covered)

    async def _ask(self, ask: ScreenRequest) -> None:
        """Replace the previous request's screen by that of a new request."""
        self._drop()
        self._number = ask.number
        if self._preparing is not None and self._app.screen is self._preparing:
            # Cover the preparing screen: only an empty screen must show in the moment between two others.
            await self._app.push_screen(Screen())
        if ask.call is DisplayCall.ASK:
            trial = self._trial if self._trial is not None else await self._trial_screen()
            trial.arm(ask.content)
            return
        self._request_screen = screen_for(ask, self._keys, self.words)
        await self._app.push_screen(self._request_screen, partial(self._reply_once_dismissed, ask.number))
        # Keys pressed before this screen could be read must not answer it.
        self._forget_earlier()

    async def _trial_screen(self) -> TrialScreen:
        self._trial = TrialScreen(self._keys, self.words)
        await self._app.push_screen(self._trial)
        return self._trial

    def _update_handle(self, update: HandleUpdate) -> None:
        if update.number == self._number and isinstance(self._request_screen, HandleScreen):
            self._request_screen.update_view(update.view)

    def _show_trouble(self, sentence: str) -> None:
        sentence = self.words.translate_fact(sentence)
        if self._trial is not None:
            self._trial.show_trouble(sentence)
        if self._trial is None or self._request_screen is not None:
            self._app.notify(sentence, severity="warning", timeout=TROUBLE_FOR_S, markup=False)

    def _reply_once_dismissed(self, number: int, value: Any) -> None:
        if number == self._number:
            self._request_screen = None
            self._reply(value)

    def _reply(self, value: Any) -> None:
        if self._number:
            self._send(Reply(self._number, value))
        self._number = 0

    def _drop(self) -> None:
        """Remove the previous request's screen and everything above it (help, commands)."""
        self._number = 0
        if self._trial is not None:
            self._trial.show_saved()  # the engine continues only after the answer is on disk
            self._trial.disarm()
        screen, self._request_screen = self._request_screen, None
        while screen is not None and screen in self._app.screen_stack:
            self._app.pop_screen()
        clear_render_caches(self._app)
