"""State machine of a form while it is filled in: each key, click or paste gives the next state from the previous one.

States are immutable, and nothing is drawn here: `study.tui.screens.form` draws them. Keys are applied in the order of
arrival, so that an answer belongs to the question at which the earlier keys have left the cursor.
"""

from dataclasses import dataclass, replace

from study.session.views.form_views import Form, FormField, FormKind, FormReply, find_missing_fields

MAX_TEXT_CHARACTERS = 500
"""Largest number of characters of free text in a field; further characters are ignored. Chosen: a few
sentences."""
CONFIRMED_KINDS = (FormKind.CONSENT, FormKind.EXCLUSION)
"""Kinds of forms in which changed choices must be confirmed before sending, because safety depends on them."""
CURSOR_STEPS = {"down": 1, "up": -1, "tab": 1, "shift+tab": -1}
"""Number of fields by which each key moves the cursor."""


@dataclass(frozen=True, slots=True)
class FieldEntry:
    """Content of one field."""

    answer: str = ""
    """The answer in the language shown; empty without one."""
    marked: int | None = None
    """Index of the choice that Space or Enter would choose; None before the first move or choice."""
    caret: int = 0
    """Position of the caret in free text, from 0 to the number of characters."""


@dataclass(frozen=True, slots=True)
class FormEntry:
    """State of a form while it is filled in; `apply_key` gives the next state."""

    form: Form
    field_entries: tuple[FieldEntry, ...]
    """Content of each field, in the order of the form's fields."""
    cursor: int = 0
    """Index of the field under the cursor; the number of fields stands for the button Continue below the last."""
    replaced: frozenset[int] = frozenset()
    """Indices of fields whose choice was changed and not yet shown for confirmation; only in `CONFIRMED_KINDS`."""
    missing: tuple[int, ...] = ()
    """Indices of the fields without a valid answer at the last attempt to send the form; empty after the next change of
    an answer."""
    unconfirmed: tuple[int, ...] = ()
    """Indices of the fields whose changed choices are shown for confirmation, after an attempt to send the form; empty
    after the next change of an answer."""
    is_sent: bool = False
    """Whether the form is complete and was sent; no key changes it then."""

    @property
    def field(self) -> FormField | None:
        """The field that has the cursor; None on Continue."""
        return self.form.fields[self.cursor] if self.cursor < len(self.form.fields) else None


def make_blank_entry(form: Form) -> FormEntry:
    """Make an empty entry for this form."""
    return FormEntry(form, (FieldEntry(),) * len(form.fields))


def make_reply(entry: FormEntry) -> FormReply:
    """Make the reply from an entry: answers by key, without blanks at their ends."""
    return FormReply(
        {
            field.key: field_entry.answer.strip()
            for field, field_entry in zip(entry.form.fields, entry.field_entries, strict=True)
        }
    )


def apply_key(entry: FormEntry, key: str, character: str | None = None, stacked: bool = False) -> FormEntry | None:
    """Apply one key and return the next entry; None if the key has no function at the cursor. After sending, no key has
    an effect.

    key: name of the key in Textual (the terminal interface library), such as "enter", "shift+tab", "1". character: the
    character that the key prints; None without one. stacked: whether the choices under the cursor are listed
    vertically; Up and Down then move through them first.
    """
    if entry.is_sent:
        return entry
    field = entry.field
    if field is not None and field.choices and stacked and key in ("up", "down"):
        moved_mark = move_mark(
            entry.field_entries[entry.cursor].marked, CURSOR_STEPS[key], len(field.choices), stop_at_ends=False
        )
        if moved_mark is not None:
            return _change_field(entry, marked=moved_mark)
    if key in CURSOR_STEPS:
        return move_cursor(entry, entry.cursor + CURSOR_STEPS[key])
    if field is None:
        return _send_form(entry) if key == "enter" else None
    return _press_choice(entry, field, key, character) if field.choices else _press_text(entry, key, character)


def move_cursor(entry: FormEntry, field_index: int) -> FormEntry:
    """Move the cursor to a field; indices beyond the ends give the first field or Continue."""
    return entry if entry.is_sent else replace(entry, cursor=min(max(field_index, 0), len(entry.form.fields)))


def click_choice(entry: FormEntry, field_index: int, choice_index: int) -> FormEntry:
    """Apply a click on a choice: the cursor moves to its field, and it is chosen. Both indices count from 0."""
    return entry if entry.is_sent else _choose_answer(move_cursor(entry, field_index), choice_index)


def click_continue(entry: FormEntry) -> FormEntry:
    """Apply a click on Continue: the form is sent if it is complete and confirmed."""
    return entry if entry.is_sent else _send_form(move_cursor(entry, len(entry.form.fields)))


