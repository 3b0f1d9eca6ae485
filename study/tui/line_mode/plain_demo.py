"""Line mode: the demonstration menu, and the waits while a stimulus plays or the handle is moved to its place.

During each wait, `sign_of_life` is called at every poll; it returns False to end the wait.
"""

from collections.abc import Callable

from protocols.wording.words import Words
from study.session.views.participant_views import (
    DemoChoice,
    DemoDone,
    DemoMenu,
    HandleView,
    PlayDemo,
    PlayingNotice,
    Unanswered,
)
from study.tui.drawing.direction_picture import describe_direction_ends
from study.tui.keys.answer_keys import AnswerKeys
from study.tui.line_mode.conversation import LEAVE, POLL_INTERVAL_S, Conversation, WaitOver
from study.tui.line_mode.plain_question import PARTICIPANT_LEFT
from study.tui.trial_replies import PAUSE
from study.tui.trial_words import describe_felt_directions
from study.workflows.trial.display import SignOfLife

MIN_MESSAGE_INTERVAL_S = 1.0
"""Shortest interval between two sentences on the handle (s). Chosen: a screen reader can finish each sentence."""

CUT_SHORT = Unanswered(WaitOver.CUT_SHORT.value, ends_sitting=False)
"""Reply if the sign of life ended the wait."""
INPUT_ENDED = Unanswered(WaitOver.INPUT_ENDED.value, ends_sitting=True)
"""Reply at the end of the input."""


def choose_demo(menu: DemoMenu, conversation: Conversation, keys: AnswerKeys, sign_of_life: SignOfLife) -> DemoChoice:
    """Let the participant choose a vibration (n, b) and a direction to play; Enter, or a false sign of life, ends the
    demonstration. Raises KeyboardInterrupt when the participant leaves, or at the end of the input."""
    conversation.discard_early_lines()
    vibration = menu.vibration
    conversation.say("", _describe_vibration(menu, vibration, conversation.words))
    while True:
        conversation.prompt(
            conversation.words.fill("line_demo_prompt", {"keys": keys.describe_keys(conversation.words)})
        )
        line = conversation.wait(sign_of_life)
        if line is WaitOver.CUT_SHORT:
            return DemoDone()
        if isinstance(line, WaitOver) or line.word == LEAVE:
            raise KeyboardInterrupt
        if line.word in ("", "done"):
            return DemoDone()
        if line.word in ("n", "b"):
            vibration, sentence = _step_vibration(menu, vibration, 1 if line.word == "n" else -1, conversation.words)
            conversation.say(sentence)
            continue
        number = keys.parse_answer(line.text)
        if number is not None:
            return PlayDemo(vibration, number)
        conversation.refuse("line_demo_no_key", line)


def show_playing(notice: PlayingNotice, conversation: Conversation, sign_of_life: SignOfLife) -> Unanswered | None:
    """Wait `notice.seconds` while a stimulus plays. Of typed lines only p (pause) and q (leave) have an effect. Returns
    None at the end; otherwise the reason why the wait ended early. Raises KeyboardInterrupt at the end of the input of
    a terminal."""
    conversation.discard_early_lines()
    if notice.title:  # the gap between two intervals has no title
        direction_text = (
            ""
            if notice.picture is None
            else f" ({describe_direction_ends(notice.picture, notice.number, conversation.words)})"
        )
        conversation.say(f"{conversation.words.translate_fact(notice.title)}{direction_text}")
    until_s = conversation.clock.now_s() + notice.seconds
    while (remaining_s := until_s - conversation.clock.now_s()) > 1e-9:  # tolerance for rounding of clock times
        early_end = _wait_briefly(conversation, sign_of_life, min(POLL_INTERVAL_S, remaining_s))
        if early_end is not None:
            return early_end
    return None


def await_handle(
    read_handle: Callable[[], HandleView], conversation: Conversation, sign_of_life: SignOfLife
) -> Unanswered | None:
    """Wait until the handle is in its place, and write how far it is from there. read_handle: reads its position.
    Returns None when the handle is in its place; otherwise the reason why the wait ended early."""
    conversation.discard_early_lines()
    last_sentence, last_message_s = "", float("-inf")
    while not (view := read_handle()).ready:
        now_s = conversation.clock.now_s()
        if view.sentence != last_sentence and now_s - last_message_s >= MIN_MESSAGE_INTERVAL_S:
            conversation.say(conversation.words.translate_fact(view.sentence))
            last_sentence, last_message_s = view.sentence, now_s
        early_end = (
            INPUT_ENDED
            if conversation.has_input_ended()
            else _wait_briefly(conversation, sign_of_life, POLL_INTERVAL_S)
        )
        if early_end is not None:
            return early_end
    return None


def _wait_briefly(conversation: Conversation, sign_of_life: SignOfLife, wait_s: float) -> Unanswered | None:
    """Wait for `wait_s` (s), call `sign_of_life`, and check for a typed p or q. Returns None if the wait may
    continue; otherwise the reply that ends it."""
    conversation.clock.sleep(wait_s)
    if not sign_of_life():
        return CUT_SHORT
    line = conversation.poll_line()
    return {LEAVE: PARTICIPANT_LEFT, "p": PAUSE}.get(line.word) if line is not None else None


def _step_vibration(menu: DemoMenu, vibration: int, step: int, words: Words) -> tuple[int, str]:
    """Step to the next (step 1) or previous (-1) vibration. Returns its number, unchanged at either end of the range,
    and a sentence about it."""
    new_vibration = vibration + step
    if new_vibration < 1:
        return vibration, words["line_demo_first"]
    if new_vibration > menu.vibrations:
        return vibration, words["line_demo_last"]
    return new_vibration, _describe_vibration(menu, new_vibration, words)


def _describe_vibration(menu: DemoMenu, vibration: int, words: Words) -> str:
    """Describe which vibration is chosen, which of its directions were felt, and whether the device is simulated."""
    vibration_text = words.fill("line_demo_place", {"vibration": vibration, "vibrations": menu.vibrations})
    simulation_text = "" if menu.handle_moves else f" {words['simulation']}"
    return f"{vibration_text} {describe_felt_directions(menu, vibration, words)}{simulation_text}"
