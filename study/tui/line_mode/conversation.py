"""Sentences out, lines in: what every part of line mode talks through."""

import textwrap
from dataclasses import dataclass
from enum import Enum
from typing import TextIO

from study.devices.clock import Clock
from study.tui.line_mode.line_input import LineInput
from study.workflows.trial.display import SignOfLife

GLANCE_S = 0.05
"""Longest time between two signs of life: half of what the port allows."""
LINE_WIDTH = 78


@dataclass(frozen=True, slots=True)
class Line:
    text: str
    at_s: float
    """Clock time at which it arrived."""

    @property
    def word(self) -> str:
        return self.text.casefold()


class WaitOver(Enum):
    """Why no line came."""

    INPUT_ENDED = "the input ended"
    CUT_SHORT = "the stimulus ended early"
    """By whatever the sign of life heard."""
    TIME_LIMIT = "no answer within the time limit"


class Conversation:
    def __init__(self, lines: LineInput, out: TextIO, clock: Clock) -> None:
        self._lines = lines
        self._out = out
        self.clock = clock

    def say(self, *sentences: str) -> None:
        for text in sentences:
            # A drawing's lines are short enough; sentences break between words.
            lines = textwrap.wrap(text, LINE_WIDTH) if len(text) > LINE_WIDTH else [text]
            self._out.write("\n".join(lines) + "\n")
        self._out.flush()

    def prompt(self, text: str) -> None:
        self._out.write(text)
        self._out.flush()

    def forget(self) -> None:
        """Drop what a person typed too early."""
        self._lines.forget()

    def wait(self, sign_of_life: SignOfLife, until_s: float = float("inf")) -> Line | WaitOver:
        """The next line. A line that comes together with the end of the stimulus came too late."""
        while True:
            try:
                text = self._lines.read(GLANCE_S)
            except EOFError:
                return WaitOver.INPUT_ENDED
            now_s = self.clock.now_s()
            if not sign_of_life():
                return WaitOver.CUT_SHORT
            if text is not None:
                return Line(text, now_s)
            if now_s > until_s:
                return WaitOver.TIME_LIMIT

    def answer(self) -> Line:
        """The next line while nothing is played. Raises KeyboardInterrupt where no line can come any more."""
        reply = self.wait(_keep_waiting)
        if isinstance(reply, WaitOver):
            raise KeyboardInterrupt
        return reply

    def answer_or_leave(self) -> Line:
        """As `answer`; q leaves."""
        line = self.answer()
        if line.word == "q":
            raise KeyboardInterrupt
        return line

    def poll_line(self) -> Line | None:
        """A line that was typed meanwhile, without waiting for it. From a pipe never: the writer planned its
        lines for the questions that follow."""
        if not self._lines.interactive:
            return None
        try:
            text = self._lines.read(0.0)
        except EOFError:
            raise KeyboardInterrupt from None
        return None if text is None else Line(text, self.clock.now_s())

    def input_is_over(self) -> bool:
        """Whether the input has ended with no line left in it."""
        return self._lines.ended()


def printable(text: str) -> str:
    """Without the control characters of arrow keys."""
    return "".join(c for c in text if c.isprintable()).strip()


def shown(line: Line) -> str:
    """What was typed, as a sentence may name it."""
    plain = printable(line.text)[:20]
    return f"'{plain}'" if plain else "Enter alone"


def _keep_waiting() -> bool:
    return True
