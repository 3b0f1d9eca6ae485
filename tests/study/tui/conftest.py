"""A pipe with lines in it, read by the line-mode display as a terminal would be; and screens that have settled.

Textual's own test driver takes an application for idle when its process gets little of the processor, which on a busy
machine it never does. Here it has settled when no message, no callback and no change of the picture is left.
"""

import asyncio
import io
import os

import pytest
from textual._context import active_app
from textual.app import App
from textual.dom import DOMNode
from textual.screen import Screen

from study.devices.clock import Clock, RealClock, VirtualClock
from study.tui.keys.answer_keys import DIGITS, AnswerKeys
from study.tui.line_mode.line_input import LineInput
from study.tui.line_mode.plain_display import PlainDisplay

SETTLED_S = 30.0
"""Longer than any machine takes; an application that never settles fails here."""


async def settled(_min_sleep_s: float = 0.0, _max_sleep_s: float = 0.0) -> None:
    """Until everything that a key or a message has set going is done and drawn."""
    app = active_app.get()
    async with asyncio.timeout(SETTLED_S):
        looks_at_rest = 0
        while looks_at_rest < 3 and app.is_running and app.screen_stack:
            await asyncio.sleep(0)
            if not _at_rest(app):
                looks_at_rest = 0
            elif _to_draw(app.screen):
                looks_at_rest = 0
                app.screen._on_timer_update()  # without waiting for its next turn
            else:
                looks_at_rest += 1


def _at_rest(app: App) -> bool:
    keys = getattr(app, "_keys", None)
    if app._resize_timer is not None or (keys is not None and keys.is_settling):
        return False
    if not _waits_for_messages(app):
        return False
    nodes = (node for screen in app.screen_stack for node in screen.walk_children(with_self=True))
    return all(_waits_for_messages(node) for node in nodes)


def _waits_for_messages(node: DOMNode) -> bool:
    """Whether it has worked through all that was sent to it, callbacks included."""
    if node._closing or node._closed:
        return True
    ready = node._message_queue.ready_event
    waits = not ready.is_set() and any(not waiter.done() for waiter in ready._waiters)
    return waits and not node._next_callbacks and node._pending_message is None


def _to_draw(screen: Screen) -> bool:
    """Whether places on the screen may still change. What they show is drawn anew whenever a test reads it."""
    return bool(screen._layout_required or screen._scroll_required or screen._callbacks)


@pytest.fixture(autouse=True)
def settling(monkeypatch):
    """What Textual's test driver waits for after a key and in a pause."""
    for module in ("textual.app", "textual.pilot"):
        monkeypatch.setattr(f"{module}.wait_for_idle", settled)


class Typed:
    def __init__(self, clock: Clock | None = None, keys: AnswerKeys = DIGITS, notes: list | None = None) -> None:
        self._read, self._write = os.pipe()
        self.out = io.StringIO()
        self.clock = clock if clock is not None else RealClock()
        note = None if notes is None else notes.append
        self.display = PlainDisplay(LineInput(self._read), self.out, self.clock, keys, note)

    def type(self, *lines: str) -> None:
        os.write(self._write, "".join(f"{line}\n" for line in lines).encode())

    def end(self) -> None:
        os.close(self._write)

    @property
    def said(self) -> str:
        """Everything on the screen; line breaks count as spaces."""
        return " ".join(self.out.getvalue().split())


@pytest.fixture
def typed():
    return Typed()


@pytest.fixture
def typed_in():
    """The same with a clock, answer keys or a list for notes."""
    return Typed


@pytest.fixture
def unhurried():
    """In virtual time: only sleeping takes any."""
    return Typed(VirtualClock())
