"""Line mode: enforced rests, and pauses with the choices to continue, to leave, to withdraw or to write a note.

No stimulus is played meanwhile.
"""

from collections.abc import Callable

from protocols.wording.words import Words
from study.session.views.views import AfterPause, PauseNotice, RestNotice
from study.session.watching.requests import NoteAsked
from study.tui.line_mode.conversation import GLANCE_S, Conversation, Line, WaitOver, printable
from study.tui.trial_words import progress_sentence
from study.workflows.trial.display import SignOfLife

COUNT_EVERY_S = 10.0
"""Interval at which the remaining time is written (s)."""


def rest(notice: RestNotice, talk: Conversation, sign_of_life: SignOfLife) -> float:
    """Count down an enforced rest, then wait for Enter. Returns the time rested (s). Raises KeyboardInterrupt when the
    participant leaves, or at the end of the input."""
    words = talk.words
    rested = words.fill("line_rest", {"seconds": f"{notice.seconds:.0f}"})
    talk.say("", f"{rested} {words.counted('runs_left', notice.runs_left)}")
    if notice.progress is not None:
        talk.say(progress_sentence(notice.progress, words))
    started_s = talk.clock.now_s()
    if _count_down(started_s + notice.seconds, talk, sign_of_life):
        talk.forget()
        talk.speak("enter_goes_on")
        line = talk.wait(sign_of_life)
        if line is WaitOver.INPUT_ENDED or (isinstance(line, Line) and line.word == "q"):
            raise KeyboardInterrupt
    return talk.clock.now_s() - started_s


def pause(
    notice: PauseNotice, talk: Conversation, note: Callable[[NoteAsked], None] | None, sign_of_life: SignOfLife
) -> AfterPause:
    """Wait in a pause until the participant decides how to continue; LEAVE if the sign of life ends the wait. note:
    stores a note in the log; None offers no notes. Raises KeyboardInterrupt at the end of the input."""
    talk.forget()
    words = talk.words
    paused = words.fill("line_pause", {"reason": words.fact(notice.reason)})
    talk.say("", f"{paused} {words.counted('saved', notice.answers)}")
    talk.say(_choices(note is not None, words))
    while True:
        talk.prompt(words["line_pause_prompt"])
        line = talk.wait(sign_of_life)
        if line is WaitOver.CUT_SHORT:
            return AfterPause.LEAVE
        if isinstance(line, WaitOver):
            raise KeyboardInterrupt
        match line.word:
            case "":
                return AfterPause.GO_ON
            case "q":
                return AfterPause.LEAVE
            case "w":
                if _withdraws(talk):
                    return AfterPause.WITHDRAW
            case "n" | "e" if note is not None:
                _take_note(line.word == "e", talk, note)
            case "?":
                talk.say(_choices(note is not None, words))
            case _:
                talk.refuse("line_pause_no_key", line)


def _choices(notes: bool, words: Words) -> str:
    """The keys of a pause. notes: whether notes are offered."""
    return " ".join(words[key] for key in ("line_pause_keys", *(["line_pause_notes"] if notes else [])))


def _withdraws(talk: Conversation) -> bool:
    """Whether the participant confirms the withdrawal of consent by typing a word."""
    word = talk.words["withdraw_word"]
    talk.speak("withdraw_all")
    talk.prompt(talk.words.fill("line_withdraw", {"word": word}))
    confirmed = talk.answer().word == word.casefold()
    if not confirmed:
        talk.speak("nothing_erased")
    return confirmed


def _take_note(adverse: bool, talk: Conversation, note: Callable[[NoteAsked], None]) -> None:
    """Ask for the text of a note, or of an adverse event, and store it; an empty line stores nothing."""
    talk.prompt(talk.words["line_happened" if adverse else "line_note"])
    text = printable(talk.answer().text)
    if not text:
        talk.speak("nothing_written")
        return
    note(NoteAsked("participant", text, adverse))
    talk.speak("line_noted")


def _count_down(until_s: float, talk: Conversation, sign_of_life: SignOfLife) -> bool:
    """Write the remaining time every `COUNT_EVERY_S`, until `until_s` on the session's clock (s). False if the sign of
    life ended the wait."""
    say_at_s = float("-inf")
    while (left_s := until_s - talk.clock.now_s()) > 1e-9:  # tolerance for rounding of clock times
        now_s = talk.clock.now_s()
        if left_s > COUNT_EVERY_S and now_s >= say_at_s:
            talk.say(f"{left_s:.0f} s")
            say_at_s = now_s + COUNT_EVERY_S
        talk.clock.sleep(min(GLANCE_S, left_s))
        if not sign_of_life():
            return False
    return True
