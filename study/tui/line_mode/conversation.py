"""Dialogue of line mode: sentences out, lines in."""

import textwrap
from dataclasses import dataclass
from enum import Enum
from typing import TextIO

from protocols.wording.words import ENGLISH_WORDS, Words
from study.devices.clock import Clock
from study.tui.line_mode.line_input import LineInput
from study.workflows.trial.display import SignOfLife

GLANCE_S = 0.05
"""Interval of the signs of life: half of what the port allows."""
LINE_WIDTH = 78
"""Characters per line: two less than the narrowest usual terminal."""


@dataclass(frozen=True, slots=True)
class Line:
    """A line that was typed."""

    text: str
    at_s: float
    """Clock time at which it arrived."""

    @property
    def word(self) -> str:
        """The text without regard to case, to compare with words."""
        return self.text.casefold()


class WaitOver(Enum):
    """Why no line came."""

    INPUT_ENDED = "the input ended"
    CUT_SHORT = "the stimulus ended early"
    """Ended by a request that the sign of life received."""
    TIME_LIMIT = "no answer within the time limit"


class Conversation:
    """Dialogue with the participant in lines of text, in the words of the protocol's language."""

    def __init__(self, lines: LineInput, out: TextIO, clock: Clock, words: Words = ENGLISH_WORDS) -> None:
        self._lines = lines
        self._out = out
        self.clock = clock
        self.words = words

    def say(self, *sentences: str) -> None:
        """Write each sentence on a line of its own, wrapped at `LINE_WIDTH` between words."""
        for text in sentences:
            # A drawing's lines are short enough; sentences break between words.
            lines = textwrap.wrap(text, LINE_WIDTH) if len(text) > LINE_WIDTH else [text]
            self._out.write("\n".join(lines) + "\n")
        self._out.flush()

    def speak(self, *keys: str) -> None:
        """Texts by their keys."""
        self.say(*(self.words[key] for key in keys))

    def refuse(self, key: str, line: Line) -> None:
        """Say that a line was not understood."""
        self.say(self.words.fill(key, {"typed": shown(line, self.words)}))

    def prompt(self, text: str) -> None:
        """Write a text without a line end: the answer is typed behind it."""
        self._out.write(text)
        self._out.flush()

    def forget(self) -> None:
        """Drop lines typed too early."""
        self._lines.forget()

    def wait(self, sign_of_life: SignOfLife, until_s: float = float("inf")) -> Line | WaitOver:
        """The next line, or why none came. A line that arrives with the end of the stimulus is too late."""
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
        """The next line while nothing is played. Raises KeyboardInterrupt if no line can come any more."""
        reply = self.wait(_keep_waiting)
        if isinstance(reply, WaitOver):
            raise KeyboardInterrupt
        return reply

    def answer_or_leave(self) -> Line:
        """Read an answer; the line "q" leaves."""
        line = self.answer()
        if line.word == "q":
            raise KeyboardInterrupt
        return line

    def poll_line(self) -> Line | None:
        """A line typed meanwhile, without waiting. Never from a pipe, whose lines are meant for later questions."""
        if not self._lines.interactive:
            return None
        try:
            text = self._lines.read(0.0)
        except EOFError:
            raise KeyboardInterrupt from None
        return None if text is None else Line(text, self.clock.now_s())

    def input_is_over(self) -> bool:
        """Whether the input has ended with no line left."""
        return self._lines.has_ended()


def printable(text: str) -> str:
    """The text without control characters, such as those of arrow keys."""
    return "".join(c for c in text if c.isprintable()).strip()


def shown(line: Line, words: Words = ENGLISH_WORDS) -> str:
    """The typed line as a sentence may quote it."""
    plain = printable(line.text)[:20]
    return f"'{plain}'" if plain else words["line_enter_alone"]


def _keep_waiting() -> bool:
    return True
