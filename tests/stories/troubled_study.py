"""A person at the real screen takes study after study on the stub, with an accelerometer at a pseudo-terminal, while
the screen, the engine, the loop, the device and the board are killed and stalled at random moments of a force."""

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from from_outside import Board, children, force_is_on, goes_off, is_off, runs
from terminal import Terminal

from study.session.facts.events import AnswerGiven
from study.store.sessions.archive import SessionFolder
from study.store.sessions.event_log import read_log
from study.workflows.files.validate import validate_file
from study.workflows.results.fold_session import fold_session

CAP_N = 4.5
STALLED_S = 1.2
"""Longer than the screen's sign of life, and than the fade that follows its absence."""
ENDED_S = 60.0
"""An engine that is just writing results does that to the end."""
SEATED_S, BARREN = 180.0, 4
"""A sitting in which nothing was felt for so long is given up; so many in a row are a failure."""


class Troubled:
    """One device and its board, and as many sessions as the troubles take. `made`: how often each came."""

    def __init__(self, stub, folder: Path, protocol: Path, seed: int) -> None:
        self.stub, self.protocol, self.data = stub, protocol, folder / "data"
        self._lab, self._link = folder / "lab.toml", folder / "board"
        self.draw, self._session, self._seat = np.random.default_rng(seed), 0, None
        self._kept: dict[int, list[tuple[int, int, int, int]]] = {}
        self._answered: set[tuple[str, int, int, int]] = set()
        self.sittings = self._barren = self._events_before = 0
        self.ways: dict[str, Callable[[], bool]] = {
            "screen killed": lambda: self._kill(self._screen()),
            "screen stalled": lambda: self._stall(self._screen()),
            "engine killed": lambda: self._kill(self._engine()),
            "engine stalled": lambda: self._stall(self._engine()),
            "loop killed": lambda: self._kill(self._loop()),
            "loop stalled": lambda: self._stall(self._loop()),
            "readings fail": lambda: self._switch({"read_fails": 2}, {"read_fails": 0}),
            "readings hang": lambda: self._switch({"late_s": 0.3, "late_every": 1}, {"late_every": 0}),
            "board killed": self._board_killed,
            "board stalled": self._board_stalled,
        }
        self._began_s = time.monotonic()
        self.made = dict.fromkeys(self.ways, 0)
        self._board = Board(self._link, self._lab)

    def run(self, times: int) -> None:
        """So many troubles, each way alike, and every session to its end."""
        order: list[str] = []
        while (due := sum(self.made.values()) < times) | self._session_open():
            self._sit_down()
            order = order or list(self.draw.permutation(list(self.ways)))
            if self._sit_on(may_be_disturbed=due):
                way = order.pop()
                self._nothing_is_lost(f"before: {way}")
                self._say(way)
                goes_on = self.ways[way]()
                self.made[way] += 1
                self._barren = 0
                assert self.stub.peek("peak_n") <= CAP_N, way
                self._nothing_is_lost(way)
                if not goes_on:
                    self._leave()
        self._leave()

    def close(self) -> None:
        self._leave()
        self._board.kill()

    def _say(self, what: str) -> None:
        sys.stderr.write(f"{time.monotonic() - self._began_s:7.1f} s {self.folder.name}: {what}\n")

    # The sitting.

    @property
    def folder(self) -> SessionFolder:
        return SessionFolder(self.data / f"P{self._session:02d}_001")

    def _events(self) -> list[dict]:
        log = self.folder.log
        whole = log.read_bytes().rpartition(b"\n")[0] if log.exists() else b""
        return [json.loads(line) for line in whole.splitlines()]

    def _answers(self) -> list[tuple[int, int, int, int]]:
        if not self.folder.log.exists():
            return []
        given = (event for event in read_log(self.folder.log).events if isinstance(event, AnswerGiven))
        return [(each.run, each.trial, each.attempt, each.answer) for each in given]

    def _nothing_is_lost(self, where: str) -> None:
        """Each answer that was ever on the disk stands there still, in its order."""
        kept, found = self._kept.get(self._session, []), self._answers()
        assert found[: len(kept)] == kept, where
        self._kept[self._session] = found

    def _session_open(self) -> bool:
        """Where its last line is written, what is on the disk is judged."""
        events = self._events()
        if not any(event["event"] == "session_closed" for event in events):
            return bool(events)
        self._finish()
        return False

    def _finish(self) -> None:
        """The results come after the last line; a sitting that was killed between has them written by a `resume`."""
        until_s = time.monotonic() + 30.0
        report = self.folder.path / "analysis" / "report.html"
        while not report.is_file() and time.monotonic() < until_s and self._seat is not None:
            self._seat.type("\r")
            self._drain(0.5)
        self._say("finished")
        self._leave()
        asked = ["resume", self.folder.name, "--data", str(self.data), "--json"]
        done = subprocess.run([sys.executable, "-m", "study", *asked], capture_output=True, check=False, timeout=120)
        assert done.returncode in (0, 1), done.stderr[-2000:]  # 1: nothing was left to do
        self._nothing_is_lost("at the end")
        assert fold_session(self.folder).state.closed
        assert validate_file(self.folder.path).problems == ()
        assert report.is_file()
        self._session += 1

    def _sit_down(self) -> None:
        if self._seat is not None and self._seat.process.poll() is None:
            return
        self._leave()
        if not self._events():  # ended before there was anything
            self._session += 1
            asked = ["study", "--protocol", str(self.protocol), "--seed", str(self._session), "--device", "omega3"]
            asked += ["--subject", f"P{self._session:02d}"]
        else:
            asked = ["resume", self.folder.name, "--device", "omega3"]
        self.sittings, self._events_before = self.sittings + 1, len(self._events())
        self._say(f"sitting {self.sittings}, {len(self._answers())} answers")
        self._seat = Terminal(*asked, "--data", str(self.data))

    def _leave(self) -> None:
        if self._seat is None:
            return
        ended = [self._seat.process.pid, *children(self._seat.process.pid)]
        ended += [each for pid in ended[1:] for each in children(pid)]
        self._seat.close()
        self._seat = None
        assert goes_off(self.stub), "after the program's end"
        until_s = time.monotonic() + ENDED_S
        while (left := [pid for pid in ended if runs(pid)]) and time.monotonic() < until_s:
            time.sleep(0.05)
        assert left == [], f"of {ended} are left"

    def _drain(self, seconds: float) -> None:
        if self._seat is not None:
            self._seat.drain(seconds)

    def _sit_on(self, may_be_disturbed: bool) -> bool:
        """Enter where something is to be read, and answers, until a force is on that is to be disturbed: True; or
        until the sitting is over."""
        until_s = time.monotonic() + SEATED_S
        while time.monotonic() < until_s:
            events, seat = self._events(), self._seat
            last = events[-1] if len(events) > self._events_before else {}
            if seat.process.poll() is not None or last.get("event") == "session_interrupted":
                self._leave()
                return False
            if last.get("event") == "session_closed":
                return False
            if last.get("event") != "trial_presented":
                self._drain(0.2)
                # A busy machine: its lateness needs a look.
                seat.type("g" if "all the same" in seat.screen[-4000:] else "\r")
                continue
            trial = (self.folder.name, last["run"], last["trial"], last["attempt"])
            if trial in self._answered or not force_is_on(self.stub):
                self._drain(0.02)
                continue
            if may_be_disturbed and self.draw.random() < 0.5:
                time.sleep(float(self.draw.uniform(0.0, 0.3)))
                return True
            self._drain(0.3)
            self._answered.add(trial)
            seat.type("12"[len(self._answered) % 2])
        self._barren += 1
        self._say(f"nothing to feel: {self._seat.drain(0.5)[-600:]!r} {self._seat.screen[-1500:]!r}")
        assert self._barren < BARREN, f"nothing to feel: {self._seat.screen[-3000:]}"
        self._leave()
        return False

    # What happens to them. Each: whether the sitting may go on.

    def _screen(self) -> int:
        return int(self._seat.process.pid)

    def _engine(self) -> int:
        return next(iter(children(self._screen())), self._screen())

    def _loop(self) -> int:
        return next(iter(children(self._engine())), self._engine())

    def _kill(self, pid: int) -> bool:
        os.kill(pid, signal.SIGKILL)
        assert goes_off(self.stub), "killed"
        self._drain(0.5)
        return False

    def _stall(self, pid: int) -> bool:
        os.kill(pid, signal.SIGSTOP)
        try:
            assert goes_off(self.stub), "stalled"
            self._drain(float(self.draw.uniform(0.0, STALLED_S)))
            assert is_off(self.stub), "on again while it was stalled"
        finally:
            if runs(pid):  # a loop that stands still is killed by its program
                os.kill(pid, signal.SIGCONT)
        self._drain(1.0)
        return bool(self.draw.random() < 0.5) and pid != self._loop()

    def _switch(self, switches: dict[str, float], healthy: dict[str, float]) -> bool:
        for name, value in switches.items():
            self.stub.set(name, value)
        try:
            assert goes_off(self.stub), "while its readings fail"
        finally:
            for name, value in healthy.items():
                self.stub.set(name, value)
        self._drain(1.0)
        return False

    def _board_killed(self) -> bool:
        """No force depends on it. Plugged in again, it is found."""
        self._board.kill()
        self._drain(float(self.draw.uniform(0.1, STALLED_S)))
        self._board = Board(self._link, self._lab)
        return False

    def _board_stalled(self) -> bool:
        self._board.process.send_signal(signal.SIGSTOP)
        self._drain(float(self.draw.uniform(0.1, STALLED_S)))
        self._board.process.send_signal(signal.SIGCONT)
        self._drain(0.3)
        return True
