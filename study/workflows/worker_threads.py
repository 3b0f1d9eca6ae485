"""Work in parallel that may be left at any time: compiled code lets other threads run meanwhile."""

import os
import threading
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from queue import SimpleQueue
from typing import Any, Generic, TypeVar

Result = TypeVar("Result")


@dataclass(slots=True)
class _Job(Generic[Result]):
    work: Callable[[], Result]
    done: threading.Event = field(default_factory=threading.Event)
    result: list[Result] = field(default_factory=list)
    error: BaseException | None = None

    def run(self) -> None:
        try:
            self.result.append(self.work())
        except BaseException as error:  # noqa: BLE001 - raised again where the result is asked for
            self.error = error
        finally:
            self.done.set()


class WorkerThreads:
    """Daemons: leaving does not wait for work that is half done, and neither does the end of the program. A
    pool of `concurrent.futures` would be waited for."""

    def __init__(self, workers: int) -> None:
        self._jobs: SimpleQueue[_Job[Any] | None] = SimpleQueue()
        self._left = False
        self._within = threading.local()
        self._threads = [threading.Thread(target=self._work, name="worker", daemon=True) for _ in range(workers)]
        for thread in self._threads:
            thread.start()

    def map(self, function: Callable[..., Result], *items: Iterable[Any]) -> Sequence[Result]:
        """As `map`, in the same order. From within a worker it is done there: all others may be waiting for it."""
        if len(self._threads) < 2 or getattr(self._within, "worker", False):
            return list(map(function, *items))
        jobs: list[_Job[Result]] = [_Job(_bound(function, each)) for each in zip(*items, strict=True)]
        for job in jobs:
            self._jobs.put(job)
        try:
            return [_result(job) for job in jobs]
        except BaseException:
            self._forget()
            raise

    def leave(self) -> None:
        """Nothing is begun any more; what is being worked on is not waited for."""
        self._left = True
        for _ in self._threads:
            self._jobs.put(None)

    def _forget(self) -> None:
        while not self._jobs.empty():
            self._jobs.get()

    def _work(self) -> None:
        self._within.worker = True
        while (job := self._jobs.get()) is not None and not self._left:
            job.run()


def _bound(function: Callable[..., Result], arguments: tuple[Any, ...]) -> Callable[[], Result]:
    return lambda: function(*arguments)


def _result(job: _Job[Result]) -> Result:
    job.done.wait()
    if job.error is not None:
        raise job.error
    return job.result[0]


@contextmanager
def worker_threads(workers: int | None = None) -> Iterator[WorkerThreads]:
    """workers: as many as this process may use cores, where nothing else is said."""
    threads = WorkerThreads(workers or _cores())
    try:
        yield threads
    finally:
        threads.leave()


def _cores() -> int:
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1
