"""Serialise keys, clicks and pastes: each waits until the effects of the previous one are complete or time out.

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

from study.tui.keys.key_presses import get_arrival_time_s

IMMEDIATE_KEYS = ("ctrl+c", "ctrl+q", "ctrl+z")
"""Keys that are never queued or ignored: in a sitting, Ctrl-C and Ctrl-Q switch the force off."""
SETTLE_PASSES = 3
"""Number of passes through the message queues until the effects of a key are complete: one each for the key, for the
message that it causes, and for the messages that the handler of that message posts."""
MAX_SETTLE_S = 1.0
"""Longest wait for the effects of an event (s). Chosen: a widget that is busy longer does not delay further keys."""


class InputQueue:
    """Queue of user input in front of the event handling of an application."""

    def __init__(self, app: App[Any], dispatch: Callable[[Event], Awaitable[None]]) -> None:
        """dispatch: the application's own handling of an event, `App.on_event`."""
        self._app = app
        self._dispatch = dispatch
        self._queued_events: deque[Event] = deque()
        self._settle_task: asyncio.Task[None] | None = None
        self._ignored_until_s = float("-inf")

    @property
    def is_settling(self) -> bool:
        """Whether the effects of an event are still awaited."""
        return self._settle_task is not None

    def discard_earlier_keys(self) -> None:
        """Ignore keys, except `IMMEDIATE_KEYS`, that arrived before this call: they were typed for the previous
        screen."""
        self._ignored_until_s = time.monotonic()

    async def handle_event(self, event: Event) -> None:
        """Queue an event of user input, and handle any other event at once. Call for every event of the application, in
        its message loop."""
        if (
            isinstance(event, Key)
            and event.key not in IMMEDIATE_KEYS
            and get_arrival_time_s(event) < self._ignored_until_s
        ):
            # This includes a key that bubbles up from a widget: the bindings now belong to another screen.
            return
        if not _is_user_input(event):
            await self._dispatch(event)
            return
        self._queued_events.append(event)
        if self._settle_task is None:
            await self._handle_next()

    async def _handle_next(self) -> None:
        """Handle the next queued event that is not ignored, and start a task that waits for its effects; without such
        an event, nothing."""
        self._settle_task = None
        if self._queued_events:
            event = self._queued_events.popleft()
            if isinstance(event, Key) and get_arrival_time_s(event) < self._ignored_until_s:
                await self._handle_next()
                return
            receivers = self._list_focus_chain()
            await self._dispatch(event)
            self._settle_task = asyncio.create_task(self._settle(receivers))

    async def _settle(self, receivers: list[MessagePump]) -> None:
        """Wait for the effects of an event, at most `MAX_SETTLE_S`, then schedule the next. receivers: focus chain when
        the event was handled; the focus may have moved since."""
        try:
            async with asyncio.timeout(MAX_SETTLE_S):
                await _drain_message_queues(receivers)
                for _ in range(SETTLE_PASSES - 1):
                    await _drain_message_queues(self._list_focus_chain())
        except TimeoutError:
            pass
        self._app.call_later(self._handle_next)

    def _list_focus_chain(self) -> list[MessagePump]:
        """List the nodes from the focused widget, or else the screen, up to the application."""
        if not self._app.screen_stack:
            return [self._app]
        return list((self._app.focused or self._app.screen).ancestors_with_self)


def _is_user_input(event: Event) -> bool:
    """Whether the event is user input that must be queued, and was not forwarded to a widget already."""
    if isinstance(event, Key):
        return not event.is_forwarded and event.key not in IMMEDIATE_KEYS
    return isinstance(event, (MouseDown, MouseUp, Paste)) and not event.is_forwarded


async def _drain_message_queues(nodes: list[MessagePump]) -> None:
    """Wait until each node in turn has processed the messages in its queue; messages that bubble up are then in the
    queue of the next node."""
    for node in nodes:
        drained = asyncio.Event()
        if node.call_later(drained.set):
            await drained.wait()
