"""How soon the screen shows a key, its first frame, and how long its event loop is ever held up: in a real terminal of
120 x 40, during a whole session on the simulated device, against a Textual application with one line of text."""

import asyncio
import contextlib
import fcntl
import os
import pty
import select
import statistics
import struct
import subprocess
import sys
import tempfile
import termios
import time
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
ROWS, COLUMNS = 40, 120
FRAMES = 5
KEYS = 100
QUIET_S = 0.25
ARMED = "TrialScreen!"

KEY_MS, FRAME_S, BLOCK_MS = 30.0, 0.6, 50.0
TIMES_THE_PEER = 12.0

PROTOCOL = """
name = "bench"
kind = "study"
title = "A study for the stopwatch"
[stimulus]
frequencies_hz = [15.0, 25.0, 35.0]
[staircase]
start_n = 1.0
cap_n = 3.0
up_after_wrong = 1
down_after_right = 3
steps = [{ step_db = 4.0, reversals = 2 }, { step_db = 1.0, reversals = 5 }]
reversals = 7
averaged_reversals = 5
[directions]
[safety]
stimulus_cap_n = 3.0
total_cap_n = 4.5
[training]
frequencies_hz = []
[trial]
pause_between_s = 0.1
[rests]
after_run_s = 0.5
[measurement]
keep_s = 0.2
"""

PEER = """
from textual.app import App
from textual.widgets import Static
class Peer(App):
    def compose(self): yield Static("ready", id="text")
    def on_key(self, event):
        if event.key == "q": self.exit()
        else: self.query_one("#text", Static).update(f"{event.key} {event.time}")
Peer().run()
"""


class Pty:
    """A terminal that is read all the time."""

    def __init__(self, command: list[str], pass_fds: tuple[int, ...] = ()) -> None:
        self.end, slave = pty.openpty()
        fcntl.ioctl(slave, termios.TIOCSWINSZ, struct.pack("HHHH", ROWS, COLUMNS, 0, 0))
        paths = os.pathsep.join((str(ROOT), str(ROOT / "study" / "launcher")))
        environment = {**os.environ, "PYTHONPATH": paths, "TERM": "xterm-256color", "TEXTUAL_ANIMATIONS": "none"}
        for name in ("COLUMNS", "LINES"):
            environment.pop(name, None)
        self.began_s = time.monotonic()
        self.process = subprocess.Popen(
            command, stdin=slave, stdout=slave, stderr=slave, env=environment, start_new_session=True, pass_fds=pass_fds
        )
        os.close(slave)

    def read(self, patience_s: float) -> bytes:
        if not select.select([self.end], [], [], patience_s)[0]:
            return b""
        with contextlib.suppress(OSError):
            return os.read(self.end, 65536)
        return b""

    def read_until(self, words: bytes, patience_s: float = 60.0) -> float:
        """Returns when they came, in seconds since the start."""
        seen, until_s = b"", time.monotonic() + patience_s
        while words not in seen:
            if time.monotonic() > until_s:
                raise TimeoutError(f"{words!r} did not come")
            seen += self.read(0.005)
        return time.monotonic() - self.began_s

    def drain(self, quiet_s: float) -> None:
        """Until nothing more comes; a cursor that blinks is waited for no longer than four times that."""
        until_s = time.monotonic() + 4.0 * quiet_s
        while time.monotonic() < until_s and self.read(quiet_s):
            pass

    def type(self, text: str) -> None:
        os.write(self.end, text.encode())

    def key_ms(self, key: str) -> float:
        """From the key to the first output that it causes: nothing else may be drawn at that time."""
        typed_s = time.monotonic()
        self.type(key)
        if not self.read(2.0):
            raise TimeoutError(f"nothing was drawn for {key!r}")
        return 1000.0 * (time.monotonic() - typed_s)

    def close(self) -> None:
        until_s = time.monotonic() + 8.0
        while self.process.poll() is None and time.monotonic() < until_s:
            self.read(0.05)
        self.process.kill()
        self.process.wait()
        os.close(self.end)


@contextlib.contextmanager
def terminal(command: list[str], pass_fds: tuple[int, ...] = ()) -> Iterator[Pty]:
    made = Pty(command, pass_fds)
    try:
        yield made
    finally:
        made.close()


