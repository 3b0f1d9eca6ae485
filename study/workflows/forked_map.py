"""Parallel `map` over forked processes, for work in Python code, where threads would wait for the global interpreter
lock.

A forked process inherits all data; results return through a pipe. The worker processes and the calling process take
tasks one after another from a shared pipe of tokens until it is empty (dynamic scheduling). Nested calls run serially.

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

from equalizer.effects.effect import Effect, list_effects_by_address

Result = TypeVar("Result")
"""Type of the result of a task."""
MIN_FORKED_WORK_S = 0.1
"""Shortest expected duration (s) of the work that is shared among processes; forking alone takes a fifth. Chosen."""
_TOKEN_BYTES, _MAX_TOKENS = 4, 8192
"""Bytes of a token; largest number of tokens written to the pipe, which they must not fill: 32 KiB of the 64 KiB of a
pipe of Linux."""
_SIGNALS = tuple(getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name))
"""Signals whose handlers may raise an exception at any point of the program."""
_mean_task_s: dict[CodeType | type, float] = {}
"""Mean duration of a task (s) in the last map of each function, by `_identify_function`."""
_unforkable: set[CodeType | type] = set()
"""Functions whose results could not be pickled, or whose process died: they are not forked again."""
_inherited_processor_s = [0.0]
"""Processor time (s) that the parent processes had used when this process was forked."""
_PICKLING_ERRORS = (pickle.PickleError, EOFError, AttributeError, LookupError, RuntimeError, TypeError, ValueError)
"""Errors where an object cannot be pickled (RuntimeError: nested too deeply) or restored (EOFError: incomplete;
TypeError: an exception whose constructor needs other arguments than its message)."""
_serial_context: list[bool] = []
"""Not empty within a task or `disable_forking`, where no further processes are started."""


def measure_processor_s() -> float:
    """Measure the processor time (s) used by this process, its ended children, and its parents before the fork."""
    ended_children = os.times()
    return _inherited_processor_s[0] + process_time() + ended_children.children_user + ended_children.children_system


def count_cores() -> int:
    """Count the processors that this process may use; 1 where the system does not state it."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def map_forked(function: Callable[..., Result], *items: Iterable[Any], workers: int | None = None) -> list[Result]:
    """Map in forked processes, serially where that is impossible or not worthwhile; results in the order of the items.
    items: iterables of equal length, the arguments of `function`. workers: number of processes including this one; None
    = `count_cores()`. An exception of `function` is raised here; no process is left running."""
    tasks = list(zip(*items, strict=True))
    process_count = min(len(tasks), workers or count_cores())
    function_key = _identify_function(function)
    # On macOS system libraries start threads, after which forking is not safe.
    can_fork = process_count > 1 and not _serial_context and sys.platform != "darwin" and hasattr(os, "fork")
    expected_s = _mean_task_s.get(function_key, MIN_FORKED_WORK_S) * len(tasks)
    if can_fork and function_key not in _unforkable and expected_s >= MIN_FORKED_WORK_S:
        try:
            shared_tasks = _SharedTasks(function, tasks)
        except OSError:  # too many open files for another pipe: the tasks are done serially
            pass
        else:
            return shared_tasks.run_with_workers(process_count - 1)
    start_s = perf_counter()
    results = [function(*task) for task in tasks]
    if tasks:
        _mean_task_s[function_key] = (perf_counter() - start_s) / len(tasks)
    return results


@contextmanager
def disable_forking() -> Iterator[None]:
    """Disable forking within this context, for processes that share the processors. The results are the same."""
    _serial_context.append(True)
    try:
        yield
    finally:
        _serial_context.pop()


