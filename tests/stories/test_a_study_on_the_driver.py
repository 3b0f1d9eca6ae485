"""A whole short study through the driver of a real device, on the stub of its library, in real time."""

import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest

from study.cli.main import main
from study.session.facts.events import AnswerGiven, TrialSpoiled
from study.store.formats.trials_file import read_trials
from study.store.sessions.event_log import read_log
from tests.slow_instances import slow

pytestmark = pytest.mark.real_time

RESUMED = 20
"""How often a busy computer may break the session off."""


@pytest.fixture
def short_file(tmp_path, small_text):
    text = small_text.replace("[25.0, 35.0]", "[35.0]").replace("after_run_s = 2.0", "after_run_s = 0.0")
    text = text.replace("reversals = 5", "reversals = 3").replace("averaged_reversals = 3", "averaged_reversals = 2")
    text = text.replace("reversals = 3 }]", "reversals = 1 }]")
    text += "missed_ticks_limit = 1.0\n"  # the computer of the tests may be busy
    path = tmp_path / "short.toml"
    path.write_text(text)
    return path


@pytest.mark.slow
def test_a_simulated_participant_takes_a_study_on_the_driver(stub, short_file, tmp_path, capsys):
    stub.set("stiffness", 150)  # a hand that holds the handle
    stub.set("stretch_in_use", 20)  # the computer of the tests is busier than that of a lab
    data = ("--data", str(tmp_path / "data"), "--device", "omega3", "--hands-off", "--json")
    code = main(["study", "--protocol", str(short_file), "--observer", "ideal", "--seed", "5", *data])
    resumed = 0
    while code != 0 and resumed < RESUMED:  # a loop that stood still for 100 ms is a lost device: nothing is lost by it
        assert code in (3, 130), capsys.readouterr().err
        assert stub.safe
        resumed += 1
        code = main(["resume", "ideal1_001", *data])
    out, err = capsys.readouterr()
    assert code == 0, err
    assert "thresholds" in out
    assert stub.safe
    assert 0.3 < stub.get("peak_n") <= 4.5
    trials = read_trials(tmp_path / "data" / "ideal1_001" / "trials.csv")
    assert len(trials) > 7
    assert all(trial.late_ticks is not None and trial.latest_s > 0 for trial in trials if trial.is_valid)


class Taking:
    """A simulated participant takes the study, in a program of its own."""

    def __init__(self, arguments: list[str], stub) -> None:
        self.stub = stub
        self.program = subprocess.Popen(
            [sys.executable, "-m", "study", *arguments],
            env=os.environ | {"HAPTEQ_STUB": "stiffness=150"},
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
        )

    def await_force(self) -> bool:
        """Until a force is played. False where the program ended before."""
        while self.program.poll() is None:
            if self.stub.peek("last_write") > 0.2 and self.stub.peek("force_on"):
                return True
            time.sleep(0.001)
        return False

    def loop_pid(self) -> int:
        """Of the process that holds the device: the program starts no other."""
        tasks = Path(f"/proc/{self.program.pid}/task").iterdir()
        (pid,) = {pid for task in tasks for pid in (task / "children").read_text("ascii").split()}
        return int(pid)

    def end(self) -> str:
        self.program.send_signal(signal.SIGCONT)
        return self.program.communicate(timeout=120)[0].decode()


def watch_it_let_go(stub) -> None:
    """Nothing drives the device any more: its firmware goes on, from where the program left it."""
    time.sleep(0.1)
    assert stub.safe
    assert stub.get("cause") == 3
    assert stub.get("peak_n") <= 4.5


@pytest.mark.parametrize("seed", [1, *slow(*range(2, 22))])
def test_a_program_that_is_killed_leaves_no_force_and_loses_no_answer(stub, short_file, tmp_path, seed):
    random = np.random.default_rng(seed)
    data = ["--data", str(tmp_path / "data"), "--device", "omega3", "--hands-off"]
    arguments = ["study", "--protocol", str(short_file), "--observer", "ideal", "--seed", str(seed), *data]
    log, before, killed = tmp_path / "data" / "ideal1_001" / "events.jsonl", b"", 0
    for _ in range(2):
        taking = Taking(arguments, stub)
        if taking.await_force():
            time.sleep(float(random.uniform(0.0, 0.5)))
            taking.program.kill()
            killed += 1
        said = taking.end()
        time.sleep(0.1)
        assert stub.safe, said
        assert stub.get("peak_n") <= 4.5
        after = log.read_bytes()
        assert after.startswith(before.rsplit(b"\n", 1)[0])
        before, arguments = after, ["resume", "ideal1_001", *data]
    assert killed, said


