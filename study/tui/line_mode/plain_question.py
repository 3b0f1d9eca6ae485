"""Line mode: the instructions, the question of a trial and its reply, and the result of a practice, in the language of
the protocol (`Words`)."""

from protocols.trial import VoidCause
from protocols.wording.words import Words
from study.session.views.participant_views import (
    Answered,
    DirectionPicture,
    PracticeResult,
    Question,
    Reply,
    Task,
    Unanswered,
    Welcome,
)
from study.tui.drawing.direction_picture import describe_direction, draw_directions
from study.tui.keys.answer_keys import AnswerKeys
from study.tui.line_mode.conversation import LEAVE, Conversation, Line, WaitOver, quote_line
from study.tui.trial_replies import PAUSE, REPEAT, format_repeat_text
from study.tui.trial_words import describe_plan, format_heading
from study.workflows.trial.display import SignOfLife

PARTICIPANT_LEFT = Unanswered("the participant left", ends_sitting=True)
"""Reply for the line "q", which ends the sitting."""


def describe_answer_keys(keys: AnswerKeys, words: Words) -> str:
    """Describe the keys that answer 1 and 2 in one sentence."""
    return words.fill("line_keys", {"keys": keys.describe_keys(words)})


def draw_direction_picture(picture: DirectionPicture, words: Words) -> tuple[str, ...]:
    """Draw the two directions as lines of text, followed by a description of each."""
    return (*draw_directions(picture), describe_direction(picture, 1, words), describe_direction(picture, 2, words))


def show_instructions(welcome: Welcome, conversation: Conversation, keys: AnswerKeys) -> None:
    """Write the instructions of a sitting, and wait for a line. Raises KeyboardInterrupt for "q" and at the end of the
    input."""
    words = conversation.words
    conversation.discard_early_lines()
    conversation.say(welcome.title, "")
    if welcome.resumed_after:
        conversation.say(words.fill_count("welcome_back", welcome.resumed_after), "")
    conversation.say(
        words["line_hold"],
        "",
        *draw_direction_picture(welcome.picture, words),
        "",
        words["line_how"],
        describe_plan(welcome, words),
        describe_answer_keys(keys, words),
    )
    if not welcome.device_moves:
        conversation.say("", words.fill("not_felt", {"device": words.translate_fact(welcome.device)}))
    conversation.say("", words["enter_begins"])
    conversation.read_line_or_leave()


def ask_question(question: Question, conversation: Conversation, keys: AnswerKeys, sign_of_life: SignOfLife) -> Reply:
    """Ask the question of a trial until there is a reply. It is an answer, or `Unanswered`: for a line that leaves,
    pauses or repeats (`parse_reply`), where the time limit (none if 0 s) is over, where the sign of life ends the wait,
    and at the end of the input, which ends the sitting. "?" explains the question; other lines, and "r" without repeats
    left, are refused; then the question is asked again."""
    words, key_placeholders = conversation.words, {"keys": keys.describe_keys(conversation.words)}
    conversation.discard_early_lines()
    conversation.say("", format_heading(question, words))
    deadline_s = conversation.clock.now_s() + question.time_limit_s if question.time_limit_s else float("inf")
    prompt = words.fill("line_which_interval" if question.task is Task.INTERVAL else "line_which", key_placeholders)
    while True:
        conversation.prompt(prompt)
        line = conversation.wait(sign_of_life, deadline_s)
        if isinstance(line, WaitOver):
            cause = VoidCause.LATE if line is WaitOver.TIME_LIMIT else VoidCause.FAULT
            return Unanswered(line.value, ends_sitting=line is WaitOver.INPUT_ENDED, cause=cause)
        reply = parse_reply(line, keys)
        if reply is REPEAT:
            if question.repeats_left == 0:
                conversation.say(f"{words['no_repeats']} {words.fill('line_type', key_placeholders)}")
                continue
            conversation.say(format_repeat_text(question.repeats_left, words))
        if reply is not None:
            return reply
        if line.word == "?":
            conversation.say(*_explain_question(question, words), describe_answer_keys(keys, words))
        else:
            refusal = words.fill("no_answer", {"typed": quote_line(line, words)})
            conversation.say(f"{refusal} {words.fill('line_type', key_placeholders)}")


def _explain_question(question: Question, words: Words) -> tuple[str, ...]:
    """Explain the question in lines of text: the interval task, or a drawing of both directions."""
    if question.task is Task.INTERVAL:
        return (words["line_intervals"],)
    return draw_direction_picture(question.picture, words)


def parse_reply(line: Line, keys: AnswerKeys) -> Reply | None:
    """Parse the reply in a typed line: an answer by its key, else "q" (leave), "p" (pause) or "r" (repeat) in either
    case; None for any other line."""
    answer = keys.parse_answer(line.text)
    if answer is not None:
        return Answered(answer, line.read_s)
    return {LEAVE: PARTICIPANT_LEFT, "p": PAUSE, "r": REPEAT}.get(line.word)


def show_practice_result(result: PracticeResult, conversation: Conversation) -> None:
    """Write the result of a practice, and wait for a line. Raises KeyboardInterrupt for "q" and at the end of the
    input."""
    conversation.discard_early_lines()
    conversation.say(
        "", conversation.words.fill("line_practice", {"right": result.correct_count, "asked": result.answer_count})
    )
    conversation.say_texts("practice_enough" if result.passed else "practice_hard", "enter_goes_on")
    conversation.read_line_or_leave()
