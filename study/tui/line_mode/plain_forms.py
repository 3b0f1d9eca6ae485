"""Line mode: forms, one question after another, and the device check."""

from protocols.wording.words import Words
from study.session.views.form_entry import CHECKED
from study.session.views.form_views import Form, FormField, FormReply, has_answer
from study.session.views.views import DeviceReport
from study.tui.line_mode.conversation import Conversation, Line, printable, shown
from study.tui.trial_words import limits_words, origin

BACK = "b"
"""Line that returns to the previous question, the same in every language."""


def fill_in(form: Form, talk: Conversation) -> FormReply:
    """Ask all fields of a form, one after another; `b` returns to the previous field. In the forms of `CHECKED`
    (consent, exclusion), changed answers must be confirmed. Raises KeyboardInterrupt when the participant leaves."""
    talk.forget()
    words = talk.words
    talk.say("", form.title, *filter(None, (form.introduction, origin(form, words))))
    talk.say(words.counted("line_form", len(form.fields)))
    answers: dict[str, str] = {}
    at, changed = 0, False
    while True:
        if at == len(form.fields):
            if not changed or _confirm_changes(form, answers, talk):
                return FormReply(answers)
            at, changed = 0, False
        field = form.fields[at]
        answer = _ask_field(field, (at + 1, len(form.fields)), talk)
        if answer is None:
            at = max(0, at - 1)
            continue
        changed = changed or (form.kind in CHECKED and answers.get(field.key, answer) != answer)
        answers[field.key] = answer
        at += 1


def _confirm_changes(form: Form, answers: dict[str, str], talk: Conversation) -> bool:
    """Show all answers after a change. True if they are confirmed; False if the form shall be asked again."""
    talk.forget()
    text = ", ".join(f"{number} {answers[field.key]}" for number, field in enumerate(form.fields, start=1))
    words = talk.words
    talk.say("", words.fill("line_form_changed", {"answers": text}))
    while True:
        talk.prompt(words["line_form_confirm"])
        line = talk.answer_or_leave()
        if line.word in (words["line_form_confirm_letter"], words["yes"], BACK):
            return line.word != BACK
        talk.forget()
        talk.refuse("no_answer", line)


def device_checked(report: DeviceReport, talk: Conversation) -> bool:
    """Write the findings of the device check. True: continue; False: check again."""
    talk.forget()
    words = talk.words
    moves = f" {words['simulation']}" if report.simulated else ""
    talk.say("", f"{words.fill('line_check', {'device': words.fact(report.device)})}{moves}")
    if report.findings:
        talk.speak("for_experimenter")
    for finding in report.findings:
        advice = f". {finding.advice}" if finding.advice and not finding.fine else ""
        talk.say(f"{finding.verdict}: {finding.name}, {finding.value}{advice}")
    ready = "check_ready" if report.fine else "check_ready_warning"
    talk.speak(ready if report.usable else "line_check_look")
    while True:
        talk.prompt(words["line_check_prompt"])
        line = talk.answer_or_leave()
        if line.word in ("", "c"):
            return not line.word
        talk.forget()
        talk.refuse("no_answer", line)


def _ask_field(field: FormField, place: tuple[int, int], talk: Conversation) -> str | None:
    """Ask a field until its answer is valid; None: return to the previous field. place: number of the field, and of all
    fields."""
    numbered = bool(field.choices) and not any(choice.isdigit() for choice in field.choices)
    words = talk.words
    asked = {"number": place[0], "all": place[1], "question": field.label}
    talk.say("", words.fill("line_form_place", asked))
    for number, choice in enumerate(field.choices, start=1):
        talk.say(f"  {number}  {choice}" if numbered else f"  {choice}")
    while True:
        talk.prompt(_prompt(field, numbered, words))
        line = talk.answer()
        answer = _parse_answer(field, line, numbered)
        if answer is not None:
            return answer
        if line.word == "q":
            raise KeyboardInterrupt
        if line.word == BACK:
            return None
        talk.forget()  # lines that were typed in advance belong to later questions
        talk.say(_refusal(field, line, numbered, words))


def _parse_answer(field: FormField, line: Line, numbered: bool) -> str | None:
    """The answer in a line; None if the line is no valid answer to this field. numbered: choices may be given by
    number."""
    text = printable(line.text)
    if not text:
        return None if field.needed else ""
    if not field.choices:
        fits = line.word not in (BACK, "q") and has_answer(field, text)
        return text if fits else None
    if numbered and text.isdecimal() and 1 <= int(text) <= len(field.choices):
        return field.choices[int(text) - 1]
    meant = [choice for choice in field.choices if choice.casefold() == text.casefold()]
    if not meant and line.word in (BACK, "q"):
        return None  # a command, also where a choice begins with this letter
    # As on the screen, the first letters of a choice suffice if no other choice has them: y for yes.
    meant = meant or [choice for choice in field.choices if choice.casefold().startswith(text.casefold())]
    return meant[0] if len(meant) == 1 else None


def _prompt(field: FormField, numbered: bool, words: Words) -> str:
    """The prompt of a field: for a number or an answer, and whether it may be left empty."""
    what = "line_form_number" if numbered else "line_form_answer"
    return words[what if field.needed else f"{what}_or_none"]


def _refusal(field: FormField, line: Line, numbered: bool, words: Words) -> str:
    """Text on a line that is no valid answer: the limits or the choices of the field."""
    typed = shown(line, words)
    if field.limits is not None:
        return words.fill("line_form_limits", {"typed": typed, "wanted": limits_words(field.limits, words)})
    if not field.choices:
        return words["line_form_needed"]
    answers = field.choices[0]
    for choice in field.choices[1:]:
        answers = words.fill("line_form_or", {"first": answers, "second": choice})
    values = {"typed": typed, "answers": answers, "count": len(field.choices)}
    return words.fill("line_form_none_numbered" if numbered else "line_form_none", values)
