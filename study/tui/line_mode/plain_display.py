"""Line mode: the display of a session in plain sentences, for any terminal, a screen reader, or answers from a pipe.

`PlainDisplay` implements the display port by the functions of `plain_forms`, `plain_demo`, `plain_question` and
`plain_pause`, which share a `Conversation`.
"""

from collections.abc import Callable
from typing import TextIO

from protocols.wording.words import ENGLISH_WORDS, Words
from study.devices.clock import Clock
from study.session.views.form_views import Form, FormReply
from study.session.views.participant_views import (
    AfterPause,
    DemoChoice,
    DemoMenu,
    DeviceReport,
    Goodbye,
    HandleView,
    PauseNotice,
    PlayingNotice,
    PracticeResult,
    Question,
    Reply,
    RestNotice,
    Unanswered,
    Welcome,
)
from study.session.watching.requests import NoteAsked
from study.tui.keys.answer_keys import DIGITS, AnswerKeys
from study.tui.line_mode import plain_demo, plain_forms, plain_pause, plain_question
from study.tui.line_mode.conversation import Conversation
from study.tui.line_mode.line_input import LineInput
from study.tui.trial_words import choose_run_key, describe_progress, describe_refusal, describe_void_trial
from study.workflows.trial.display import SignOfLife


class PlainDisplay:
    """The display port (`study.workflows.trial.display.Display`) in lines of text; the docstrings of `Display` apply.

    lines, output: the terminal or pipe; note: stores a note or an adverse event that is typed during a pause; if None,
    the pause offers no notes.
    """

    def __init__(
        self,
        lines: LineInput,
        output: TextIO,
        clock: Clock,
        keys: AnswerKeys = DIGITS,
        note: Callable[[NoteAsked], None] | None = None,
        words: Words = ENGLISH_WORDS,
    ) -> None:
        self._words = words
        self._conversation = Conversation(lines, output, clock, words)
        self._keys = keys
        self._note = note
        self._demo_shown = False
        self._announced_run: tuple[str, int] | None = None
        """Run whose progress was written last, so that it is written once per run."""

    def listen_with(self, listen: Callable[[], None]) -> None:
        self._conversation.listen = listen

    def fill_in(self, form: Form) -> FormReply:
        return plain_forms.ask_form(form, self._conversation)

    def device_checked(self, report: DeviceReport) -> bool:
        return plain_forms.show_device_check(report, self._conversation)

    def welcome(self, notice: Welcome) -> None:
        plain_question.show_instructions(notice, self._conversation, self._keys)

    def choose_demo(self, menu: DemoMenu, sign_of_life: SignOfLife) -> DemoChoice:
        if not self._demo_shown:
            self._conversation.say(
                "", self._words["line_demo"], *plain_question.draw_direction_picture(menu.picture, self._words)
            )
            self._demo_shown = True
        return plain_demo.choose_demo(menu, self._conversation, self._keys, sign_of_life)

    def show_playing(self, notice: PlayingNotice, sign_of_life: SignOfLife) -> Unanswered | None:
        return plain_demo.show_playing(notice, self._conversation, sign_of_life)

    def await_handle(self, look: Callable[[], HandleView], sign_of_life: SignOfLife) -> Unanswered | None:
        return plain_demo.await_handle(look, self._conversation, sign_of_life)

    def ask(self, question: Question, sign_of_life: SignOfLife) -> Reply:
        current_run = (choose_run_key(question), question.run_number)
        if question.progress is not None and current_run != self._announced_run:
            self._conversation.say("", describe_progress(question.progress, self._words))
            self._announced_run = current_run
        return plain_question.ask_question(question, self._conversation, self._keys, sign_of_life)

    def feedback(self, correct: bool) -> None:
        self._conversation.say_texts("right" if correct else "wrong")

    def practice_over(self, result: PracticeResult) -> None:
        plain_question.show_practice_result(result, self._conversation)

    def rest(self, notice: RestNotice, sign_of_life: SignOfLife) -> float:
        return plain_pause.run_rest(notice, self._conversation, sign_of_life)

    def pause(self, notice: PauseNotice, sign_of_life: SignOfLife) -> AfterPause:
        return plain_pause.run_pause(notice, self._conversation, self._note, sign_of_life)

    def await_return(self, reason: str) -> None:
        self._conversation.discard_early_lines()
        self._conversation.say("", f"{self._words['void_title']}. {describe_void_trial(reason, self._words)}")
        self._conversation.say_texts("line_ready_again")
        self._conversation.read_line_or_leave()

    def goodbye(self, notice: Goodbye) -> None:
        words = self._words
        if notice.outcome:
            self._conversation.say("", *describe_refusal(notice.outcome, words))
        elif notice.finished:
            self._conversation.say("", words.fill_count("line_finished", notice.answers))
        else:
            ending_with_reason = words.fill("line_over_because", {"reason": words.translate_fact(notice.reason)})
            ending = ending_with_reason if notice.reason else words["line_over"]
            self._conversation.say("", f"{ending} {words.fill_count('saved', notice.answers)} {words['line_thanks']}")

    def trouble(self, sentence: str) -> None:
        self._conversation.say(self._words.translate_fact(sentence))
