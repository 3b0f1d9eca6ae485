"""Device port: the interface through which the rest of the program uses a device.

Every call and every answer is a value: a real device's 1 kHz loop lives in a process of its own (`loop_process`).
`hold` has no end because a participant feels a trial as long as wanted.
"""

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from typing import Protocol

from equalizer.signals.recording import Recording
from equalizer.signals.signal import Signal
from study.session.facts.sensor_facts import SensorFacts
from study.session.facts.void_reasons import PROGRAM_STALLED
from study.session.stimulus.held_stimulus import HeldStimulus
from study.session.stimulus.limits import Limits

REPLAY = "replay:"
"""Begins a device's name, before the path of a recording: its handle moves as it once did, independent of the force
asked for."""
CALIBRATED = "simulated:"
"""Begins a device's name, before the path of a calibration: the simulated device with the linkage and the inertia that
it tells."""


@dataclass(frozen=True, slots=True)
class DeviceInfo:
    """Properties of an opened device: name, rate, maximum force and mass."""

    name: str
    simulated: bool
    sample_rate_hz: float
    max_force_n: float
    effective_mass_kg: float
    """Apparent mass at the handle in the centre of the workspace, to which the virtual spring's natural frequency
    refers."""
    details: str = ""
    """Serial number, firmware, or the simulation's parameter set."""
    has_sensor: bool = True
    """Whether there is an accelerometer: a real device's is named by the lab's file."""
    moved_by_force: bool = True
    """False for a replay alone: its position may stand still under any force. Ignored for a device that is not
    simulated."""


@dataclass(frozen=True, slots=True)
class DeviceSettings:
    """Settings from opening to closing: limits, spring, and recorded part of each stimulus."""

    limits: Limits
    spring_frequency_hz: float
    """Natural frequency of the centring spring with the device's effective mass; 0 = no spring."""
    spring_damping_n_s_per_m: float
    keep_s: float
    hand_on_handle: bool
    """Whether a hand holds the handle. A simulated device then carries a simulated hand."""
    place_m: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Centre of the spring, x, y, z."""
    beyond_hand_ceiling: bool = False
    """Without a hand on the handle: caps up to the device's own maximum, not only up to what a hand may feel. Never
    set by a protocol; refused with a hand."""
    with_sensor: bool = True
    """Whether a real device's accelerometer is read, where the lab's file names one. Without it there is no
    acceleration."""


class Fault(Enum):
    """Why the device let go by itself. Each ends a trial."""

    @property
    def sentence(self) -> str:
        """The fault as a sentence, with a capital letter and a full stop."""
        return f"{self.value[0].upper()}{self.value[1:]}."

    NONE = "none"
    NOT_A_NUMBER = "a command or a position was no plausible number"
    STALLED = PROGRAM_STALLED
    HELD_TOO_LONG = "the stimulus was held longer than the protocol allows"
    STOPPED = "the emergency stop was pressed"
    LOST = "the device stopped answering"
    FORCE_LEFT = "the device took no zero force: let go of the handle and switch the device off"
    OUTSIDE = "the position lay outside the workspace, so the force was let go"
    JUMPED = "the position jumped further than a handle can move, so the force was let go"
    SHAKEN = "the position changed its speed faster than a handle can, so the force was let go"
    STALE = "the position stood still although the handle must have moved, so the force was let go"


@dataclass(frozen=True, slots=True)
class Health:
    """Counters of the safety layer since `hold` or `play`, in ticks."""

    fault: Fault
    ticks: int
    missed_ticks: int
    stimulus_clipped: int
    """The stimulus itself was above its cap."""
    total_clipped: int
    """Stimulus, spring and damper together were above the total cap."""
    slew_limited: int
    sensor_clipped: int
    peak_command_n: float
    feedback_clipped: int = 0
    """Spring, damper, or both together were above their cap (a lean on the spring)."""
    late_ticks: int = 0
    """Ticks of a real-time loop whose work ended after the next was due. Missed ticks are counted separately."""
    latest_s: float = 0.0
    """The longest from when a tick was due until its work, or that of the one that came in its place, was done."""
    sensor: SensorFacts | None = None
    """Known when it is over. None where the acceleration is read with each tick, as in a simulation, or not at all."""
    why: str = ""
    """Of a lost device, in its driver's words: a sentence without a full stop. Empty where the fault says it all."""