def test_a_program_that_is_stopped_leaves_no_force_and_none_comes_back(stub, short_file, tmp_path):
    """Its loop hears no sign of life any more, and fades."""
    stub.set("stretch_in_use", 1000)  # the loop lets go, not the firmware
    data = ["--data", str(tmp_path / "data"), "--device", "omega3", "--hands-off"]
    taking = Taking(["study", "--protocol", str(short_file), "--observer", "ideal", "--seed", "3", *data], stub)
    assert taking.await_force(), taking.end()
    taking.program.send_signal(signal.SIGSTOP)
    becomes(lambda: stays_zero(stub))
    for _ in range(5):
        time.sleep(0.1)
        assert stays_zero(stub)
    taking.program.send_signal(signal.SIGCONT)
    taking.program.send_signal(signal.SIGINT)
    said = taking.end()
    assert taking.program.returncode in (3, 130), said
    assert stub.safe
    assert stub.get("peak_n") <= 4.5


def becomes(true) -> None:
    until_s = time.monotonic() + 30.0
    while not true():
        assert time.monotonic() < until_s
        time.sleep(0.005)


def stays_zero(stub) -> bool:
    """Longer than a period of what was held."""
    for _ in range(20):
        if stub.get("last_write") != 0.0:
            return False
        time.sleep(0.003)
    return True


@pytest.mark.parametrize("how", [signal.SIGSTOP, pytest.param(signal.SIGKILL, marks=pytest.mark.slow)])
def test_a_loop_that_ends_leaves_no_force_and_the_study_ends_with_words_and_goes_on(stub, short_file, tmp_path, how):
    data = ["--data", str(tmp_path / "data"), "--device", "omega3", "--hands-off"]
    arguments = ["study", "--protocol", str(short_file), "--observer", "ideal", "--seed", "3", *data]
    for _ in range(3):
        taking = Taking(arguments, stub)
        if taking.await_force():
            break
        taking.end()
        arguments = ["resume", "ideal1_001", *data]
    os.kill(taking.loop_pid(), how)
    watch_it_let_go(stub)
    said = taking.end()
    assert taking.program.returncode == 3, said
    assert stub.safe
    assert "hapteq resume" in said
    if how == signal.SIGKILL:
        stub.set("stretch_in_use", 20)
        assert main(["resume", "ideal1_001", *data]) in (0, 3, 130)
        assert stub.safe


NEVER = 1e9


class Trouble:
    """Twice, in the middle of a force: the fault for a moment, then it is mended."""

    def __init__(self, stub, switches: dict[str, float], healthy: dict[str, float]) -> None:
        self._stub, self._switches, self._healthy = stub, switches, healthy
        self.made = 0
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._make)
        self._thread.start()

    def end(self) -> None:
        self._over.set()
        self._thread.join(20)

    def _make(self) -> None:
        while self.made < 2 and not self._over.wait(0.01):
            if self._stub.peek("last_write") > 0.3 and self._stub.peek("force_on"):
                self._set(self._switches)
                time.sleep(0.3)
                self._set(self._healthy)
                self.made += 1
                self._over.wait(0.5)

    def _set(self, switches: dict[str, float]) -> None:
        for name, value in switches.items():
            self._stub.set(name, value)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("switches", "healthy"),
    [
        ({"jump_m": 0.06, "jump_every": 7}, {"jump_m": 0, "jump_every": 0}),
        pytest.param(
            {"scaled_from_n": 0.1, "scaled_every": 3},
            {"scaled_from_n": NEVER, "scaled_every": 0},
            marks=pytest.mark.slow,
        ),
    ],
)
def test_faults_that_come_and_go_void_trials_and_lose_no_answer(stub, short_file, tmp_path, switches, healthy, capsys):
    stub.set("stiffness", 150)  # a hand that holds the handle
    stub.set("stretch_in_use", 20)  # the computer of the tests is busier than that of a lab
    data = ("--data", str(tmp_path / "data"), "--device", "omega3", "--hands-off", "--json")
    trouble, answers, code = Trouble(stub, switches, healthy), 0, -1
    log = tmp_path / "data" / "ideal1_001" / "events.jsonl"
    try:
        for _ in range(1 + RESUMED):
            begin = ["resume", "ideal1_001"] if log.exists() else ["study", "--protocol", str(short_file)]
            begin += [] if log.exists() else ["--observer", "ideal", "--seed", "5"]
            code = main([*begin, *data])
            said = capsys.readouterr().err
            assert stub.safe
            kept = sum(isinstance(event, AnswerGiven) for event in read_log(log).events)
            assert kept >= answers
            answers = kept
            if code == 0:
                break
            assert code in (3, 130), said
    finally:
        trouble.end()
    assert code == 0, said
    assert trouble.made == 2
    assert stub.get("peak_n") <= 4.5
    assert any(isinstance(event, TrialSpoiled) for event in read_log(log).events)
    assert len([trial for trial in read_trials(log.parent / "trials.csv") if trial.is_valid]) > 7
