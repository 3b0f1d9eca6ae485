"""Line mode: enforced rests, and pauses with the choices to continue, to leave, to withdraw or to write a note."""

from collections.abc import Callable

from protocols.wording.words import Words
from study.session.views.participant_views import AfterPause, PauseNotice, RestNotice
from study.session.watching.requests import NoteAsked
from study.tui.line_mode.conversation import (
    LEAVE,
    POLL_INTERVAL_S,
    Conversation,
    Line,
    WaitOver,
    remove_control_characters,
)
from study.tui.trial_words import describe_progress
from study.workflows.trial.display import SignOfLife

COUNTDOWN_INTERVAL_S = 10.0
"""Interval at which the remaining time of a rest is written (s). Chosen."""


def run_rest(notice: RestNotice, conversation: Conversation, sign_of_life: SignOfLife) -> float:
    """Count down an enforced rest, then wait for Enter, unless the sign of life ends it. Returns the time rested (s).
    Raises KeyboardInterrupt where the line after the countdown is `LEAVE` or the input has ended."""
    words = conversation.words
    rest_text = words.fill("line_rest", {"seconds": f"{notice.seconds:.0f}"})
    conversation.say("", f"{rest_text} {words.fill_count('runs_left', notice.runs_left)}")
    if notice.progress is not None:
        conversation.say(describe_progress(notice.progress, words))
    start_s = conversation.clock.now_s()
    if _count_down(start_s + notice.seconds, conversation, sign_of_life):
        conversation.discard_early_lines()
        conversation.say_texts("enter_goes_on")
        line = conversation.wait(sign_of_life)
        if line is WaitOver.INPUT_ENDED or (isinstance(line, Line) and line.word == LEAVE):
            raise KeyboardInterrupt
    return conversation.clock.now_s() - start_s


def run_pause(
    notice: PauseNotice,
    conversation: Conversation,
    store_note: Callable[[NoteAsked], None] | None,
    sign_of_life: SignOfLife,
) -> AfterPause:
    """Wait in a pause until the participant decides how to continue; END_SITTING if the sign of life ends the wait.
    store_note: stores a note in the log; None offers no notes. Raises KeyboardInterrupt at the end of the input."""
    conversation.discard_early_lines()
    words = conversation.words
    pause_text = words.fill("line_pause", {"reason": words.translate_fact(notice.reason)})
    conversation.say("", f"{pause_text} {words.fill_count('saved', notice.answers)}")
    conversation.say(_list_pause_keys(store_note is not None, words))
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
                if _confirm_withdrawal(conversation, sign_of_life):
                    return AfterPause.WITHDRAW
            case "n" | "e" if store_note is not None:
                _take_note(line.word == "e", conversation, store_note, sign_of_life)
            case "?":
                conversation.say(_list_pause_keys(store_note is not None, words))
            case _:
                conversation.refuse("line_pause_no_key", line)


def _list_pause_keys(has_notes: bool, words: Words) -> str:
    """List the keys of a pause as text."""
    return " ".join(words[key] for key in ("line_pause_keys", *(["line_pause_notes"] if has_notes else [])))


def _confirm_withdrawal(conversation: Conversation, sign_of_life: SignOfLife) -> bool:
    """Ask the participant to confirm the withdrawal of consent by typing a word. Returns whether it was typed; a stop
    that is requested meanwhile ends the pause only afterwards."""
    word = conversation.words["withdraw_word"]
    conversation.say_texts("withdraw_all")
    conversation.prompt(conversation.words.fill("line_withdraw", {"word": word}))
    is_confirmed = conversation.words.is_typed("withdraw_word", conversation.read_line(sign_of_life).text)
    if not is_confirmed:
        conversation.say_texts("nothing_erased")
    return is_confirmed


def _take_note(
    is_adverse: bool, conversation: Conversation, store_note: Callable[[NoteAsked], None], sign_of_life: SignOfLife
) -> None:
    """Ask for the text of a note, or of an adverse event where `is_adverse`, and store it without control
    characters; an empty line stores nothing. A stop that is requested meanwhile ends the pause only afterwards."""
    conversation.prompt(conversation.words["line_happened" if is_adverse else "line_note"])
    text = remove_control_characters(conversation.read_line(sign_of_life).text)
    if not text:
        conversation.say_texts("nothing_written")
        return
    store_note(NoteAsked("participant", text, is_adverse))
    conversation.say_texts("line_noted")


def _count_down(until_s: float, conversation: Conversation, sign_of_life: SignOfLife) -> bool:
    """Wait until `until_s` on the session's clock (s), and write the remaining time every `COUNTDOWN_INTERVAL_S` while
    more than that is left. Returns False if the sign of life ended the wait."""
    next_message_s = float("-inf")
    while (remaining_s := until_s - conversation.clock.now_s()) > 1e-9:  # tolerance for rounding of clock times
        now_s = conversation.clock.now_s()
        if remaining_s > COUNTDOWN_INTERVAL_S and now_s >= next_message_s:
            conversation.say(f"{remaining_s:.0f} s")
            next_message_s = now_s + COUNTDOWN_INTERVAL_S
        conversation.clock.sleep(min(POLL_INTERVAL_S, remaining_s))
        if not sign_of_life():
            return False
    return True
