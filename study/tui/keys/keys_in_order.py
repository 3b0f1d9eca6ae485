"""Serialise keys, clicks and pastes: each is handled only when the effects of the previous event are complete.

Textual delivers a key to the widget that has the focus when the key is handled. Tab, or Enter in a field, moves the
focus only some messages later, so that of keys that arrive together, the later ones would reach the previous field.
"""

import asyncio
import time
from collections import deque
from collections.abc import Awaitable, Callable
from typing import Any

from textual.app import App
from textual.events import Event, Key, MouseDown, MouseUp, Paste
from textual.message_pump import MessagePump

from study.tui.keys.key_presses import arrival_s

AT_ONCE = ("ctrl+c", "ctrl+q", "ctrl+z")
"""Keys that are never queued: Ctrl-C and Ctrl-Q take the force off, Ctrl-Z suspends the program."""
ROUNDS = 3
"""Passes through the message queues until the effects of a key are complete: the key, the message that it causes, and
the message's handler."""
LONGEST_WAIT_S = 1.0
"""Longest wait for the effects of a key (s). A widget that is busy for longer does not delay further keys."""


class KeysInOrder:
    """A queue in front of the event handling of an application. hand_on: handles an event, `App.on_event`."""

    def __init__(self, app: App[Any], hand_on: Callable[[Event], Awaitable[None]]) -> None:
        self._app = app
        self._hand_on = hand_on
        self._waiting: deque[Event] = deque()
        self._settling: asyncio.Task[None] | None = None
        self._ignored_until_s = float("-inf")

    @property
    def at_work(self) -> bool:
        """Whether the effects of an event are still incomplete."""
        return self._settling is not None

    def forget_earlier(self) -> None:
        """Ignore keys that were pressed before now: they were meant for the screen before the one that is shown now."""
        self._ignored_until_s = time.monotonic()

    async def handle_event(self, event: Event) -> None:
        """Take an event of the application: queue it if it is typed, else handle it at once. Called in the message
        loop."""
        if isinstance(event, Key) and event.key not in AT_ONCE and arrival_s(event) < self._ignored_until_s:
            # This includes a key that returns from a widget: it would now meet the bindings of another screen.
            return
        if not _is_user_input(event):
            await self._hand_on(event)
            return
        self._waiting.append(event)
        if self._settling is None:
            await self._handle_next()

    async def _handle_next(self) -> None:
        """Handle the next event of the queue that is not ignored, and begin to wait for its effects."""
        self._settling = None
        if self._waiting:
            event = self._waiting.popleft()
            if isinstance(event, Key) and arrival_s(event) < self._ignored_until_s:
                await self._handle_next()
                return
            receivers = self._with_the_keyboard()
            await self._hand_on(event)
            self._settling = asyncio.create_task(self._settle(receivers))

    async def _settle(self, receivers: list[MessagePump]) -> None:
        """Wait for the effects of an event, at most `LONGEST_WAIT_S`, then continue with the next. receivers: the chain
        of widgets that received it; the focus may have moved since."""
        try:
            async with asyncio.timeout(LONGEST_WAIT_S):
                await _pass_through(receivers)
                for _ in range(ROUNDS - 1):
                    await _pass_through(self._with_the_keyboard())
        except TimeoutError:
            pass
        self._app.call_later(self._handle_next)

    def _with_the_keyboard(self) -> list[MessagePump]:
        """The chain of nodes from the focused widget, or the screen, up to the application."""
        if not self._app.screen_stack:
            return [self._app]
        return list((self._app.focused or self._app.screen).ancestors_with_self)


def _is_user_input(event: Event) -> bool:
    """Whether the event is input of the user that must be serialised and was not forwarded to a widget before."""
    if isinstance(event, Key):
        return not event.is_forwarded and event.key not in AT_ONCE
    return isinstance(event, (MouseDown, MouseUp, Paste)) and not event.is_forwarded


async def _pass_through(nodes: list[MessagePump]) -> None:
    """Wait until each node has processed its message queue, one after another; messages that a node passes on are then
    in the queue of the next."""
    for node in nodes:
        handled = asyncio.Event()
        if node.call_later(handled.set):
            await handled.wait()
