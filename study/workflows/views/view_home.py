"""Lists for the start screen: the sessions of a data folder, and the protocols, models and devices to choose from.

Nothing is changed. Damaged files are listed with a remark or left out.
"""

import tomllib
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

from equalizer.plant.model_quality import write_quality_brief
from protocols.definition.study_protocol import StudyProtocol
from study.devices.opening import DEVICES
from study.errors import StudyError
from study.session.views.archive_views import HomeView, ProtocolLine, SessionLine
from study.session.views.printable import make_printable, replace_unprintable
from study.store.disk.file_errors import CannotReadError
from study.store.disk.text_file import read_toml_text
from study.store.formats.identified_model_file import confirm_identified_model, read_identified_model
from study.store.formats.protocol_files import ProtocolRefusedError, list_shipped_protocols, read_protocol
from study.store.sessions.archive import list_session_folders
from study.workflows.views.session_line import make_session_line


def list_protocol_lines(data: Path) -> tuple[ProtocolLine, ...]:
    """List the study protocols to choose from: shipped ones first, then files in the data folder and in its parent
    folder."""
    study_files = [str(path) for path in _list_files(data, "*.toml") if _is_study_protocol(path)]
    lines = (make_protocol_line(name, data) for name in (*list_shipped_protocols(), *study_files))
    return tuple(line for line in lines if line is not None)


def _list_files(data: Path, pattern: str) -> list[Path]:
    """List the files of a pattern in the data folder, then in its parent folder, each by name; none where a folder
    cannot be read."""
    paths: list[Path] = []
    for folder in dict.fromkeys((data.absolute(), data.absolute().parent)):
        with suppress(OSError):
            paths += sorted(path for path in folder.glob(pattern) if path.is_file())
    return paths


def _is_study_protocol(path: Path) -> bool:
    """Whether a TOML file has the entry kind = "study"."""
    try:
        return tomllib.loads(read_toml_text(path, "protocol")).get("kind") == "study"
    except (StudyError, ValueError, RecursionError):
        return False


def make_protocol_line(name: str, data: Path) -> ProtocolLine | None:
    """Make the line of a study protocol; None for a protocol of another kind. An invalid one is listed with its
    problem. name: of a shipped protocol, or the path of a file."""
    try:
        protocol_file = read_protocol(name, data)
    except ProtocolRefusedError as refusal:
        return ProtocolLine(name, f"Cannot be used: {refusal.problems[0]}", locked=False)
    except StudyError as problem:
        return ProtocolLine(name, f"Cannot be used. {problem.happened}", locked=False)
    if not isinstance(protocol_file.protocol, StudyProtocol):
        return None
    is_equalized = protocol_file.protocol.stimulus.quantity == "delivered_acceleration"
    return ProtocolLine(name, protocol_file.protocol.title, protocol_file.locked, is_equalized)


def list_model_files(data: Path) -> tuple[str, ...]:
    """List the files of identified models in the data folder and in its parent folder, the latest first."""
    latest_first = sorted(_list_files(data, "*.h5"), key=_read_mtime_s, reverse=True)
    return tuple(str(path) for path in latest_first if _is_identified_model(path))


def describe_model_quality(path: str) -> str:
    """Describe the quality of the model in a file, in a few words, or why it cannot be used."""
    try:
        return write_quality_brief(read_identified_model(Path(path)).quality)
    except StudyError as problem:
        return f"cannot be used: {problem.title}"


def _read_mtime_s(path: Path) -> float:
    """Read the time of the last change (s since 1970); 0 for a file that was removed meanwhile."""
    try:
        return path.stat().st_mtime
    except OSError:
        return 0.0


def _is_identified_model(path: Path) -> bool:
    """Whether an HDF5 file is an identified model; False also where it cannot be read."""
    try:
        return confirm_identified_model(path)
    except StudyError:  # a recording, or not a hapteq file
        return False


def make_home_view(data: Path) -> HomeView:
    """Make the content of the start screen. A data folder that is missing or cannot be read is shown as empty. Control
    characters are replaced, except in the paths of sessions, protocols and models, by which the files are opened."""
    model_paths = list_model_files(data)
    qualities = tuple((model_path, describe_model_quality(model_path)) for model_path in model_paths)
    session_lines: tuple[SessionLine, ...] = ()
    with suppress(StudyError):
        session_lines = list_session_lines(data)
    return HomeView(
        replace_unprintable(str(data)),
        session_lines,
        tuple(replace(make_printable(line), name=line.name) for line in list_protocol_lines(data)),
        DEVICES,
        model_paths,
        qualities,
    )


def list_session_lines(data: Path) -> tuple[SessionLine, ...]:
    """List the lines of all sessions, the latest first; empty without the folder. Unreadable sessions are listed with a
    remark. Raises CannotReadError where the folder cannot be read."""
    try:
        folders = list_session_folders(data)
    except OSError as problem:
        raise CannotReadError(data, problem) from problem
    lines = (replace(make_printable(make_session_line(folder)), path=str(folder.path)) for folder in folders)
    return tuple(sorted(lines, key=lambda line: (line.begun_utc, line.name), reverse=True))
