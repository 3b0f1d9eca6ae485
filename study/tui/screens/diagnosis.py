"""Screen of a finished diagnosis: which physics a model of the device lacks.

It shows the verdict, the identified effects, alternative explanations (candidates and rivals), the recording that is
recommended next, and tables of errors before and after the effects are added. The contents come from `DiagnosisView`.
"""

from typing import ClassVar

from rich.table import Table
from rich.text import Text
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Container, Horizontal, VerticalScroll
from textual.screen import Screen
from textual.widgets import Footer, Static

from study.session.views.archive_views import DiagnosisView
from study.tui.home_messages import HomeRequested
from study.tui.screens.session import open_report
from study.tui.widgets.text_table import TextTable

HELP = """\
# A diagnosis

Where a model and the device disagree, and why.

* **Verdict**: whether there is a mismatch, and whether it is explained.
* **Effects**: physics that the model lacks, with its parameters and their 95 % intervals.
* **Candidates**: physics that would explain some of it and is not confirmed, and why not.
* **Rivals**: what else was considered, and why not.
* **Fit**: errors of the given model, after re-tuning its own parameters, and with the effects. *repeats allow* is the
  smallest error that can be reached. *test* is the record that no fit has seen: that line counts.
* **Mismatch** and **What remains**: where the model is wrong, before and after.
* **Next**: the recording that would distinguish the rivals.

Arrow keys, PageUp and PageDown scroll. **o** opens the report in the browser. **Esc** goes back.

In a terminal: `hapteq show diagnosis.json`.
"""
"""Help of the screen, in Markdown."""


class DiagnosisScreen(Screen[None]):
    """Page of a diagnosis: sentences, then tables; side by side in a terminal of at least 120 characters. The key o
    opens the report in the browser, if there is one; Esc returns to the start screen."""

    HELP = HELP
    CSS = """
    DiagnosisScreen #head { height: auto; min-height: 1; padding: 0 1; background: $primary-muted; }
    DiagnosisScreen #page { height: 1fr; padding: 0 1; }
    DiagnosisScreen #halves { height: auto; }
    DiagnosisScreen .half { height: auto; }
    DiagnosisScreen.-wide #halves { layout: horizontal; }
    DiagnosisScreen.-wide .half { width: 1fr; padding-right: 2; }
    DiagnosisScreen .title { text-style: bold; color: $text-primary; margin-top: 1; }
    DiagnosisScreen #verdict { text-style: bold; margin-top: 1; }
    DiagnosisScreen .table { height: auto; overflow-x: auto; }
    DiagnosisScreen .muted { color: $foreground 65%; }
    """
    HORIZONTAL_BREAKPOINTS = [(0, "-narrow"), (120, "-wide")]  # noqa: RUF012  # no ClassVar in the base class
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("escape", "back", "Back", key_display="Esc"),
        Binding("o", "open_report", "Open report"),
    ]

    def __init__(self, view: DiagnosisView) -> None:
        super().__init__()
        self._view = view

    def compose(self) -> ComposeResult:
        view = self._view
        yield Static(f"Diagnosis   {view.path}", id="head", markup=False)
        with VerticalScroll(id="page"):
            yield Static(view.verdict, id="verdict", markup=False)
            with Container(id="halves"):
                with Container(classes="half"):
                    yield from _compose_section("Effects", view.sentences, "No effect is named.")
                    if view.candidates:
                        yield from _compose_section("Candidates, not confirmed", view.candidates, "")
                    yield from _compose_section(
                        "Rivals, and why rejected", view.rivals, "No other effect fitted nearly as well."
                    )
                    yield from _compose_section(
                        "Next", tuple(view.next_experiment.splitlines()), "No further recording is suggested."
                    )
                with Container(classes="half"):
                    yield from _compose_table("Fit (errors; smaller is better)", view.fit, "No fit is reported.")
                    yield Static("\n".join(view.notes), classes="muted", markup=False)
                    yield from _compose_table("Mismatch", view.mismatch, "None beyond what repeats allow.")
                    yield from _compose_table("What remains", view.remainder, "Nothing beyond what repeats allow.")
        yield Footer(show_command_palette=False)

    def on_mount(self) -> None:
        self.query_one("#page").focus()

    def action_back(self) -> None:
        self.post_message(HomeRequested())

    def action_open_report(self) -> None:
        open_report(self.app, self._view.report)

    def check_action(self, action: str, parameters: tuple[object, ...]) -> bool | None:
        """Disable the key o where the diagnosis has no report."""
        return action != "open_report" or bool(self._view.report)


def _compose_section(title: str, sentences: tuple[str, ...], empty_text: str) -> ComposeResult:
    """Yield a title and its sentences as a bulleted list, or `empty_text` where there are no sentences."""
    yield Static(title, classes="title", markup=False)
    bullets = Table.grid(padding=(0, 1, 0, 0))
    for sentence in sentences or (empty_text,):
        bullets.add_row("•" if sentences else "", Text(sentence))
    yield Static(bullets)


def _compose_table(title: str, rows: tuple[tuple[str, ...], ...], empty_text: str) -> ComposeResult:
    """Yield a title and its table, whose first row is the header, or `empty_text` where there are no other rows."""
    yield Static(title, classes="title", markup=False)
    if len(rows) < 2:
        yield Static(empty_text, markup=False)
        return
    with Horizontal(classes="table"):
        yield TextTable(rows)
