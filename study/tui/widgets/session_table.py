"""Table of the sessions of a data folder, a row for each, with keys to open, resume or watch a session.

Part of the start screen (`study.tui.screens.home`), which acts on the messages that the keys post. Rows of long lists
are added in batches, and columns are left out in narrow terminals.
"""

from collections.abc import Mapping
from textwrap import wrap
from typing import ClassVar

from textual.binding import Binding, BindingType
from textual.content import Content
from textual.events import Resize
from textual.message import Message
from textual.widgets import DataTable

from study.local_clock import convert_to_machine_zone
from study.session.views.archive_views import SessionLine
from study.session.views.local_time import format_times_in_zone
from study.tui.engine.to_engine import ShowSession
from study.tui.home_messages import CommandRequested, ResumeRequested, WatchRequested
from study.tui.session_status import find_status_style, format_status

_NAME_TITLE, _STATUS_TITLE, _START_TITLE, _RUNS_TITLE, _ANSWERS_TITLE, _PROTOCOL_TITLE = (
    "Session",
    "Standing",
    "Begun",
    "Runs",
    "Answers",
    "Protocol",
)
"""Titles of the columns, the keys of their widths; `show` adds the offset from UTC to that of the start times."""
_FIXED_WIDTHS = {_STATUS_TITLE: 12, _RUNS_TITLE: 5, _ANSWERS_TITLE: 7}
"""Fixed widths (character cells) of columns with short entries, which are not measured. The protocol's column gets the
remaining width, as far as its entries need it; longer entries are wrapped."""
_MIN_PROTOCOL_WIDTH, _CELL_PADDING = 10, 2
"""Least width of the protocol's column, chosen so that a wrapped name stays readable, and padding that the table adds
to a column, in character cells."""

BATCH_ROWS = 60
"""Number of rows that are added at once; more than a terminal usually shows. Chosen."""
_BATCH_PAUSE_S = 0.01
"""Pause (s) between two batches of rows, in which keys are handled. Chosen: too short to be noticed."""


