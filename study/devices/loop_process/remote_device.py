"""Device port over a device whose control loop runs in a separate process. Every call has a timeout.

A process that has ended or does not answer is a lost device. It is killed if it still runs, so that it commands no
further force; the device's own watchdog switches off its last force.
"""

import atexit
import contextlib
import signal
import threading
from collections.abc import Callable
from dataclasses import replace
from typing import Any

from equalizer.signals.signal import Signal
from study.devices.device import DeviceInfo, DeviceSettings, Fault, Health, Look, PlaybackResult
from study.devices.loop_process.call_pipe import CLOSE_TIMEOUT_S, Call, CallPipe, LoopGoneError
from study.devices.loop_process.start import LoopProcess
from study.devices.telemetry import Ring
from study.errors import DeviceError
from study.session.stimulus.held_stimulus import HeldStimulus

OPENING_TIMEOUT_S = 180.0
"""Timeout (s) for starting the process, compiling where necessary, and opening the device. Chosen."""
ANSWER_TIMEOUT_S = 3.0
"""Timeout for an answer (s). Chosen: longer than the delays of a busy computer and the safety layer's own timeouts."""
STOP_TIMEOUT_S = 0.5
"""Timeout of an emergency stop (s), after which the process is killed at once. Chosen."""
SENT_S_PER_RECORDED_S = 0.05
"""Additional timeout (s) per recorded second (100 kB, 2 ms through a pipe, more on a busy computer). Chosen."""
INITIAL_HEALTH = Health(Fault.NONE, 0, 0, 0, 0, 0, 0, 0.0)
"""Health before the first stimulus: no fault, nothing counted."""


def open_remotely(name: str, settings: DeviceSettings, seed: int) -> "RemoteDevice":
    """Open a device in a separate process. name, settings, seed: as in `opening.open_device`. Raises what opening
    raised in the process, or `DeviceError` where the process ended or hangs."""
    process: LoopProcess | None = None
    ring = Ring()
    try:
        process = LoopProcess()
        info: DeviceInfo = process.work.queue_call("open", name, settings, seed, ring.path).wait_for_answer(
            OPENING_TIMEOUT_S
        )
        return RemoteDevice(process, info, settings, ring)
    except LoopGoneError as loop_error:
        assert process is not None
        ring.remove()
        process.hang_up()
        raise DeviceError(
            "The device was not opened",
            f"The process of its loop failed while it was opened: {loop_error}, {process.end(0.5)}.",
            "Try again. If it happens again, report what was written above.",
        ) from loop_error
    except BaseException:
        ring.remove()
        if process is not None:
            process.hang_up()
            process.end(CLOSE_TIMEOUT_S)
        raise


