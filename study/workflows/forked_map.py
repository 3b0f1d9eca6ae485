"""`map` over forked processes: a search hands compiled code little and Python much, so threads would wait for its lock.

A forked process has all that its work refers to, with nothing to be sent; results come back through a pipe. It takes
the next piece whenever it is done with one, and so does the process that forked it. Work within work is done there.
"""

import io
import os
import pickle
import signal
import sys
import warnings
from collections.abc import Callable, Iterable, Sequence
from functools import cache
from inspect import unwrap
from time import perf_counter, process_time
from types import CodeType
from typing import Any, TypeVar

from equalizer.effects.catalogue import CATALOGUE
from equalizer.effects.effect import Effect

Result = TypeVar("Result")
WORTH_S = 0.1
"""Work that is shorter, as it was the last time, is done without forking: that takes a fifth of it."""
_TOKEN, _MOST_TOKENS = 4, 8192
"""Bytes of a token in the pipe that pieces are taken from; and so many fit into it."""
_mean_s: dict[CodeType, float] = {}
_spent_s = [0.0]
"""By the processes that this one was forked from, until then."""
_within: list[bool] = []


def processor_s() -> float:
    """Processor time of this work, in all processes that have ended and this one."""
    ended = os.times()
    return _spent_s[0] + process_time() + ended.children_user + ended.children_system


def cores() -> int:
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def forked_map(function: Callable[..., Result], *items: Iterable[Any], workers: int | None = None) -> list[Result]:
    """As `map`, in the same order. What raises there raises here; left early, no process stays behind."""
    pieces = list(zip(*items, strict=True))
    count = min(len(pieces), workers or cores())
    known_s = _mean_s.get(_code(function), WORTH_S)
    # macOS does not allow what its libraries start to be forked.
    if count < 2 or _within or sys.platform == "darwin" or not hasattr(os, "fork") or known_s * len(pieces) < WORTH_S:
        return [function(*piece) for piece in pieces]
    return _Shared(function, pieces).with_others(count - 1)


class _Shared:
    """Pieces of work that several processes take one after the other."""

    def __init__(self, function: Callable[..., Any], pieces: Sequence[tuple[Any, ...]]) -> None:
        self._function, self._pieces = function, pieces
        self._stride = -(-len(pieces) // _MOST_TOKENS)
        self._tokens, end = os.pipe()
        for first in range(0, len(pieces), self._stride):
            os.write(end, first.to_bytes(_TOKEN, "little"))
        os.close(end)

    def with_others(self, others: int) -> list[Any]:
        children: list[tuple[int, int]] = []
        try:
            for _ in range(others):
                children.append(self._forked())
            _within.append(True)
            try:
                found = self._taken(guarded=False)
            finally:
                _within.pop()
            while children:
                process, answers = children[0]
                found.update(_received(answers))
                os.waitpid(process, 0)
                del children[0]
                os.close(answers)
        finally:
            os.close(self._tokens)
            for process, answers in children:
                os.close(answers)
                os.kill(process, signal.SIGKILL)
                os.waitpid(process, 0)
        results = []
        for number, piece in enumerate(self._pieces):
            # What a process could not send, or died of, is done here.
            result, error = found[number] if number in found else (self._function(*piece), None)
            if error is not None:
                raise error
            results.append(result)
        return results

    def _forked(self) -> tuple[int, int]:
        """Its process, and where its answers come from."""
        spent_s = processor_s()
        answers, end = os.pipe()
        parent = os.getpid()
        with warnings.catch_warnings():
            # Of other threads, whose locks it might wait for: it computes, and leaves without cleaning up.
            warnings.simplefilter("ignore", DeprecationWarning)
            process = os.fork()
        if process:
            os.close(end)
            return process, answers
        try:
            # A terminal sends Ctrl-C to all; who forked this one ends it.
            for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
                signal.signal(number, signal.SIG_IGN if number == signal.SIGINT else signal.SIG_DFL)
            _within.append(True)
            _spent_s[0] = spent_s
            sent = _packed(self._taken(guarded=True, parent=parent))
            with os.fdopen(end, "wb") as pipe:
                pipe.write(sent)
        finally:
            os._exit(0)

    def _taken(self, guarded: bool, parent: int = 0) -> dict[int, tuple[Any, Exception | None]]:
        """Results and errors, by number. guarded: an error is kept, and ends this share of the work."""
        found: dict[int, tuple[Any, Exception | None]] = {}
        code, begun_s = _code(self._function), perf_counter()
        while token := os.read(self._tokens, _TOKEN):
            first = int.from_bytes(token, "little")
            for number in range(first, min(first + self._stride, len(self._pieces))):
                if guarded and os.getppid() != parent:
                    return {}
                try:
                    found[number] = self._function(*self._pieces[number]), None
                except Exception as error:
                    if not guarded:
                        raise
                    found[number] = None, error
                    return found
        if found:
            _mean_s[code] = (perf_counter() - begun_s) / len(found)
        return found


def _code(function: Callable[..., Any]) -> CodeType:
    return getattr(unwrap(function), "__code__", _code.__code__)


@cache
def _known() -> dict[int, Effect]:
    """Effects stay what they are, however often they are sent: a forked process has them at the same addresses."""
    return {id(effect): effect for effect in CATALOGUE}


class _Pickler(pickle.Pickler):
    def persistent_id(self, obj: object) -> int | None:
        if not isinstance(obj, Effect):
            return None
        if id(obj) not in _known():
            raise pickle.PicklingError(obj.name)
        return id(obj)


class _Unpickler(pickle.Unpickler):
    def persistent_load(self, pid: int) -> Effect:
        return _known()[pid]


def _packed(found: dict[int, tuple[Any, Exception | None]]) -> bytes:
    """One after the other; what cannot be sent is left out."""
    whole = io.BytesIO()
    for number, answer in found.items():
        each = io.BytesIO()
        try:
            _Pickler(each, pickle.HIGHEST_PROTOCOL).dump((number, answer))
        except (pickle.PicklingError, TypeError, AttributeError, ValueError):
            continue
        whole.write(each.getbuffer())
    return whole.getvalue()


def _received(answers: int) -> dict[int, tuple[Any, Exception | None]]:
    with os.fdopen(answers, "rb", closefd=False) as pipe:
        sent = io.BytesIO(pipe.read())
    found: dict[int, tuple[Any, Exception | None]] = {}
    while sent.tell() < len(sent.getbuffer()):
        try:
            number, answer = _Unpickler(sent).load()
        except (pickle.UnpicklingError, EOFError):
            break
        found[number] = answer
    return found