class SessionTable(DataTable[Content | str]):
    """Rows of sessions in the order given: Enter opens a session, r resumes an unfinished one, w watches a running one.
    Each key posts a message."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("enter", "select_cursor", "Open"),
        Binding("r", "resume", "Resume"),
        Binding("w", "watch", "Watch"),
    ]

    class CursorMoved(Message):
        """Message: the cursor moved to the session `line`, or the list was replaced with the cursor on it."""

        def __init__(self, line: SessionLine) -> None:
            super().__init__()
            self.line = line

    def __init__(self, *, id: str | None = None) -> None:
        super().__init__(id=id, cursor_type="row", zebra_stripes=False)
        self._lines: tuple[SessionLine, ...] = ()
        self._start_times: tuple[str, ...] = ()
        self._widths: dict[str, int] = {}
        self._fitted_width = 0

    def show(self, lines: tuple[SessionLine, ...]) -> None:
        """Replace the listed sessions; the cursor stays on its session if that is still listed, else it is on the first
        row."""
        selected_line = self._selected_line
        self._lines = lines
        utc_offset, self._start_times = format_times_in_zone(
            [line.begun_utc for line in lines], convert_to_machine_zone
        )
        self._widths = self._fit_columns(f"{_START_TITLE} ({utc_offset})" if utc_offset else _START_TITLE)
        self.clear(columns=True)
        for title, width in self._widths.items():
            self.add_column(title, width=width)
        self._add_rows(lines, selected_line.name if selected_line is not None else "")
        self._post_cursor_moved()

    def on_resize(self, event: Resize) -> None:
        if self._lines and event.size.width != self._fitted_width:
            self.show(self._lines)

    def _fit_columns(self, start_title: str) -> dict[str, int]:
        """Compute the column widths (cells) by title, and store the table's width for which they hold. The column of
        answers is left out where the protocols do not fit on one line, that of runs where less than
        `_MIN_PROTOCOL_WIDTH` remains then. start_title: title of the column of times."""
        self._fitted_width = self.size.width
        names, protocols = ([getattr(line, attribute) for line in self._lines] for attribute in ("name", "protocol"))
        widths = {_NAME_TITLE: max(map(len, (_NAME_TITLE, *names))), _STATUS_TITLE: _FIXED_WIDTHS[_STATUS_TITLE]}
        widths |= {
            start_title: max(map(len, (start_title, *self._start_times))),
            _RUNS_TITLE: _FIXED_WIDTHS[_RUNS_TITLE],
            _ANSWERS_TITLE: _FIXED_WIDTHS[_ANSWERS_TITLE],
        }
        protocol_width = max(map(len, (_PROTOCOL_TITLE, *protocols)))
        for title, min_width in ((_ANSWERS_TITLE, protocol_width), (_RUNS_TITLE, _MIN_PROTOCOL_WIDTH)):
            if self._compute_protocol_width(widths) < min_width:
                del widths[title]
        return widths | {
            _PROTOCOL_TITLE: min(protocol_width, max(_MIN_PROTOCOL_WIDTH, self._compute_protocol_width(widths)))
        }

    def _compute_protocol_width(self, widths: Mapping[str, int]) -> int:
        """Compute the width (cells) that the given columns and the scroll bar leave for the protocol; may be
        negative."""
        scroll_bar_width = self.styles.scrollbar_size_vertical if len(self._lines) >= self.size.height else 0
        return self.size.width - scroll_bar_width - sum(widths.values()) - _CELL_PADDING * (len(widths) + 1)

    def _add_rows(self, lines: tuple[SessionLine, ...], selected_name: str) -> None:
        """Add the next rows, and the remaining ones after a pause, so that keys are handled in between.
        selected_name: name of the session to put the cursor on; empty for none."""
        if lines is not self._lines:
            return  # the list was replaced since this call was scheduled
        first_row = self.row_count
        batch = lines[first_row : first_row + BATCH_ROWS]
        for index, line in enumerate(batch, start=first_row):
            # Wrapped here, because the table truncates an entry that is too wide.
            protocol_lines = wrap(line.protocol, self._widths[_PROTOCOL_TITLE])
            self.add_row(
                *self._format_row(line, self._start_times[index], "\n".join(protocol_lines)),
                height=max(1, len(protocol_lines)),
            )
            if line.name == selected_name:
                self.move_cursor(row=index)
        if self.row_count < len(lines):
            self.set_timer(_BATCH_PAUSE_S, lambda: self._add_rows(lines, selected_name))

    @property
    def _selected_line(self) -> SessionLine | None:
        """Session under the cursor; None in an empty table."""
        return self._lines[self.cursor_row] if 0 <= self.cursor_row < len(self._lines) else None

    def on_data_table_row_highlighted(self) -> None:
        self._post_cursor_moved()

    def on_data_table_row_selected(self) -> None:
        """Request to show the session under the cursor."""
        if self._selected_line is not None:
            self.post_message(CommandRequested(ShowSession(self._selected_line.path)))

    def action_resume(self) -> None:
        """Request to resume the session under the cursor."""
        if self._selected_line is not None:
            self.post_message(ResumeRequested(self._selected_line.path))

    def action_watch(self) -> None:
        """Request to watch the session under the cursor."""
        if self._selected_line is not None:
            self.post_message(WatchRequested(self._selected_line.path))

    def check_action(self, action: str, parameters: tuple[object, ...]) -> bool | None:
        """Disable actions that do not apply to the session under the cursor, and hide them in the footer."""
        needed_status = {"resume": "unfinished", "watch": "running"}.get(action)
        return needed_status is None or (
            self._selected_line is not None and self._selected_line.standing == needed_status
        )

    def _post_cursor_moved(self) -> None:
        """Update the footer and post `CursorMoved` for the session under the cursor."""
        self.refresh_bindings()
        if self._selected_line is not None:
            self.post_message(self.CursorMoved(self._selected_line))

    def _format_row(self, line: SessionLine, start_time: str, protocol: str) -> tuple[Content | str, ...]:
        """Format the cells of a row, for the columns in `_widths`; counts only of finished, unfinished and running
        sessions. start_time: local time at which the session began; protocol: its name, wrapped into lines."""
        has_counts = line.standing in ("finished", "unfinished", "running")
        runs_cells = (f"{line.runs_done}/{line.runs}" if has_counts else "",) if _RUNS_TITLE in self._widths else ()
        answers_cells = (f"{line.answers:>7}" if has_counts else "",) if _ANSWERS_TITLE in self._widths else ()
        status = Content.styled(format_status(line.standing), find_status_style(line.standing))
        return Content(line.name), status, start_time, *runs_cells, *answers_cells, Content(protocol)
