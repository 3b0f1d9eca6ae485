"""What lies in a data folder, and what the start screen offers. Reads only."""

from pathlib import Path

from study.devices.opening import DEVICES
from study.session.views.archive_views import HomeView, SessionLine
from study.session.views.printable import printable, printable_text
from study.store.sessions.archive import session_folders
from study.workflows.views.list_models import model_files, model_words
from study.workflows.views.list_protocols import protocol_lines
from study.workflows.views.session_line import session_line


def home_view(data: Path) -> HomeView:
    """Everything on the start screen. A data folder that is not there is an empty one."""
    models = model_files(data)
    qualities = tuple((model, model_words(model)) for model in models)
    return HomeView(
        printable_text(str(data)), session_lines(data), printable(protocol_lines(data)), DEVICES, models, qualities
    )


def session_lines(data: Path) -> tuple[SessionLine, ...]:
    """Latest first. What cannot be read is there with a remark."""
    try:
        folders = session_folders(data)
    except OSError:
        return ()
    lines = printable(tuple(map(session_line, folders)))
    return tuple(sorted(lines, key=lambda line: (line.begun_utc, line.name), reverse=True))
