"""Dialogue of line mode: write sentences to the terminal and wait for typed lines.

While it waits, it calls the sign of life of the session, which keeps the device running and may end the wait.
"""

import textwrap
from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from typing import TextIO

from protocols.wording.words import ENGLISH_WORDS, Words
from study.devices.clock import Clock
from study.tui.line_mode.line_input import LineInput
from study.workflows.trial.display import SignOfLife

POLL_INTERVAL_S = 0.05
"""Interval of the signs of life (s): half of the 0.1 s that the display port allows (`display.SignOfLife`)."""
LINE_WIDTH = 78
"""Characters per line: two less than the 80 columns of the narrowest usual terminal."""
LEAVE = "q"
"""Line by which the participant leaves the session, the same in every language."""


@dataclass(frozen=True, slots=True)
class Line:
    """A line that was typed."""

    text: str
    read_s: float
    """Time at which the line was read (s), on the session's clock."""

    @property
    def word(self) -> str:
        """The text, case-folded, for comparison with words."""
        return self.text.casefold()


class WaitOver(Enum):
    """Reason why a wait ended without a line; the values are logged as the reason of the unanswered trial."""

    INPUT_ENDED = "the input ended"
    CUT_SHORT = "the stimulus ended early"
    """The sign of life returned False: a fault, a request or a button of the device ended the wait."""
    TIME_LIMIT = "no answer within the time limit"


class Conversation:
    """Dialogue with the participant in lines of text, in the words of the protocol's language."""

    def __init__(self, lines: LineInput, output: TextIO, clock: Clock, words: Words = ENGLISH_WORDS) -> None:
        self._lines = lines
        self._output = output
        self.clock = clock
        self.words = words
        self.listen: Callable[[], object] = lambda: None
        """Called at each poll of `read_line` (`Display.listen_with`)."""

    def say(self, *sentences: str) -> None:
        """Write each sentence on a new line, wrapped at `LINE_WIDTH` between words."""
        for text in sentences:
            # Lines of a drawing are never longer, so that only sentences are wrapped.
            lines = textwrap.wrap(text, LINE_WIDTH) if len(text) > LINE_WIDTH else [text]
            self._output.write("\n".join(lines) + "\n")
        self._output.flush()

    def say_texts(self, *keys: str) -> None:
        """Write the texts with these keys, each on a new line."""
        self.say(*(self.words[key] for key in keys))

    def refuse(self, key: str, line: Line) -> None:
        """Write that a line was not understood. key: key of the text, in which the line is quoted."""
        self.say(self.words.fill(key, {"typed": quote_line(line, self.words)}))

    def prompt(self, text: str) -> None:
        """Write a text without a line end, so that the answer is typed after it."""
        self._output.write(text)
        self._output.flush()

    def discard_early_lines(self) -> None:
        """Drop lines that were typed before the question; lines of a pipe are kept."""
        self._lines.discard_early_lines()

    def wait(self, sign_of_life: SignOfLife, until_s: float = float("inf")) -> Line | WaitOver:
        """Wait for the next line; return it, or the reason why there is none. until_s: end of the wait on the session's
        clock (s). If the sign of life ends the wait, a line that arrives at the same time does not count."""
        while True:
            try:
                text = self._lines.read(POLL_INTERVAL_S)
            except EOFError:
                return WaitOver.INPUT_ENDED
            now_s = self.clock.now_s()
            if not sign_of_life():
                return WaitOver.CUT_SHORT
            if text is not None:
                return Line(text, now_s)
            if now_s > until_s:
                return WaitOver.TIME_LIMIT

    def read_line(self, listen: Callable[[], object] | None = None) -> Line:
        """Wait for the next line while no stimulus is played. listen: called at each poll in place of `self.listen`;
        its result does not end the wait. Raises KeyboardInterrupt at the end of the input, and what `listen` raises."""
        call = self.listen if listen is None else listen

        def keep_waiting() -> bool:
            """Sign of life that never ends the wait."""
            call()
            return True

        result = self.wait(keep_waiting)
        if isinstance(result, WaitOver):
            raise KeyboardInterrupt
        return result

    def read_line_or_leave(self) -> Line:
        """Wait for the next line while no stimulus is played. Raises KeyboardInterrupt for `LEAVE` and at the end of
        the input."""
        line = self.read_line()
        if line.word == LEAVE:
            raise KeyboardInterrupt
        return line

    def poll_line(self) -> Line | None:
        """Read a line that was typed already, without waiting; None without one. Always None for a pipe, whose lines
        are meant for later questions. Raises KeyboardInterrupt at the end of the input."""
        if not self._lines.is_interactive:
            return None
        try:
            text = self._lines.read(0.0)
        except EOFError:
            raise KeyboardInterrupt from None
        return None if text is None else Line(text, self.clock.now_s())

    def has_input_ended(self) -> bool:
        """Whether the input has ended and all its lines were read."""
        return self._lines.has_ended()


def remove_control_characters(text: str) -> str:
    """Remove control characters and surrounding blanks."""
    return "".join(character for character in text if character.isprintable()).strip()


def quote_line(line: Line, words: Words = ENGLISH_WORDS) -> str:
    """Quote a typed line for a sentence, with at most 20 characters, chosen; an empty line is described in words."""
    shown_text = remove_control_characters(line.text)[:20]
    return f"'{shown_text}'" if shown_text else words["line_enter_alone"]