@dataclass(frozen=True, slots=True, eq=False)
class Played:
    """Recording and counters of the device between `hold` and `release`, or during `play`."""

    recording: Recording | None
    """For `hold`: the last of the steady part, whole loops, at most `DeviceSettings.keep_s` long; of a loop longer
    than that, its last `keep_s`. None if it was not steady for so long. For `play`: all of it, or None if a fault
    ended it."""
    health: Health
    truth: Signal | None = None
    """The handle's true acceleration, beside the recording: for tests and benchmarks of simulated devices."""


@dataclass(frozen=True, slots=True)
class Look:
    """Current state of the handle. Position and acceleration are both None without a reading."""

    position_m: tuple[float, float, float] | None
    """x, y, z; None where the encoders gave no numbers."""
    acceleration_mps2: tuple[float, float, float] | None
    """Acceleration by the accelerometer, in the device's axes; None without a valid reading."""
    sensor_clipped: bool
    buttons: frozenset[int]
    """Numbers of the device's own buttons that are pressed, as its driver counts them."""
    missed_ticks: int
    """Missed ticks of the present stimulus; 0 without one."""


class Device(Protocol):
    """A device behind its safety layer. Opened by `study.devices.opening.open_device`, closed by `close`."""

    @property
    def info(self) -> DeviceInfo:
        """Properties of the device as opened; they stay the same until it is closed."""
        ...

    @property
    def telemetry(self) -> str:
        """Path of the ring into which its loop writes every tick (`study.devices.telemetry`); empty if there is none,
        as in virtual time."""
        ...

    def hold(self, stimulus: HeldStimulus) -> None:
        """Fade in and repeat until `release`. Returns at once.

        Raises `DeviceError`, before anything moves, for a stimulus that is not within the limits.
        """
        ...

    def keep_alive(self) -> None:
        """A sign of life. Without one for `watchdog_s` the force fades to zero and the fault is STALLED.

        Looks for the device's own sign of life too: if it hangs, the force goes off and the fault is LOST.
        """
        ...

    def fault(self) -> Fault:
        """The fault that ended the present stimulus, if any. Cheap: may be asked at every key press."""
        ...

    def health(self) -> Health:
        """Counters of the safety layer since `hold`, so far. Fast, like `fault`."""
        ...

    def release(self) -> Played:
        """Fade out, wait until the device is still, and say what happened. To be called after a fault as well.

        Does not raise for a lost device, so that the trial can be logged as void; the next `hold` or `play` does.
        After FORCE_LEFT the force may still be on: the program says so to the person at the handle.
        """
        ...

    def play(self, commands: Signal, on_progress: Callable[[float], None] | None = None) -> Played:
        """Play once through: identification and recordings. Returns when it is over; gives its own signs of life.

        `on_progress(share)` is called now and then with the share that is over; what it raises ends the playing,
        as Ctrl-C does, with a fade. Raises `DeviceError` for commands that are not within the limits, before
        anything moves, and for a lost device.
        """
        ...

    def look(self) -> Look:
        """What the handle does right now, at any time and from any thread: no force is commanded for it.

        Cheap enough for twenty times a second. A device that is lost, closed or late gives a `Look` without reading;
        one that hangs makes the first caller wait for 0.1 s, and no later one.
        """
        ...

    def simulate_hand(self, on_handle: bool) -> None:
        """The simulated hand of a simulated device lets go of the handle, or takes it again. Only while nothing is
        played. Nothing at any other device; limits stay as they are in every case."""
        ...

    def stop(self) -> None:
        """Emergency stop: no force from the next tick on, until the device is opened again.

        From any thread. Waits some milliseconds for the loop, and where that hangs, writes zero past it.
        """
        ...

    def close(self) -> None:
        """Let go and disconnect. Never raises; may be called twice."""
        ...
