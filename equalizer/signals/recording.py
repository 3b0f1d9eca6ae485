"""A recording: what entered the plant, what came out, and under which conditions.

Sampling: `response[k]` and `position[k]` are taken at t_k just before `command[k]` is written, which is held
until t_(k+1). A plant with direct feedthrough therefore answers `command[k-1]`.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum
from typing import Any

from equalizer.signals.signal import FloatArray, Signal
from equalizer.signals.summary import Summarised, Summary


class Hold(Enum):
    """How the command moves between its samples: held, or linearly interpolated."""

    ZERO_ORDER = "zero-order"
    BAND_LIMITED = "band-limited"
    LINEAR = "linear"


SEGMENT_KINDS = (
    "multisine", "sweep", "sine", "slow", "noise", "binary", "step", "impact", "free", "rest",
)  # fmt: skip
SEGMENT_ROLES = ("fit", "test", "")


@dataclass(frozen=True, slots=True)
class Segment:
    """Samples start (included) to stop (excluded) of one kind of excitation. Outside all segments is rest."""

    start: int
    stop: int
    kind: str
    amplitude: float = 0.0
    """Peak of the excitation in the command's unit."""
    period: int = 0
    """Samples per period; 0 = not periodic."""
    role: str = ""


@dataclass(frozen=True, repr=False, slots=True, eq=False)
class Recording(Summarised):
    """One recording of a device. All signals share rate and length."""

    device: str
    command: Signal
    """(n, m): what entered the plant, virtual spring included."""
    response: Signal
    """(n, p)"""
    position: Signal | None = None
    """(n, d)"""
    excitation: Signal | None = None
    """(n, m): the part of the command that was decided beforehand, where a feedback adds to it."""
    time_s: FloatArray | None = None
    """(n,): time stamps where the device kept them."""
    hold: Hold = Hold.ZERO_ORDER
    segments: tuple[Segment, ...] = ()
    meta: Mapping[str, Any] = field(default_factory=dict)
    """JSON values: place, sensor and its frame, feedback, grip, operator, provenance."""
    condition: Signal | None = None
    """(n, q): measured conditions, such as a temperature, a pressure, a setting."""

    @property
    def is_timed(self) -> bool:
        """Whether time is known; where not, samples are numbered and the rate of 1 Hz is nominal."""
        return self.meta.get("time") != "unknown"

    @property
    def sample_rate_hz(self) -> float:
        return self.response.sample_rate_hz

    @property
    def is_rotational(self) -> bool:
        """Whether a response or command channel is an angle, its derivative or a torque, by its unit."""
        return any(unit.startswith(("rad", "N m")) for unit in (*self.response.units, *self.command.units))

    def __len__(self) -> int:
        return len(self.response)

    def summary(self) -> Summary:
        signals = {"command": self.command, "response": self.response, "position": self.position}
        return Summary(
            f"Recording of {self.device or 'a device'}",
            (
                ("length", f"{len(self)} samples at {self.sample_rate_hz:g} Hz"),
                *((name, _channels_text(signal)) for name, signal in signals.items() if signal is not None),
                ("segments", str(len(self.segments))),
            ),
        )


def _channels_text(signal: Signal) -> str:
    return ", ".join(f"{name} [{unit}]" for name, unit in zip(signal.channels, signal.units, strict=True))
