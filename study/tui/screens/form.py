"""Screen of a form, such as consent, exclusion criteria, questionnaires or set-up.

The rules of filling in (valid answers, movement of the cursor, changes to be confirmed) are in
`study.session.views.form_entry`: each key turns a `FormEntry` into the next, and this screen draws the result.
"""

from dataclasses import dataclass
from typing import ClassVar

from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Container
from textual.errors import NoWidget
from textual.events import Click, Event, Key, Paste
from textual.message import Message
from textual.widgets import Button, Footer

from protocols.wording.words import ENGLISH_WORDS, Words
from study.session.views.form_entry import (
    FormEntry,
    apply_key,
    click_choice,
    click_continue,
    make_blank_entry,
    make_reply,
    move_cursor,
    paste_text,
)
from study.session.views.form_views import Form, FormReply, find_missing_fields
from study.tui.dismiss_screen import dismiss_screen
from study.tui.translated_screen import TranslatedScreen
from study.tui.trial_words import describe_form_origin, describe_number_limits
from study.tui.widgets.card import Sheet
from study.tui.widgets.choice_row import ChoiceRow
from study.tui.widgets.form_question import FormQuestion
from study.tui.widgets.literal_text import LiteralText

MAX_QUOTE_CHARACTERS = 48
"""Largest number of characters of a quoted question or answer in a message; longer texts are cut. Chosen: the message
remains short."""
FOOTER_ENTRIES = (
    ("1", "choice", "1 2 …", "Choose"),
    ("left", "choice", "← →", "Move"),
    ("space", "choice", "Space", "Choose"),
    ("enter", "choice", "Enter", "Choose, next"),
    ("enter", "text", "Enter", "Next"),
    ("enter", "continue", "Enter", "Continue"),
    ("up", "", "↑", "Previous"),
    ("down", "", "↓", "Next"),
)
"""Footer entries: key, kind of field where the entry applies (empty: everywhere), text of the key, description."""
FOOTER_KEYS = frozenset(key for key, *_ in FOOTER_ENTRIES)
"""Keys that have a footer entry."""


