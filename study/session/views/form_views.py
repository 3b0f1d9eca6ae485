"""Forms that a person fills in beside the trials: consent, exclusion, the set-up, questions. Values only.

What is shown is in the participant's language; what is kept is not: see `coded`.
"""

import re
from dataclasses import dataclass
from enum import Enum


class FormKind(Enum):
    """Kinds of forms, each shown at its own point of a sitting."""

    CONSENT = "consent"
    EXCLUSION = "exclusion"
    QUESTIONNAIRE = "questionnaire"
    """Before the trials; the debrief comes after them."""
    SETUP = "setup"
    DEBRIEF = "debrief"
    HANDLE = "handle"
    """Whether it is free, or held again: asked around a reference, and logged with it."""


@dataclass(frozen=True, slots=True)
class Limits:
    """Limits of a number."""

    lowest: float
    highest: float


@dataclass(frozen=True, slots=True)
class FormField:
    """A question of a form: a choice, a number (with `limits`), or free text."""

    key: str
    """Names the answer in the log."""
    label: str
    """What is asked, a whole sentence."""
    choices: tuple[str, ...] = ()
    """Exactly one of them; empty for free text."""
    needed: bool = True
    """Whether an answer is required; what is not required may stay empty."""
    codes: tuple[str, ...] = ()
    """What is kept for each of the choices; empty: the choices themselves."""
    limits: Limits | None = None
    """Where a number is asked for."""


@dataclass(frozen=True, slots=True)
class Form:
    """A form as it is shown, in the participant's language. version, ethics_id: as stated by the protocol, for the
    log."""

    kind: FormKind
    title: str
    introduction: str
    fields: tuple[FormField, ...]
    version: str = ""
    ethics_id: str = ""


@dataclass(frozen=True, slots=True)
class FormReply:
    """Answers to a form as they were given, in the language shown; `coded` converts them to what is kept."""

    answers: dict[str, str]
    """Answers by the keys of their fields."""


def find_missing_fields(form: Form, reply: FormReply) -> tuple[FormField, ...]:
    """Fields without a valid answer."""
    return tuple(field for field in form.fields if not has_answer(field, reply.answers.get(field.key, "").strip()))


def has_answer(field: FormField, answer: str) -> bool:
    """Whether this answer, as it is shown, will do; none will do where none is needed."""
    if not answer:
        return not field.needed
    if field.choices:
        return answer in field.choices
    if field.limits is None:
        return True
    number = number_in(answer)
    return number is not None and field.limits.lowest <= number <= field.limits.highest


def number_in(answer: str) -> float | None:
    """Parse a decimal number, with point or comma; None for other text."""
    plain = answer.replace(",", ".")
    return float(plain) if re.fullmatch(r"[+-]?([0-9]{1,15}\.?[0-9]{0,15}|\.[0-9]{1,15})", plain) else None


def coded(form: Form, reply: FormReply) -> dict[str, str]:
    """The answers as they are kept, the same in every language: choices by their codes, numbers with a point."""
    kept = {}
    for field in form.fields:
        answer = reply.answers.get(field.key, "").strip()
        number = number_in(answer) if field.limits is not None else None
        if field.codes and answer in field.choices:
            answer = field.codes[field.choices.index(answer)]
        kept[field.key] = answer if number is None else f"{number:.10g}"
    return kept
