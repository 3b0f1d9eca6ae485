"""A pipe with lines in it, read by the line-mode display as a terminal would be."""

import io
import os

import pytest

from study.devices.clock import Clock, RealClock, VirtualClock
from study.tui.answer_keys import DIGITS, AnswerKeys
from study.tui.line_input import LineInput
from study.tui.plain import PlainDisplay


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
