"""Line mode: the participant's part in plain sentences, for any terminal, a screen reader, or a pipe of answers."""

import textwrap
from typing import TextIO

from protocols.trial import Phase
from study.devices.clock import Clock
from study.session.views import Answered, Goodbye, Question, Reply, RestNotice, Unanswered, Welcome
from study.tui.direction_picture import drawing, sentence
from study.tui.line_input import LineInput
from study.workflows.display import SignOfLife

GLANCE_S = 0.05
LINE_WIDTH = 78
KEYS = (
    "Keys: 1 or 2 answers, r skips this one and plays a new one, q leaves, ? shows this. Each followed by Enter. "
    "Ctrl-C stops the device at once."
)


class PlainDisplay:
    def __init__(
        self,
        lines: LineInput,
        out: TextIO,
        clock: Clock,
    ) -> None:
        self._lines = lines
        self._out = out
        self._clock = clock
        self._picture: tuple[str, ...] = ()

    def welcome(self, notice: Welcome) -> None:
        picture = notice.picture
        self._picture = (*drawing(picture), sentence(picture, 1), sentence(picture, 2))
        self._say(notice.title, "")
        if notice.resumed_after:
            self._say(
                f"Welcome back: {notice.resumed_after} answers are on disk; the study goes on where it stopped.", ""
            )
        self._say(
            "Hold the handle with a constant, comfortable grip. In each trial it shakes along one of two directions:",
            "",
            *self._picture,
            "",
            "Feel as long as you like, then type its number and Enter. When in doubt, guess.",
            _plan(notice),
            KEYS,
        )
        if not notice.felt:
            self._say("", f"Practice: the device is a simulation ({notice.device}), so nothing moves here.")
            self._say("Your answers are marked 'not felt' and never enter an analysis of people.")
        self._say("", "Press Enter to begin.")
        self._wait_for_enter()

    def ask(self, question: Question, sign_of_life: SignOfLife) -> Reply:
        self._lines.forget()
        self._say("", _trial_heading(question))
        self._prompt("1 or 2? ")
        until_s = self._clock.now_s() + question.time_limit_s if question.time_limit_s else float("inf")
        while True:
            try:
                line = self._lines.read(GLANCE_S)
            except EOFError:
                return Unanswered("the input ended", leave=True)
            now_s = self._clock.now_s()
            if not sign_of_life():
                return Unanswered("the stimulus ended early", leave=False)
            if line is None:
                if now_s > until_s:
                    return Unanswered("no answer within the time limit", leave=False)
                continue
            reply = self._understand(line, now_s)
            if reply is not None:
                return reply

    def feedback(self, correct: bool) -> None:
        self._say("Right." if correct else "Wrong.")

    def rest(self, notice: RestNotice) -> float:
        left = "1 run is" if notice.runs_left == 1 else f"{notice.runs_left} runs are"
        self._say("", f"Rest. Let go of the handle for at least {notice.seconds:.0f} s. {left} left.")
        started_s = self._clock.now_s()
        self._count_down(started_s + notice.seconds)
        self._lines.forget()
        self._say("Press Enter to go on.")
        self._wait_for_enter()
        return self._clock.now_s() - started_s

    def await_return(self, reason: str) -> None:
        self._lines.forget()
        self._say("", f"The last trial is void: {reason}. Press Enter when you are ready for it again.")
        self._wait_for_enter()

    def goodbye(self, notice: Goodbye) -> None:
        if notice.finished:
            self._say("", f"Finished: {notice.answers} answers. Thank you.")

    def trouble(self, sentence: str) -> None:
        self._say(sentence)

    def _understand(self, line: str, now_s: float) -> Reply | None:
        match line.lower():
            case "1" | "2":
                return Answered(int(line), now_s)
            case "q":
                return Unanswered("the participant left", leave=True)
            case "r":
                return Unanswered("asked to repeat", leave=False, asked=True)
            case "?":
                self._say(*self._picture, KEYS)
            case _:
                self._say(f"{_shown(line)} is no answer. Type 1 or 2 and Enter; ? for help.")
        self._prompt("1 or 2? ")
        return None

    def _count_down(self, until_s: float) -> None:
        """Says every ten seconds how long it takes; sleeping too, so that virtual time passes as well."""
        while (left_s := until_s - self._clock.now_s()) > 0:
            if left_s > 10:
                self._say(f"{left_s:.0f} s")
            self._clock.sleep(min(10.0, left_s))

    def _wait_for_enter(self) -> None:
        while True:
            try:
                line = self._lines.read(GLANCE_S)
            except EOFError:
                raise KeyboardInterrupt from None
            if line is None:
                continue
            if line.lower() == "q":
                raise KeyboardInterrupt
            return

    def _say(self, *sentences: str) -> None:
        for text in sentences:
            # The picture's lines are short enough; sentences break between words.
            lines = textwrap.wrap(text, LINE_WIDTH) if len(text) > LINE_WIDTH else [text]
            self._out.write("\n".join(lines) + "\n")
        self._out.flush()

    def _prompt(self, text: str) -> None:
        self._out.write(text)
        self._out.flush()


def _plan(notice: Welcome) -> str:
    runs = f"{notice.runs} run{'s' if notice.runs != 1 else ''}"
    if notice.training_runs and notice.runs:
        return f"There is some training first, then {runs} with rests between them."
    return f"There {'are' if notice.runs != 1 else 'is'} {runs}." if notice.runs else "This is a training session."


def _trial_heading(question: Question) -> str:
    phase = "Training" if question.phase is Phase.TRAINING else "Run"
    again = ", once more" if question.repeated else ""
    return f"{phase} {question.run_number} of {question.runs_in_phase}, trial {question.trial_number}{again}"


def _shown(line: str) -> str:
    """What was typed, without the control characters of arrow keys."""
    plain = "".join(c for c in line if c.isprintable())[:20]
    return f"'{plain}'" if plain else "Enter alone"
