"""A device served over real pipes as the loop's process serves it, by threads of the test: on a clock of the test."""

import contextlib
import os
import socket
import threading
from multiprocessing import Pipe

from study.devices.device import Device, DeviceSettings
from study.devices.loop_process.call_pipe import PIPE_NAMES, CallPipe
from study.devices.loop_process.remote_device import RemoteDevice
from study.devices.loop_process.serve import DeviceServer


class ServedHere:
    """In the place of the loop's process."""

    def __init__(self, device: Device) -> None:
        pairs = [Pipe() for _ in PIPE_NAMES]
        self.theirs = tuple(theirs for _, theirs in pairs)
        self.lines = [CallPipe(ours, name) for (ours, _), name in zip(pairs, PIPE_NAMES, strict=True)]
        self.work, self.signs, self.look, self.stop, self.close = self.lines
        self.server = DeviceServer(device, self.theirs)
        self._thread = threading.Thread(target=self._serve, daemon=True)
        self._thread.start()
        self.killed = False
        self.patience_s: list[float] = []
        """Of each wait for its end."""

    def hang_up(self) -> None:
        for line in self.lines:
            line.close_after_calls()

    def end(self, patience_s: float) -> str:
        self.patience_s.append(patience_s)
        self._thread.join(patience_s)
        return "and was killed" if self.killed or self._thread.is_alive() else "with code 0"

    def kill(self) -> None:
        self.killed = True
        self.die()

    def die(self) -> None:
        """As one that is killed: its ends of the pipes close."""
        for end in self.theirs:
            with contextlib.suppress(OSError), socket.socket(fileno=os.dup(end.fileno())) as pipe:
                pipe.shutdown(socket.SHUT_RDWR)

    def _serve(self) -> None:
        self.server.start()
        self.server.ended.wait()
        self.server.close()
        self.die()


def remote(device: Device, settings: DeviceSettings) -> RemoteDevice:
    return RemoteDevice(ServedHere(device), device.info, settings)
