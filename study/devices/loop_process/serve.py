"""Main program of the process of the device loop: opens a device behind its safety layer and executes the remote calls
of another process, the caller, with a thread for each pipe. Begin at `run`.

Keep-alive calls always come from the caller: `keep_alive` runs only on its call, and `play` continues only while the
caller answers each progress message. When the caller's end of a pipe closes, for any reason, the force fades, the
device is closed, and the process ends."""

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
from study.devices.loop_process.call_pipe import CLOSE_TIMEOUT_S, ERROR, PIPE_NAMES, PROGRESS, VALUE, PipeEnd
from study.devices.opening import open_device, raise_thread_priority

POLL_INTERVAL_S = 0.2
"""Interval (s) at which the existence of the caller's process is checked, because a fork of the caller may keep its end
of a pipe open. Chosen."""

LAST_ANSWER_TIMEOUT_S = 1.0
"""Longest wait (s) for the thread that answers the call of `close`. Chosen."""

OPENING_GRACE_S = 1.0
"""Time (s) that the process may still run after its caller has ended while the device is being opened: no stimulus has
to be faded out then. Chosen."""

EXIT_GRACE_S = CLOSE_TIMEOUT_S + 3.0
"""Time (s) in addition to the fade after which a process that does not end is terminated: it hangs, in the driver or in
an exit handler. Chosen."""


class PlaybackCancelledError(Exception):
    """The caller has cancelled the playback: it answered a progress message with False."""


class DeviceServer:
    """Executes the caller's remote calls on an opened device: a thread per pipe of `PIPE_NAMES` calls the methods."""

    def __init__(
        self,
        device: Device,
        pipe_ends: tuple[PipeEnd, ...],
        after_stimulus: Callable[[], object] = lambda: None,
        raise_thread_priority: Callable[[], AbstractContextManager[object]] = contextlib.nullcontext,
    ) -> None:
        """pipe_ends: this process's ends of the pipes, in the order of `PIPE_NAMES`. after_stimulus: called after each
        stimulus. raise_thread_priority: context in which the threads for stop and keep-alive calls run."""
        self._device = device
        self._after_stimulus = after_stimulus
        self._raise_priority = raise_thread_priority
        self._closed = threading.Event()
        self.ended = threading.Event()
        """Set when the caller is gone or has asked to close the device."""
        playback_end, keep_alive_end, look_end, stop_end, close_end = pipe_ends
        method_tables: tuple[tuple[PipeEnd, dict[str, Callable[..., Any]]], ...] = (
            (
                playback_end,
                {
                    "hold": device.hold,
                    "release": device.release,
                    "play": lambda commands: self._play_commands(playback_end, commands),
                },
            ),
            (keep_alive_end, {"keep_alive": device.keep_alive, "fault": device.fault, "health": device.health}),
            (look_end, {"look": device.look}),
            (stop_end, {"stop": device.stop}),
            (close_end, {"close": self._await_closed}),
        )
        self._threads = [
            threading.Thread(target=self._serve, args=method_table, name=f"serve {name}", daemon=True)
            for name, method_table in zip(PIPE_NAMES, method_tables, strict=True)
        ]

    def start(self) -> None:
        """Start the thread of each pipe."""
        for thread in self._threads:
            thread.start()

    def close(self) -> None:
        """Close the device with a fade, then answer the caller's call of `close`, if any. Never raises."""
        self._device.close()
        self._closed.set()
        self._threads[-1].join(LAST_ANSWER_TIMEOUT_S)  # the thread of the pipe for `close`

    def _serve(self, pipe_end: PipeEnd, methods: dict[str, Callable[..., Any]]) -> None:
        """Receive the calls of a pipe, execute them and send the answers, until the caller is gone or the device is
        closed; the function of the pipe's thread. methods: by the name that a call states."""
        is_urgent = "stop" in methods or "keep_alive" in methods
        try:
            with self._raise_priority() if is_urgent else contextlib.nullcontext():
                while not self._closed.is_set():
                    name, arguments = pipe_end.recv()
                    pipe_end.send(_call_function(methods[name], arguments))
                    if name in ("release", "play"):
                        self._after_stimulus()
        except (EOFError, OSError):
            return
        finally:
            self.ended.set()

    def _play_commands(self, pipe_end: PipeEnd, commands: Signal) -> PlaybackResult:
        """Play commands; after each progress message, continue only if the caller answers True. Raises
        PlaybackCancelledError if it answers False."""

        def request_continuation(share: float) -> None:
            """Send the share that was played (0 to 1), and wait for the answer of the caller."""
            pipe_end.send((PROGRESS, share))
            if not pipe_end.recv():
                raise PlaybackCancelledError

        return self._device.play(commands, request_continuation)

    def _await_closed(self) -> Any:
        """Ask the main thread to close the device, and wait until it is closed. Returns the final counters."""
        self.ended.set()
        self._closed.wait()
        return self._device.health()