class _SharedTasks:
    """Tasks that several processes take one after another, by tokens in a pipe. A token is the index of the first task
    of a group of `_stride` tasks."""

    def __init__(self, function: Callable[..., Any], tasks: Sequence[tuple[Any, ...]]) -> None:
        """Write the tokens to the pipe. tasks: arguments of each call of `function`."""
        self._function, self._tasks = function, tasks
        self._known_effects = list_effects_by_address()
        self._stride = -(-len(tasks) // _MAX_TOKENS)
        self._token_pipe, write_end = os.pipe()
        for first_index in range(0, len(tasks), self._stride):
            os.write(write_end, first_index.to_bytes(_TOKEN_BYTES, "little"))
        os.close(write_end)

    def run_with_workers(self, worker_count: int) -> list[Any]:
        """Compute all results, in the order of the tasks, by this process and `worker_count` forked ones. On any
        exception the forked processes are killed."""
        children: list[tuple[int, int]] = []
        try:
            while len(children) < worker_count and self._fork_worker(children):
                pass
            with disable_forking():
                results_by_task = self._run_tasks(guarded=False)
            while children:
                results_by_task.update(_receive_results(children[0][1], self._known_effects))
                with _block_signals():
                    _reap_child(*children.pop(0))
        finally:
            with _block_signals():
                os.close(self._token_pipe)
                for process_id, read_end in children:
                    with suppress(ProcessLookupError):
                        os.kill(process_id, signal.SIGKILL)
                    _reap_child(process_id, read_end)
        return self._order_results(results_by_task)

    def _order_results(self, results_by_task: dict[int, tuple[Any, Exception | None]]) -> list[Any]:
        """Order the results by their tasks. Tasks without a result, at which a process died or whose result it could
        not send, are computed here. Raises the error of the first task that failed."""
        results = []
        for index, task in enumerate(self._tasks):
            if index not in results_by_task:
                _unforkable.add(_identify_function(self._function))
                results_by_task[index] = self._function(*task), None
            result, error = results_by_task[index]
            if error is not None:
                raise error
            results.append(result)
        return results

    def _fork_worker(self, children: list[tuple[int, int]]) -> bool:
        """Start a process and append (process id, reading end of its pipe) to `children`; False if the system refuses
        the pipe or the fork."""
        processor_s, parent_id = measure_processor_s(), os.getpid()
        # Signals wait: an exception here would leave a process that is not in `children`, or would let the child return
        # from this function and continue the work of its parent.
        with _block_signals():
            try:
                read_end, write_end = os.pipe()
            except OSError:  # too many open files
                return False
            try:
                with warnings.catch_warnings():
                    # Python warns of other threads, for whose locks the child might wait. The child only computes and
                    # exits without clean-up, so that it takes no such lock.
                    warnings.simplefilter("ignore", DeprecationWarning)
                    process_id = os.fork()
            except OSError:
                os.close(read_end)
                os.close(write_end)
                return False
            if not process_id:
                try:
                    # With a reading end open here, writing results would block forever after the parent has ended.
                    for pipe_end in (read_end, *(earlier_pipe for _, earlier_pipe in children)):
                        os.close(pipe_end)
                    self._run_child(write_end, parent_id, processor_s)
                finally:
                    os._exit(0)
            children.append((process_id, read_end))
            os.close(write_end)
        return True

    def _run_child(self, write_end: int, parent_id: int, parent_processor_s: float) -> None:
        """Run in the child process: take tasks and write their results to the pipe. write_end: its descriptor.
        parent_id: process id of the parent. parent_processor_s: processor time (s) used before the fork."""
        # A terminal sends Ctrl-C to all processes; the child ignores it, and its parent ends it.
        for signal_number in _SIGNALS:
            signal.signal(signal_number, signal.SIG_IGN if signal_number == signal.SIGINT else signal.SIG_DFL)
        signal.pthread_sigmask(signal.SIG_UNBLOCK, _SIGNALS)
        _serial_context.append(True)
        _inherited_processor_s[0] = parent_processor_s
        packed_results = _pack_results(self._run_tasks(guarded=True, parent_id=parent_id), self._known_effects)
        with os.fdopen(write_end, "wb") as pipe:
            pipe.write(packed_results)

    def _run_tasks(self, guarded: bool, parent_id: int = 0) -> dict[int, tuple[Any, Exception | None]]:
        """Take tasks until no token is left; returns (result, error) by the index of the task. guarded (in a child): an
        error is stored as a result and ends the work of this process; the end of the parent ends it without results.
        Not guarded: an error is raised."""
        results_by_task: dict[int, tuple[Any, Exception | None]] = {}
        start_s = perf_counter()
        while token := os.read(self._token_pipe, _TOKEN_BYTES):
            first_index = int.from_bytes(token, "little")
            for index in range(first_index, min(first_index + self._stride, len(self._tasks))):
                if guarded and os.getppid() != parent_id:
                    return {}
                try:
                    results_by_task[index] = self._function(*self._tasks[index]), None
                except Exception as error:
                    if not guarded:
                        raise
                    results_by_task[index] = None, error
                    return results_by_task
        if results_by_task:
            _mean_task_s[_identify_function(self._function)] = (perf_counter() - start_s) / len(results_by_task)
        return results_by_task


@contextmanager
def _block_signals() -> Iterator[None]:
    """Block `_SIGNALS` within this context; they are delivered after it."""
    previous_mask = signal.pthread_sigmask(signal.SIG_BLOCK, _SIGNALS)
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, previous_mask)


