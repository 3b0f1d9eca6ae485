"""Line mode: forms, one question after another, and the device check."""

from protocols.wording.words import Words
from study.session.views.form_entry import CHECKED
from study.session.views.form_views import Form, FormField, FormReply, has_answer
from study.session.views.views import DeviceReport
from study.tui.line_mode.conversation import Conversation, Line, printable, quote_line
from study.tui.trial_words import describe_form_origin, describe_number_limits

BACK = "b"
"""Line that returns to the previous question, the same in every language."""


def ask_form(form: Form, conversation: Conversation) -> FormReply:
    """Ask all fields of a form, one after another; `b` returns to the previous field. In the forms of `CHECKED`
    (consent, exclusion), changed answers must be confirmed. Raises KeyboardInterrupt when the participant leaves."""
    conversation.discard_early_lines()
    words = conversation.words
    conversation.say("", form.title, *filter(None, (form.introduction, describe_form_origin(form, words))))
    conversation.say(words.fill_count("line_form", len(form.fields)))
    answers: dict[str, str] = {}
    index, is_changed = 0, False
    while True:
        if index == len(form.fields):
            if not is_changed or _confirm_changes(form, answers, conversation):
                return FormReply(answers)
            index, is_changed = 0, False
        field = form.fields[index]
        answer = _ask_field(field, (index + 1, len(form.fields)), conversation)
        if answer is None:
            index = max(0, index - 1)
            continue
        is_changed = is_changed or (form.kind in CHECKED and answers.get(field.key, answer) != answer)
        answers[field.key] = answer
        index += 1


def _confirm_changes(form: Form, answers: dict[str, str], conversation: Conversation) -> bool:
    """Show all answers after a change. True if they are confirmed; False if the form shall be asked again."""
    conversation.discard_early_lines()
    text = ", ".join(f"{number} {answers[field.key]}" for number, field in enumerate(form.fields, start=1))
    words = conversation.words
    conversation.say("", words.fill("line_form_changed", {"answers": text}))
    while True:
        conversation.prompt(words["line_form_confirm"])
        line = conversation.answer_or_leave()
        if line.word in (words["line_form_confirm_letter"], words["yes"], BACK):
            return line.word != BACK
        conversation.discard_early_lines()
        conversation.refuse("no_answer", line)


def device_checked(report: DeviceReport, conversation: Conversation) -> bool:
    """Write the findings of the device check. True: continue; False: check again."""
    conversation.discard_early_lines()
    words = conversation.words
    moves = f" {words['simulation']}" if report.simulated else ""
    conversation.say("", f"{words.fill('line_check', {'device': words.fact(report.device)})}{moves}")
    if report.findings:
        conversation.say_texts("for_experimenter")
    for finding in report.findings:
        advice = f". {finding.advice}" if finding.advice and not finding.fine else ""
        conversation.say(f"{finding.verdict}: {finding.name}, {finding.value}{advice}")
    ready = "check_ready" if report.fine else "check_ready_warning"
    conversation.say_texts(ready if report.usable else "line_check_look")
    while True:
        conversation.prompt(words["line_check_prompt"])
        line = conversation.answer_or_leave()
        if line.word in ("", "c"):
            return not line.word
        conversation.discard_early_lines()
        conversation.refuse("no_answer", line)


def _ask_field(field: FormField, place: tuple[int, int], conversation: Conversation) -> str | None:
    """Ask a field until its answer is valid; None: return to the previous field. place: number of the field, and of all
    fields."""
    by_number = bool(field.choices) and not any(choice.isdigit() for choice in field.choices)
    words = conversation.words
    place_values = {"number": place[0], "all": place[1], "question": field.label}
    conversation.say("", words.fill("line_form_place", place_values))
    for number, choice in enumerate(field.choices, start=1):
        conversation.say(f"  {number}  {choice}" if by_number else f"  {choice}")
    while True:
        conversation.prompt(_prompt(field, by_number, words))
        line = conversation.answer()
        answer = _parse_answer(field, line, by_number)
        if answer is not None:
            return answer
        if line.word == "q":
            raise KeyboardInterrupt
        if line.word == BACK:
            return None
        conversation.discard_early_lines()  # lines that were typed in advance belong to later questions
        conversation.say(_refusal(field, line, by_number, words))


def _parse_answer(field: FormField, line: Line, by_number: bool) -> str | None:
    """The answer in a line; None if the line is no valid answer to this field. by_number: choices may be given by
    number."""
    text = printable(line.text)
    if not text:
        return None if field.needed else ""
    if not field.choices:
        is_valid = line.word not in (BACK, "q") and has_answer(field, text)
        return text if is_valid else None
    if by_number and text.isdecimal() and 1 <= int(text) <= len(field.choices):
        return field.choices[int(text) - 1]
    matching_choices = [choice for choice in field.choices if choice.casefold() == text.casefold()]
    if not matching_choices and line.word in (BACK, "q"):
        return None  # a command, also where a choice begins with this letter
    # As on the screen, the first letters of a choice suffice if no other choice has them: y for yes.
    matching_choices = matching_choices or [
        choice for choice in field.choices if choice.casefold().startswith(text.casefold())
    ]
    return matching_choices[0] if len(matching_choices) == 1 else None


def _prompt(field: FormField, by_number: bool, words: Words) -> str:
    """The prompt of a field: for a number or an answer, and whether it may be left empty."""
    text_key = "line_form_number" if by_number else "line_form_answer"
    return words[text_key if field.needed else f"{text_key}_or_none"]


def _refusal(field: FormField, line: Line, by_number: bool, words: Words) -> str:
    """Text on a line that is no valid answer: the limits or the choices of the field."""
    quoted_line = quote_line(line, words)
    if field.limits is not None:
        return words.fill(
            "line_form_limits", {"typed": quoted_line, "wanted": describe_number_limits(field.limits, words)}
        )
    if not field.choices:
        return words["line_form_needed"]
    answers = field.choices[0]
    for choice in field.choices[1:]:
        answers = words.fill("line_form_or", {"first": answers, "second": choice})
    values = {"typed": quoted_line, "answers": answers, "count": len(field.choices)}
    return words.fill("line_form_none_numbered" if by_number else "line_form_none", values)
