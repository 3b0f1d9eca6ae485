"""A form while it is filled in: the question that the keys belong to, and the answers so far. Values only.

A screen is a picture of it. Each key makes a new value from the one before, in the order of arrival, so an answer
belongs to the question at which the cursor stood when its key arrived, however fast the keys come.
"""

from dataclasses import dataclass, replace

from study.session.views.form_views import Form, FormField, FormKind, FormReply, find_missing_fields

MOST_CHARACTERS = 500
"""Longest free text of a field, in characters; more is not taken."""
CHECKED = (FormKind.CONSENT, FormKind.EXCLUSION)
"""Forms in which changed choices are shown once more before sending, because safety depends on them."""
STEPS = {"down": 1, "up": -1, "tab": 1, "shift+tab": -1}
"""Fields that a key moves the cursor by."""


@dataclass(frozen=True, slots=True)
class FieldEntry:
    """Content of one field."""

    answer: str = ""
    marked: int | None = None
    """Index of the choice that Space would choose; None before the first move."""
    caret: int = 0
    """Position of the cursor in free text."""


@dataclass(frozen=True, slots=True)
class FormEntry:
    """State of a form while it is filled in; each key gives a new state, see `press`."""

    form: Form
    given: tuple[FieldEntry, ...]
    """In the order of the form's fields."""
    at: int = 0
    """Index of the field under the cursor; the number of fields means Continue, below the last."""
    replaced: frozenset[int] = frozenset()
    """Indices of choices that were changed and not shown again yet; only of the forms in CHECKED."""
    open: tuple[int, ...] = ()
    """Indices of the fields without an answer when sending was last tried; empty after the next answer."""
    check: tuple[int, ...] = ()
    """Indices of the changed choices to be checked before sending; empty after the next answer."""
    sent: bool = False

    @property
    def field(self) -> FormField | None:
        """The field that has the cursor; None on Continue."""
        return self.form.fields[self.at] if self.at < len(self.form.fields) else None


def blank_entry(form: Form) -> FormEntry:
    """An empty entry for this form."""
    return FormEntry(form, (FieldEntry(),) * len(form.fields))


def reply_of(entry: FormEntry) -> FormReply:
    """The reply that a sent entry makes."""
    return FormReply({f.key: given.answer.strip() for f, given in zip(entry.form.fields, entry.given, strict=True)})


def press(entry: FormEntry, key: str, character: str | None = None, stacked: bool = False) -> FormEntry | None:
    """The entry after one key; None if the key has no meaning in a form. After sending no key changes anything.

    key: Textual's name, such as "enter", "shift+tab", "1". character: what it prints, None if nothing. stacked: the
    choices under the cursor are listed vertically, so Up and Down move through them first.
    """
    if entry.sent:
        return entry
    field = entry.field
    if field is not None and field.choices and stacked and key in ("up", "down"):
        marked = move_mark(entry.given[entry.at].marked, STEPS[key], len(field.choices), stay=False)
        if marked is not None:
            return _change_field(entry, marked=marked)
    if key in STEPS:
        return go_to(entry, entry.at + STEPS[key])
    if field is None:
        return _send_form(entry) if key == "enter" else None
    return _press_choice(entry, field, key, character) if field.choices else _press_text(entry, key, character)


def go_to(entry: FormEntry, at: int) -> FormEntry:
    """Move the cursor; it stops at the first question and at Continue."""
    return entry if entry.sent else replace(entry, at=min(max(at, 0), len(entry.form.fields)))


def click_choice(entry: FormEntry, at: int, choice: int) -> FormEntry:
    """The mouse on a choice: the cursor goes there, and it is chosen."""
    return entry if entry.sent else _choose(go_to(entry, at), choice)


def click_continue(entry: FormEntry) -> FormEntry:
    """The entry after a click on Continue."""
    return entry if entry.sent else _send_form(go_to(entry, len(entry.form.fields)))


def paste(entry: FormEntry, text: str) -> FormEntry:
    """Insert pasted text where free text is asked for; ignored elsewhere."""
    field = entry.field
    if entry.sent or field is None or field.choices:
        return entry
    return _write(entry, "".join(c for c in " ".join(text.split()) if c.isprintable()))


