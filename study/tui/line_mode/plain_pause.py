"""Line mode: enforced rests, and pauses with the choices to continue, to leave, to withdraw or to write a note.

No stimulus is played meanwhile.
"""

from collections.abc import Callable

from protocols.wording.words import Words
from study.session.views.views import AfterPause, PauseNotice, RestNotice
from study.session.watching.requests import NoteAsked
from study.tui.line_mode.conversation import POLL_INTERVAL_S, Conversation, Line, WaitOver, printable
from study.tui.trial_words import describe_progress
from study.workflows.trial.display import SignOfLife

COUNT_EVERY_S = 10.0
"""Interval at which the remaining time is written (s)."""


def run_rest(notice: RestNotice, conversation: Conversation, sign_of_life: SignOfLife) -> float:
    """Count down an enforced rest, then wait for Enter. Returns the time rested (s). Raises KeyboardInterrupt when the
    participant leaves, or at the end of the input."""
    words = conversation.words
    rested = words.fill("line_rest", {"seconds": f"{notice.seconds:.0f}"})
    conversation.say("", f"{rested} {words.fill_count('runs_left', notice.runs_left)}")
    if notice.progress is not None:
        conversation.say(describe_progress(notice.progress, words))
    started_s = conversation.clock.now_s()
    if _count_down(started_s + notice.seconds, conversation, sign_of_life):
        conversation.discard_early_lines()
        conversation.say_texts("enter_goes_on")
        line = conversation.wait(sign_of_life)
        if line is WaitOver.INPUT_ENDED or (isinstance(line, Line) and line.word == "q"):
            raise KeyboardInterrupt
    return conversation.clock.now_s() - started_s


def pause(
    notice: PauseNotice, conversation: Conversation, note: Callable[[NoteAsked], None] | None, sign_of_life: SignOfLife
) -> AfterPause:
    """Wait in a pause until the participant decides how to continue; LEAVE if the sign of life ends the wait. note:
    stores a note in the log; None offers no notes. Raises KeyboardInterrupt at the end of the input."""
    conversation.discard_early_lines()
    words = conversation.words
    paused = words.fill("line_pause", {"reason": words.fact(notice.reason)})
    conversation.say("", f"{paused} {words.fill_count('saved', notice.answers)}")
    conversation.say(_choices(note is not None, words))
    while True:
        conversation.prompt(words["line_pause_prompt"])
        line = conversation.wait(sign_of_life)
        if line is WaitOver.CUT_SHORT:
            return AfterPause.END_SITTING
        if isinstance(line, WaitOver):
            raise KeyboardInterrupt
        match line.word:
            case "":
                return AfterPause.CONTINUE_SITTING
            case "q":
                return AfterPause.END_SITTING
            case "w":
                if _withdraws(conversation):
                    return AfterPause.WITHDRAW
            case "n" | "e" if note is not None:
                _take_note(line.word == "e", conversation, note)
            case "?":
                conversation.say(_choices(note is not None, words))
            case _:
                conversation.refuse("line_pause_no_key", line)


def _choices(notes: bool, words: Words) -> str:
    """The keys of a pause. notes: whether notes are offered."""
    return " ".join(words[key] for key in ("line_pause_keys", *(["line_pause_notes"] if notes else [])))


def _withdraws(conversation: Conversation) -> bool:
    """Whether the participant confirms the withdrawal of consent by typing a word."""
    word = conversation.words["withdraw_word"]
    conversation.say_texts("withdraw_all")
    conversation.prompt(conversation.words.fill("line_withdraw", {"word": word}))
    confirmed = conversation.answer().word == word.casefold()
    if not confirmed:
        conversation.say_texts("nothing_erased")
    return confirmed


def _take_note(adverse: bool, conversation: Conversation, note: Callable[[NoteAsked], None]) -> None:
    """Ask for the text of a note, or of an adverse event, and store it; an empty line stores nothing."""
    conversation.prompt(conversation.words["line_happened" if adverse else "line_note"])
    text = printable(conversation.answer().text)
    if not text:
        conversation.say_texts("nothing_written")
        return
    note(NoteAsked("participant", text, adverse))
    conversation.say_texts("line_noted")


def _count_down(until_s: float, conversation: Conversation, sign_of_life: SignOfLife) -> bool:
    """Write the remaining time every `COUNT_EVERY_S`, until `until_s` on the session's clock (s). False if the sign of
    life ended the wait."""
    next_say_s = float("-inf")
    while (remaining_s := until_s - conversation.clock.now_s()) > 1e-9:  # tolerance for rounding of clock times
        now_s = conversation.clock.now_s()
        if remaining_s > COUNT_EVERY_S and now_s >= next_say_s:
            conversation.say(f"{remaining_s:.0f} s")
            next_say_s = now_s + COUNT_EVERY_S
        conversation.clock.sleep(min(POLL_INTERVAL_S, remaining_s))
        if not sign_of_life():
            return False
    return True
