"""Messages from the screen's process to the engine process, sent pickled through the pipe.

They are plain values, and the module imports no slow module, so that the first frame appears soon. `from_engine` has
the messages of the other direction.
"""

from dataclasses import dataclass
from typing import Any

from study.session.watching.requests import Request


@dataclass(frozen=True, slots=True)
class SessionOrder:
    """Parameters of a new session."""

    protocol: str
    """Name of a shipped protocol, or path of a protocol file."""
    device: str
    subject: str
    """Participant code."""
    data: str
    """Path of the data folder."""
    seed: int | None = None
    """Seed of the session's random numbers; None: a seed is drawn. The seed is logged."""
    model: str = ""
    """File of the identified model that equalizes the stimuli; empty if the protocol commands forces directly."""


@dataclass(frozen=True, slots=True)
class ShowHome:
    """Read the data folder for the start screen."""

    data: str
    """Path of the data folder."""
    protocol: str = ""
    """Protocol that is listed first; empty for none."""
    device: str = ""
    """Device that is listed first; empty for none."""
    model: str = ""
    """Model that is listed first; empty for none."""


@dataclass(frozen=True, slots=True)
class ShowSession:
    """Read a past session."""

    path: str
    """Path of its folder."""


@dataclass(frozen=True, slots=True)
class ShowDiagnosis:
    """Read a diagnosis."""

    path: str
    """Path of its `diagnosis.json`."""


@dataclass(frozen=True, slots=True)
class BeginSession:
    """Begin a new session."""

    order: SessionOrder


@dataclass(frozen=True, slots=True)
class Resume:
    """Resume a session after a crash or a pause."""

    session: str
    """Path of its folder, or its name in the data folder."""
    device: str
    data: str
    """Path of the data folder."""
    follows_log: bool = False
    """Whether the device that the session's log names takes the place of `device`, unless both are simulated; otherwise
    a device of another kind (real or simulated) is an error."""


@dataclass(frozen=True, slots=True)
class Analyze:
    """Write the tables and the report of a session, and show the session."""

    session: str
    """Path of its folder."""


@dataclass(frozen=True, slots=True)
class Withdraw:
    """Erase all sessions of the participant of this session. The screen has asked the user for confirmation before."""

    session: str
    """Path of its folder."""


@dataclass(frozen=True, slots=True)
class Diagnose:
    """Diagnose recordings against a model, write the results and show them. `Interrupt` interrupts the diagnosis."""

    sources: tuple[str, ...]
    """Paths of recordings, or of one session folder."""
    model: str
    """Path of the model; empty if none is given."""
    out: str
    """Path of the folder for the results; empty: a new folder in the session's folder, or next to the recording."""
    clean: tuple[str, ...] = ()
    """Paths of reference recordings, of the device without a fault; `--clean` in a terminal."""


@dataclass(frozen=True, slots=True)
class CalibrateSensor:
    """Calibrate the accelerometer under gravity in six positions; the engine requests each by
    `PlacementRequest`. `Interrupt` interrupts the calibration."""

    port: str
    """Name of the serial port."""
    baud: int


@dataclass(frozen=True, slots=True)
class StoreCalibration:
    """Store a calibration in the lab's file."""

    table: str
    """The calibration as a TOML table, as in `CalibrationComputed`."""


@dataclass(frozen=True, slots=True)
class SendRequest:
    """Send a request to a session that runs in another program."""

    session: str
    """Path of its folder."""
    request: Request


@dataclass(frozen=True, slots=True)
class ForwardRequest:
    """Send a request (a note, a pause or a stop) to the session that runs in this engine."""

    request: Request


@dataclass(frozen=True, slots=True)
class Interrupt:
    """Switch the force off at once, in any state of the engine, and interrupt the current command (Ctrl-C). An
    interrupted session can be resumed."""


@dataclass(frozen=True, slots=True)
class Heartbeat:
    """Sign of life of the screen's event loop."""


@dataclass(frozen=True, slots=True)
class Reply:
    """Reply to the `ScreenRequest` or `PlacementRequest` of the same number. A reply to a request that has ended is
    ignored."""

    number: int
    """Number of the request."""
    value: Any
    """Return value of the method of the display port; true for a `PlacementRequest`, when the sensor was placed."""


Command = (
    ShowHome
    | ShowSession
    | ShowDiagnosis
    | BeginSession
    | Resume
    | Analyze
    | Withdraw
    | Diagnose
    | CalibrateSensor
    | StoreCalibration
    | SendRequest
)
"""Messages that the engine performs one after another."""

ToEngine = Command | ForwardRequest | Interrupt | Heartbeat | Reply
"""Any message from the screen."""
