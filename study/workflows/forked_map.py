"""`map` over forked processes, for work in Python code, where threads would wait for the global interpreter lock.

A forked process inherits all data; results return through a pipe. The workers and the calling process take tasks one
after another from a shared pipe of tokens until it is empty (dynamic scheduling). Nested calls run serially.

Forking is safe together with numba here: no kernel has `parallel=True` or `prange`, so numba starts no threads whose
locks a forked process would inherit.
"""

import io
import os
import pickle
import signal
import sys
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from functools import partial
from inspect import unwrap
from time import perf_counter, process_time
from types import CodeType
from typing import Any, TypeVar

from equalizer.effects.effect import Effect, effects_by_address

Result = TypeVar("Result")
WORTH_S = 0.1
"""Work that is expected to take less than this (s) is done without forking, which alone costs a fifth of this time."""
_TOKEN, _MOST_TOKENS = 4, 8192
"""Bytes of a token, the number of the first of some tasks; largest number of tokens that the pipe holds."""
_SIGNALS = tuple(getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name))
"""Signals whose handlers may raise an exception at any point of the program."""
_mean_s: dict[CodeType | type, float] = {}
"""Mean duration of a task (s) the last time each function was mapped."""
_lost: set[CodeType | type] = set()
"""Functions whose results could not be pickled, or whose process died: they are not forked again."""
_spent_s = [0.0]
"""Processor time (s) that the parent processes had used when this process was forked."""
_serial_context: list[bool] = []
"""Not empty within a task, where no further processes are started."""


def processor_s() -> float:
    """Processor time of this work (s): of this process, its ended children, and its parents before the fork."""
    ended = os.times()
    return _spent_s[0] + process_time() + ended.children_user + ended.children_system


