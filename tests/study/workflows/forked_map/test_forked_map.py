"""Work over forked processes: results in order, errors, nested maps, evaluations and processor time counted."""

import gc
import os
import time
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from analysis.diagnosis.search.guard import Guard
from analysis.diagnosis.search.time_budget import CountedBudget, OutOfTimeError, limit_map
from equalizer.effects.catalogue import CATALOGUE
from equalizer.effects.discovered_law import make_law_effect
from equalizer.effects.effect import list_effects_by_address
from equalizer.laws.law import parse_law
from study.workflows import forked_map as module
from study.workflows.forked_map import map_forked, measure_processor_s
from tests.study.workflows.forked_map.child_processes import slow


def test_results_come_in_order_from_two_processes():
    found = map_forked(slow, range(8))
    assert [number for number, _ in found] == list(range(8))
    assert len({process for _, process in found}) == 2
    assert map_forked(pow, [2, 3], [3, 2]) == [8, 9]
    assert map_forked(str, []) == []


def test_arrays_and_effects_come_back_as_they_are():
    def paired(number: int) -> tuple[np.ndarray, object]:
        time.sleep(0.02)
        return np.full(3, float(number)), CATALOGUE[number]

    for number, (values, effect) in enumerate(map_forked(paired, range(6))):
        assert values.tolist() == [number] * 3
        assert effect is CATALOGUE[number]


def test_a_law_that_was_there_before_comes_back_as_it_is_and_from_where_it_was_found():
    law = make_law_effect(parse_law("2*vx", "force", "x"))

    def found(_: int) -> tuple[object, int]:
        time.sleep(0.02)
        return law, os.getpid()

    answers = map_forked(found, range(6))
    assert all(effect is law for effect, _ in answers)
    assert len({process for _, process in answers}) == 2


@pytest.mark.slow
def test_an_effect_without_references_is_not_kept_alive():
    law = make_law_effect(parse_law("2*vx", "force", "x"))
    address = id(law)
    assert list_effects_by_address()[address] is law
    del law
    gc.collect()
    assert address not in list_effects_by_address()


def test_what_cannot_be_sent_is_done_here_and_not_tried_elsewhere_again():
    processes: list[int] = []

    def function_of(number: int) -> object:
        time.sleep(0.02)
        processes.append(os.getpid())
        return lambda: number

    for _ in range(2):
        assert [found() for found in map_forked(function_of, range(6))] == list(range(6))
        assert len(processes) == 6
        processes.clear()
        assert module._identify_function(function_of) in module._unforkable


def of_seconds(seconds: float, _: int) -> int:
    time.sleep(seconds)
    return os.getpid()


def test_work_that_was_short_is_forked_again_once_it_takes_longer():
    assert set(map_forked(partial(of_seconds, 0.0), range(4))) >= {os.getpid()}
    assert set(map_forked(partial(of_seconds, 0.0), range(4))) == {os.getpid()}
    assert set(map_forked(partial(of_seconds, 0.06), range(4))) == {os.getpid()}
    assert len(set(map_forked(partial(of_seconds, 0.06), range(8)))) == 2


def test_functions_without_code_of_their_own_are_distinguished():
    class Callable:
        def __call__(self) -> None: ...

    functions = (slow, of_seconds, Callable(), pow, Path)
    assert len({module._identify_function(function) for function in functions}) == len(functions)
    assert module._identify_function(partial(partial(slow), 1.0)) == module._identify_function(slow)
    assert module._identify_function(Callable()) == module._identify_function(Callable())


def test_work_within_work_is_done_there():
    def inner(number: int) -> list[int]:
        return [process for _, process in map_forked(slow, range(number))]

    assert all(len(set(processes)) == 1 for processes in map_forked(inner, [2, 3, 2, 3]))


def test_crashes_in_a_process_are_noted_here():
    guard = Guard(enabled=True)

    def broken(effect: object) -> str:
        time.sleep(0.02)
        raise ValueError("no such number")

    assert list(guard.wrap(map_forked, "its fit")(broken, CATALOGUE[:6])) == []
    assert [crash.subject for crash in guard.crashes] == [effect.name for effect in CATALOGUE[:6]]
    assert all(crash.message == "ValueError: no such number" for crash in guard.crashes)


def asked(most: int, map_: object) -> int:
    """How many maps of four nested maps of two a count allows."""
    mapped, done = limit_map(map_, CountedBudget(most)), 0

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
    assert asked(most, map_forked) == asked(most, map) == most // 12


def test_pieces_that_began_in_time_are_kept_where_a_clock_ran_out_before_they_were_done(tmp_path):
    over = tmp_path / "over"
    mapped = limit_map(map_forked, lambda: not over.exists())

    def last(number: int) -> int:
        (tmp_path / str(number)).touch()
        while not (tmp_path / str(1 - number)).exists():
            time.sleep(0.001)
        over.touch()
        return number

    assert list(mapped(last, [0, 1])) == [0, 1]
    with pytest.raises(OutOfTimeError):
        mapped(abs, [2])


def test_processor_time_of_processes_counts():
    def busy(_: int) -> None:
        until = time.process_time() + 0.1
        while time.process_time() < until:
            pass

    before = measure_processor_s()
    map_forked(busy, range(4))
    assert measure_processor_s() - before > 0.35
