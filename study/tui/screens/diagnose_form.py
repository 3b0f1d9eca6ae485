"""Form for the input of a diagnosis: recordings or a session, and the model of the device to compare with.

The form checks only that the entered recordings and model exist, and posts `DiagnoseRequested`; the engine process runs
the diagnosis.
"""

import shlex
from pathlib import Path
from typing import ClassVar

from textual import on
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Horizontal, Vertical
from textual.screen import ModalScreen
from textual.widgets import Footer, Input, Label, Static

from study.tui.dismiss_screen import dismiss_screen
from study.tui.engine.to_engine import Diagnose
from study.tui.home_messages import DiagnoseRequested
from study.tui.screens.help import HelpScreen
from study.tui.typed_paths import exists, expand_home, is_file

HELP = """\
# Diagnose

Where does a recording differ from a model of the device, and what physics does the model lack?

* **Recordings**: one file of `hapteq record` or `hapteq import`, or several of one device, separated by spaces (put a
  name with spaces in quotation marks); or the folder of a session, whose trials are taken.
* **Model**: a mechanical model, MODEL.toml. Left empty, a linear one is fitted to the recordings first; a session on
  the simulated device is compared with its twin.
* **Reference**: recordings of the device without a fault (`--clean`), where there are any. Differences from the
  model that they already show are not counted as mismatch.
* **Results**: a folder that does not exist yet. Left empty, one next to the recording, or in the session's folder.

**F5** begins, **Esc** goes back.

In a terminal: `hapteq diagnose REC.h5 --model MODEL.toml --out DIR`.
"""
"""Help of the screen, in Markdown."""
FIELDS = (
    ("sources", "Recordings", "REC.h5, several, or a session's folder"),
    ("model", "Model", "MODEL.toml; empty: none is given"),
    ("clean", "Reference", "recordings without a fault; may stay empty"),
    ("out", "Results", "a new folder; empty: next to the recording"),
)
"""Name, label and placeholder of each field, from top to bottom."""


class DiagnoseForm(ModalScreen[None]):
    """Dialog for the recordings, the model, the reference recordings and the folder of the results of a diagnosis. F5
    or Enter checks the paths and posts the request, Esc closes it."""

    HELP = HELP
    CSS = """
    DiagnoseForm { align: center middle; }
    DiagnoseForm > Vertical {
        width: 76; max-width: 95%; height: auto; border: round $primary; padding: 1 2; background: $surface;
    }
    DiagnoseForm .field { height: auto; }
    DiagnoseForm Label { width: 13; }
    DiagnoseForm Input { width: 1fr; }
    DiagnoseForm #message { height: auto; min-height: 2; margin-top: 1; color: $text-error; }
    """
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("f5", "begin", "Diagnose", priority=True),
        Binding("escape", "leave", "Back", key_display="Esc"),
        Binding("f1", "help", "Help"),  # a modal screen hides the bindings of the application
    ]

    def __init__(self, source: str = "") -> None:
        """source: path of a recording or session that the form enters as recording; empty: none."""
        super().__init__()
        self._source = source

    def compose(self) -> ComposeResult:
        with Vertical() as dialog:
            dialog.border_title = "Diagnose: what does a model lack?"
            for field, label, hint in FIELDS:
                with Horizontal(classes="field"):
                    yield Label(label)
                    initial_text = shlex.quote(self._source) if field == "sources" and self._source else ""
                    yield Input(initial_text, placeholder=hint, compact=True, id=field)
            yield Static("", id="message", markup=False)
        yield Footer(show_command_palette=False)

    def on_mount(self) -> None:
        self.query_one("#model" if self._source else "#sources", Input).focus()

    @on(Input.Submitted)
    def action_begin(self) -> None:
        """Check the paths; post the request and close the form, or show the first problem and focus its field. The
        diagnosis itself checks that the folder of the results is new."""
        paths_by_field: dict[str, tuple[Path, ...]] = {}
        for field in ("sources", "clean"):
            try:
                paths_by_field[field] = tuple(map(expand_home, shlex.split(self._read_field(field))))
            except ValueError:
                self._show_message("A quotation mark is open.", field)
                return
        sources, clean = (tuple(map(str, paths)) for paths in paths_by_field.values())
        model, out_folder = (
            str(expand_home(text)) if (text := self._read_field(name)) else "" for name in ("model", "out")
        )
        missing_entry = next(
            ((field, path) for field, paths in paths_by_field.items() for path in paths if not exists(path)), None
        )
        if not sources:
            self._show_message("Name a recording, or the folder of a session.", "sources")
        elif missing_entry is not None:
            self._show_message(f"There is nothing at {missing_entry[1]}.", missing_entry[0])
        elif model and not is_file(Path(model)):
            self._show_message(f"There is no file {model}.", "model")
        elif self.is_active:
            self.app.post_message(DiagnoseRequested(Diagnose(sources, model, out_folder, clean)))
            dismiss_screen(self, None)

    def action_help(self) -> None:
        self.app.push_screen(HelpScreen(HELP))

    def action_leave(self) -> None:
        dismiss_screen(self, None)

    def _read_field(self, field: str) -> str:
        """Read the text of a field, without surrounding blanks."""
        return self.query_one(f"#{field}", Input).value.strip()

    def _show_message(self, text: str, field: str) -> None:
        """Show a problem, and focus the field that it concerns."""
        self.query_one("#message", Static).update(text)
        self.query_one(f"#{field}", Input).focus()
