"""Line mode (sessions in plain lines of text): forms, one question after another, and the device check."""

from protocols.wording.words import Words
from study.session.views.form_entry import CONFIRMED_KINDS
from study.session.views.form_views import Form, FormField, FormReply, is_valid_answer
from study.session.views.participant_views import DeviceReport
from study.tui.line_mode.conversation import LEAVE, Conversation, Line, quote_line, remove_control_characters
from study.tui.trial_words import describe_form_origin, describe_number_limits

BACK = "b"
"""Line that returns to the previous question, the same in every language."""


def ask_form(form: Form, conversation: Conversation) -> FormReply:
    """Ask all fields of a form, one after another; `b` returns to the previous field. In the forms of `CONFIRMED_KINDS`
    (consent, exclusion), changed answers must be confirmed. Raises KeyboardInterrupt for `LEAVE` and at the end of
    input."""
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
        is_changed = is_changed or (form.kind in CONFIRMED_KINDS and answers.get(field.key, answer) != answer)
        answers[field.key] = answer
        index += 1


def _confirm_changes(form: Form, answers: dict[str, str], conversation: Conversation) -> bool:
    """Show all answers after a change. Returns True if they are confirmed; False if the form is to be asked again."""
    conversation.discard_early_lines()
    text = ", ".join(f"{number} {answers[field.key]}" for number, field in enumerate(form.fields, start=1))
    words = conversation.words
    conversation.say("", words.fill("line_form_changed", {"answers": text}))
    while True:
        conversation.prompt(words["line_form_confirm"])
        line = conversation.read_line_or_leave()
        if (
            line.word == BACK
            or words.is_typed("line_form_confirm_letter", line.text)
            or words.is_typed("yes", line.text)
        ):
            return line.word != BACK
        conversation.discard_early_lines()
        conversation.refuse("no_answer", line)


def show_device_check(report: DeviceReport, conversation: Conversation) -> bool:
    """Write the findings of the device check, and ask how to continue. Returns True for Enter (continue), False for c
    (check again). Raises KeyboardInterrupt when the participant leaves."""
    conversation.discard_early_lines()
    words = conversation.words
    simulation_text = f" {words['simulation']}" if report.simulated else ""
    conversation.say(
        "", f"{words.fill('line_check', {'device': words.translate_fact(report.device)})}{simulation_text}"
    )
    if report.findings:
        conversation.say_texts("for_experimenter")
    for finding in report.findings:
        advice = f". {finding.advice}" if finding.advice and not finding.fine else ""
        conversation.say(f"{finding.verdict}: {finding.name}, {finding.value}{advice}")
    ready_key = "check_ready" if report.fine else "check_ready_warning"
    conversation.say_texts(ready_key if report.usable else "line_check_look")
    while True:
        conversation.prompt(words["line_check_prompt"])
        line = conversation.read_line_or_leave()
        if line.word in ("", "c"):
            return not line.word
        conversation.discard_early_lines()
        conversation.refuse("no_answer", line)


def _ask_field(field: FormField, field_position: tuple[int, int], conversation: Conversation) -> str | None:
    """Ask a field until its answer is valid; None: return to the previous field. field_position: number of the field,
    from 1, and number of fields. Raises KeyboardInterrupt when the participant leaves."""
    is_numbered = bool(field.choices) and not any(choice.isdigit() for choice in field.choices)
    words = conversation.words
    place_values = {"number": field_position[0], "all": field_position[1], "question": field.label}
    conversation.say("", words.fill("line_form_place", place_values))
    for number, choice in enumerate(field.choices, start=1):
        conversation.say(f"  {number}  {choice}" if is_numbered else f"  {choice}")
    while True:
        conversation.prompt(_choose_prompt(field, is_numbered, words))
        line = conversation.read_line()
        answer = _parse_answer(field, line, is_numbered)
        if answer is not None:
            return answer
        if line.word == LEAVE:
            raise KeyboardInterrupt
        if line.word == BACK:
            return None
        conversation.discard_early_lines()  # lines that were typed in advance belong to later questions
        conversation.say(_format_refusal(field, line, is_numbered, words))


def _parse_answer(field: FormField, line: Line, is_numbered: bool) -> str | None:
    """Parse the answer in a line; None if the line is no valid answer to this field. A choice is given by its text, by
    first letters that no other choice has or, where is_numbered, by its number."""
    text = remove_control_characters(line.text)
    if not text:
        return None if field.needed else ""
    if not field.choices:
        is_valid = line.word not in (BACK, LEAVE) and is_valid_answer(field, text)
        return text if is_valid else None
    if is_numbered and text.isdecimal() and 1 <= int(text) <= len(field.choices):
        return field.choices[int(text) - 1]
    matching_choices = [choice for choice in field.choices if choice.casefold() == text.casefold()]
    if not matching_choices and line.word in (BACK, LEAVE):
        return None  # a command, also where a choice begins with this letter
    # As in the form of the screen, first letters suffice where a single choice has them: y for yes.
    matching_choices = matching_choices or [
        choice for choice in field.choices if choice.casefold().startswith(text.casefold())
    ]
    return matching_choices[0] if len(matching_choices) == 1 else None


def _choose_prompt(field: FormField, is_numbered: bool, words: Words) -> str:
    """Choose the prompt of a field: for a number or an answer, and whether it may be left empty."""
    text_key = "line_form_number" if is_numbered else "line_form_answer"
    return words[text_key if field.needed else f"{text_key}_or_none"]


def _format_refusal(field: FormField, line: Line, is_numbered: bool, words: Words) -> str:
    """Format the text on a line that is no valid answer: it states the limits or the choices of the field, or that an
    answer is needed."""
    quoted_line = quote_line(line, words)
    if field.limits is not None:
        return words.fill(
            "line_form_limits", {"typed": quoted_line, "wanted": describe_number_limits(field.limits, words)}
        )
    if not field.choices:
        return words["line_form_needed"]
    choices_text = field.choices[0]
    for choice in field.choices[1:]:
        choices_text = words.fill("line_form_or", {"first": choices_text, "second": choice})
    values = {"typed": quoted_line, "answers": choices_text, "count": len(field.choices)}
    return words.fill("line_form_none_numbered" if is_numbered else "line_form_none", values)
