"""Screen of a trial: a two-alternative forced choice between two directions, or two intervals, by the keys 1 and 2.

Nothing on it depends on level or frequency. Whether an answer was right is shown only where the protocol gives
feedback."""

import time
from dataclasses import dataclass
from typing import ClassVar

from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Horizontal
from textual.events import Key, Paste
from textual.message import Message
from textual.timer import Timer
from textual.widgets import Footer

from protocols.wording.words import ENGLISH_WORDS, Words
from study.session.views.participant_views import Answered, Question, Reply, Task, Unanswered
from study.tui.keys.answer_keys import DIGITS, AnswerKeys
from study.tui.keys.key_presses import KeyPressDetector, get_arrival_time_s
from study.tui.translated_screen import TranslatedScreen
from study.tui.trial_replies import LEAVING, PAUSE, REPEAT, TIME_OVER, format_repeat_text
from study.tui.trial_words import choose_run_key, format_heading
from study.tui.widgets.direction_panel import DirectionPanel, Mark
from study.tui.widgets.literal_text import LiteralText
from study.tui.widgets.session_bar import SessionBar

QUESTION_TEXTS = {Task.DIRECTION: "asked_direction", Task.INTERVAL: "asked_interval"}
"""Key of the question's text, by task."""
REPLIES = {"pause": PAUSE, "leave": LEAVING, "repeat": REPEAT}
"""Replies other than an answer, by the argument of their key binding."""
REPLY_TEXTS = {
    PAUSE: "pause_let_go",
    LEAVING: "pause_let_go",
    TIME_OVER: "time_over",
}
"""Key of the text shown after a reply. REPEAT has none: its text states the number of repeats left."""
REQUEST_VALIDITY_S = 3.0
"""Time (s) for which a request to pause or leave that is made between two questions is kept. Chosen. A question that
comes within it is answered with the request at once."""
NUM_LOCK_OFF_KEYS = {"end", "down", "kp_begin"}
"""Names of the keys that a numeric keypad sends in place of 1, 2 and 5 while Num Lock is off."""