def run(caller_pid: int, *handles: int) -> None:
    """Run the process. caller_pid: process id of the caller; handles: file descriptors or handles of this process's
    ends of the pipes, in the order of `PIPE_NAMES`."""
    received_signals: list[int] = []
    _install_signal_handlers(received_signals)
    watchdog = CallerWatchdog(caller_pid, received_signals)
    threading.Thread(target=watchdog.watch, name="lifetime", daemon=True).start()
    pipe_ends = tuple(PipeEnd(handle) for handle in handles)
    with contextlib.suppress(EOFError, OSError):  # the caller has ended; an opened device is already closed
        _open_and_serve(watchdog, pipe_ends)


class CallerWatchdog:
    """Ends the process if it does not end itself soon after its caller has ended or asked for the end, or after a
    SIGTERM. caller_pid: process id of the caller. received_signals: numbers of the signals received, filled by the
    signal handler."""

    def __init__(self, caller_pid: int, received_signals: list[int]) -> None:
        self._caller_pid = caller_pid
        self._received_signals = received_signals
        self.end_requested = threading.Event()
        """To be set when the device's closing begins: the caller is gone or has asked for it."""
        self.exit_timeout_s = OPENING_GRACE_S
        """Time (s) that the main thread may take to end the process, from the moment at which `must_exit` is True."""

    def must_exit(self) -> bool:
        """Whether a SIGTERM was received, `end_requested` is set, or the process that started this one is gone. On
        Windows `os.getppid` does not change, and the end of the caller is recognised by its closed pipes alone, thus
        not while the device is being opened."""
        return bool(self._received_signals) or self.end_requested.is_set() or os.getppid() != self._caller_pid

    def watch(self) -> None:
        """Wait until the process must exit, and terminate it if its main thread does not within `exit_timeout_s`; the
        watchdog of the device's hardware then switches the force off. The function of a daemon thread."""
        while not self.must_exit():
            time.sleep(POLL_INTERVAL_S)
        exit_requested_s = time.monotonic()
        while time.monotonic() < exit_requested_s + self.exit_timeout_s:
            time.sleep(POLL_INTERVAL_S)
        os._exit(1)


def _open_and_serve(watchdog: CallerWatchdog, pipe_ends: tuple[PipeEnd, ...]) -> None:
    """Open the device that the first message names, execute calls until the caller is gone, `close` is called or the
    process must exit, and close the device with a fade. An error while opening is sent to the caller."""
    name, settings, seed, telemetry = pipe_ends[0].recv()[1]
    try:
        device = open_device(name, settings, RealClock(), seed, own_process=False, telemetry=telemetry)
    except BaseException as error:  # noqa: BLE001 - the caller raises it
        pipe_ends[0].send((ERROR, _make_sendable(error)))
        return
    watchdog.exit_timeout_s = settings.limits.release_s + settings.limits.watchdog_s + EXIT_GRACE_S
    with contextlib.closing(device):
        # The garbage collector must not interrupt the loop: existing objects are exempted, new ones are collected
        # between stimuli.
        gc.collect()
        gc.freeze()
        gc.disable()
        pipe_ends[0].send((VALUE, device.info))
        server = DeviceServer(device, pipe_ends, after_stimulus=gc.collect, raise_thread_priority=raise_thread_priority)
        server.start()
        while not (server.ended.wait(POLL_INTERVAL_S) or watchdog.must_exit()):
            pass
        watchdog.end_requested.set()
        server.close()


def _install_signal_handlers(received_signals: list[int]) -> None:
    """Ignore Ctrl-C and the end of the terminal, which the caller handles with a fade. SIGTERM is appended to
    `received_signals`, so that the main thread ends the process with a fade, too."""

    def record_signal(signal_number: int, frame: FrameType | None) -> None:
        """Append the number of the signal."""
        received_signals.append(signal_number)

    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, record_signal)
    if hasattr(signal, "SIGHUP"):
        signal.signal(signal.SIGHUP, signal.SIG_IGN)


def _call_function(function: Callable[..., Any], arguments: tuple[Any, ...]) -> tuple[int, Any]:
    """Call a function. Returns its value or its exception as a message (kind, value), but raises EOFError and
    ConnectionError: the caller is gone."""
    try:
        return VALUE, function(*arguments)
    except (EOFError, ConnectionError):  # the caller ended during its answer to a progress
        raise
    except BaseException as error:  # noqa: BLE001 - the caller raises it
        return ERROR, _make_sendable(error)


def _make_sendable(error: BaseException) -> Exception:
    """Return the exception itself if it is an `Exception` that can be pickled and restored, else a RuntimeError with
    its type and text."""
    if isinstance(error, Exception):
        with contextlib.suppress(Exception):
            restored_error = pickle.loads(pickle.dumps(error))
            if isinstance(restored_error, type(error)):
                return error
    return RuntimeError(f"{type(error).__name__}: {error}")
