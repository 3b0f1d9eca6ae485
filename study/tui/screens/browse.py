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
from study.tui.home_messages import CommandWanted
from study.tui.screens.help import HelpScreen

LOG, DIAGNOSIS = "events.jsonl", "diagnosis.json"
"""Names of the files that can be opened: the log of a session, and the document of a diagnosis."""

HELP = """\
# Open

Choose **events.jsonl** to open the session it belongs to, or **diagnosis.json** to read a diagnosis. Arrow keys move,
Enter opens a folder or a file. In the first line another folder, or the whole path of a file, can be typed. Esc goes
back.

In a terminal: `hapteq show PATH`.
"""
"""Help of the screen, in Markdown."""


class HapteqFiles(DirectoryTree):
    """Tree of folders that lists only event logs of sessions and documents of diagnoses; hidden files are left out."""

    def filter_paths(self, paths: Iterable[Path]) -> Iterable[Path]:
        return [path for path in paths if not path.name.startswith(".") and (_is_ours(path) or path.is_dir())]


def _is_ours(path: Path) -> bool:
    """Whether the name is that of a session's log or of a diagnosis."""
    return path.name == LOG or (path.suffix == ".json" and "diagnosis" in path.name)


class BrowseScreen(ModalScreen[None]):
    """A field for a path and a tree of folders: Enter opens a session or a diagnosis, Esc returns. folder: where the
    tree begins; the current folder if it does not exist."""

    HELP = HELP
    CSS = """
    BrowseScreen { align: center middle; }
    BrowseScreen > Vertical {
        width: 90%; max-width: 100; height: 90%; border: round $primary; padding: 0 1; background: $surface;
    }
    BrowseScreen HapteqFiles { height: 1fr; background: $surface; }
    BrowseScreen #message { height: 1; color: $foreground 65%; }
    """
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("escape", "leave", "Back", key_display="Esc"),
        Binding("f1", "help", "Help"),  # the application's own keys do not reach through a modal screen
    ]

    def __init__(self, folder: str) -> None:
        super().__init__()
        self._folder = Path(folder) if Path(folder).is_dir() else Path()

    def compose(self) -> ComposeResult:
        with Vertical() as box:
            box.border_title = "Open a session or a diagnosis"
            yield Input(str(self._folder.absolute()), compact=True, id="path")
            yield HapteqFiles(self._folder.absolute(), id="tree")
            yield Static("", id="message", markup=False)
        yield Footer(show_command_palette=False)

    def on_mount(self) -> None:
        self._show_message(f"{LOG}: a session. {DIAGNOSIS}: a diagnosis.")
        self.query_one(HapteqFiles).focus()

    @on(Input.Submitted, "#path")
    def _go_to_path(self, event: Input.Submitted) -> None:
        """Open a typed session folder or file; show any other folder in the tree."""
        path = Path(event.value).expanduser()
        if path.is_dir() and (path / LOG).exists():
            self._open_path(path / LOG)
        elif path.is_dir():
            tree = self.query_one(HapteqFiles)
            tree.path = path
            tree.focus()
        elif path.is_file():
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
        """Ask the engine to read the session of a log, or any other file as a diagnosis, and close the dialog."""
        command = ShowSession(str(path.parent)) if path.name == LOG else ShowDiagnosis(str(path))
        self.app.post_message(CommandWanted(command))
        dismiss_screen(self, None)

    def _show_message(self, text: str) -> None:
        self.query_one("#message", Static).update(text)