class TrialScreen(TranslatedScreen[None]):
    """Shows the question, both answers, and the progress of the session. 1 and 2 (and further answer keys) answer, p
    pauses, r asks for the trial again, q leaves. The same screen serves all questions until the device is prepared
    again: it is armed for each question and takes no answer in between."""

    PAGE = "help_trial"
    DEFAULT_CSS = """
    TrialScreen { layout: vertical; }
    TrialScreen #asked { height: auto; min-height: 1; margin: 1 1 0 1; text-align: center; text-style: bold; }
    TrialScreen #answers { height: 1fr; margin: 0 1; }
    TrialScreen #message { height: auto; min-height: 1; margin: 0 1; text-align: center; text-style: bold; }
    TrialScreen #trouble { height: 2; margin: 0 1; text-align: center; color: $text-warning; }
    """
    AUTO_FOCUS = ""
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("1", "heard(1)", "Answer 1"),
        Binding("2", "heard(2)", "Answer 2"),
        Binding("p", "reply('pause')", "Pause"),
        Binding("r", "reply('repeat')", "Again"),
        Binding("q", "reply('leave')", "Leave"),
    ]

    @dataclass
    class Replied(Message):
        """The participant's reply. Posted at most once for each call of `arm`."""

        reply: Reply

    def __init__(self, keys: AnswerKeys = DIGITS, words: Words = ENGLISH_WORDS) -> None:
        super().__init__(words)
        self._keys = keys
        self._press_detector = KeyPressDetector()
        self._question: Question | None = None
        self._repeats_left: int | None = None
        # Time from which a reply is accepted (s, monotonic clock); None where none is.
        self._armed_s: float | None = None
        # Answer to the current question, 1 or 2; 0 without one.
        self._accepted_answer = 0
        self._time_limit_timer: Timer | None = None
        # Problem shown below the answers; empty for none.
        self._trouble = ""
        # Whether a question was shown together with this problem, so that the next call of `arm` removes it.
        self._is_trouble_old = False
        self._verdict: bool | None = None
        """Whether the last answer was right; None without feedback."""
        # Request made between two questions, and its time (s, monotonic clock); None without one.
        self._pending_request: tuple[Unanswered, float] | None = None

    def compose(self) -> ComposeResult:
        yield SessionBar(self.words)
        yield LiteralText(id="asked")
        with Horizontal(id="answers"):
            yield DirectionPanel(1, words=self.words)
            yield DirectionPanel(2, words=self.words)
        yield LiteralText(id="message")
        yield LiteralText(id="trouble")
        yield Footer(show_command_palette=False)

    def on_mount(self) -> None:
        self._show_question()

    def arm(self, question: Question) -> None:
        """Show a question and accept one reply to it. Starts its time limit (s), where it has one."""
        self._stop_time_limit()
        if self._question is not None and choose_run_key(question) != choose_run_key(self._question):
            self._verdict = None  # another kind of run begins, which may give no feedback
        self._question, self._repeats_left, self._accepted_answer = question, question.repeats_left, 0
        # Feedback is repeated with the next question: the trial that it belongs to ends too soon to read it.
        previous_verdict, self._verdict = self._verdict, None
        if self._is_trouble_old:
            self.show_trouble("")
        self._is_trouble_old = True
        if question.time_limit_s > 0:
            self._time_limit_timer = self.set_timer(question.time_limit_s, self._end_at_time_limit)
        self._show_question(
            "" if previous_verdict is None else f"{self.words['last_right' if previous_verdict else 'last_wrong']} "
        )
        self._armed_s = time.monotonic()
        if self._pending_request is not None and self._armed_s - self._pending_request[1] < REQUEST_VALIDITY_S:
            self._post_reply(self._pending_request[0])
        self._pending_request = None

    def disarm(self) -> None:
        """Accept no further reply until `arm` is called again, and stop the time limit."""
        self._armed_s = None
        self._stop_time_limit()
        if not self._accepted_answer:
            self._show_message(self.words["wait"])

    def show_saved(self) -> None:
        """Show that the answer was written to the log on disk."""
        if self._accepted_answer:
            self._show_mark("saved")
            saved_text = f"{self.words.fill('answer_saved', {'answer': self._accepted_answer})} {self.words['wait']}"
            self._show_message(self._describe_verdict() or saved_text)

    def show_feedback(self, correct: bool) -> None:
        """Show whether the answer was right, now and again with the next question of the same kind of run."""
        self._verdict = correct
        self._show_message(self._describe_verdict())

    def show_trouble(self, sentence: str) -> None:
        """Show a problem below the answers. So that there is time to read it, the next call of `arm` keeps it, and the
        call after that removes it."""
        self._trouble = sentence
        self._is_trouble_old = False
        if self._is_composed:
            self.query_one("#trouble", LiteralText).update(sentence)

    def on_key(self, event: Key) -> None:
        """Take an answer, or explain why a key has no effect."""
        arrival_time_s = get_arrival_time_s(event)
        answer = self._keys.parse_answer(event.character or event.key)
        if answer is not None:
            event.stop()
            self._take_answer(answer, arrival_time_s)
        elif self._armed_s is not None and event.key not in self.active_bindings:
            self._explain_refused_key(event)

    def on_paste(self, event: Paste) -> None:
        """Refuse pasted text: it is no answer."""
        event.stop()
        if self._armed_s is not None:
            self._show_message(f"{self.words['pasted']} {self._describe_answer_keys()}")

    def action_reply(self, reply_name: str) -> None:
        """Post a reply of `REPLIES`. A repetition beyond the allowed number is refused; a request to pause or leave
        between two questions is kept for `REQUEST_VALIDITY_S`."""
        reply = REPLIES[reply_name]
        if self._armed_s is not None and reply is REPEAT and self._repeats_left == 0:
            self._show_message(f"{self.words['no_repeats']} {self._describe_answer_keys()}")
        elif self._armed_s is not None:
            self._post_reply(reply)
        elif reply.pause:
            self._pending_request = reply, time.monotonic()
            self._show_message(self.words["pause_comes"])

    def action_heard(self, answer: int) -> None:
        """Do nothing: the binding exists for its entry in the footer; `on_key` handles the answers."""

    def _take_answer(self, answer: int, arrival_time_s: float) -> None:
        """Post an answer (1 or 2), unless the key is held down or arrived before the question. arrival_time_s: arrival
        of the key (s, monotonic clock)."""
        armed_s = self._armed_s
        is_press = self._press_detector.record_event(
            answer, arrival_time_s, float("inf") if armed_s is None else armed_s
        )
        if armed_s is None or arrival_time_s < armed_s:
            return
        if not is_press:
            self._show_message(f"{self.words['key_held']} {self._describe_answer_keys()}")
            return
        self._armed_s = None
        self.post_message(self.Replied(Answered(answer, arrival_time_s)))
        self._stop_time_limit()
        self._accepted_answer = answer
        self._show_mark("taken")
        self._show_message(self.words.fill("answer_taken", {"answer": answer}))

    def _post_reply(self, reply: Unanswered) -> None:
        """Post a reply other than an answer, accept no further reply, and show a text about it."""
        self._armed_s = None
        self.post_message(self.Replied(reply))
        self._stop_time_limit()
        self._show_message(
            self.words[REPLY_TEXTS[reply]]
            if reply in REPLY_TEXTS
            else format_repeat_text(self._repeats_left, self.words)
        )

    def _end_at_time_limit(self) -> None:
        """Reply `TIME_OVER` if the question is still unanswered."""
        if self._armed_s is not None:
            self._post_reply(TIME_OVER)

    def _stop_time_limit(self) -> None:
        """Stop the timer of the question's time limit, if there is one."""
        if self._time_limit_timer is not None:
            self._time_limit_timer.stop()
            self._time_limit_timer = None

    def _explain_refused_key(self, event: Key) -> None:
        """Show why a key that is no reply has no effect; other keys without a character are ignored."""
        if event.key in NUM_LOCK_OFF_KEYS:
            self._show_message(self.words["num_lock"])
        elif event.is_printable or event.key == "enter":
            text_key = {"enter": "enter_key", "space": "space_key"}.get(event.key)
            key_text = f"'{event.character}'" if text_key is None else self.words[text_key]
            self._show_message(f"{self.words.fill('no_answer', {'typed': key_text})} {self._describe_answer_keys()}")

    def _describe_verdict(self) -> str:
        """Describe whether the last answer was right; empty without feedback."""
        return "" if self._verdict is None else self.words["right" if self._verdict else "wrong"]

    def _show_question(self, feedback_text: str = "") -> None:
        """Redraw the screen for the current question. feedback_text: text about the previous answer, put before the
        message."""
        if not self._is_composed:
            return
        self.query_one("#trouble", LiteralText).update(self._trouble)
        question = self._question
        if question is None:
            self._show_message(self.words["wait"])
            return
        bar = self.query_one(SessionBar)
        bar.heading, bar.progress = format_heading(question, self.words), question.progress
        self.query_one("#asked", LiteralText).update(self.words[QUESTION_TEXTS[question.task]])
        for panel in self.query(DirectionPanel):
            panel.picture = question.picture if question.task is Task.DIRECTION else None
            panel.mark = ""
        self._show_message(f"{feedback_text}{self._describe_answer_keys()} {self.words['guess']}")

    @property
    def _is_composed(self) -> bool:
        """Whether the widgets exist; the screen may be armed before its first frame."""
        return bool(self.query("#message"))

    def _show_mark(self, mark: Mark) -> None:
        """Show the mark on the panel of the accepted answer, and none on the other."""
        for panel in self.query(DirectionPanel):
            panel.mark = mark if panel.number == self._accepted_answer else ""

    def _describe_answer_keys(self) -> str:
        """Describe the keys that answer."""
        return self.words.fill("press", {"keys": self._keys.describe_keys(self.words)})

    def _show_message(self, sentence: str) -> None:
        """Show a sentence below the answers; nothing before the widgets exist."""
        if self._is_composed:
            self.query_one("#message", LiteralText).update(sentence)
