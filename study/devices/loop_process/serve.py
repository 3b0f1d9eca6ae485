"""Main program of the loop's process: a device behind its safety layer, with a thread for each pipe from the caller.

Signs of life always come from the caller: `keep_alive` runs only on its call, and `play` continues only while the
caller answers its progress. When the caller's end of a pipe closes, for any reason, the force fades, the device is
closed, and the process ends.
"""

import contextlib
import gc
import os
import pickle
import signal
import threading
import time
from collections.abc import Callable
from contextlib import AbstractContextManager
from types import FrameType
from typing import Any

from equalizer.signals.signal import Signal
from study.devices.clock import RealClock
from study.devices.device import Device, PlaybackResult
from study.devices.loop_process.line import CLOSE_TIMEOUT_S, ERROR, LINE_NAMES, PROGRESS, VALUE, PipeEnd
from study.devices.opening import open_device, raise_thread_priority

POLL_EVERY_S = 0.2
"""Interval (s) at which the existence of the caller's process is checked, because a fork of the caller may keep its end
of a pipe open."""

LAST_ANSWER_S = 1.0
"""Longest wait for the thread that sends the last answer (s)."""

OPENING_GRACE_S = 1.0
"""Time (s) that the process may still run after its caller has ended while the device is being opened: no stimulus has
to be faded out then."""

OVERDUE_S = CLOSE_TIMEOUT_S + 3.0
"""Time (s) in addition to the fade after which a process that does not end is terminated: it hangs, in the driver or in
an exit handler."""


class BrokenOffError(Exception):
    """The caller has cancelled the commands that are being played."""


class DeviceServer:
    """Serves an opened device to the caller's process: a thread per pipe of `LINE_NAMES` calls the device's methods."""

    def __init__(
        self,
        device: Device,
        ends: tuple[PipeEnd, ...],
        at_rest: Callable[[], object] = lambda: None,
        raise_thread_priority: Callable[[], AbstractContextManager[object]] = contextlib.nullcontext,
    ) -> None:
        """ends: ends of the pipes, in the order of `LINE_NAMES`. at_rest: called after each stimulus.
        raise_thread_priority: context in which the threads for stops and signs of life run."""
        self._device = device
        self._at_rest = at_rest
        self._raise_priority = raise_thread_priority
        self._closed = threading.Event()
        self.ended = threading.Event()
        """Set when the caller is gone or has asked to close the device."""
        work, signs, look, stop, close = ends
        tables: tuple[tuple[PipeEnd, dict[str, Callable[..., Any]]], ...] = (
            (
                work,
                {
                    "hold": device.hold,
                    "release": device.release,
                    "play": lambda commands: self._play_commands(work, commands),
                },
            ),
            (signs, {"keep_alive": device.keep_alive, "fault": device.fault, "health": device.health}),
            (look, {"look": device.look}),
            (stop, {"stop": device.stop}),
            (close, {"close": self._await_closed}),
        )
        self._threads = [
            threading.Thread(target=self._serve, args=table, name=f"serve {name}", daemon=True)
            for name, table in zip(LINE_NAMES, tables, strict=True)
        ]

    def start(self) -> None:
        """Start the thread of each pipe."""
        for thread in self._threads:
            thread.start()

    def close(self) -> None:
        """Close the device with a fade, then tell the caller that it is done. Never raises."""
        self._device.close()
        self._closed.set()
        self._threads[-1].join(LAST_ANSWER_S)

    def _serve(self, end: PipeEnd, table: dict[str, Callable[..., Any]]) -> None:
        """Thread of a pipe: receive calls and send answers, until the caller is gone. table: functions by name."""
        urgent = "stop" in table or "keep_alive" in table
        try:
            with self._raise_priority() if urgent else contextlib.nullcontext():
                while not self._closed.is_set():
                    name, arguments = end.recv()
                    end.send(_call_function(table[name], arguments))
                    if name in ("release", "play"):
                        self._at_rest()
        except (EOFError, OSError):
            return
        finally:
            self.ended.set()

    def _play_commands(self, end: PipeEnd, commands: Signal) -> PlaybackResult:
        """Play commands; after each progress, continue only with the caller's consent."""

        def await_consent(share: float) -> None:
            end.send((PROGRESS, share))
            if not end.recv():
                raise BrokenOffError

        return self._device.play(commands, await_consent)

    def _await_closed(self) -> Any:
        """Ask the main thread to close the device, and wait for that. Returns the final counters."""
        self.ended.set()
        self._closed.wait()
        return self._device.health()