def watched_screen(protocol: str, data: str, news: int) -> None:
    """The application itself, with a task in its event loop that measures how late it comes."""
    from study.tui.app.app import HapteqApp
    from study.tui.app.start_options import StartOptions
    from study.tui.engine.to_engine import BeginSession, SessionOrder

    class FollowedSession(HapteqApp):
        async def on_mount(self) -> None:
            self._watchdog = asyncio.create_task(self._watch())

        async def _watch(self) -> None:
            told = ""
            while True:
                began_s = time.monotonic()
                await asyncio.sleep(0.002)
                late_ms = 1000.0 * (time.monotonic() - began_s) - 2.0
                screen = self.screen
                state = f"{type(screen).__name__}{'!' if getattr(screen, '_armed_s', None) else ''}"
                if state != told or late_ms > 5.0:
                    told = state
                    os.write(news, f"{state} {late_ms:.1f}\n".encode())

    app = FollowedSession(
        StartOptions(data, "simulated", first_sitting=BeginSession(SessionOrder(protocol, "simulated", "B01", data, 4)))
    )
    try:
        app.run()
    finally:
        app.close_engine()


class News:
    """Which screen is up, and the longest delay of the event loop while it was."""

    def __init__(self, descriptor: int) -> None:
        self._descriptor = descriptor
        self._rest = b""
        self.state = ""
        self.longest_ms: dict[str, float] = {}

    def take(self) -> None:
        while select.select([self._descriptor], [], [], 0)[0]:
            *lines, self._rest = (self._rest + os.read(self._descriptor, 65536)).split(b"\n")
            for line in lines:
                state, late = line.decode().split()
                self.state = state
                screen = state.rstrip("!")
                self.longest_ms[screen] = max(self.longest_ms.get(screen, 0.0), float(late))


def session(folder: Path) -> tuple[list[float], dict[str, float]]:
    """Key latencies of its trials, and the longest block of the event loop by screen."""
    protocol = folder / "bench.toml"
    protocol.write_text(PROTOCOL)
    reading, writing = os.pipe()
    command = [sys.executable, __file__, "--screen", str(protocol), str(folder / "data"), str(writing)]
    news, keys_ms = News(reading), []
    with terminal(command, (writing,)) as screen:
        until_s = time.monotonic() + 240.0
        while news.state != "OutcomeScreen" and time.monotonic() < until_s:
            screen.read(0.01)
            news.take()
            if news.state == ARMED:
                screen.drain(QUIET_S)
                news.take()
            if news.state == ARMED:
                keys_ms.append(screen.key_ms("12"[len(keys_ms) % 2]))
            elif news.state in ("DeviceCheckScreen", "InstructionsScreen", "RestScreen", "GoodbyeScreen"):
                screen.drain(QUIET_S)
                screen.type("\r")
        screen.type("q")
    return keys_ms, news.longest_ms


def peer_keys() -> list[float]:
    with terminal([sys.executable, "-c", PEER]) as screen:
        screen.read_until(b"ready")
        keys = []
        for n in range(KEYS):
            screen.drain(QUIET_S)
            keys.append(screen.key_ms("12"[n % 2]))
        screen.type("q")
    return keys


def first_frame_s(command: list[str], words: bytes, leave: str) -> float:
    times = []
    for _ in range(FRAMES):
        with terminal(command) as screen:
            times.append(screen.read_until(words))
            screen.drain(1.0)
            screen.type(leave)
    return statistics.median(times)


def report(line: str) -> None:
    sys.stdout.write(line + "\n")


def spread(values: list[float]) -> tuple[float, float]:
    return statistics.median(values), statistics.quantiles(values, n=20)[-1]


def main() -> int:
    with tempfile.TemporaryDirectory() as name:
        home = first_frame_s([sys.executable, "-m", "study", "study", "--data", name], b"Sessions", "\x11")
        peer_frame = first_frame_s([sys.executable, "-c", PEER], b"ready", "q")
        keys, blocks = session(Path(name))
    (key, key_95), (peer, peer_95) = spread(keys), spread(peer_keys())
    longest = max(blocks.values())
    allowed = f"allowed {KEY_MS:.0f} ms and {TIMES_THE_PEER:.0f} x"
    report(f"key to first changed output: {key:.1f} ms median, {key_95:.1f} ms p95 of {len(keys)} keys ({allowed})")
    report(f"  {key / peer:.1f} x one line of text in Textual ({peer:.1f} ms median, {peer_95:.1f} ms p95)")
    report(f"first frame: {home:.2f} s, {home / peer_frame:.1f} x the same ({peer_frame:.2f} s; allowed {FRAME_S} s)")
    report(f"longest hold-up of the event loop: {longest:.0f} ms (allowed {BLOCK_MS:.0f})")
    for screen, block in sorted(blocks.items(), key=lambda item: -item[1]):
        report(f"  {block:5.0f} ms on {screen}")
    return int(key > KEY_MS or key > TIMES_THE_PEER * peer or home > FRAME_S or longest > BLOCK_MS)


if __name__ == "__main__":
    if sys.argv[1:2] == ["--screen"]:
        watched_screen(sys.argv[2], sys.argv[3], int(sys.argv[4]))
        sys.exit(0)
    sys.exit(main())
