"""Main program of the loop's process: a device behind its safety layer, and a thread for each pipe of its caller.

A sign of life is always the caller's: `keep_alive` runs when it is called from there, and `play` goes on only as long
as the caller answers its progress. When the caller's end of a pipe closes, for any reason, the force fades, the brakes
hold, and the process ends.
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
from study.devices.device import Device, Played
from study.devices.loop_process.line import CLOSE_S, ERROR, LINES, PROGRESS, VALUE, End
from study.devices.opening import open_device, raise_thread_priority

POLL_EVERY_S = 0.2
"""Whether the caller's process is there still: a fork of it may hold its end of a pipe open."""

LAST_ANSWER_S = 1.0
"""Longest wait for the thread that sends the last answer (s)."""

OPENING_GRACE_S = 1.0
"""While the device is opened, no force of a stimulus is on that a fade would end: the process ends soon."""

OVERDUE_S = CLOSE_S + 3.0
"""Time granted beyond the fade: only a process that hangs, in the driver or in an exit handler, takes so long to
end."""


class BrokenOffError(Exception):
    """The caller wants no more of what is played."""


class DeviceServer:
    """Serves an opened device to the caller's process: a thread per pipe of `LINES` calls the device's methods."""

    def __init__(
        self,
        device: Device,
        ends: tuple[End, ...],
        at_rest: Callable[[], object] = lambda: None,
        raise_thread_priority: Callable[[], AbstractContextManager[object]] = contextlib.nullcontext,
    ) -> None:
        """ends: of `LINES`. at_rest: called after each stimulus. raise_thread_priority: entered by the threads that
        a stop and a sign of life wait for."""
        self._device = device
        self._at_rest = at_rest
        self._raise_priority = raise_thread_priority
        self._closed = threading.Event()
        self.ended = threading.Event()
        """The caller is gone, or wants the device closed."""
        work, signs, look, stop, close = ends
        tables: tuple[tuple[End, dict[str, Callable[..., Any]]], ...] = (
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
            for name, table in zip(LINES, tables, strict=True)
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

    def _serve(self, end: End, table: dict[str, Callable[..., Any]]) -> None:
        urgent = "stop" in table or "keep_alive" in table
        try:
            with self._raise_priority() if urgent else contextlib.nullcontext():
                while not self._closed.is_set():
                    name, arguments = end.recv()
                    end.send(_answer(table[name], arguments))
                    if name in ("release", "play"):
                        self._at_rest()
        except (EOFError, OSError):
            return
        finally:
            self.ended.set()

    def _play_commands(self, end: End, commands: Signal) -> Played:
        def go_on(share: float) -> None:
            end.send((PROGRESS, share))
            if not end.recv():
                raise BrokenOffError

        return self._device.play(commands, go_on)

    def _await_closed(self) -> Any:
        self.ended.set()
        self._closed.wait()
        return self._device.health()


def run(parent: int, *handles: int) -> None:
    """The main function of the process. parent: the caller's process; handles: of the ends of `LINES`."""
    told_to_end: list[int] = []
    _leave_signals_to_the_caller(told_to_end)
    lifetime = Lifetime(parent, told_to_end)
    threading.Thread(target=lifetime.watch, name="lifetime", daemon=True).start()
    ends = tuple(End(handle) for handle in handles)
    with contextlib.suppress(EOFError, OSError):  # the caller is gone: what is open is closed all the same
        _open_and_serve(lifetime, ends)


class Lifetime:
    """Longest time that the process may still run."""

    def __init__(self, parent: int, told_to_end: list[int]) -> None:
        self._parent = parent
        self._told_to_end = told_to_end
        self.patience_s = OPENING_GRACE_S
        """From when the end is due."""

    def is_over(self) -> bool:
        """Whether the process was told to end, or the one that started it is gone."""
        return bool(self._told_to_end) or os.getppid() != self._parent

    def watch(self) -> None:
        """Ends the process where its main thread does not: the device's own watchdog then drops the force."""
        while not self.is_over():
            time.sleep(POLL_EVERY_S)
        due_s = time.monotonic()
        while time.monotonic() < due_s + self.patience_s:
            time.sleep(POLL_EVERY_S)
        os._exit(1)


def _open_and_serve(lifetime: Lifetime, ends: tuple[End, ...]) -> None:
    name, settings, seed, telemetry = ends[0].recv()[1]
    try:
        device = open_device(name, settings, RealClock(), seed, own_process=False, telemetry=telemetry)
    except BaseException as error:  # noqa: BLE001 - the caller raises it
        ends[0].send((ERROR, _sendable(error)))
        return
    lifetime.patience_s = settings.limits.release_s + settings.limits.watchdog_s + OVERDUE_S
    with contextlib.closing(device):
        # Nothing may stop the loop to look for garbage: what is there stays, what comes is looked at between stimuli.
        gc.collect()
        gc.freeze()
        gc.disable()
        ends[0].send((VALUE, device.info))
        server = DeviceServer(device, ends, at_rest=gc.collect, raise_thread_priority=raise_thread_priority)
        server.start()
        while not (server.ended.wait(POLL_EVERY_S) or lifetime.is_over()):
            pass
        server.close()


def _leave_signals_to_the_caller(told_to_end: list[int]) -> None:
    """A terminal's Ctrl-C or end is the caller's business, which lets go with a fade. A SIGTERM for this process ends
    it, with the same fade."""

    def note(number: int, frame: FrameType | None) -> None:
        told_to_end.append(number)

    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, note)
    if hasattr(signal, "SIGHUP"):
        signal.signal(signal.SIGHUP, signal.SIG_IGN)


def _answer(function: Callable[..., Any], arguments: tuple[Any, ...]) -> tuple[int, Any]:
    try:
        return VALUE, function(*arguments)
    except (EOFError, ConnectionError):  # the caller went while it was asked whether to go on
        raise
    except BaseException as error:  # noqa: BLE001 - the caller raises it
        return ERROR, _sendable(error)


def _sendable(error: BaseException) -> Exception:
    if isinstance(error, Exception):
        with contextlib.suppress(Exception):
            copy = pickle.loads(pickle.dumps(error))
            if isinstance(copy, type(error)):
                return error
    return RuntimeError(f"{type(error).__name__}: {error}")
