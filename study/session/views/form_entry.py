"""State of a form while it is filled in: position of the cursor, and the answers so far. Immutable values, no drawing.

Each key gives a new state from the previous one, in the order of arrival; a screen only draws the state. An answer
therefore belongs to the question at which the cursor was when the key arrived, however fast the keys are pressed.
"""

from dataclasses import dataclass, replace

from study.session.views.form_views import Form, FormField, FormKind, FormReply, find_missing_fields

LONGEST_TEXT = 500
"""Largest number of characters of free text in a field; further characters are ignored."""
CHECKED = (FormKind.CONSENT, FormKind.EXCLUSION)
"""Forms in which changed choices are shown once more before sending, because safety depends on them."""
CURSOR_STEPS = {"down": 1, "up": -1, "tab": 1, "shift+tab": -1}
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
    field_entries: tuple[FieldEntry, ...]
    """Content of each field, in the order of the form's fields."""
    cursor: int = 0
    """Index of the field under the cursor; the number of fields means Continue, below the last."""
    replaced: frozenset[int] = frozenset()
    """Indices of fields whose choice was changed and not yet shown again for a check; only in forms of `CHECKED`."""
    open: tuple[int, ...] = ()
    """Indices of the fields without a valid answer at the last attempt to send the form; empty after the next
    answer."""
    check: tuple[int, ...] = ()
    """Indices of the fields whose changed choices must be checked before sending; empty after the next answer."""
    is_sent: bool = False
    """Whether the form is complete and was sent; no key changes it then."""

    @property
    def field(self) -> FormField | None:
        """The field that has the cursor; None on Continue."""
        return self.form.fields[self.cursor] if self.cursor < len(self.form.fields) else None


def make_blank_entry(form: Form) -> FormEntry:
    """An empty entry for this form."""
    return FormEntry(form, (FieldEntry(),) * len(form.fields))


def make_reply(entry: FormEntry) -> FormReply:
    """The reply that an entry contains: answers by key, without blanks at their ends."""
    return FormReply(
        {
            f.key: field_entry.answer.strip()
            for f, field_entry in zip(entry.form.fields, entry.field_entries, strict=True)
        }
    )


def press(entry: FormEntry, key: str, character: str | None = None, stacked: bool = False) -> FormEntry | None:
    """The entry after one key; None if the key has no meaning in a form. After sending no key changes anything.

    key: name of the key in Textual (the library for screens), such as "enter", "shift+tab", "1". character: the
    character that the key prints; None without one. stacked: the choices under the cursor are listed vertically, so Up
    and Down move through them first.
    """
    if entry.is_sent:
        return entry
    field = entry.field
    if field is not None and field.choices and stacked and key in ("up", "down"):
        marked = move_mark(
            entry.field_entries[entry.cursor].marked, CURSOR_STEPS[key], len(field.choices), stop_at_ends=False
        )
        if marked is not None:
            return _change_field(entry, marked=marked)
    if key in CURSOR_STEPS:
        return move_cursor(entry, entry.cursor + CURSOR_STEPS[key])
    if field is None:
        return _send_form(entry) if key == "enter" else None
    return _press_choice(entry, field, key, character) if field.choices else _press_text(entry, key, character)


def move_cursor(entry: FormEntry, field_index: int) -> FormEntry:
    """Move the cursor; it stops at the first question and at Continue."""
    return entry if entry.is_sent else replace(entry, cursor=min(max(field_index, 0), len(entry.form.fields)))


def click_choice(entry: FormEntry, field_index: int, choice: int) -> FormEntry:
    """The entry after a click on a choice: the cursor moves to its field, and it is chosen. field_index, choice:
    indices of the field and of the choice, from 0."""
    return entry if entry.is_sent else _choose(move_cursor(entry, field_index), choice)


def click_continue(entry: FormEntry) -> FormEntry:
    """The entry after a click on Continue."""
    return entry if entry.is_sent else _send_form(move_cursor(entry, len(entry.form.fields)))


def paste(entry: FormEntry, text: str) -> FormEntry:
    """The entry after text was pasted: inserted into free text, ignored in other fields."""
    field = entry.field
    if entry.is_sent or field is None or field.choices:
        return entry
    return _insert_text(entry, "".join(c for c in " ".join(text.split()) if c.isprintable()))


def move_mark(marked: int | None, step: int, choices: int, stop_at_ends: bool = True) -> int | None:
    """Index of the marked choice after a step of 1 or -1; from no mark to the first or the last choice. A step beyond
    the ends leaves the mark unchanged; if `stop_at_ends` is false, it gives None, and so does a step of -1
    without a mark."""
    if marked is None:
        return (0 if step > 0 else choices - 1) if stop_at_ends or step > 0 else None
    target = marked + step
    return target if 0 <= target < choices else marked if stop_at_ends else None


