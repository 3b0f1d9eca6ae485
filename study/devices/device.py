"""Device port: the interface through which the rest of the program uses a haptic device. Implemented by
`study.devices.safe.SafeDevice` and, over pipes, by `loop_process.remote_device.RemoteDevice`.

Arguments and results, but not `on_progress`, are plain values that can be sent between processes, because a real
device's 1 kHz loop runs in a separate process (`loop_process`). `hold` has no fixed duration, because a participant may
feel a stimulus until the answer.
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

REPLAY_PREFIX = "replay:"
"""Prefix of a device's name, followed by the path of a recording: the handle moves as recorded, independent of the
commanded force."""
CALIBRATED_PREFIX = "simulated:"
"""Prefix of a device's name, followed by the path of a calibration: the simulated device with the linkage and inertia
of that calibration."""


@dataclass(frozen=True, slots=True)
class DeviceInfo:
    """Properties of an opened device: name, rate, maximum force and mass."""

    name: str
    simulated: bool
    """Whether there is no hardware, as for a simulation or a replay."""
    sample_rate_hz: float
    """Rate of the control loop and of the recordings (Hz)."""
    max_force_n: float
    """Largest norm of the force (N)."""
    effective_mass_kg: float
    """Apparent mass at the handle in the centre of the workspace (kg), from which the stiffness of the centring spring
    is computed."""
    details: str = ""
    """Serial number, firmware, or the simulation's parameter set."""
    has_sensor: bool = True
    """Whether there is an accelerometer; for a real device it is configured in the laboratory's settings file."""
    moved_by_force: bool = True
    """False only for a replay, whose position does not depend on the force, so that a constant position is no fault.
    Ignored for a device that is not simulated."""


@dataclass(frozen=True, slots=True)
class DeviceSettings:
    """Settings that are fixed from opening to closing: limits, centring spring, and recorded part of each stimulus."""

    limits: Limits
    """Limits on force, slew rate, times and plausible readings."""
    spring_frequency_hz: float
    """Natural frequency of the centring spring with the device's effective mass: K = m (2 pi f)²; 0 = no spring."""
    spring_damping_n_s_per_m: float
    """Damping coefficient of the centring spring (N s/m)."""
    keep_s: float
    """Longest recorded part of a held stimulus (s): the last `keep_s` of its steady part."""
    hand_on_handle: bool
    """Whether a hand holds the handle. A simulated device then carries a simulated hand."""
    place_m: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Centre of the spring, x, y, z, in the device's axes (m)."""
    beyond_hand_ceiling: bool = False
    """Whether force caps up to the device's maximum are allowed instead of the limits for a hand. Never set by a
    protocol; refused with a hand on the handle."""
    with_sensor: bool = True
    """Whether a real device's accelerometer is read, where the laboratory's settings file configures one. Without it no
    acceleration is measured."""


class Fault(Enum):
    """Why the safety layer released the force without `release`. Each fault but NONE ends a trial; its value is part of
    a sentence for messages. Codes in the same order: `governor.cells`."""

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
    """Counters of the safety layer since `hold` or `play`, in ticks where not said otherwise."""

    fault: Fault
    """Fault that ended the stimulus; `Fault.NONE` without one."""
    ticks: int
    """Ticks since the stimulus began, including missed ones."""
    missed_ticks: int
    """Ticks that were not run in time; the device held its last force meanwhile."""
    stimulus_clipped: int
    """Ticks in which the stimulus itself exceeded its cap and was limited."""
    total_clipped: int
    """Ticks in which the sum of stimulus, spring and damper exceeded the total cap."""
    slew_limited: int
    """Ticks in which the change of the force was limited."""
    sensor_clipped: int
    """Ticks with an accelerometer channel at its limit."""
    peak_command_n: float
    """Largest norm of a written force (N)."""
    feedback_clipped: int = 0
    """Ticks in which spring, damper or their sum exceeded the feedback cap, as when a hand leans on the spring."""
    late_ticks: int = 0
    """Ticks of a real-time loop that ended after the next tick was due. Missed ticks are counted separately."""
    latest_s: float = 0.0
    """Longest time (s) from when a tick was due to the end of its work; for a missed tick, to the end of the tick that
    was run in its place."""
    sensor: SensorFacts | None = None
    """Facts about an accelerometer with its own clock, known after the end of the stimulus. None where the acceleration
    is read with each tick, as in a simulation, or not at all."""
    why: str = ""
    """Cause of the loss of a device as its driver reports it, a sentence without a full stop; empty without one."""


