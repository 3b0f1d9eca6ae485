"""Work over forked processes: in order, with its errors, from within itself, counted, and left at once."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from analysis.diagnosis.search.guard import Guard
from analysis.diagnosis.search.time_budget import OutOfTimeError, budgeted, counted
from equalizer.effects.catalogue import CATALOGUE
from study.workflows import forked_map as module
from study.workflows.forked_map import forked_map, processor_s


@pytest.fixture(autouse=True)
def two_cores_and_nothing_known(monkeypatch):
    monkeypatch.setattr(module, "cores", lambda: 2)
    monkeypatch.setattr(module, "_mean_s", {})


def children() -> list[int]:
    return [int(pid) for pid in Path(f"/proc/self/task/{os.getpid()}/children").read_text().split()]


def slow(number: float) -> tuple[float, int]:
    time.sleep(0.05)
    return number, os.getpid()


def test_results_come_in_order_from_two_processes():
    found = forked_map(slow, range(8))
    assert [number for number, _ in found] == list(range(8))
    assert len({process for _, process in found}) == 2
    assert forked_map(pow, [2, 3], [3, 2]) == [8, 9]
    assert forked_map(str, []) == []


def test_arrays_and_effects_come_back_as_they_are():
    def paired(number: int) -> tuple[np.ndarray, object]:
        time.sleep(0.02)
        return np.full(3, float(number)), CATALOGUE[number]

    for number, (values, effect) in enumerate(forked_map(paired, range(6))):
        assert values.tolist() == [number] * 3
        assert effect is CATALOGUE[number]


def test_what_cannot_be_sent_is_done_here():
    def function_of(number: int) -> object:
        time.sleep(0.02)
        return lambda: number

    assert [found() for found in forked_map(function_of, range(6))] == list(range(6))


def test_what_a_process_died_of_is_done_here():
    here = os.getpid()

    def dies(number: int) -> int:
        time.sleep(0.02)
        if os.getpid() != here:
            os._exit(1)
        return number

    assert forked_map(dies, range(6)) == list(range(6))


@pytest.mark.parametrize("wrong", range(4))
def test_an_error_is_raised_where_the_results_are_wanted_and_leaves_no_process(wrong):
    def inverse(number: int) -> float:
        time.sleep(0.02)
        return 1 / (number - wrong)

    with pytest.raises(ZeroDivisionError):
        forked_map(inverse, range(4))
    assert children() == []
    assert forked_map(abs, [-1, -2]) == [1, 2]


def test_work_within_work_is_done_there():
    def inner(number: int) -> list[int]:
        return [process for _, process in forked_map(slow, range(number))]

    assert all(len(set(processes)) == 1 for processes in forked_map(inner, [2, 3, 2, 3]))


def test_crashes_in_a_process_are_noted_here():
    guard = Guard(on=True)

    def broken(effect: object) -> str:
        time.sleep(0.02)
        raise ValueError("no such number")

    assert list(guard.over(forked_map, "its fit")(broken, CATALOGUE[:6])) == []
    assert [crash.what for crash in guard.crashes] == [effect.name for effect in CATALOGUE[:6]]
    assert all(crash.said == "ValueError: no such number" for crash in guard.crashes)


def asked(most: int, map_: object) -> int:
    """How many maps of four nested maps of two a count allows."""
    mapped, done = budgeted(map_, counted(most)), 0

    def nested(number: int) -> float:
        time.sleep(0.01)
        return sum(mapped(abs, [number, -number]))

    try:
        while done < 10:
            mapped(nested, range(4))
            done += 1
    except OutOfTimeError:
        pass
    return done


@pytest.mark.parametrize("most", [11, 12, 13, 23, 24, 100])
def test_evaluations_are_counted_wherever_they_are_made(most):
    assert asked(most, forked_map) == asked(most, map) == most // 12


def test_processor_time_of_processes_counts():
    def busy(_: int) -> None:
        until = time.process_time() + 0.1
        while time.process_time() < until:
            pass

    before = processor_s()
    forked_map(busy, range(4))
    assert processor_s() - before > 0.35


@pytest.mark.real_time
@pytest.mark.timeout(60)
def test_ctrl_c_ends_a_program_and_all_its_processes():
    program = (
        "import os, signal, time\n"
        # A shell that starts this in the background has it ignored, and children inherit that.
        "signal.signal(signal.SIGINT, signal.default_int_handler)\n"
        "from study.workflows.forked_map import forked_map\n"
        "def work(_):\n"
        "    print(os.getpid(), flush=True)\n"
        "    time.sleep(50)\n"
        "forked_map(work, range(8), workers=2)\n"
    )
    root = Path(__file__).parents[3]
    process = subprocess.Popen(
        [sys.executable, "-c", program],
        cwd=root, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True, start_new_session=True,
    )  # fmt: skip
    assert process.stdout is not None
    workers = {int(process.stdout.readline()) for _ in range(2)}
    assert len(workers) == 2
    os.killpg(process.pid, signal.SIGINT)
    assert process.wait(20) != 0
    process.stdout.close()
    for worker in workers:
        with pytest.raises(ProcessLookupError):
            os.kill(worker, 0)