def find_choice(choices: tuple[str, ...], character: str) -> int | None:
    """Index of the choice that a typed character means: its number from 1, or its first letter if no other choice has
    the same. Where choices are numbers themselves, a digit means the choice with this text. None without such a
    choice."""
    if character.isdecimal():
        if any(choice.isdigit() for choice in choices):
            return choices.index(character) if character in choices else None
        return int(character) - 1 if 0 < int(character) <= len(choices) else None
    matching = [i for i, choice in enumerate(choices) if choice.casefold().startswith(character.casefold())]
    return matching[0] if len(matching) == 1 else None


def _press_choice(entry: FormEntry, field: FormField, key: str, character: str | None) -> FormEntry | None:
    """The entry after a key in a field with choices; None if the key has no meaning there."""
    field_entry = entry.field_entries[entry.cursor]
    if key in ("left", "right"):
        return _change_field(
            entry, marked=move_mark(field_entry.marked, 1 if key == "right" else -1, len(field.choices))
        )
    if key in ("space", "enter"):
        chosen = entry if field_entry.marked is None else _choose(entry, field_entry.marked)
        can_leave = chosen.field_entries[entry.cursor].answer or not field.needed
        return move_cursor(chosen, entry.cursor + 1) if key == "enter" and can_leave else chosen
    if key in ("backspace", "delete") and not field.needed:
        return _change_field(entry, answer="")
    choice = find_choice(field.choices, character) if character else None
    return None if choice is None else _choose(entry, choice)


def _press_text(entry: FormEntry, key: str, character: str | None) -> FormEntry | None:
    """The entry after a key in a field with text or a number; None if the key has no meaning there."""
    text, caret = entry.field_entries[entry.cursor].answer, entry.field_entries[entry.cursor].caret
    match key:
        case "enter":
            return move_cursor(entry, entry.cursor + 1)
        case "left" | "right":
            return _change_field(entry, caret=min(max(caret + (1 if key == "right" else -1), 0), len(text)))
        case "home" | "end":
            return _change_field(entry, caret=0 if key == "home" else len(text))
        case "backspace":
            return _change_field(entry, answer=text[: max(caret - 1, 0)] + text[caret:], caret=max(caret - 1, 0))
        case "delete":
            return _change_field(entry, answer=text[:caret] + text[caret + 1 :])
    return _insert_text(entry, character) if character and character.isprintable() else None


def _insert_text(entry: FormEntry, characters: str) -> FormEntry:
    """Insert characters at the caret, up to `LONGEST_TEXT` in the field."""
    text, caret = entry.field_entries[entry.cursor].answer, entry.field_entries[entry.cursor].caret
    fitting = characters[: LONGEST_TEXT - len(text)]
    return _change_field(entry, answer=text[:caret] + fitting + text[caret:], caret=caret + len(fitting))


def _choose(entry: FormEntry, choice: int) -> FormEntry:
    """Choose an answer in the field under the cursor; in forms of `CHECKED`, a changed choice is noted in
    `replaced`."""
    field, previous_answer = entry.form.fields[entry.cursor], entry.field_entries[entry.cursor].answer
    answer = field.choices[choice]
    chosen = _change_field(entry, answer=answer, marked=choice)
    if previous_answer in ("", answer) or entry.form.kind not in CHECKED:
        return chosen
    return replace(chosen, replaced=entry.replaced | {entry.cursor})


def _change_field(
    entry: FormEntry, answer: str | None = None, marked: int | None = None, caret: int | None = None
) -> FormEntry:
    """The entry with changes to the field under the cursor; None leaves a value unchanged."""
    previous_field = entry.field_entries[entry.cursor]
    updated_field = FieldEntry(
        previous_field.answer if answer is None else answer,
        previous_field.marked if marked is None else marked,
        previous_field.caret if caret is None else caret,
    )
    field_entries = (*entry.field_entries[: entry.cursor], updated_field, *entry.field_entries[entry.cursor + 1 :])
    is_answer_changed = updated_field.answer != previous_field.answer
    return replace(
        entry,
        field_entries=field_entries,
        open=() if is_answer_changed else entry.open,
        check=() if is_answer_changed else entry.check,
    )


def _send_form(entry: FormEntry) -> FormEntry:
    """Send the form. Where answers are missing, or changed choices are not checked, it is not sent, and the cursor
    moves to the first such field."""
    missing_fields = find_missing_fields(entry.form, make_reply(entry))
    if missing_fields:
        field_indices = tuple(entry.form.fields.index(field) for field in missing_fields)
        return replace(entry, cursor=field_indices[0], open=field_indices, check=())
    if entry.replaced:
        field_indices = tuple(sorted(entry.replaced))
        return replace(entry, cursor=field_indices[0], open=(), check=field_indices, replaced=frozenset())
    return replace(entry, is_sent=True)
