"""Safety layer: implements the `Device` port over any rig, compiled or driven from Python, in real or virtual time.

`governor.govern` limits the force at each tick; `admission` refuses unsafe settings and stimuli before anything moves;
`drive.virtual_drive` and `drive.realtime_drive` decide when ticks run. The limits and their reasons: docs/safety.md.
"""

import atexit
import contextlib
import signal
import sys
from collections.abc import Callable
from dataclasses import replace

from equalizer.signals.signal import Signal
from study.devices.admission import check_commands, check_hardware, check_settings, check_stimulus
from study.devices.clock import Clock, RealClock, VirtualClock
from study.devices.device import DeviceInfo, DeviceSettings, Fault, Health, Look, PlaybackResult
from study.devices.drive.last_reading import make_look
from study.devices.drive.realtime_drive import RealtimeDrive
from study.devices.drive.recorded_run import make_commands_recording, make_stimulus_recording
from study.devices.drive.runner import CompiledRunner, Runner
from study.devices.drive.stepped_runner import SteppedRunner
from study.devices.drive.virtual_drive import VirtualDrive
from study.devices.governor.governor import SETTLE_S, Governor
from study.devices.rig import AsynchronousAccelerometer, CompiledRig, Rig, ignore_hand
from study.devices.telemetry import Ring
from study.errors import DeviceError
from study.session.stimulus.held_stimulus import HeldStimulus

REALTIME_BLOCK_S = 0.05
"""Longest block of a compiled rig's ticks in real time, and longest keep-alive interval in `play` (s).
Chosen: the loop reacts to other threads between blocks."""

VIRTUAL_BLOCK_S = 5.0
"""Longest block of a compiled rig's ticks in virtual time (s). Chosen: limits the calls from Python."""

CLOSING_UNCONFIRMED = (
    "the device did not say that it brakes when it was closed: it got zero force, and its brakes may be off; what was "
    "measured is saved; switch it off before a hand touches the handle, and on again before the next session"
)
"""Written to stderr where the device did not confirm that it was closed."""

STOP_TIMEOUT_S = 1.0
"""Timeout (s) after the end of all fades; a device that still moves then counts as lost. Chosen."""


