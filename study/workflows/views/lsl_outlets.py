"""Outlets of the lab streaming layer (LSL) for the markers and signals of a session (`hapteq stream`).

The optional library pylsl is imported only when an outlet is made. Times of samples are on LSL's own clock, in s.
"""

import hashlib
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

from equalizer.signals.signal import FloatArray
from study.errors import StudyError
from study.regular_file import open_regular

MAX_FIRST_LINE_BYTES = 2**20
"""Largest part (bytes) of the first line of a log that is read; its hash identifies the session. Chosen: 1 MiB, far
more than a line with the text of a protocol."""


@dataclass(frozen=True, slots=True)
class StreamDescription:
    """Description of a stream of samples, as other programs receive it; a unit for each channel, empty for none."""

    name: str
    kind: str
    """Content type of the stream, in LSL's vocabulary."""
    channels: tuple[str, ...]
    """Label of each channel."""
    units: tuple[str, ...]


class SignalOutlet(Protocol):
    """An LSL outlet of a stream of samples."""

    def push(self, samples: FloatArray, at_s: FloatArray) -> None:
        """Send samples with their times. samples: (n, channels); at_s: (n,), times on LSL's clock (s)."""
        ...


class MarkerOutlet:
    """Outlet for the markers of one session, a `stream_session.Outlet`. log: the session's log. The constructor raises
    StudyError where the library is not installed or the log cannot be read."""

    def __init__(self, log: Path) -> None:
        self._library = _import_pylsl()
        self._source_id = make_source_id(log)
        stream_fields = ("hapteq markers", "Markers", 1, self._library.IRREGULAR_RATE, "string", self._source_id)
        self._outlet = self._library.StreamOutlet(self._library.StreamInfo(*stream_fields))

    def clock_s(self) -> float:
        """Time by LSL's clock (s)."""
        return float(self._library.local_clock())

    def push(self, marker: str, at_s: float) -> None:
        """Send a marker with its time by LSL's clock (s)."""
        self._outlet.push_sample([marker], at_s)

    def make_signal_outlet(self, stream: StreamDescription, rate_hz: float) -> SignalOutlet:
        """Make an outlet for a stream of signals of the same session. rate_hz: its nominal sample rate (Hz)."""
        return _PylslSignalOutlet(self._library, f"{self._source_id} {stream.name}", stream, rate_hz)


class _PylslSignalOutlet:
    """A `SignalOutlet` of pylsl for samples in double precision, with label, unit and type of each channel."""

    def __init__(self, library: Any, source_id: str, stream: StreamDescription, rate_hz: float) -> None:
        info = library.StreamInfo(stream.name, stream.kind, len(stream.channels), rate_hz, "double64", source_id)
        channels = info.desc().append_child("channels")
        for label, unit in zip(stream.channels, stream.units, strict=True):
            channel = channels.append_child("channel")
            for key, value in (("label", label), ("unit", unit), ("type", stream.kind)):
                channel.append_child_value(key, value)
        self._outlet = library.StreamOutlet(info)

    def push(self, samples: FloatArray, at_s: FloatArray) -> None:
        """Send samples with their times, see `SignalOutlet`."""
        self._outlet.push_chunk(samples, at_s.tolist())


def make_source_id(log: Path) -> str:
    """Make the identifier by which a recorder finds the stream again after a restart: 64 bits of the SHA-256 of the
    log's first line. It does not depend on the folder and reveals nothing about the session. Raises StudyError."""
    try:
        with open_regular(log) as file:
            first_line = file.readline(MAX_FIRST_LINE_BYTES)
    except OSError as problem:
        raise make_unreadable_log_error(log, problem) from problem
    return f"hapteq {hashlib.sha256(first_line).hexdigest()[:16]}"


def make_unreadable_log_error(log: Path, problem: Exception) -> StudyError:
    """Make the error for a log that cannot be read while a session is followed."""
    return StudyError(
        "The session's log cannot be followed",
        f"{log.name} in {log.parent.name}: {problem}.",
        "Check it with: hapteq validate FILE",
        saved="The session is not touched.",
    )


def _import_pylsl() -> Any:
    """Import the module pylsl. Raises StudyError where it, or its C library, is not installed."""
    try:
        import pylsl
    except (ImportError, RuntimeError, OSError) as problem:  # installed, but without the C library
        raise StudyError(
            "Nothing can be streamed",
            f"The lab streaming layer is not installed here ({problem}).",
            "Install it: pip install '.[lsl]'. Where its wheel has no library for this system, install liblsl too.",
            saved="The session is not touched.",
        ) from problem
    return pylsl