@dataclass(frozen=True, slots=True, eq=False)
class PlaybackResult:
    """Recording and counters of the device between `hold` and `release`, or during `play`."""

    recording: Recording | None
    """For `hold`: the end of the steady part, whole loops, at most `DeviceSettings.keep_s` long; of a longer loop the
    last `keep_s`. None if the steady part was shorter than a loop or `keep_s`, the shorter one. For `play`: all of it,
    or None after a fault or where it was ended early."""
    health: Health
    """Counters at the end of the stimulus."""
    truth: Signal | None = None
    """True acceleration of a simulated handle at the same ticks, for tests and benchmarks. None for real devices."""


@dataclass(frozen=True, slots=True)
class Look:
    """Present state of the handle. Position and acceleration are both None where the device gave no reading."""

    position_m: tuple[float, float, float] | None
    """x, y, z (m); None where the encoders gave no numbers."""
    acceleration_mps2: tuple[float, float, float] | None
    """Acceleration by the accelerometer, x, y, z in the device's axes (m/s²); None without a valid reading."""
    sensor_clipped: bool
    """Whether a channel of the accelerometer was at its limit in this reading."""
    buttons: frozenset[int]
    """Numbers of the pressed buttons of the device, as its driver counts them."""
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
        """Path of the ring buffer into which the loop writes every tick (`study.devices.telemetry`); empty where there
        is none, as in virtual time."""
        ...

    def hold(self, stimulus: HeldStimulus) -> None:
        """Fade the stimulus in and repeat its loop until `release`. Returns at once. Raises `DeviceError`, before
        anything moves, for a stimulus that is not within the limits, while another is held, after `stop`, and for a
        lost or closed device."""
        ...

    def keep_alive(self) -> None:
        """Restart the watchdog. Without a call for `watchdog_s` the force fades to zero and the fault is STALLED. Also
        checks that the control loop responds: if it hangs, the force is switched off and the fault is LOST."""
        ...

    def fault(self) -> Fault:
        """The fault that ended the present or last stimulus, `Fault.NONE` without one. Fast enough for every key
        press."""
        ...

    def health(self) -> Health:
        """Counters of the safety layer since `hold` or `play`, up to now. Fast, like `fault`."""
        ...

    def release(self) -> PlaybackResult:
        """Fade out, wait until no force acts, and return recording and counters. To be called after a fault as well.
        Raises `DeviceError` where nothing is held, but not for a lost device, so that the trial can be logged as void;
        the next `hold` or `play` does. After FORCE_LEFT the force may still be on."""
        ...

    def play(self, commands: Signal, on_progress: Callable[[float], None] | None = None) -> PlaybackResult:
        """Play commands once, for identification and recordings. Returns when all are played; restarts the watchdog
        itself. `on_progress(share)` is called repeatedly with the share played so far, 0 to 1; an exception from it, or
        Ctrl-C, ends the playing with a fade. Raises `DeviceError` for commands that are not within the limits, before
        anything moves, and for a lost device.
        """
        ...

    def look(self) -> Look:
        """Present state of the handle, at any time and from any thread; no force is commanded for it. Fast enough for
        20 calls per second. A device that is lost, closed or late gives a `Look` without a reading; a loop that hangs
        delays only the first caller, by 0.1 s."""
        ...

    def simulate_hand(self, on_handle: bool) -> None:
        """Let the simulated hand of a simulated device take or release the handle. To be called only while nothing is
        played. No effect on other devices; the limits do not change."""
        ...

    def stop(self) -> None:
        """Emergency stop: no force from the next tick on, until the device is opened again. May be called from any
        thread. Waits a few milliseconds for the loop; if the loop hangs, another thread writes the zero force."""
        ...

    def close(self) -> None:
        """Fade the force out and disconnect. Never raises; may be called twice."""
        ...
