"""Line mode: rests and pauses, with nothing played, and notes for the log."""

from collections.abc import Callable

from study.session.views.counted import answers_are
from study.session.views.views import AfterPause, PauseNotice, RestNotice
from study.session.watching.requests import NoteAsked
from study.tui.line_mode.conversation import GLANCE_S, Conversation, Line, WaitOver, printable, shown
from study.tui.trial_words import WITHDRAW, progress_sentence, runs_left
from study.workflows.trial.display import SignOfLife

COUNT_EVERY_S = 10.0


def rest(notice: RestNotice, talk: Conversation, sign_of_life: SignOfLife) -> float:
    left = runs_left(notice.runs_left)
    talk.say("", f"Rest. Let go of the handle for at least {notice.seconds:.0f} s. {left}")
    if notice.progress is not None:
        talk.say(progress_sentence(notice.progress))
    started_s = talk.clock.now_s()
    if _count_down(started_s + notice.seconds, talk, sign_of_life):
        talk.forget()
        talk.say("Press Enter to go on.")
        line = talk.wait(sign_of_life)
        if line is WaitOver.INPUT_ENDED or (isinstance(line, Line) and line.word == "q"):
            raise KeyboardInterrupt
    return talk.clock.now_s() - started_s


def pause(
    notice: PauseNotice, talk: Conversation, note: Callable[[NoteAsked], None] | None, sign_of_life: SignOfLife
) -> AfterPause:
    talk.forget()
    talk.say("", f"Pause ({notice.reason}). Nothing is played. {answers_are(notice.answers)} on disk.")
    talk.say(_choices(notes=note is not None))
    while True:
        talk.prompt("Enter goes on: ")
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
                talk.say(_choices(notes=note is not None))
            case _:
                talk.say(f"{shown(line)} is none of the keys; ? tells them.")


def _choices(notes: bool) -> str:
    more = " n writes a note, e reports that something happened to the participant." if notes else ""
    return f"Enter goes on, q leaves and another day goes on, w takes the consent back and erases the session.{more}"


def _withdraws(talk: Conversation) -> bool:
    talk.say("Everything recorded of this participant will be erased, and cannot be brought back.")
    talk.prompt(f"Type {WITHDRAW} to confirm; Enter alone keeps everything: ")
    confirmed = talk.answer().word == WITHDRAW
    if not confirmed:
        talk.say("Nothing is erased.")
    return confirmed


def _take_note(adverse: bool, talk: Conversation, note: Callable[[NoteAsked], None]) -> None:
    talk.prompt("What happened? " if adverse else "Note: ")
    text = printable(talk.answer().text)
    if not text:
        talk.say("Nothing was written.")
        return
    note(NoteAsked("participant", text, adverse))
    talk.say("Written into the log.")


def _count_down(until_s: float, talk: Conversation, sign_of_life: SignOfLife) -> bool:
    """Announce the remaining time every ten seconds. False if the sign of life ended the wait."""
    say_at_s = float("-inf")
    while (left_s := until_s - talk.clock.now_s()) > 1e-9:
        now_s = talk.clock.now_s()
        if left_s > COUNT_EVERY_S and now_s >= say_at_s:
            talk.say(f"{left_s:.0f} s")
            say_at_s = now_s + COUNT_EVERY_S
        talk.clock.sleep(min(GLANCE_S, left_s))
        if not sign_of_life():
            return False
    return True
