"""A form: consent, exclusion, the set-up, the debrief. It says what is missing, and judges nothing."""

from typing import ClassVar

from textual import on
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Container
from textual.screen import Screen
from textual.widgets import Button, Footer, Input

from study.session.form_views import Form, FormReply, missing
from study.tui.take_off import take_off
from study.tui.widgets.card import Sheet
from study.tui.widgets.choice_row import ChoiceRow
from study.tui.widgets.form_question import FormQuestion
from study.tui.widgets.said import Said

LONGEST_QUOTE = 48


class Questions(Sheet, can_focus=False, inherit_bindings=False):
    """Up and down go from question to question, not line by line."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("pageup", "page_up", "Page up", show=False),
        Binding("pagedown", "page_down", "Page down", show=False),
    ]


class FormScreen(Screen[FormReply]):
    HELP = """\
# A form

- **Up**, **Down** and **Tab** go from question to question.
- A choice is made by its number, by its first letter, or with **Left**, **Right** and **Space**.
- **Enter** chooses what is highlighted and goes to the next question.
- **Continue** stands below the last question. It says what is missing.
- You may ask the experimenter about anything that is unclear. **Ctrl+C** leaves.
"""
    DEFAULT_CSS = """
    FormScreen Container { height: 1fr; align-horizontal: center; }
    FormScreen #top { height: 1; padding: 0 1; background: $panel; text-style: bold; }
    FormScreen #introduction { margin: 1 0; }
    FormScreen #origin { color: $foreground 65%; margin-bottom: 1; }
    FormScreen #said { height: 1; padding: 0 1; text-align: center; text-style: bold; }
    FormScreen Button { margin: 0 0 1 2; }
    """
    AUTO_FOCUS = "ChoiceRow, Input"
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("up", "app.focus_previous", "Previous", key_display="↑"),
        Binding("down", "app.focus_next", "Next", key_display="↓"),
    ]

    def __init__(self, form: Form) -> None:
        super().__init__()
        self._form = form

    def compose(self) -> ComposeResult:
        form = self._form
        yield Said(id="top")
        with Container(), Questions():
            yield Said(form.introduction, id="introduction")
            for number, field in enumerate(form.fields, start=1):
                yield FormQuestion(number, field)
            yield Said(_origin(form), id="origin")
            yield Button("Continue", variant="primary", compact=True)
        yield Said(id="said")
        yield Footer(show_command_palette=False)

    def on_mount(self) -> None:
        self._count()

    @on(ChoiceRow.Chosen)
    @on(Input.Changed)
    def _count(self) -> None:
        """How much is answered, always in sight."""
        open_ones = len(missing(self._form, self._reply()))
        fields = len(self._form.fields)
        told = f"{open_ones} of {fields} still open" if open_ones else "everything is answered"
        self.query_one("#top", Said).update(f"{self._form.title}: {told}")
        self.query_one("#said", Said).update("" if open_ones else "Go down to Continue and press Enter.")

    @on(ChoiceRow.Left)
    @on(Input.Submitted)
    def _next(self) -> None:
        self.focus_next()

    @on(Button.Pressed)
    def _finish(self) -> None:
        reply = self._reply()
        gaps = missing(self._form, reply)
        if not gaps:
            take_off(self, reply)
            return
        questions = list(self.query(FormQuestion))
        first = next(question for question in questions if question.field == gaps[0])
        first.take_focus()
        number = questions.index(first) + 1
        more = f" {len(gaps) - 1} more are open." if len(gaps) > 2 else " 1 more is open." if len(gaps) == 2 else ""
        self.query_one("#said", Said).update(f"Please answer {number}: {_quoted(gaps[0].label)}{more}")

    def _reply(self) -> FormReply:
        return FormReply({question.field.key: question.answer for question in self.query(FormQuestion)})


def _origin(form: Form) -> str:
    parts = (form.version and f"Version {form.version}", form.ethics_id and f"Ethics approval {form.ethics_id}")
    return ". ".join(part for part in parts if part) + "." if any(parts) else ""


def _quoted(label: str) -> str:
    return f"“{label}”" if len(label) <= LONGEST_QUOTE else f"“{label[: LONGEST_QUOTE - 1].rstrip()}…”"