def move_mark(marked: int | None, step: int, choices: int, stay: bool = True) -> int | None:
    """Index of the choice after a step: from none to the first or last. At the ends it stays, or is None if `stay`
    is false."""
    if marked is None:
        return (0 if step > 0 else choices - 1) if stay or step > 0 else None
    there = marked + step
    return there if 0 <= there < choices else marked if stay else None


def find_choice(choices: tuple[str, ...], character: str) -> int | None:
    """Index of the choice by its number, or by a first letter that is unique. Where choices are numbers, a digit
    means that choice."""
    if character.isdecimal():
        if any(choice.isdigit() for choice in choices):
            return choices.index(character) if character in choices else None
        return int(character) - 1 if 0 < int(character) <= len(choices) else None
    same = [i for i, choice in enumerate(choices) if choice.casefold().startswith(character.casefold())]
    return same[0] if len(same) == 1 else None


def _press_choice(entry: FormEntry, field: FormField, key: str, character: str | None) -> FormEntry | None:
    given = entry.given[entry.at]
    if key in ("left", "right"):
        return _change_field(entry, marked=move_mark(given.marked, 1 if key == "right" else -1, len(field.choices)))
    if key in ("space", "enter"):
        chosen = entry if given.marked is None else _choose(entry, given.marked)
        leaves = chosen.given[entry.at].answer or not field.needed
        return go_to(chosen, entry.at + 1) if key == "enter" and leaves else chosen
    if key in ("backspace", "delete") and not field.needed:
        return _change_field(entry, answer="")
    named = find_choice(field.choices, character) if character else None
    return None if named is None else _choose(entry, named)


def _press_text(entry: FormEntry, key: str, character: str | None) -> FormEntry | None:
    text, caret = entry.given[entry.at].answer, entry.given[entry.at].caret
    match key:
        case "enter":
            return go_to(entry, entry.at + 1)
        case "left" | "right":
            return _change_field(entry, caret=min(max(caret + (1 if key == "right" else -1), 0), len(text)))
        case "home" | "end":
            return _change_field(entry, caret=0 if key == "home" else len(text))
        case "backspace":
            return _change_field(entry, answer=text[: max(caret - 1, 0)] + text[caret:], caret=max(caret - 1, 0))
        case "delete":
            return _change_field(entry, answer=text[:caret] + text[caret + 1 :])
    return _write(entry, character) if character and character.isprintable() else None


def _write(entry: FormEntry, characters: str) -> FormEntry:
    """Insert characters at the caret, as far as they fit."""
    text, caret = entry.given[entry.at].answer, entry.given[entry.at].caret
    fitting = characters[: MOST_CHARACTERS - len(text)]
    return _change_field(entry, answer=text[:caret] + fitting + text[caret:], caret=caret + len(fitting))


def _choose(entry: FormEntry, choice: int) -> FormEntry:
    """Choose under the cursor; in forms that safety depends on, a changed choice is noted to be shown once more."""
    field, before = entry.form.fields[entry.at], entry.given[entry.at].answer
    answer = field.choices[choice]
    chosen = _change_field(entry, answer=answer, marked=choice)
    if before in ("", answer) or entry.form.kind not in CHECKED:
        return chosen
    return replace(chosen, replaced=entry.replaced | {entry.at})


def _change_field(
    entry: FormEntry, answer: str | None = None, marked: int | None = None, caret: int | None = None
) -> FormEntry:
    """The entry with changes to the field under the cursor; None leaves a value."""
    before = entry.given[entry.at]
    now = FieldEntry(
        before.answer if answer is None else answer,
        before.marked if marked is None else marked,
        before.caret if caret is None else caret,
    )
    given = (*entry.given[: entry.at], now, *entry.given[entry.at + 1 :])
    answered = now.answer != before.answer
    return replace(entry, given=given, open=() if answered else entry.open, check=() if answered else entry.check)


def _send_form(entry: FormEntry) -> FormEntry:
    """Send the form; refused, with the cursor on the first problem, while answers are missing or changed choices
    unchecked."""
    gaps = find_missing_fields(entry.form, reply_of(entry))
    if gaps:
        places = tuple(entry.form.fields.index(field) for field in gaps)
        return replace(entry, at=places[0], open=places, check=())
    if entry.replaced:
        places = tuple(sorted(entry.replaced))
        return replace(entry, at=places[0], open=(), check=places, replaced=frozenset())
    return replace(entry, sent=True)
