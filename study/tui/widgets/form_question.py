"""Widget of one field of a form: the question and its answer. It only displays; the form's screen
(`study.tui.screens.form`) handles the keys."""

from rich.text import Text
from textual.app import ComposeResult
from textual.containers import Vertical
from textual.widgets import Static

from protocols.wording.words import ENGLISH_WORDS, Words
from study.session.views.form_entry import FieldEntry
from study.session.views.form_views import FormField
from study.tui.trial_words import describe_number_limits
from study.tui.widgets.choice_row import ChoiceRow
from study.tui.widgets.literal_text import LiteralText


class FormQuestion(Vertical):
    """Numbered question, and below it the choices or the text entered so far."""

    DEFAULT_CSS = """
    FormQuestion {
        height: auto; margin-bottom: 1; padding: 0 1 0 2; background: $surface;
    }
    FormQuestion.-at { border-left: thick $primary; padding: 0 1; background: $panel; }
    FormQuestion .written { background: $boost; }
    """

    def __init__(self, number: int, field: FormField, words: Words = ENGLISH_WORDS) -> None:
        """number: of the question, from 1. words: texts in the language of the participant."""
        super().__init__()
        self.field = field
        self._number = number
        self._words = words

    def compose(self) -> ComposeResult:
        yield LiteralText(f"{self._number}. {self.field.label}")
        if self.field.choices:
            choice_row = ChoiceRow(self.field.choices)
            choice_row.can_focus = False
            yield choice_row
        else:
            yield Static(classes="written")

    @property
    def stacked(self) -> bool:
        """Whether the field has choices that are listed vertically at the present width."""
        return bool(self.field.choices) and self.query_one(ChoiceRow).stacked

    def show(self, entry: FieldEntry, is_current: bool) -> None:
        """Show the state of the answer. is_current: whether the cursor of the form is on this question, which is then
        scrolled into view."""
        if is_current and not self.has_class("-at"):
            # Scrolls to the whole widget: the question must be visible, not only its answer.
            self.scroll_visible(animate=False)
        self.set_class(is_current, "-at")
        if self.field.choices:
            choice_row = self.query_one(ChoiceRow)
            choice_row.cursor, choice_row.is_current = entry.marked, is_current
            choice_row.chosen = self.field.choices.index(entry.answer) if entry.answer in self.field.choices else None
        else:
            self.query_one(".written", Static).update(self._format_answer(entry, is_current))

    def _format_answer(self, entry: FieldEntry, is_current: bool) -> Text:
        """Format the entered text, or a hint (with the range of a number) while nothing is entered; the text cursor is
        shown if `is_current`."""
        if not entry.answer:
            hint = self._words["form_type" if self.field.needed else "form_type_or_not"]
            if self.field.limits is not None:
                hint = f"{hint} ({describe_number_limits(self.field.limits, self._words)})"
            text = Text(hint, "dim")
            if is_current:
                text.stylize("reverse", 0, 1)
            return text
        text = Text(entry.answer + (" " if is_current else ""))
        if is_current:
            text.stylize("reverse", entry.caret, entry.caret + 1)
        return text
