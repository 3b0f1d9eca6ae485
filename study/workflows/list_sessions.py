"""What lies in a data folder, and what the start screen offers. Reads only."""

from pathlib import Path

from study.devices.opening import DEVICES
from study.session.archive_views import HomeView, SessionLine
from study.store.archive import session_folders
from study.workflows.list_protocols import protocol_lines
from study.workflows.session_line import session_line


def home_view(data: Path) -> HomeView:
    """Everything on the start screen. A data folder that is not there is an empty one."""
    return HomeView(str(data), session_lines(data), protocol_lines(data), DEVICES)


def session_lines(data: Path) -> tuple[SessionLine, ...]:
    """Latest first. What cannot be read is there with a remark."""
    try:
        folders = session_folders(data)
    except OSError:
        return ()
    return tuple(sorted(map(session_line, folders), key=lambda line: (line.begun_utc, line.name), reverse=True))
