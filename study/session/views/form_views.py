"""Forms of a session as data classes (consent, exclusion criteria, questionnaires, set-up, state of the handle), and
the validation and encoding of their answers.

Texts are shown in the participant's language; answers are logged as codes that are the same in every language, so that
studies in several languages can be analysed together (`encode_answers`). `forms` makes the forms from a protocol.
"""

import re
from dataclasses import dataclass
from enum import Enum


class FormKind(Enum):
    """Kinds of forms, each shown at its own point of a sitting."""

    CONSENT = "consent"
    """Informed consent to take part."""
    EXCLUSION = "exclusion"
    """Questions on the exclusion criteria."""
    QUESTIONNAIRE = "questionnaire"
    """Questions to the participant before the trials."""
    SETUP = "setup"
    """Questions to the experimenter about the set-up."""
    DEBRIEF = "debrief"
    """Questions to the participant after the trials."""
    HANDLE = "handle"
    """Whether the handle is free, or held again: shown before and after a reference measurement; logged with
    that measurement, not as a form."""


@dataclass(frozen=True, slots=True)
class NumberLimits:
    """Least and largest valid value of a numerical answer, both included, in the unit that the question states."""

    lowest: float
    highest: float


@dataclass(frozen=True, slots=True)
class FormField:
    """A question of a form: a choice (with `choices`), a number (with `limits`), or free text."""

    key: str
    """Name of the answer in the log."""
    label: str
    """Text of the question, a whole sentence."""
    choices: tuple[str, ...] = ()
    """Valid answers, of which exactly one is given; empty for a number or free text."""
    needed: bool = True
    """Whether an answer is required; otherwise it may be empty."""
    codes: tuple[str, ...] = ()
    """Logged code of each choice, in the order of `choices`; empty: the choices are logged."""
    limits: NumberLimits | None = None
    """Limits of a number; None for a choice or free text."""


@dataclass(frozen=True, slots=True)
class Form:
    """A form as it is shown, in the participant's language. version, ethics_id: version of the form and number of the
    ethics approval as the protocol states them, for the log."""

    kind: FormKind
    title: str
    introduction: str
    fields: tuple[FormField, ...]
    version: str = ""
    ethics_id: str = ""


@dataclass(frozen=True, slots=True)
class FormReply:
    """Answers to a form in the language shown; `encode_answers` converts them for the log."""

    answers: dict[str, str]
    """Answer by the key of its field; a missing key means no answer."""


def find_missing_fields(form: Form, reply: FormReply) -> tuple[FormField, ...]:
    """Find the fields of the form whose answer is missing (where one is required) or invalid, in their order. Spaces
    around an answer are ignored."""
    return tuple(field for field in form.fields if not is_valid_answer(field, reply.answers.get(field.key, "").strip()))


def is_valid_answer(field: FormField, answer: str) -> bool:
    """Whether an answer in the language shown is valid: one of the choices, a number within the limits, or any text. An
    empty answer is valid only where none is required."""
    if not answer:
        return not field.needed
    if field.choices:
        return answer in field.choices
    if field.limits is None:
        return True
    number = parse_number(answer)
    return number is not None and field.limits.lowest <= number <= field.limits.highest


def parse_number(answer: str) -> float | None:
    """Parse a decimal number with point or comma, at most 15 digits on either side; None for other text."""
    decimal_text = answer.replace(",", ".")
    return (
        float(decimal_text) if re.fullmatch(r"[+-]?([0-9]{1,15}\.?[0-9]{0,15}|\.[0-9]{1,15})", decimal_text) else None
    )


def encode_answers(form: Form, reply: FormReply) -> dict[str, str]:
    """Encode the answers for the log, the same in every language: choices as their codes, numbers with a decimal point
    and all digits of a float, free text without surrounding spaces, missing answers as empty text."""
    encoded_answers = {}
    for field in form.fields:
        answer = reply.answers.get(field.key, "").strip()
        number = parse_number(answer) if field.limits is not None else None
        if field.codes and answer in field.choices:
            answer = field.codes[field.choices.index(answer)]
        encoded_answers[field.key] = answer if number is None else repr(number).removesuffix(".0")
    return encoded_answers