class RemoteDevice:
    """A device whose loop runs in a separate process, with the interface of `Device`; opened by `open_remotely`."""

    def __init__(
        self, process: LoopProcess, info: DeviceInfo, settings: DeviceSettings, ring: Ring | None = None
    ) -> None:
        self._process = process
        self._ring = ring
        self._info = info
        limits = settings.limits
        self._fade_s = limits.release_s + limits.watchdog_s
        self._keep_s = settings.keep_s
        self._held_stimulus: HeldStimulus | None = None
        self._release_call: Call | None = None
        self._health = INITIAL_HEALTH
        self._force_left = self._stopped = False
        """Whether the process reported FORCE_LEFT or an executed stop; both remain true after its end."""
        self._closing = self._closed = self._ended = False
        """Closing has begun; no further calls are sent; the process has ended."""
        self._loss_lock = threading.Lock()
        self._loss_reason = ""
        """Reason why the device was lost; empty while it is not."""
        # Registered twice: a pending KeyboardInterrupt may end the first call before its first line.
        atexit.register(self._close_at_exit)
        atexit.register(self._close_at_exit)

    @property
    def info(self) -> DeviceInfo:
        """Properties of the device, as reported when it was opened."""
        return self._info

    @property
    def telemetry(self) -> str:
        """Path of the telemetry ring (`study.devices.telemetry`); empty without one."""
        return self._ring.path if self._ring is not None else ""

    def hold(self, stimulus: HeldStimulus) -> None:
        """Begin to play a stimulus; see `Device.hold`. Raises `DeviceError`, also for a closed or lost device."""
        self._require_idle()
        previous_stimulus, self._held_stimulus = self._held_stimulus, stimulus
        try:
            self._call_remote(self._process.work, "hold", stimulus)
        except Exception:
            self._held_stimulus = previous_stimulus
            raise

    def keep_alive(self) -> None:
        """Restart the watchdog. Does not raise for a lost or closed device."""
        with contextlib.suppress(DeviceError):
            self._call_remote(self._process.signs, "keep_alive")

    def fault(self) -> Fault:
        """Fault of the device. Where the process is lost: FORCE_LEFT if that was reported before, else STOPPED after an
        emergency stop, else LOST. After `close`: the fault reported last."""
        try:
            fault: Fault = self._call_remote(self._process.signs, "fault")
        except DeviceError:
            return self._find_fault_when_lost()
        self._force_left |= fault is Fault.FORCE_LEFT
        return fault

    def health(self) -> Health:
        """Counters of the loop; for a lost or closed device, those that it reported last."""
        try:
            return self._store_health(self._call_remote(self._process.signs, "health"))
        except DeviceError:
            return self._make_health_when_lost()

    def release(self) -> PlaybackResult:
        """Release the stimulus and return what was played. For a lost or closed device: no recording, and the counters
        reported last, or `DeviceError` where nothing was held. After an interruption, a further call gets the answer of
        the same release."""
        if self._loss_reason or self._closed:
            if self._held_stimulus is None:
                self._require_connected()
            self._held_stimulus = None
            return PlaybackResult(recording=None, health=self._make_health_when_lost())
        fade_out_s = self._held_stimulus.fade_out_s if self._held_stimulus is not None else 0.0
        self._release_call = self._release_call or self._process.work.queue_call("release")
        try:
            result: PlaybackResult = self._release_call.wait_for_answer(fade_out_s + self._get_timeout_s(self._keep_s))
        except LoopGoneError as loop_error:
            self._mark_lost(loop_error)
            result = PlaybackResult(recording=None, health=self._make_health_when_lost())
        except Exception:  # raised in the process. After an interruption the answer is awaited again.
            self._release_call = self._held_stimulus = None
            raise
        self._store_health(result.health)
        self._release_call = self._held_stimulus = None
        return result

    def play(self, commands: Signal, on_progress: Callable[[float], None] | None = None) -> PlaybackResult:
        """Play commands once; see `Device.play`. Any exception, such as KeyboardInterrupt, cancels them with a fade."""
        self._require_idle()
        call = self._process.work.queue_call("play", commands)
        timeout_s = self._get_timeout_s(0.0)
        try:
            result: PlaybackResult = call.wait_for_answer(
                timeout_s, on_progress, sending_s=SENT_S_PER_RECORDED_S * commands.duration_s
            )
        except LoopGoneError as loop_error:
            self._mark_lost(loop_error)
            raise self._make_lost_error() from loop_error
        except BaseException:
            if not call.is_over:
                self._cancel_play(call, timeout_s)
            raise
        self._store_health(result.health)
        return result

    def look(self) -> Look:
        """Snapshot of the device; without a position or an acceleration for a lost or closed device."""
        with contextlib.suppress(DeviceError):
            look: Look = self._call_remote(self._process.look, "look")
            return look
        return Look(None, None, sensor_clipped=False, buttons=frozenset(), missed_ticks=0)

    def simulate_hand(self, on_handle: bool) -> None:
        """No effect: real devices have no simulated hand."""

    def stop(self) -> None:
        """Emergency stop. Without an answer within `STOP_TIMEOUT_S` the process is killed, and the watchdog acts."""
        if self._loss_reason or self._ended:
            return
        try:
            with contextlib.suppress(DeviceError):
                self._process.stop.queue_call("stop").wait_for_answer(STOP_TIMEOUT_S, grace_s=0.0)
                self._stopped = True
        except LoopGoneError as loop_error:
            # Kill here: `_mark_lost` may wait for another call that waits for the process to fade its force and end.
            self._process.kill()
            self._mark_lost(loop_error)

    def close(self) -> None:
        """Close device and process, within about the fade and twice `CLOSE_TIMEOUT_S`; else the process is killed."""
        if self._ended:
            return
        self._closing = True
        try:
            if not (self._loss_reason or self._closed):
                with contextlib.suppress(DeviceError):
                    self._store_health(
                        self._call_remote(self._process.close, "close", timeout_s=self._fade_s + CLOSE_TIMEOUT_S)
                    )
        finally:  # closed pipes make the process fade the force and end
            self._closed = True
            self._process.hang_up()
        self._process.end(CLOSE_TIMEOUT_S)
        if self._ring is not None:
            self._ring.remove()
        # Last, so that an interrupted close is repeated when the program ends.
        self._ended = True
        atexit.unregister(self._close_at_exit)

    def _close_at_exit(self) -> None:
        """Close when the program ends, even if Ctrl-C interrupts it."""
        while not self._ended:
            try:
                signal.signal(signal.SIGINT, signal.SIG_IGN)
                self.close()
            except KeyboardInterrupt:  # arrived before SIGINT was ignored
                continue

    def _get_timeout_s(self, recorded_s: float) -> float:
        """Return the timeout (s) of a call that ends with a fade, with time to send a recording of this length (s)."""
        return self._fade_s + ANSWER_TIMEOUT_S + SENT_S_PER_RECORDED_S * recorded_s

    def _call_remote(self, pipe: CallPipe, name: str, *arguments: Any, timeout_s: float | None = None) -> Any:
        """Call a method in the process; raises `DeviceError` for a lost or closed device, else what that raised."""
        self._require_connected()
        try:
            return pipe.queue_call(name, *arguments).wait_for_answer(
                ANSWER_TIMEOUT_S if timeout_s is None else timeout_s
            )
        except LoopGoneError as loop_error:
            self._mark_lost(loop_error)
            raise self._make_lost_error() from loop_error

    def _cancel_play(self, call: Call, timeout_s: float) -> None:
        """Cancel `play` with a fade, and wait for its end."""
        try:
            call.cancel(timeout_s)
        except LoopGoneError as loop_error:
            self._mark_lost(loop_error)
        except BaseException:  # interrupted again: stop without a fade
            self.stop()
            raise

    def _mark_lost(self, loop_error: LoopGoneError) -> None:
        """Mark the device as lost, at the first failure, and end the process."""
        with self._loss_lock:
            if not self._loss_reason and not self._closed:
                self._process.hang_up()
                # A process that closed its pipes may still be fading the force: wait for its end.
                self._loss_reason = (
                    f"{loop_error}, {self._process.end(0.0 if loop_error.hangs else self._fade_s + CLOSE_TIMEOUT_S)}"
                )

    def _store_health(self, health: Health) -> Health:
        """Store the counters for the time after a loss of the process, and return them."""
        self._health = health
        self._force_left |= health.fault is Fault.FORCE_LEFT
        return health

    def _require_idle(self) -> None:
        """Raise `DeviceError` for a lost or closed device, and while a release is pending."""
        self._require_connected()
        if self._release_call is not None:  # its pending answer must not be taken for that of the next call
            raise DeviceError("The device cannot do this now", "It is still playing.", "Call release first.")

    def _require_connected(self) -> None:
        """Raise `DeviceError` for a lost or closed device."""
        if self._closed or self._loss_reason:
            raise self._make_lost_error()

    def _make_lost_error(self) -> DeviceError:
        """Make the error for a call on a closed or lost device."""
        if self._closing:
            return DeviceError("The device cannot do this now", "The device is closed.", "Open it again.")
        return DeviceError(
            "The device was lost",
            f"The process of its loop is gone: {self._loss_reason}.",
            "Take the hand off the handle until you know that no force is on: the device's own watchdog drops it. Then "
            "open the device again; a session is continued with `hapteq resume`.",
        )

    def _find_fault_when_lost(self) -> Fault:
        """Find the fault without the process; see `fault`. After a normal close: the fault reported last."""
        if self._force_left:
            return Fault.FORCE_LEFT
        if self._closed and not self._loss_reason:
            return self._health.fault
        return Fault.STOPPED if self._stopped else Fault.LOST

    def _make_health_when_lost(self) -> Health:
        """Make the counters reported last, with the fault and the reason of the loss."""
        reason = f"the process of its loop is gone: {self._loss_reason}" if self._loss_reason else self._health.why
        return replace(self._health, fault=self._find_fault_when_lost(), why=reason)
