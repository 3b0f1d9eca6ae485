"""Line mode: one trial with its question and instructions."""

from protocols.trial import VoidCause
from study.session.views.counted import answers_are
from study.session.views.views import (
    Answered,
    DirectionPicture,
    PracticeResult,
    Question,
    Reply,
    Task,
    Unanswered,
    Welcome,
)
from study.tui.drawing.direction_picture import draw_directions, sentence
from study.tui.keys.answer_keys import AnswerKeys
from study.tui.line_mode.conversation import Conversation, Line, WaitOver, shown
from study.tui.trial_replies import NO_REPEATS, PAUSE, REPEAT, repeat_words
from study.tui.trial_words import heading, plan
from study.workflows.trial.display import SignOfLife

LEFT = Unanswered("the participant left", leave=True)
INTERVALS = "In one of the two intervals it shook, however weakly; in the other it did not. Type the number of the one."


def keys_sentence(keys: AnswerKeys) -> str:
    return (
        f"Keys: {keys.choice} answers, r plays it again, p pauses, q leaves, ? shows this. Each "
        "followed by Enter. Ctrl-C stops the device at once."
    )


def picture_lines(picture: DirectionPicture) -> tuple[str, ...]:
    """The drawing, and both directions in words."""
    return (*draw_directions(picture), sentence(picture, 1), sentence(picture, 2))


def welcome(notice: Welcome, talk: Conversation, keys: AnswerKeys) -> None:
    talk.forget()
    talk.say(notice.title, "")
    if notice.resumed_after:
        talk.say(f"Welcome back: {answers_are(notice.resumed_after)} on disk; the study goes on where it stopped.", "")
    talk.say(
        "Hold the handle with a constant, comfortable grip. In each trial it shakes along one of two directions:",
        "",
        *picture_lines(notice.picture),
        "",
        "Feel as long as you like, then type its number and Enter. When in doubt, guess.",
        plan(notice),
        keys_sentence(keys),
    )
    if not notice.felt:
        talk.say("", f"Practice: the device is a simulation ({notice.device}), so nothing moves here.")
        talk.say("Your answers are marked 'not felt' and never enter an analysis of people.")
    talk.say("", "Press Enter to begin.")
    talk.answer_or_leave()


def ask(question: Question, talk: Conversation, keys: AnswerKeys, sign_of_life: SignOfLife) -> Reply:
    talk.forget()
    talk.say("", heading(question))
    until_s = talk.clock.now_s() + question.time_limit_s if question.time_limit_s else float("inf")
    prompt = f"Which interval, {keys.choice}? " if question.task is Task.INTERVAL else f"{keys.choice}? "
    while True:
        talk.prompt(prompt)
        line = talk.wait(sign_of_life, until_s)
        if isinstance(line, WaitOver):
            cause = VoidCause.LATE if line is WaitOver.TIME_LIMIT else VoidCause.FAULT
            return Unanswered(line.value, leave=line is WaitOver.INPUT_ENDED, cause=cause)
        reply = parse_reply(line, keys)
        if reply is REPEAT:
            if question.repeats_left == 0:
                talk.say(f"{NO_REPEATS} Type {keys.choice} and Enter; ? for help.")
                continue
            talk.say(repeat_words(question.repeats_left))
        if reply is not None:
            return reply
        if line.word == "?":
            explanation = (INTERVALS,) if question.task is Task.INTERVAL else picture_lines(question.picture)
            talk.say(*explanation, keys_sentence(keys))
        else:
            talk.say(f"{shown(line)} is no answer. Type {keys.choice} and Enter; ? for help.")


def parse_reply(line: Line, keys: AnswerKeys) -> Reply | None:
    """The reply of a typed line; None if it is none."""
    answer = keys.answer(line.text)
    if answer is not None:
        return Answered(answer, line.at_s)
    return {"q": LEFT, "p": PAUSE, "r": REPEAT}.get(line.word)


def practice_over(result: PracticeResult, talk: Conversation) -> None:
    talk.forget()
    talk.say("", f"End of this practice. Right answers: {result.right} of the last {result.of}.")
    if result.passed:
        talk.say("That is enough to go on.")
    else:
        talk.say("Some vibrations are hard to tell for everyone. The study goes on all the same.")
    talk.say("Press Enter to go on.")
    talk.answer_or_leave()
