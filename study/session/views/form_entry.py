"""State of a form while it is filled in: position of the cursor, and the answers so far. Immutable values, no drawing.

Each key gives a new state from the previous one, in the order of arrival; a screen only draws the state. An answer
therefore belongs to the question at which the cursor was when the key arrived, however fast the keys are pressed.
"""

from dataclasses import dataclass, replace

from study.session.views.form_views import Form, FormField, FormKind, FormReply, find_missing_fields

MOST_CHARACTERS = 500
"""Largest number of characters of free text in a field; further characters are ignored."""
CHECKED = (FormKind.CONSENT, FormKind.EXCLUSION)
"""Forms in which changed choices are shown once more before sending, because safety depends on them."""
STEPS = {"down": 1, "up": -1, "tab": 1, "shift+tab": -1}
"""Number of fields by which each key moves the cursor."""


@dataclass(frozen=True, slots=True)
class FieldEntry:
    """Content of one field."""

    answer: str = ""
    """The answer in the language shown; empty if not given."""
    marked: int | None = None
    """Index of the choice that Space would choose; None before the first move."""
    caret: int = 0
    """Position of the cursor in free text."""


@dataclass(frozen=True, slots=True)
class FormEntry:
    """State of a form while it is filled in; each key gives a new state, see `press`."""

    form: Form
    given: tuple[FieldEntry, ...]
    """Content of each field, in the order of the form's fields."""
    at: int = 0
    """Index of the field under the cursor; the number of fields means Continue, below the last."""
    replaced: frozenset[int] = frozenset()
    """Indices of fields whose choice was changed and not yet shown again for a check; only in forms of `CHECKED`."""
    open: tuple[int, ...] = ()
    """Indices of the fields without a valid answer at the last attempt to send the form; empty after the next
    answer."""
    check: tuple[int, ...] = ()
    """Indices of the fields whose changed choices must be checked before sending; empty after the next answer."""
    sent: bool = False
    """Whether the form is complete and was sent; no key changes it then."""

    @property
    def field(self) -> FormField | None:
        """The field that has the cursor; None on Continue."""
        return self.form.fields[self.at] if self.at < len(self.form.fields) else None


def blank_entry(form: Form) -> FormEntry:
    """An empty entry for this form."""
    return FormEntry(form, (FieldEntry(),) * len(form.fields))


def reply_of(entry: FormEntry) -> FormReply:
    """The reply that an entry contains: answers by key, without blanks at their ends."""
    return FormReply({f.key: given.answer.strip() for f, given in zip(entry.form.fields, entry.given, strict=True)})


def press(entry: FormEntry, key: str, character: str | None = None, stacked: bool = False) -> FormEntry | None:
    """The entry after one key; None if the key has no meaning in a form. After sending no key changes anything.

    key: name of the key in Textual (the library for screens), such as "enter", "shift+tab", "1". character: the
    character that the key prints; None without one. stacked: the choices under the cursor are listed vertically, so Up
    and Down move through them first.
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
    """The entry after a click on a choice: the cursor moves to its field, and it is chosen. at, choice: indices."""
    return entry if entry.sent else _choose(go_to(entry, at), choice)


def click_continue(entry: FormEntry) -> FormEntry:
    """The entry after a click on Continue."""
    return entry if entry.sent else _send_form(go_to(entry, len(entry.form.fields)))


def paste(entry: FormEntry, text: str) -> FormEntry:
    """The entry after text was pasted: inserted into free text, ignored in other fields."""
    field = entry.field
    if entry.sent or field is None or field.choices:
        return entry
    return _write(entry, "".join(c for c in " ".join(text.split()) if c.isprintable()))


def move_mark(marked: int | None, step: int, choices: int, stay: bool = True) -> int | None:
    """Index of the marked choice after a step of 1 or -1; from no mark to the first or the last choice. A step beyond
    the ends leaves the mark unchanged; if `stay` is false, it gives None, and so does a step of -1 without a mark."""
    if marked is None:
        return (0 if step > 0 else choices - 1) if stay or step > 0 else None
    there = marked + step
    return there if 0 <= there < choices else marked if stay else None


def find_choice(choices: tuple[str, ...], character: str) -> int | None:
    """Index of the choice that a typed character means: its number from 1, or its first letter if no other choice has
    the same. Where choices are numbers themselves, a digit means the choice with this text. None without such a
    choice."""
    if character.isdecimal():
        if any(choice.isdigit() for choice in choices):
            return choices.index(character) if character in choices else None
        return int(character) - 1 if 0 < int(character) <= len(choices) else None
    same = [i for i, choice in enumerate(choices) if choice.casefold().startswith(character.casefold())]
    return same[0] if len(same) == 1 else None


def _press_choice(entry: FormEntry, field: FormField, key: str, character: str | None) -> FormEntry | None:
    """The entry after a key in a field with choices; None if the key has no meaning there."""
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
    """The entry after a key in a field with text or a number; None if the key has no meaning there."""
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
    """Insert characters at the caret, up to `MOST_CHARACTERS` in the field."""
    text, caret = entry.given[entry.at].answer, entry.given[entry.at].caret
    fitting = characters[: MOST_CHARACTERS - len(text)]
    return _change_field(entry, answer=text[:caret] + fitting + text[caret:], caret=caret + len(fitting))


def _choose(entry: FormEntry, choice: int) -> FormEntry:
    """Choose an answer in the field under the cursor; in forms of `CHECKED`, a changed choice is noted in
    `replaced`."""
    field, before = entry.form.fields[entry.at], entry.given[entry.at].answer
    answer = field.choices[choice]
    chosen = _change_field(entry, answer=answer, marked=choice)
    if before in ("", answer) or entry.form.kind not in CHECKED:
        return chosen
    return replace(chosen, replaced=entry.replaced | {entry.at})


def _change_field(
    entry: FormEntry, answer: str | None = None, marked: int | None = None, caret: int | None = None
) -> FormEntry:
    """The entry with changes to the field under the cursor; None leaves a value unchanged."""
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
    """Send the form. Where answers are missing, or changed choices are not checked, it is not sent, and the cursor
    moves to the first such field."""
    gaps = find_missing_fields(entry.form, reply_of(entry))
    if gaps:
        places = tuple(entry.form.fields.index(field) for field in gaps)
        return replace(entry, at=places[0], open=places, check=())
    if entry.replaced:
        places = tuple(sorted(entry.replaced))
        return replace(entry, at=places[0], open=(), check=places, replaced=frozenset())
    return replace(entry, sent=True)
