"""Table of the sessions of a data folder, a row for each, with keys to open, resume or watch a session.

Long lists are added in parts, and columns are dropped in narrow terminals.
"""

from collections.abc import Mapping
from textwrap import wrap
from typing import ClassVar

from textual.binding import Binding, BindingType
from textual.content import Content
from textual.events import Resize
from textual.message import Message
from textual.widgets import DataTable

from study.local_clock import machine_zone
from study.session.views.archive_views import SessionLine
from study.session.views.local_time import format_times_in_zone
from study.tui.engine.to_engine import ShowSession
from study.tui.home_messages import CommandWanted, ResumeWanted, WatchWanted
from study.tui.session_status import STYLES, format_status

_NAME, _STATUS, _START, _RUNS, _ANSWERS, _PROTOCOL = (
    "Session",
    "Standing",
    "Begun",
    "Runs",
    "Answers",
    "Protocol",
)
_FIXED = {_STATUS: 12, _RUNS: 5, _ANSWERS: 7}
"""Fixed column widths in cells: measuring every entry of a long list would take time. The protocol gets the remaining
width, and is wrapped."""
_LEAST_PROTOCOL, _PADDING = 10, 2
"""Least width of the protocol's column, and padding of a cell, in character cells."""

AT_ONCE = 60
"""Number of rows that are added at once; more than a terminal usually shows."""
_BREATH_S = 0.01
"""Pause (s) between two batches of rows, in which keys are handled."""


class SessionTable(DataTable[Content | str]):
    """Rows of sessions in the order given: Enter opens a session, r resumes an unfinished one, w watches a running one.
    Each key posts a message."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("enter", "select_cursor", "Open"),
        Binding("r", "resume", "Resume"),
        Binding("w", "watch", "Watch"),
    ]

    class Looked(Message):
        """The cursor moved to another session."""

        def __init__(self, line: SessionLine) -> None:
            super().__init__()
            self.line = line

    def __init__(self, *, id: str | None = None) -> None:
        super().__init__(id=id, cursor_type="row", zebra_stripes=False)
        self._lines: tuple[SessionLine, ...] = ()
        self._start_times: tuple[str, ...] = ()
        self._widths: dict[str, int] = {}
        self._fitted_to = 0

    def show(self, lines: tuple[SessionLine, ...]) -> None:
        """Replace the sessions; the cursor stays on its session if that is still listed."""
        chosen = self._chosen
        self._lines = lines
        offset, self._start_times = format_times_in_zone([line.begun_utc for line in lines], machine_zone)
        self._widths = self._fit_columns(f"{_START} ({offset})" if offset else _START)
        self.clear(columns=True)
        for title, width in self._widths.items():
            self.add_column(title, width=width)
        self._add_more(lines, chosen.name if chosen is not None else "")
        self._post_looked()

    def on_resize(self, event: Resize) -> None:
        if self._lines and event.size.width != self._fitted_to:
            self.show(self._lines)

    def _fit_columns(self, start_title: str) -> dict[str, int]:
        """Column widths (cells) by title. Where the protocol has too little room, the column of answers, then that of
        runs, is left out: the sentence below the list states both. start_title: title of the column of times."""
        self._fitted_to = self.size.width
        names, protocols = ([getattr(line, attribute) for line in self._lines] for attribute in ("name", "protocol"))
        widths = {_NAME: max(map(len, (_NAME, *names))), _STATUS: _FIXED[_STATUS]}
        widths |= {
            start_title: max(map(len, (start_title, *self._start_times))),
            _RUNS: _FIXED[_RUNS],
            _ANSWERS: _FIXED[_ANSWERS],
        }
        protocol_width = max(map(len, (_PROTOCOL, *protocols)))
        for title, least_width in ((_ANSWERS, protocol_width), (_RUNS, _LEAST_PROTOCOL)):
            if self._room(widths) < least_width:
                del widths[title]
        return widths | {_PROTOCOL: min(protocol_width, max(_LEAST_PROTOCOL, self._room(widths)))}

    def _room(self, widths: Mapping[str, int]) -> int:
        """Width (cells) that the given columns and the scroll bar leave for the protocol."""
        bar = self.styles.scrollbar_size_vertical if len(self._lines) >= self.size.height else 0
        return self.size.width - bar - sum(widths.values()) - _PADDING * (len(widths) + 1)

    def _add_more(self, lines: tuple[SessionLine, ...], chosen: str) -> None:
        """Add the next rows, and the remaining ones after a pause, so that keys are handled in between. chosen: name of
        the session to put the cursor on; empty for none."""
        if lines is not self._lines:
            return  # the list was replaced since this call was scheduled
        start = self.row_count
        part = lines[start : start + AT_ONCE]
        for index, line in enumerate(part, start=start):
            protocol = wrap(line.protocol, self._widths[_PROTOCOL])  # the table would cut it instead of wrapping it
            self.add_row(*self._row(line, self._start_times[index], "\n".join(protocol)), height=max(1, len(protocol)))
            if line.name == chosen:
                self.move_cursor(row=index)
        if self.row_count < len(lines):
            self.set_timer(_BREATH_S, lambda: self._add_more(lines, chosen))

    @property
    def _chosen(self) -> SessionLine | None:
        return self._lines[self.cursor_row] if 0 <= self.cursor_row < len(self._lines) else None

    def on_data_table_row_highlighted(self) -> None:
        self._post_looked()

    def on_data_table_row_selected(self) -> None:
        if self._chosen is not None:
            self.post_message(CommandWanted(ShowSession(self._chosen.path)))

    def action_resume(self) -> None:
        if self._chosen is not None:
            self.post_message(ResumeWanted(self._chosen.path))

    def action_watch(self) -> None:
        if self._chosen is not None:
            self.post_message(WatchWanted(self._chosen.path))

    def check_action(self, action: str, parameters: tuple[object, ...]) -> bool | None:
        """The footer shows only actions that apply to the session under the cursor."""
        needed_status = {"resume": "unfinished", "watch": "running"}.get(action)
        return needed_status is None or (self._chosen is not None and self._chosen.standing == needed_status)

    def _post_looked(self) -> None:
        self.refresh_bindings()
        if self._chosen is not None:
            self.post_message(self.Looked(self._chosen))

    def _row(self, line: SessionLine, start_time: str, protocol: str) -> tuple[Content | str, ...]:
        has_counts = line.standing in ("finished", "unfinished", "running")
        runs = (f"{line.runs_done}/{line.runs}" if has_counts else "",) if _RUNS in self._widths else ()
        answers = (f"{line.answers:>7}" if has_counts else "",) if _ANSWERS in self._widths else ()
        status = Content.styled(format_status(line.standing), STYLES[line.standing])
        return Content(line.name), status, start_time, *runs, *answers, Content(protocol)
