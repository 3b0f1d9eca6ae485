"""Line mode: forms and the device check, one question after another."""

from study.session.views.form_entry import CHECKED
from study.session.views.form_views import Form, FormField, FormReply
from study.session.views.views import DeviceReport
from study.tui.line_mode.conversation import Conversation, Line, printable, shown

BACK = "b"


def fill_in(form: Form, talk: Conversation) -> FormReply:
    talk.forget()
    talk.say("", form.title, *filter(None, (form.introduction, _version(form))))
    talk.say(f"{_count(len(form.fields))} Type the answer and Enter; {BACK} goes one question back, q leaves.")
    answers: dict[str, str] = {}
    at, changed = 0, False
    while True:
        if at == len(form.fields):
            if not changed or _confirm_changes(form, answers, talk):
                return FormReply(answers)
            at, changed = 0, False
        field = form.fields[at]
        answer = _ask(field, f"{at + 1} of {len(form.fields)}", talk)
        if answer is None:
            at = max(0, at - 1)
            continue
        changed = changed or (form.kind in CHECKED and answers.get(field.key, answer) != answer)
        answers[field.key] = answer
        at += 1


def _confirm_changes(form: Form, answers: dict[str, str], talk: Conversation) -> bool:
    """Whether changed answers are confirmed; otherwise the form is asked again."""
    talk.forget()
    told = ", ".join(f"{number} {answers[field.key]}" for number, field in enumerate(form.fields, start=1))
    talk.say("", f"You changed an answer. Your answers are now: {told}.")
    while True:
        talk.prompt(f"y if that is right, {BACK} to answer again: ")
        line = talk.answer_or_leave()
        if line.word in ("y", "yes", BACK):
            return line.word != BACK
        talk.forget()
        talk.say(f"{shown(line)} is no answer.")


def device_checked(report: DeviceReport, talk: Conversation) -> bool:
    talk.forget()
    talk.say("", f"Device: {report.device}{' (simulated: nothing moves)' if report.simulated else ''}")
    for finding in report.findings:
        advice = f". {finding.advice}" if finding.advice and not finding.fine else ""
        talk.say(f"{finding.verdict}: {finding.name}, {finding.value}{advice}")
    talk.say(report.conclusion or "Something needs a look before you go on.")
    while True:
        talk.prompt("Enter goes on, c checks again, q leaves: ")
        line = talk.answer_or_leave()
        if line.word in ("", "c"):
            return not line.word
        talk.forget()
        talk.say(f"{shown(line)} is no answer.")


def _ask(field: FormField, place: str, talk: Conversation) -> str | None:
    """The answer; None: back to the previous question."""
    numbered = bool(field.choices) and not any(choice.isdigit() for choice in field.choices)
    talk.say("", f"{place}: {field.label}")
    for number, choice in enumerate(field.choices, start=1):
        talk.say(f"  {number}  {choice}" if numbered else f"  {choice}")
    while True:
        talk.prompt(_prompt(field, numbered))
        line = talk.answer()
        answer = _parse_answer(field, line, numbered)
        if answer is not None:
            return answer
        if line.word == "q":
            raise KeyboardInterrupt
        if line.word == BACK:
            return None
        talk.forget()  # typed ahead for the questions after this one
        talk.say(_refusal(field, line, numbered))


def _parse_answer(field: FormField, line: Line, numbered: bool) -> str | None:
    """The answer; None if the line is not an answer to this question."""
    text = printable(line.text)
    if not text:
        return None if field.needed else ""
    if not field.choices:
        return None if line.word in (BACK, "q") else text
    if numbered and text.isdecimal() and 1 <= int(text) <= len(field.choices):
        return field.choices[int(text) - 1]
    meant = [choice for choice in field.choices if choice.casefold() == text.casefold()]
    # As on the screen, a beginning will do that only one choice has: y for yes.
    meant = meant or [choice for choice in field.choices if choice.casefold().startswith(text.casefold())]
    return meant[0] if len(meant) == 1 else None


def _prompt(field: FormField, numbered: bool) -> str:
    what = "Number or word" if numbered else "Answer"
    return f"{what}: " if field.needed else f"{what} (Enter alone for none): "


def _refusal(field: FormField, line: Line, numbered: bool) -> str:
    if not field.choices:
        return "An answer is needed here."
    numbers = f", or its number, 1 to {len(field.choices)}" if numbered else ""
    return f"{shown(line)} is none of the answers. Type {' or '.join(field.choices)}{numbers}."


def _count(questions: int) -> str:
    return "1 question." if questions == 1 else f"{questions} questions."


def _version(form: Form) -> str:
    parts = (form.version and f"Version {form.version}", form.ethics_id and f"Ethics approval {form.ethics_id}")
    return ". ".join(part for part in parts if part) + "." if any(parts) else ""