def paste_text(entry: FormEntry, text: str) -> FormEntry:
    """Insert pasted text into a field of text or number, blanks reduced to single spaces, unprintable characters
    removed, and cut at `MAX_TEXT_CHARACTERS` in the field; ignored in fields with choices and on Continue."""
    field = entry.field
    if entry.is_sent or field is None or field.choices:
        return entry
    return _insert_text(entry, "".join(character for character in " ".join(text.split()) if character.isprintable()))


def move_mark(marked: int | None, step: int, choice_count: int, stop_at_ends: bool = True) -> int | None:
    """Move the mark among the choices by a step of 1 or -1 and return the index of the marked choice. Without a mark
    (None), a step of 1 gives the first choice, -1 the last. A step beyond the ends leaves the mark unchanged; if
    `stop_at_ends` is false, it gives None, as does a step of -1 without a mark."""
    if marked is None:
        return (0 if step > 0 else choice_count - 1) if stop_at_ends or step > 0 else None
    moved_mark = marked + step
    return moved_mark if 0 <= moved_mark < choice_count else marked if stop_at_ends else None


def find_choice(choices: tuple[str, ...], character: str) -> int | None:
    """Find the index of the choice that a typed character selects: by its number from 1, or by its first letter if no
    other choice has the same. Where any choice is a number, a digit selects the choice with this text. None without
    such a choice."""
    if character.isdecimal():
        if any(choice.isdigit() for choice in choices):
            return choices.index(character) if character in choices else None
        return int(character) - 1 if 0 < int(character) <= len(choices) else None
    matching_choices = [
        index for index, choice in enumerate(choices) if choice.casefold().startswith(character.casefold())
    ]
    return matching_choices[0] if len(matching_choices) == 1 else None


def _press_choice(entry: FormEntry, field: FormField, key: str, character: str | None) -> FormEntry | None:
    """Apply a key in a field with choices; None if the key has no function there."""
    field_entry = entry.field_entries[entry.cursor]
    if key in ("left", "right"):
        return _change_field(
            entry, marked=move_mark(field_entry.marked, 1 if key == "right" else -1, len(field.choices))
        )
    if key in ("space", "enter"):
        changed_entry = entry if field_entry.marked is None else _choose_answer(entry, field_entry.marked)
        can_leave = changed_entry.field_entries[entry.cursor].answer or not field.needed
        return move_cursor(changed_entry, entry.cursor + 1) if key == "enter" and can_leave else changed_entry
    if key in ("backspace", "delete") and not field.needed:
        return _change_field(entry, answer="")
    choice_index = find_choice(field.choices, character) if character else None
    return None if choice_index is None else _choose_answer(entry, choice_index)


def _press_text(entry: FormEntry, key: str, character: str | None) -> FormEntry | None:
    """Apply a key in a field with text or a number; None if the key has no function there."""
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
    """Insert characters at the caret, up to `MAX_TEXT_CHARACTERS` in the field."""
    text, caret = entry.field_entries[entry.cursor].answer, entry.field_entries[entry.cursor].caret
    fitting_characters = characters[: MAX_TEXT_CHARACTERS - len(text)]
    return _change_field(
        entry, answer=text[:caret] + fitting_characters + text[caret:], caret=caret + len(fitting_characters)
    )


def _choose_answer(entry: FormEntry, choice_index: int) -> FormEntry:
    """Choose an answer in the field under the cursor; in `CONFIRMED_KINDS`, a changed choice is added to `replaced`."""
    field, previous_answer = entry.form.fields[entry.cursor], entry.field_entries[entry.cursor].answer
    answer = field.choices[choice_index]
    changed_entry = _change_field(entry, answer=answer, marked=choice_index)
    if previous_answer in ("", answer) or entry.form.kind not in CONFIRMED_KINDS:
        return changed_entry
    return replace(changed_entry, replaced=entry.replaced | {entry.cursor})


def _change_field(
    entry: FormEntry, answer: str | None = None, marked: int | None = None, caret: int | None = None
) -> FormEntry:
    """Change the field under the cursor; None leaves a value unchanged. A new answer clears `missing` and
    `unconfirmed`."""
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
        missing=() if is_answer_changed else entry.missing,
        unconfirmed=() if is_answer_changed else entry.unconfirmed,
    )


def _send_form(entry: FormEntry) -> FormEntry:
    """Send the form, unless answers are missing or changed choices are unconfirmed; the cursor then moves to the first
    such field. Another attempt to send confirms the changed choices."""
    missing_fields = find_missing_fields(entry.form, make_reply(entry))
    if missing_fields:
        field_indices = tuple(entry.form.fields.index(field) for field in missing_fields)
        return replace(entry, cursor=field_indices[0], missing=field_indices, unconfirmed=())
    if entry.replaced:
        field_indices = tuple(sorted(entry.replaced))
        return replace(entry, cursor=field_indices[0], missing=(), unconfirmed=field_indices, replaced=frozenset())
    return replace(entry, is_sent=True)