def cores() -> int:
    """Number of processors that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def map_forked(function: Callable[..., Result], *items: Iterable[Any], workers: int | None = None) -> list[Result]:
    """Parallel `map` in forked processes, with results in the order of the items. workers: number of processes with
    this one; None = `cores()`. An exception of `function` is raised here; no process is left running."""
    tasks = list(zip(*items, strict=True))
    count = min(len(tasks), workers or cores())
    key = _key(function)
    # On macOS system libraries start threads, after which forking is not safe.
    can_fork = count > 1 and not _serial_context and sys.platform != "darwin" and hasattr(os, "fork")
    if can_fork and key not in _lost and _mean_s.get(key, WORTH_S) * len(tasks) >= WORTH_S:
        return _Shared(function, tasks).run_with_workers(count - 1)
    begun_s = perf_counter()
    results = [function(*task) for task in tasks]
    if tasks:
        _mean_s[key] = (perf_counter() - begun_s) / len(tasks)
    return results


@contextmanager
def without_forking() -> Iterator[None]:
    """Context in which nothing is forked, for workers that already share the processors with others. Results do not
    change."""
    _serial_context.append(True)
    try:
        yield
    finally:
        _serial_context.pop()


class _Shared:
    """Tasks that several processes take one after another, by tokens in a pipe."""

    def __init__(self, function: Callable[..., Any], tasks: Sequence[tuple[Any, ...]]) -> None:
        self._function, self._tasks = function, tasks
        self._known_effects = effects_by_address()
        self._stride = -(-len(tasks) // _MOST_TOKENS)
        self._tokens, end = os.pipe()
        for first in range(0, len(tasks), self._stride):
            os.write(end, first.to_bytes(_TOKEN, "little"))
        os.close(end)

    def run_with_workers(self, worker_count: int) -> list[Any]:
        """All results, in order, computed with so many further processes. On any exception the processes are killed."""
        children: list[tuple[int, int]] = []
        try:
            while len(children) < worker_count and self._fork_worker(children):
                pass
            with without_forking():
                results_by_task = self._process_tasks(guarded=False)
            while children:
                results_by_task.update(_receive(children[0][1], self._known_effects))
                with _hold_signals():
                    _reap(*children.pop(0))
        finally:
            with _hold_signals():
                os.close(self._tokens)
                for process, answers in children:
                    with suppress(ProcessLookupError):
                        os.kill(process, signal.SIGKILL)
                    _reap(process, answers)
        return self._in_order(results_by_task)

    def _in_order(self, results_by_task: dict[int, tuple[Any, Exception | None]]) -> list[Any]:
        """The results in the order of the tasks. Raises the error of the first task that failed."""
        results = []
        for number, task in enumerate(self._tasks):
            if number not in results_by_task:
                # Results that a process could not send, or tasks at which it died, are computed here.
                _lost.add(_key(self._function))
                results_by_task[number] = self._function(*task), None
            result, error = results_by_task[number]
            if error is not None:
                raise error
            results.append(result)
        return results

    def _fork_worker(self, children: list[tuple[int, int]]) -> bool:
        """Start a process and append it with its pipe to `children`; False if the system refuses."""
        spent_s, parent = processor_s(), os.getpid()
        # Signals wait: an exception here would leave a process that is not in `children`, or would let the child return
        # from this function and continue the work of its parent.
        with _hold_signals():
            answers, end = os.pipe()
            try:
                with warnings.catch_warnings():
                    # Python warns of other threads, for whose locks the child might wait. The child only computes and
                    # exits without clean-up, so that it takes no such lock.
                    warnings.simplefilter("ignore", DeprecationWarning)
                    process = os.fork()
            except OSError:
                os.close(answers)
                os.close(end)
                return False
            if not process:
                try:
                    # With a reading end open here, writing results would block for ever after the parent has ended.
                    for pipe_end in (answers, *(earlier_pipe for _, earlier_pipe in children)):
                        os.close(pipe_end)
                    self._work_there(end, parent, spent_s)
                finally:
                    os._exit(0)
            children.append((process, answers))
            os.close(end)
        return True

    def _work_there(self, end: int, parent: int, spent_s: float) -> None:
        """In the child: take tasks and write their results to the pipe `end`. parent: its process identifier."""
        # A terminal sends Ctrl-C to all processes; the child ignores it, and its parent ends it.
        for number in _SIGNALS:
            signal.signal(number, signal.SIG_IGN if number == signal.SIGINT else signal.SIG_DFL)
        signal.pthread_sigmask(signal.SIG_UNBLOCK, _SIGNALS)
        _serial_context.append(True)
        _spent_s[0] = spent_s
        packed_results = _pack(self._process_tasks(guarded=True, parent=parent), self._known_effects)
        with os.fdopen(end, "wb") as pipe:
            pipe.write(packed_results)

    def _process_tasks(self, guarded: bool, parent: int = 0) -> dict[int, tuple[Any, Exception | None]]:
        """Results and errors by the number of the task, until no token is left. guarded (in a child): an error is kept
        as a result and ends the work of this process, and so does the end of the parent; else it is raised."""
        results_by_task: dict[int, tuple[Any, Exception | None]] = {}
        begun_s = perf_counter()
        while token := os.read(self._tokens, _TOKEN):
            first = int.from_bytes(token, "little")
            for number in range(first, min(first + self._stride, len(self._tasks))):
                if guarded and os.getppid() != parent:
                    return {}
                try:
                    results_by_task[number] = self._function(*self._tasks[number]), None
                except Exception as error:
                    if not guarded:
                        raise
                    results_by_task[number] = None, error
                    return results_by_task
        if results_by_task:
            _mean_s[_key(self._function)] = (perf_counter() - begun_s) / len(results_by_task)
        return results_by_task


@contextmanager
def _hold_signals() -> Iterator[None]:
    """Context in which `_SIGNALS` are blocked; they are delivered after it."""
    previous_mask = signal.pthread_sigmask(signal.SIG_BLOCK, _SIGNALS)
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, previous_mask)


def _reap(process: int, answers: int) -> None:
    """Close the pipe of a child and wait for its end, so that it does not remain as a zombie."""
    os.close(answers)
    with suppress(ChildProcessError):
        os.waitpid(process, 0)


def _key(function: Callable[..., Any]) -> CodeType | type:
    """Identifier of a function that is the same for closures and partial functions created anew for each map."""
    unwrapped = unwrap(function)
    while isinstance(unwrapped, partial):
        unwrapped = unwrap(unwrapped.func)
    return unwrapped if isinstance(unwrapped, type) else getattr(unwrapped, "__code__", type(unwrapped))


class _Pickler(pickle.Pickler):
    """Pickler that sends effects by their address, which is the same in a forked process. Raises PicklingError for an
    effect that was not known before the fork."""

    def __init__(self, file: io.BytesIO, known_effects: Mapping[int, Effect]) -> None:
        super().__init__(file, pickle.HIGHEST_PROTOCOL)
        self._known_effects = known_effects

    def persistent_id(self, obj: object) -> int | None:
        if not isinstance(obj, Effect):
            return None
        if id(obj) not in self._known_effects:
            raise pickle.PicklingError(obj.name)
        return id(obj)


class _Unpickler(pickle.Unpickler):
    """Unpickler that finds effects by their address."""

    def __init__(self, file: io.BytesIO, known_effects: Mapping[int, Effect]) -> None:
        super().__init__(file)
        self._known_effects = known_effects

    def persistent_load(self, pid: int) -> Effect:
        return self._known_effects[pid]


def _pack(results_by_task: dict[int, tuple[Any, Exception | None]], known_effects: Mapping[int, Effect]) -> bytes:
    """The results pickled separately; those that cannot be pickled are left out, and the parent computes them."""
    packed_results = io.BytesIO()
    for number, answer in results_by_task.items():
        buffer = io.BytesIO()
        try:
            _Pickler(buffer, known_effects).dump((number, answer))
        except (pickle.PicklingError, TypeError, AttributeError, ValueError):
            continue
        packed_results.write(buffer.getbuffer())
    return packed_results.getvalue()


def _receive(answers: int, known_effects: Mapping[int, Effect]) -> dict[int, tuple[Any, Exception | None]]:
    """Results of a child, by the number of the task, up to the first that is incomplete."""
    with os.fdopen(answers, "rb", closefd=False) as pipe:
        received = io.BytesIO(pipe.read())
    results_by_task: dict[int, tuple[Any, Exception | None]] = {}
    while received.tell() < len(received.getbuffer()):
        try:
            number, answer = _Unpickler(received, known_effects).load()
        except (pickle.UnpicklingError, EOFError):
            break
        results_by_task[number] = answer
    return results_by_task
