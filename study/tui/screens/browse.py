"""File dialog that opens a session or a diagnosis from any folder, also outside the data folder."""

from collections.abc import Iterable
from pathlib import Path
from typing import ClassVar

from textual import on
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Vertical
from textual.screen import ModalScreen
from textual.widgets import DirectoryTree, Footer, Input, Static

from study.tui.dismiss_screen import dismiss_screen
from study.tui.engine.to_engine import ShowDiagnosis, ShowSession
from study.tui.home_messages import CommandRequested
from study.tui.screens.help import HelpScreen
from study.tui.typed_paths import exists, expand_home, is_file, is_folder

LOG_NAME, DIAGNOSIS_NAME = "events.jsonl", "diagnosis.json"
"""Names of the files to open, equal to `event_log.LOG_NAME` and `diagnosis_file.DIAGNOSIS_NAME`; this module imports no
storage modules."""

HELP = """\
# Open

Choose **events.jsonl** to open the session it belongs to, or **diagnosis.json** to read a diagnosis. Arrow keys move,
Enter opens a folder or a file. In the first line another folder, or the whole path of a file, can be typed. Esc goes
back.

In a terminal: `hapteq show PATH`.
"""
"""Help of the screen, in Markdown."""


class HapteqFiles(DirectoryTree):
    """Tree that shows only folders, session logs and documents of diagnoses, by name; hidden ones are left out."""

    def filter_paths(self, paths: Iterable[Path]) -> Iterable[Path]:
        return [path for path in paths if not path.name.startswith(".") and (_is_openable(path) or is_folder(path))]


def _is_openable(path: Path) -> bool:
    """Whether the name is that of a session log, or of a JSON file with "diagnosis" in its name."""
    return path.name == LOG_NAME or (path.suffix == ".json" and "diagnosis" in path.name)


class BrowseScreen(ModalScreen[None]):
    """Dialog with a field for a path and a tree of folders: Enter opens a session or a diagnosis, Esc closes it."""

    HELP = HELP
    CSS = """
    BrowseScreen { align: center middle; }
    BrowseScreen > Vertical {
        width: 90%; max-width: 100; height: 90%; border: round $primary; padding: 0 1; background: $surface;
    }
    BrowseScreen HapteqFiles { height: 1fr; background: $surface; }
    BrowseScreen #message { height: auto; min-height: 1; color: $foreground 65%; }
    """
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("escape", "leave", "Back", key_display="Esc"),
        Binding("f1", "help", "Help"),  # a modal screen hides the bindings of the application
    ]

    def __init__(self, folder: str) -> None:
        """folder: root of the tree; the current folder if it is no folder."""
        super().__init__()
        self._folder = Path(folder) if is_folder(Path(folder)) else Path()

    def compose(self) -> ComposeResult:
        with Vertical() as dialog:
            dialog.border_title = "Open a session or a diagnosis"
            yield Input(str(self._folder.absolute()), compact=True, id="path")
            yield HapteqFiles(self._folder.absolute(), id="tree")
            yield Static("", id="message", markup=False)
        yield Footer(show_command_palette=False)

    def on_mount(self) -> None:
        self._show_message(f"{LOG_NAME}: a session. {DIAGNOSIS_NAME}: a diagnosis.")
        self.query_one(HapteqFiles).focus()

    @on(Input.Submitted, "#path")
    def _go_to_path(self, event: Input.Submitted) -> None:
        """Open a typed session folder or file; make any other folder the root of the tree; report a missing path."""
        path = expand_home(event.value.strip())
        if exists(path / LOG_NAME):
            self._open_path(path / LOG_NAME)
        elif is_folder(path):
            tree = self.query_one(HapteqFiles)
            tree.path = path
            tree.focus()
        elif is_file(path):
            self._open_path(path)
        else:
            self._show_message(f"There is nothing at {path}.")

    @on(DirectoryTree.FileSelected)
    def _open_selected(self, event: DirectoryTree.FileSelected) -> None:
        self._open_path(event.path)

    def action_help(self) -> None:
        self.app.push_screen(HelpScreen(HELP))

    def action_leave(self) -> None:
        dismiss_screen(self, None)

    def _open_path(self, path: Path) -> None:
        """Post the request to show the session of a log, or any other file as a diagnosis, and close the dialog."""
        command = ShowSession(str(path.parent)) if path.name == LOG_NAME else ShowDiagnosis(str(path))
        self.app.post_message(CommandRequested(command))
        dismiss_screen(self, None)

    def _show_message(self, text: str) -> None:
        self.query_one("#message", Static).update(text)