class SafeDevice:
    """The `Device` port (`study.devices.device.Device`) over a rig. The constructor raises `DeviceError` for settings
    that are not safe; the port's methods raise as it states."""

    def __init__(
        self, rig: Rig | CompiledRig, settings: DeviceSettings, clock: Clock, ring: Ring | None = None
    ) -> None:
        """ring: telemetry ring into which every tick is written; `close` removes a ring that this program made."""
        check_settings(settings, rig.info)
        if not isinstance(rig, CompiledRig):
            check_hardware(rig.drops_force_after_s, rig.info, settings)
        self._info = rig.info
        self._set_simulated_hand = rig.simulate_hand if isinstance(rig, CompiledRig) else ignore_hand
        self._own_clock_sensor = rig if isinstance(rig, AsynchronousAccelerometer) else None
        self._limits = settings.limits
        self._hand_on_handle = settings.hand_on_handle
        self._clock = clock
        self._ring = ring
        telemetry_rows = ring.map_rows(rig.info.sample_rate_hz) if ring is not None else None
        self._governor = Governor(rig.info, settings, telemetry_rows)
        self._runner = self._make_runner(rig)
        self._drive = self._make_drive(clock)
        self._held_stimulus: HeldStimulus | None = None
        self._closing = self._closed = False
        # Registered twice: a KeyboardInterrupt that is pending at exit ends the first call before its first line.
        atexit.register(self._close_at_exit)
        atexit.register(self._close_at_exit)

    @property
    def info(self) -> DeviceInfo:
        return self._info

    @property
    def telemetry(self) -> str:
        return self._ring.path if self._ring is not None else ""

    def hold(self, stimulus: HeldStimulus) -> None:
        self._require_idle()
        check_stimulus(stimulus, self._limits, self._info.sample_rate_hz)
        self._start_stimulus(lambda: self._governor.begin_hold(stimulus))
        self._held_stimulus = stimulus

    def hold_unchecked(self, stimulus: HeldStimulus) -> None:
        """Hold a stimulus of valid shape that `hold` refuses, to test that the caps hold at each tick. Raises
        `DeviceError` with a hand on the handle, and where `hold` would for the state of the device."""
        if self._hand_on_handle:
            raise _make_usage_error("A hand is on the handle.", "Open it without.")
        self._require_idle()
        self._start_stimulus(lambda: self._governor.begin_hold(stimulus))
        self._held_stimulus = stimulus

    def keep_alive(self) -> None:
        self._governor.restart_watchdog()
        self._drive.check()

    def fault(self) -> Fault:
        self._drive.check()
        fault = self._governor.fault
        return Fault.STOPPED if self._governor.stop_requested and fault is not Fault.FORCE_LEFT else fault

    def health(self) -> Health:
        return self._add_failure_reason(replace(self._governor.collect_health(), fault=self.fault()))

    def _add_failure_reason(self, health: Health) -> Health:
        """Add the reason of a lost device (`why`) to the counters, if the rig has failed."""
        failure = self._runner.failure
        if failure is None:
            return health
        return replace(health, why=failure.happened.rstrip(".") if isinstance(failure, DeviceError) else str(failure))

    def release(self) -> PlaybackResult:
        stimulus = self._held_stimulus
        if stimulus is None:
            raise _make_usage_error("Nothing is held, so nothing can be released.", "Call hold first.")
        self._governor.request_release()
        self._wait_until_still(stimulus.fade_out_s)
        self._held_stimulus = None
        result = make_stimulus_recording(self._governor, self._info, self._own_clock_sensor)
        return replace(result, health=self._add_failure_reason(result.health))

    def play(self, commands: Signal, on_progress: Callable[[float], None] | None = None) -> PlaybackResult:
        self._require_idle()
        check_commands(commands, self._limits, self._info.sample_rate_hz)
        self._start_stimulus(lambda: self._governor.begin_play(commands))
        try:
            self._wait_for_playback(SETTLE_S + commands.duration_s, on_progress)
        except BaseException:
            self._fade_out()
            raise
        self._wait_until_still(0.0)
        self._require_connected()
        return make_commands_recording(self._governor, self._info, self._own_clock_sensor)

    def look(self) -> Look:
        """In real time, while nothing moves, wait for the next reading, at most `realtime_drive.READING_TIMEOUT_S`."""
        self._drive.check()
        has_reading = not self._closing and self._drive.refresh()
        missed_ticks = self._governor.missed if self._held_stimulus is not None or self._runner.moving else 0
        return make_look(self._runner.last_reading if has_reading else None, missed_ticks)

    def simulate_hand(self, on_handle: bool) -> None:
        self._require_idle()
        self._set_simulated_hand(on_handle)

    def stop(self) -> None:
        self._governor.request_stop()
        self._drive.stop()

    def close(self) -> None:
        """Fade out a stimulus that is playing, then disconnect. Warns on stderr where the device did not confirm zero
        force or its closing."""
        if self._closed:
            return
        self._closing = True
        try:
            self._fade_out()
        finally:
            try:
                self._drive.close()
            finally:
                self._runner.disconnect()
                if self._ring is not None:
                    self._ring.remove()
        # Set last: a close that was interrupted is repeated when the program ends.
        self._closed = True
        atexit.unregister(self._close_at_exit)
        if not (self._runner.force_off and self._runner.disconnected):
            # This may be the program's last action, so stderr must warn the person at the handle.
            warning = CLOSING_UNCONFIRMED if self._runner.force_off else Fault.FORCE_LEFT.value
            with contextlib.suppress(OSError):
                sys.stderr.writelines([f"{warning}\n"])

    def _close_at_exit(self) -> None:
        """Close when the program ends, and ignore Ctrl-C: the interpreter stops all threads next, including the thread
        that writes zero force. `close` cannot block forever: its waits have time limits."""
        while not self._closed:
            try:
                signal.signal(signal.SIGINT, signal.SIG_IGN)
                self.close()
            except KeyboardInterrupt:  # Ctrl-C came before the line above took effect
                continue

    def _wait_for_playback(self, duration_s: float, on_progress: Callable[[float], None] | None) -> None:
        """Wait until the commands are played, at most `STOP_TIMEOUT_S` longer than duration_s; send keep-alives."""
        keep_alive_interval_s = min(REALTIME_BLOCK_S, self._limits.watchdog_s / 4)
        started_s = self._clock.now_s()
        while self._governor.playing and (elapsed_s := self._clock.now_s() - started_s) < duration_s + STOP_TIMEOUT_S:
            if on_progress is not None:
                on_progress(min(1.0, elapsed_s / duration_s))
            self.keep_alive()
            self._clock.sleep(keep_alive_interval_s)
        if on_progress is not None and not self._governor.playing:
            on_progress(1.0)

    def _fade_out(self) -> None:
        """Fade out within `release_s` and wait; if interrupted, stop without a fade."""
        self._governor.request_let_go()
        try:
            self._wait_until_still(0.0)
        except BaseException:  # interrupted
            self._governor.request_stop()
            raise

    def _wait_until_still(self, fade_out_s: float) -> None:
        """Wait, checking every 5 ticks, until no force is commanded. A device that takes longer than both fades, the
        watchdog's timeout and `STOP_TIMEOUT_S` together counts as lost."""
        timeout_s = fade_out_s + self._limits.release_s + self._limits.watchdog_s + STOP_TIMEOUT_S
        deadline_s = self._clock.now_s() + timeout_s
        poll_interval_s = 5 / self._info.sample_rate_hz
        while self._runner.moving:
            self._drive.check()
            if self._clock.now_s() > deadline_s:
                self._runner.give_up(TimeoutError(f"no answer within {timeout_s:g} s"))
                return
            self._clock.sleep(poll_interval_s)

    def _require_idle(self) -> None:
        """Raise `DeviceError` where the device is closed, lost, stopped or holds a stimulus."""
        if self._closing:
            raise _make_usage_error("The device is closed.", "Open it again.")
        self._require_connected()
        if self._governor.stop_requested:
            raise _make_usage_error(
                "It was stopped, by the emergency stop or an interruption.",
                "Make sure that all is well, then open the device again.",
            )
        if self._held_stimulus is not None:
            raise _make_playing_error()

    def _start_stimulus(self, begin_stimulus: Callable[[], None]) -> None:
        """Start the ticks of a stimulus. begin_stimulus: hands the stimulus to the governor. Raises `DeviceError` for a
        lost device, or one that still moves."""

        def begin_and_prepare() -> None:
            try:
                begin_stimulus()
                self._runner.prepare()
            except BaseException:  # the caller gets an error, so no tick of the stimulus may run
                self._governor.abandon(Fault.NONE)
                raise

        has_started = self._drive.start(begin_and_prepare)
        self._require_connected()
        if not has_started:
            raise _make_playing_error()

    def _require_connected(self) -> None:
        """Raise `DeviceError` for a lost device; the message says whether its force may still be on."""
        failure = self._runner.failure
        if failure is None:
            return
        problem = f"It stopped answering ({type(failure).__name__}: {failure})."
        # Without the first letter of "check", which begins a sentence or follows "then".
        remedy_tail = "heck its power and its cable, then open it again; a session is continued with `hapteq resume`."
        if self._runner.force_off:
            raise DeviceError("The device was lost", f"{problem} Its force is off.", f"C{remedy_tail}") from failure
        raise DeviceError(
            "The device was lost",
            f"{problem} It took no zero force: its force may still be on.",
            f"Let go of the handle and switch the device off. Then c{remedy_tail}",
        ) from failure

    def _make_runner(self, rig: Rig | CompiledRig) -> Runner:
        """Make the runner of the rig's ticks: in blocks for a compiled rig, tick by tick otherwise."""
        is_virtual = isinstance(self._clock, VirtualClock)
        if isinstance(rig, CompiledRig):
            block_ticks = round((VIRTUAL_BLOCK_S if is_virtual else REALTIME_BLOCK_S) * rig.info.sample_rate_hz)
            return CompiledRunner(rig, self._governor, block_ticks)
        read_time_s, is_monotonic = None if is_virtual else self._clock.now_s, type(self._clock) is RealClock
        return SteppedRunner(rig, self._governor, is_virtual, read_time_s, is_monotonic)

    def _make_drive(self, clock: Clock) -> VirtualDrive | RealtimeDrive:
        """Make the drive, which decides when ticks run: at once in virtual time, at the sample rate in real time."""
        rate_hz = self._info.sample_rate_hz
        if isinstance(clock, VirtualClock):
            return VirtualDrive(self._runner, self._governor, clock, rate_hz)
        in_realtime_class = not self._info.simulated
        return RealtimeDrive(self._runner, self._governor, clock, rate_hz, self._limits.watchdog_s, in_realtime_class)


def _make_playing_error() -> DeviceError:
    """Make the error of a call that needs a device at rest, while a stimulus is held or the device still moves."""
    return _make_usage_error("It is still playing.", "Call release first.")


def _make_usage_error(problem: str, remedy: str) -> DeviceError:
    """Make the error of a call that the device cannot carry out in its present state."""
    return DeviceError("The device cannot do this now", problem, remedy)