def run(parent: int, *handles: int) -> None:
    """The main function of the process. parent: process id of the caller; handles: of the ends of the pipes, in the
    order of `LINE_NAMES`."""
    told_to_end: list[int] = []
    _leave_signals_to_the_caller(told_to_end)
    lifetime = Lifetime(parent, told_to_end)
    threading.Thread(target=lifetime.watch, name="lifetime", daemon=True).start()
    ends = tuple(PipeEnd(handle) for handle in handles)
    with contextlib.suppress(EOFError, OSError):  # the caller is gone: the device is closed all the same
        _open_and_serve(lifetime, ends)


class Lifetime:
    """Ensures that the process ends soon after its caller has ended or it was told to end. told_to_end: numbers of the
    signals received."""

    def __init__(self, parent: int, told_to_end: list[int]) -> None:
        self._parent = parent
        self._told_to_end = told_to_end
        self.patience_s = OPENING_GRACE_S
        """Time (s) granted to the main thread from then on."""

    def must_end(self) -> bool:
        """Whether the process was told to end, or the one that started it is gone."""
        return bool(self._told_to_end) or os.getppid() != self._parent

    def watch(self) -> None:
        """Terminate the process where its main thread does not end it in time; the device's own watchdog then switches
        the force off."""
        while not self.must_end():
            time.sleep(POLL_EVERY_S)
        due_s = time.monotonic()
        while time.monotonic() < due_s + self.patience_s:
            time.sleep(POLL_EVERY_S)
        os._exit(1)


def _open_and_serve(lifetime: Lifetime, ends: tuple[PipeEnd, ...]) -> None:
    """Open the device that the first message names, serve it until the end is due, and close it with a fade. An error
    while opening is sent to the caller."""
    name, settings, seed, telemetry = ends[0].recv()[1]
    try:
        device = open_device(name, settings, RealClock(), seed, own_process=False, telemetry=telemetry)
    except BaseException as error:  # noqa: BLE001 - the caller raises it
        ends[0].send((ERROR, _make_sendable(error)))
        return
    lifetime.patience_s = settings.limits.release_s + settings.limits.watchdog_s + OVERDUE_S
    with contextlib.closing(device):
        # The garbage collector must not interrupt the loop: existing objects are exempted, new ones are collected
        # between stimuli.
        gc.collect()
        gc.freeze()
        gc.disable()
        ends[0].send((VALUE, device.info))
        server = DeviceServer(device, ends, at_rest=gc.collect, raise_thread_priority=raise_thread_priority)
        server.start()
        while not (server.ended.wait(POLL_EVERY_S) or lifetime.must_end()):
            pass
        server.close()


def _leave_signals_to_the_caller(told_to_end: list[int]) -> None:
    """Ignore Ctrl-C and the end of the terminal, which the caller handles with a fade. SIGTERM is noted in
    `told_to_end` and ends the process with the same fade."""

    def note(number: int, frame: FrameType | None) -> None:
        told_to_end.append(number)

    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, note)
    if hasattr(signal, "SIGHUP"):
        signal.signal(signal.SIGHUP, signal.SIG_IGN)


def _call_function(function: Callable[..., Any], arguments: tuple[Any, ...]) -> tuple[int, Any]:
    """Call a function. Returns its value or its exception as a message (kind, value)."""
    try:
        return VALUE, function(*arguments)
    except (EOFError, ConnectionError):  # the caller ended during its answer to a progress
        raise
    except BaseException as error:  # noqa: BLE001 - the caller raises it
        return ERROR, _make_sendable(error)


def _make_sendable(error: BaseException) -> Exception:
    """The exception itself if it can be pickled and restored, else a RuntimeError with its type and text."""
    if isinstance(error, Exception):
        with contextlib.suppress(Exception):
            copy = pickle.loads(pickle.dumps(error))
            if isinstance(copy, type(error)):
                return error
    return RuntimeError(f"{type(error).__name__}: {error}")
