"""Past sessions, latest first: one row each, with what can be done with it as keys."""

from typing import ClassVar

from textual.binding import Binding, BindingType
from textual.content import Content
from textual.message import Message
from textual.widgets import DataTable

from study.local_clock import machine_zone
from study.session.archive_views import SessionLine
from study.session.local_time import local_time
from study.tui.home_messages import ResumeWanted, SessionWanted, WatchWanted
from study.tui.standing_words import STYLES, standing_words

COLUMNS = (("Standing", 12), ("Begun", 23), ("Runs", 5), ("Answers", 7), ("Protocol", 40))
"""With their widths in cells, so that nothing has to be measured in a long list. The session's name comes first."""
_NAME = "Session"

AT_ONCE = 60
"""Rows: more than any terminal shows."""
_BREATH_S = 0.01


class SessionTable(DataTable[Content | str]):
    """Rows are made when they are there to be seen: the table itself draws only those."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("enter", "select_cursor", "Open"),
        Binding("r", "resume", "Resume"),
        Binding("w", "watch", "Watch"),
    ]

    class Looked(Message):
        """Another session is under the cursor."""

        def __init__(self, line: SessionLine) -> None:
            super().__init__()
            self.line = line

    def __init__(self, *, id: str | None = None) -> None:
        super().__init__(id=id, cursor_type="row", zebra_stripes=False)
        self._lines: tuple[SessionLine, ...] = ()

    def show(self, lines: tuple[SessionLine, ...]) -> None:
        """The cursor stays on its session, as far as it is still there."""
        chosen = self._chosen
        self._lines = lines
        self.clear(columns=True)
        longest = max((len(line.name) for line in lines), default=0)
        for title, width in ((_NAME, max(len(_NAME), longest)), *COLUMNS):
            self.add_column(title, width=width)
        self._add_more(lines, chosen.name if chosen is not None else "")
        self._tell()

    def _add_more(self, lines: tuple[SessionLine, ...], chosen: str) -> None:
        """A long list comes in parts, so that keys are heard in between."""
        if lines is not self._lines:
            return  # a newer list came meanwhile
        have = self.row_count
        part = lines[have : have + AT_ONCE]
        self.add_rows(_row(line) for line in part)
        for place, line in enumerate(part, start=have):
            if line.name == chosen:
                self.move_cursor(row=place)
        if self.row_count < len(lines):
            self.set_timer(_BREATH_S, lambda: self._add_more(lines, chosen))

    @property
    def _chosen(self) -> SessionLine | None:
        return self._lines[self.cursor_row] if 0 <= self.cursor_row < len(self._lines) else None

    def on_data_table_row_highlighted(self) -> None:
        self._tell()

    def on_data_table_row_selected(self) -> None:
        if self._chosen is not None:
            self.post_message(SessionWanted(self._chosen.path))

    def action_resume(self) -> None:
        if self._chosen is not None:
            self.post_message(ResumeWanted(self._chosen.path))

    def action_watch(self) -> None:
        if self._chosen is not None:
            self.post_message(WatchWanted(self._chosen.path))

    def check_action(self, action: str, parameters: tuple[object, ...]) -> bool | None:
        """Not in the footer where it does nothing for the session under the cursor."""
        wanted = {"resume": "unfinished", "watch": "running"}.get(action)
        return wanted is None or (self._chosen is not None and self._chosen.standing == wanted)

    def _tell(self) -> None:
        self.refresh_bindings()
        if self._chosen is not None:
            self.post_message(self.Looked(self._chosen))


def _row(line: SessionLine) -> tuple[Content | str, ...]:
    known = line.standing in ("finished", "unfinished", "running")
    return (
        Content(line.name),
        Content.styled(standing_words(line.standing), STYLES[line.standing]),
        local_time(line.begun_utc, machine_zone),
        f"{line.runs_done}/{line.runs}" if known else "",
        f"{line.answers:>7}" if known else "",
        Content(line.protocol),
    )
