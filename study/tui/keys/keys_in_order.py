"""Serialise keys, clicks and pastes: each is handed on when the effects of the previous one are complete.

Textual delivers a key to the widget that has the focus when the key is handled. Tab, or Enter in a field, moves the
focus only some messages later: of keys that arrive together, later ones would otherwise go to the previous field.
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
"""Remove the force, or suspend: never queued."""
ROUNDS = 3
"""Rounds of the event loop until a key has had its effect: the key, the message that it becomes, its handler."""
LONGEST_WAIT_S = 1.0
"""Longest wait for the effects of a key: a widget that is busy for longer does not delay further keys."""


class KeysInOrder:
    """A queue in front of an application's handling of events. hand_on: that handling."""

    def __init__(self, app: App[Any], hand_on: Callable[[Event], Awaitable[None]]) -> None:
        self._app = app
        self._hand_on = hand_on
        self._waiting: deque[Event] = deque()
        self._settling: asyncio.Task[None] | None = None
        self._ignored_until_s = float("-inf")

    @property
    def at_work(self) -> bool:
        """Whether the effects of a key are not complete yet."""
        return self._settling is not None

    def forget_earlier(self) -> None:
        """Ignore keys that were pressed before now: a new question is shown, and they were meant for the last one."""
        self._ignored_until_s = time.monotonic()

    async def take(self, event: Event) -> None:
        """Handle every event of the application, in its message loop."""
        if isinstance(event, Key) and event.key not in AT_ONCE and arrival_s(event) < self._ignored_until_s:
            return  # also where it comes back from a widget: its bindings would be those of another screen
        if not _is_typed(event):
            await self._hand_on(event)
            return
        self._waiting.append(event)
        if self._settling is None:
            await self._next()

    async def _next(self) -> None:
        self._settling = None
        if self._waiting:
            event = self._waiting.popleft()
            if isinstance(event, Key) and arrival_s(event) < self._ignored_until_s:
                await self._next()
                return
            before = self._with_the_keyboard()
            await self._hand_on(event)
            self._settling = asyncio.create_task(self._settle(before))

    async def _settle(self, before: list[MessagePump]) -> None:
        try:
            async with asyncio.timeout(LONGEST_WAIT_S):
                await _pass_through(before)
                for _ in range(ROUNDS - 1):
                    await _pass_through(self._with_the_keyboard())
        except TimeoutError:
            pass
        self._app.call_later(self._next)

    def _with_the_keyboard(self) -> list[MessagePump]:
        """The chain of widgets from the one that has the keyboard up to the application."""
        if not self._app.screen_stack:
            return [self._app]
        return list((self._app.focused or self._app.screen).ancestors_with_self)


def _is_typed(event: Event) -> bool:
    if isinstance(event, Key):
        return not event.is_forwarded and event.key not in AT_ONCE
    return isinstance(event, (MouseDown, MouseUp, Paste)) and not event.is_forwarded


async def _pass_through(nodes: list[MessagePump]) -> None:
    """Wait until each node has processed its queue, so that what it passed on is queued at the next."""
    for node in nodes:
        handled = asyncio.Event()
        if node.call_later(handled.set):
            await handled.wait()
