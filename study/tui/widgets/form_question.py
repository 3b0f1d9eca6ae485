"""One field of a form: what is asked, and where it is answered."""

from textual.app import ComposeResult
from textual.containers import Vertical
from textual.events import DescendantFocus
from textual.widgets import Input

from study.session.form_views import FormField
from study.tui.widgets.choice_row import ChoiceRow
from study.tui.widgets.said import Said

MOST_CHARACTERS = 500


class FormQuestion(Vertical):
    DEFAULT_CSS = """
    FormQuestion {
        height: auto; margin-bottom: 1; padding: 0 1 0 2; background: $surface;
    }
    FormQuestion:focus-within { border-left: thick $primary; padding: 0 1; background: $panel; }
    FormQuestion Input { background: $boost; }
    """

    def __init__(self, number: int, field: FormField) -> None:
        super().__init__()
        self.field = field
        self._number = number

    def compose(self) -> ComposeResult:
        yield Said(f"{self._number}. {self.field.label}")
        if self.field.choices:
            yield ChoiceRow(self.field.choices)
        else:
            hint = "type your answer" if self.field.needed else "type your answer, or leave it empty"
            yield Input(placeholder=hint, max_length=MOST_CHARACTERS, compact=True, select_on_focus=False)

    @property
    def answer(self) -> str:
        return self.query_one(ChoiceRow).answer if self.field.choices else self.query_one(Input).value.strip()

    def take_focus(self) -> None:
        self.query_one(ChoiceRow if self.field.choices else Input).focus()

    def on_descendant_focus(self, event: DescendantFocus) -> None:
        # The question itself must be seen too, not only where it is answered.
        self.scroll_visible(animate=False)
