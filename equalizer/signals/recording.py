"""A recording: the commands that entered the plant, the measured responses, and the conditions of the measurement.

The input of identification and diagnosis. `recording_checks` checks it; `study.store.formats.recording_file` reads and
writes it.

Time convention: `response[k]` and `position[k]` are sampled at t_k, just before `command[k]` is written, which is held
until t_(k+1) (`Hold.ZERO_ORDER`). Direct feedthrough of `command[k-1]` therefore appears in `response[k]`.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from enum import Enum
from typing import Any

from equalizer.signals.signal import FloatArray, Signal
from equalizer.signals.summary import Summary, SummaryDisplay


class Hold(Enum):
    """Course of the command between its samples, which a discrete model has to assume."""

    ZERO_ORDER = "zero-order"
    """Held until the next sample, as a digital controller writes it."""
    BAND_LIMITED = "band-limited"
    """A continuous signal without power above half the sample rate, such as a signal measured behind an anti-aliasing
    filter."""
    LINEAR = "linear"
    """Straight lines between the samples (first-order hold)."""


SEGMENT_KINDS = (
    "multisine", "sweep", "sine", "slow", "noise", "binary", "step", "impact", "free", "rest",
)  # fmt: skip
"""Kinds of excitation of a segment: periodic multisine, swept sine, single sine, slow movement, random noise, random
binary signal, steps, impacts, free motion after a release, rest without a command."""
SEGMENT_ROLES = ("fit", "test", "")
"""Use of a segment: to fit a model, to test it on held-out data, or (empty) as the identification decides."""

LEAST_PART_SAMPLES = 32
"""Least number of samples of a part; shorter ones are left out. Chosen by hand."""


@dataclass(frozen=True, slots=True)
class Segment:
    """A range of samples with a single kind of excitation; where segments are stated, the device rests outside them."""

    start: int
    """Index of the first sample."""
    stop: int
    """Index after the last sample."""
    kind: str
    """One of `SEGMENT_KINDS`."""
    amplitude: float = 0.0
    """Peak of the excitation in the command's unit."""
    period: int = 0
    """Samples per period; 0 = not periodic."""
    role: str = ""
    """One of `SEGMENT_ROLES`."""


@dataclass(frozen=True, repr=False, slots=True, eq=False)
class Recording(SummaryDisplay):
    """One recording of a device: n samples. All signals have the same sample rate and length, and their own units."""

    device: str
    """Name of the device; may be empty."""
    command: Signal
    """(n, m): the total command that entered the plant, that of a virtual spring or controller included."""
    response: Signal
    """(n, p): measured response, such as an acceleration."""
    position: Signal | None = None
    """(n, d): measured position; None where it was not recorded."""
    excitation: Signal | None = None
    """(n, m): the part of the command that was planned beforehand, where feedback (a virtual spring, a controller) adds
    to it; None where the command is all planned, or the part is not known."""
    time_s: FloatArray | None = None
    """(n,): time stamps (s); None where only the sample rate is known."""
    hold: Hold = Hold.ZERO_ORDER
    """Course of the command between samples."""
    segments: tuple[Segment, ...] = ()
    """Ranges of samples by kind of excitation; empty where not known."""
    meta: Mapping[str, Any] = field(default_factory=dict)
    """JSON values: place, sensor and its frame, feedback, grip, operator, provenance. `time` = "unknown" marks a
    recording whose sample rate is not known."""
    condition: Signal | None = None
    """(n, q): measured conditions, such as a temperature, a pressure or a setting; None without any."""

    @property
    def is_timed(self) -> bool:
        """Whether the sample rate is known. If not, it is set to 1 Hz as a placeholder: time is counted in samples."""
        return self.meta.get("time") != "unknown"

    @property
    def sample_rate_hz(self) -> float:
        """Sample rate (Hz) of all signals."""
        return self.response.sample_rate_hz

    @property
    def is_rotational(self) -> bool:
        """Whether a response or command channel is an angle, its derivative or a torque, by its unit."""
        return any(unit.startswith(("rad", "N m")) for unit in (*self.response.units, *self.command.units))

    def __len__(self) -> int:
        return len(self.response)

    def summary(self) -> Summary:
        """Summarise length, channels with units, and number of segments, for printing."""
        signals = {"command": self.command, "response": self.response, "position": self.position}
        return Summary(
            f"Recording of {self.device or 'a device'}",
            (
                ("length", f"{len(self)} samples at {self.sample_rate_hz:g} Hz"),
                *((name, _format_channels(signal)) for name, signal in signals.items() if signal is not None),
                ("segments", str(len(self.segments))),
            ),
        )


def find_parts(recording: Recording) -> tuple[tuple[int, int], ...]:
    """Find begin and end (exclusive) of each part with at least `LEAST_PART_SAMPLES`, as sample indices: a stretch that
    was recorded without interruption. The whole recording where `meta` (key "parts") states no such part within it."""
    stated_parts = recording.meta.get("parts")
    stated_ranges = [
        (int(stated_part["start"]), int(stated_part["stop"]))
        for stated_part in (
            stated_parts if isinstance(stated_parts, Sequence) and not isinstance(stated_parts, str) else ()
        )
        if isinstance(stated_part, dict) and "start" in stated_part and "stop" in stated_part
    ]
    long_parts = [
        (start, stop)
        for start, stop in stated_ranges
        if start >= 0 and stop <= len(recording) and stop - start >= LEAST_PART_SAMPLES
    ]
    return tuple(long_parts) or ((0, len(recording)),)


def list_segments(recording: Recording) -> tuple[Segment, ...]:
    """List the segments; where none are stated, one of noise for each part (`find_parts`)."""
    return recording.segments or tuple(Segment(start, stop, "noise") for start, stop in find_parts(recording))


def _format_channels(signal: Signal) -> str:
    """Format the channels with their units in brackets, for the summary: "fx [N], fy [N]"."""
    return ", ".join(f"{name} [{unit}]" for name, unit in zip(signal.channels, signal.units, strict=True))