def _reap_child(process_id: int, read_end: int) -> None:
    """Close the pipe of a child and wait for the end of its process, so that it does not remain as a zombie."""
    os.close(read_end)
    with suppress(ChildProcessError):
        os.waitpid(process_id, 0)


def _identify_function(function: Callable[..., Any]) -> CodeType | type:
    """Identify a function by its key in `_mean_task_s` and `_unforkable`: its code object or class, the same for
    closures and partial functions that are created anew for each map."""
    unwrapped = unwrap(function)
    while isinstance(unwrapped, partial):
        unwrapped = unwrap(unwrapped.func)
    return unwrapped if isinstance(unwrapped, type) else getattr(unwrapped, "__code__", type(unwrapped))


class _Pickler(pickle.Pickler):
    """Pickler that sends an effect as its address in memory, which is the same in a forked process. Raises
    PicklingError for an effect that was not known before the fork."""

    def __init__(self, file: io.BytesIO, known_effects: Mapping[int, Effect]) -> None:
        super().__init__(file, pickle.HIGHEST_PROTOCOL)
        self._known_effects = known_effects

    def persistent_id(self, obj: object) -> int | None:
        """Return the address of an effect; None for any other object, which is pickled as usual."""
        if not isinstance(obj, Effect):
            return None
        if id(obj) not in self._known_effects:
            raise pickle.PicklingError(obj.name)
        return id(obj)


class _Unpickler(pickle.Unpickler):
    """Unpickler that finds an effect by its address in memory."""

    def __init__(self, file: io.BytesIO, known_effects: Mapping[int, Effect]) -> None:
        super().__init__(file)
        self._known_effects = known_effects

    def persistent_load(self, pid: int) -> Effect:
        """Return the effect with the address `pid`."""
        return self._known_effects[pid]


def _pack_results(
    results_by_task: dict[int, tuple[Any, Exception | None]], known_effects: Mapping[int, Effect]
) -> bytes:
    """Pack the results of a child as bytes, each pickled separately. Results that cannot be pickled are omitted; the
    parent computes them again."""
    packed_results = io.BytesIO()
    for index, result_and_error in results_by_task.items():
        buffer = io.BytesIO()
        try:
            _Pickler(buffer, known_effects).dump((index, result_and_error))
        except _PICKLING_ERRORS:
            continue
        packed_results.write(buffer.getbuffer())
    return packed_results.getvalue()


def _receive_results(read_end: int, known_effects: Mapping[int, Effect]) -> dict[int, tuple[Any, Exception | None]]:
    """Receive the results of a child, by the index of the task, up to the first that cannot be restored.
    read_end: descriptor of its pipe."""
    with os.fdopen(read_end, "rb", closefd=False) as pipe:
        received_bytes = io.BytesIO(pipe.read())
    results_by_task: dict[int, tuple[Any, Exception | None]] = {}
    while received_bytes.tell() < len(received_bytes.getbuffer()):
        try:
            index, result_and_error = _Unpickler(received_bytes, known_effects).load()
        except _PICKLING_ERRORS:
            break
        results_by_task[index] = result_and_error
    return results_by_task
