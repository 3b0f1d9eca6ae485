"""Forms that a person fills in beside the trials: consent, exclusion, the set-up, the debrief. Values only."""

from dataclasses import dataclass
from enum import Enum


class FormKind(Enum):
    CONSENT = "consent"
    EXCLUSION = "exclusion"
    SETUP = "setup"
    DEBRIEF = "debrief"
    HANDLE = "handle"
    """Whether it is free, or held again: asked around a reference, and logged with it."""


@dataclass(frozen=True, slots=True)
class FormField:
    key: str
    """Names the answer in the log."""
    label: str
    """What is asked, a whole sentence."""
    choices: tuple[str, ...] = ()
    """Exactly one of them; empty for free text."""
    needed: bool = True
    """Whether an answer is required; free text that is not required may stay empty."""


@dataclass(frozen=True, slots=True)
class Form:
    kind: FormKind
    title: str
    introduction: str
    fields: tuple[FormField, ...]
    version: str = ""
    ethics_id: str = ""


@dataclass(frozen=True, slots=True)
class FormReply:
    answers: dict[str, str]
    """By the fields' keys."""


def find_missing_fields(form: Form, reply: FormReply) -> tuple[FormField, ...]:
    """Fields without a valid answer."""
    return tuple(field for field in form.fields if not _has_answer(field, reply.answers.get(field.key, "").strip()))


def _has_answer(field: FormField, answer: str) -> bool:
    if field.choices:
        return answer in field.choices or (not field.needed and not answer)
    return bool(answer) or not field.needed