class FormScreen(TranslatedScreen[FormReply]):
    """Screen that draws a `FormEntry`: introduction, questions, and the button Continue. Its result is the reply. No
    widget has the focus: the screen itself receives keys, clicks and pastes, and applies them in order of arrival."""

    PAGE = "help_form"
    DEFAULT_CSS = """
    FormScreen Container { height: 1fr; align-horizontal: center; }
    FormScreen #top { height: auto; min-height: 1; padding: 0 1; background: $panel; text-style: bold; }
    FormScreen #introduction { margin: 1 0; }
    FormScreen #origin { color: $foreground 65%; margin-bottom: 1; }
    FormScreen #message { height: auto; min-height: 1; padding: 0 1; text-align: center; text-style: bold; }
    FormScreen Button { margin: 0 0 1 2; }
    FormScreen Button.-at { text-style: bold reverse; }
    """
    AUTO_FOCUS = ""
    BINDINGS: ClassVar[list[BindingType]] = [
        *(
            Binding(key, f"press('{key}', '{field_kind}')", description, key_display=key_text)
            for key, field_kind, key_text, description in FOOTER_ENTRIES
        ),
        Binding("pageup", "scroll(-1)", "Page up", show=False),
        Binding("pagedown", "scroll(1)", "Page down", show=False),
    ]

    @dataclass
    class Pointed(Message):
        """A mouse click: the widget, and the index of the choice in it, if the click was on one."""

        widget: ChoiceRow | FormQuestion | Button
        choice: int | None = None

    def __init__(self, form: Form, words: Words = ENGLISH_WORDS) -> None:
        super().__init__(words)
        self._entry = make_blank_entry(form)
        self._enabled_entries: list[bool | None] = []
        """Whether each entry of `FOOTER_ENTRIES` had an effect when the footer was last drawn."""

    def compose(self) -> ComposeResult:
        form = self._entry.form
        yield LiteralText(id="top")
        with Container(), Sheet(can_focus=False):
            yield LiteralText(form.introduction, id="introduction")
            for number, field in enumerate(form.fields, start=1):
                yield FormQuestion(number, field, self.words)
            yield LiteralText(describe_form_origin(form, self.words), id="origin")
            button = Button(self.words["key_continue"], variant="primary", compact=True)
            button.can_focus = False
            yield button
        yield LiteralText(id="message")
        yield Footer(show_command_palette=False)

    def on_mount(self) -> None:
        self._show(self._entry)

    @property
    def entry(self) -> FormEntry:
        """Present state of the form: answers and position of the cursor."""
        return self._entry

    @property
    def stacked(self) -> bool:
        """Whether the choices under the cursor are listed vertically at this width."""
        index = self._entry.cursor
        return index < len(self._entry.form.fields) and self.query(FormQuestion)[index].stacked

    def on_key(self, event: Key) -> None:
        is_handled = self._apply(apply_key(self._entry, event.key, event.character, self.stacked))
        # Otherwise the binding of a footer key would act on it, later than on the keys that follow.
        if is_handled or event.key in FOOTER_KEYS:
            event.stop()
            event.prevent_default()

    def on_paste(self, event: Paste) -> None:
        event.stop()
        self._apply(paste_text(self._entry, event.text))

    def action_press(self, key: str, field_kind: str) -> None:
        """Apply the key of a footer entry. field_kind: kind of field where the entry applies;
        unused, because `check_action` disables the entry elsewhere."""
        self._apply(apply_key(self._entry, key, key if len(key) == 1 else None, self.stacked))

    def action_scroll(self, pages: int) -> None:
        """Scroll by pages; negative: up."""
        sheet = self.query_one(Sheet)
        sheet.scroll_relative(y=pages * sheet.size.height, animate=False)

    def check_action(self, action: str, parameters: tuple[object, ...]) -> bool | None:
        """Enable a footer entry only if its key has an effect at the present field."""
        if action != "press":
            return True
        key, entry_field_kind = parameters
        field = self._entry.field
        field_kind = "continue" if field is None else "choice" if field.choices else "text"
        key_names = ("left", "right") if key == "left" else (str(key),)
        stacked = self.is_mounted and self.stacked
        next_entries = [apply_key(self._entry, name, name if len(name) == 1 else None, stacked) for name in key_names]
        return entry_field_kind in ("", field_kind) and any(
            next_entry not in (None, self._entry) for next_entry in next_entries
        )

    def _forward_event(self, event: Event) -> None:
        """Post a click as a message to the screen, so that it stays in order with the keys."""
        if (
            isinstance(event, Click)
            and not event.is_forwarded
            and (click_message := self._locate_click(event)) is not None
        ):
            self.post_message(click_message)
            return
        super()._forward_event(event)

    def _locate_click(self, click: Click) -> Pointed | None:
        """Find the choice row, button or question under the pointer; None elsewhere."""
        try:
            widget, region = self.get_widget_at(click.screen_x, click.screen_y)
        except NoWidget:
            return None
        if isinstance(widget, ChoiceRow):
            return self.Pointed(widget, widget.find_choice_at(click.screen_x - region.x, click.screen_y - region.y))
        if isinstance(widget, Button):
            return self.Pointed(widget)
        question = next((node for node in widget.ancestors_with_self if isinstance(node, FormQuestion)), None)
        return self.Pointed(question) if question is not None else None

    def on_form_screen_pointed(self, click_message: Pointed) -> None:
        """Apply a mouse click: on Continue, a question, or a choice."""
        if isinstance(click_message.widget, Button):
            self._apply(click_continue(self._entry))
            return
        questions = list(self.query(FormQuestion))
        index = next(
            question_index
            for question_index, question in enumerate(questions)
            if question in click_message.widget.ancestors_with_self
        )
        next_entry = (
            move_cursor(self._entry, index)
            if click_message.choice is None
            else click_choice(self._entry, index, click_message.choice)
        )
        self._apply(next_entry)

    def _apply(self, entry: FormEntry | None) -> bool:
        """Make this the present state, and draw it; dismiss the screen if the form was sent. All changes of the state
        use this method. Returns False for None: the key had no meaning."""
        if entry is None:
            return False
        previous_entry, self._entry = self._entry, entry
        if entry.is_sent and not previous_entry.is_sent:
            dismiss_screen(self, make_reply(entry))
        elif entry != previous_entry:
            self._show(entry)
        return True

    def _show(self, entry: FormEntry) -> None:
        """Draw the state: answers, cursor, number of open questions, message and footer."""
        for index, question in enumerate(self.query(FormQuestion)):
            question.show(entry.field_entries[index], is_current=index == entry.cursor)
        button = self.query_one(Button)
        button.set_class(entry.field is None, "-at")
        if entry.field is None:
            button.scroll_visible(animate=False)
        reply = make_reply(entry)
        missing_count = len(find_missing_fields(entry.form, reply))
        counts = {"title": entry.form.title, "open": missing_count, "all": len(entry.field_entries)}
        status_text = self.words.fill("form_open" if missing_count else "form_complete", counts)
        is_anything_left_out = not missing_count and not all(reply.answers.values())  # answers that are optional
        self.query_one("#top", LiteralText).update(entry.form.title if is_anything_left_out else status_text)
        self.query_one("#message", LiteralText).update(_compose_message(entry, not missing_count, self.words))
        enabled_entries = [self.check_action("press", key[:2]) for key in FOOTER_ENTRIES]
        if enabled_entries != self._enabled_entries:
            self._enabled_entries = enabled_entries
            self.refresh_bindings()


def _compose_message(entry: FormEntry, is_complete: bool, words: Words) -> str:
    """Compose the line below the form: the first missing answer, or changed answers to be checked, or how to
    send a complete form; empty otherwise."""
    if entry.missing:
        remaining, field = len(entry.missing) - 1, entry.form.fields[entry.missing[0]]
        question_text = (
            _quote_label(field.label, words) if field.limits is None else describe_number_limits(field.limits, words)
        )
        request = words.fill("form_please", {"number": entry.missing[0] + 1, "question": question_text})
        return f"{request} {words.fill_count('form_more', remaining)}" if remaining else request
    if entry.unconfirmed:
        changes = ", ".join(
            words.fill(
                "form_change", {"number": index + 1, "answer": _quote_label(entry.field_entries[index].answer, words)}
            )
            for index in entry.unconfirmed
        )
        return words.fill("form_changed", {"changes": changes})
    return words["form_done"] if is_complete else ""


def _quote_label(label: str, words: Words) -> str:
    """Quote a text in quotation marks, cut to `MAX_QUOTE_CHARACTERS` characters."""
    shortened_label = label if len(label) <= MAX_QUOTE_CHARACTERS else f"{label[: MAX_QUOTE_CHARACTERS - 1].rstrip()}…"
    return words.fill("quoted", {"text": shortened_label})
