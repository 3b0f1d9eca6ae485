"""The study protocols that can be chosen: the shipped ones, and those that lie with the data. Reads only."""

import tomllib
from pathlib import Path

from protocols.definition.study_protocol import StudyProtocol
from study.errors import StudyError
from study.session.views.archive_views import ProtocolLine
from study.store.disk.toml_text import read_toml_text
from study.store.formats.protocol_files import ProtocolRefusedError, read_protocol, shipped_protocols


def protocol_lines(data: Path) -> tuple[ProtocolLine, ...]:
    """The shipped ones first, then files in the data folder and beside it."""
    places = dict.fromkeys((data.absolute(), data.absolute().parent))
    found = [str(path) for place in places for path in _toml_files(place) if _says_study(path)]
    lines = (protocol_line(name, data) for name in (*shipped_protocols(), *found))
    return tuple(line for line in lines if line is not None)


def _toml_files(folder: Path) -> list[Path]:
    try:
        return sorted(path for path in folder.glob("*.toml") if path.is_file())
    except OSError:
        return []


def _says_study(path: Path) -> bool:
    try:
        return tomllib.loads(read_toml_text(path, "protocol")).get("kind") == "study"
    except (StudyError, ValueError, RecursionError):
        return False


def protocol_line(name: str, data: Path) -> ProtocolLine | None:
    """None for a protocol of another kind. A bad one is offered with its problem, so that nobody misses it."""
    try:
        file = read_protocol(name, data)
    except ProtocolRefusedError as refused:
        return ProtocolLine(name, f"Cannot be used: {refused.problems[0]}", locked=False)
    except StudyError as problem:
        return ProtocolLine(name, f"Cannot be used. {problem.happened}", locked=False)
    if not isinstance(file.protocol, StudyProtocol):
        return None
    equalized = file.protocol.stimulus.quantity == "delivered_acceleration"
    return ProtocolLine(name, file.protocol.title, file.locked, equalized)
