"""Calls of C functions (system, device libraries) from numba code without the interpreter lock: clock, sleep, lock.

A function is given by its address, in an array of int64. Arguments are int32, int64 (also addresses) and float64; on
64-bit computers these are passed as C expects char, int, pointers and double.
"""

import ctypes
import sys
import time
from typing import Any

import numpy as np
import numpy.typing as npt
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

from study.devices.governor.compiling import njit_inline

Addresses = npt.NDArray[np.int64]
"""Addresses of C functions and objects, as 64-bit integers."""

CLOCK, SLEEP, MONOTONIC, ACQUIRE, RELEASE, LOCK, SYSTEM_SIZE = range(7)
"""Indices into `collect_system_calls`: clock_gettime, clock_nanosleep, Python's `time.monotonic`, the functions of
PyThread that acquire (timeout in µs) and release a lock, and the lock; SYSTEM_SIZE is their number. CLOCK and SLEEP are
0 except on Linux with its usual monotonic clock."""

_intrinsic: Any = intrinsic
"""numba's decorator `intrinsic` and module `cgutils` as `Any`, because numba declares no types for them."""
_cgutils: Any = cgutils

_CLOCK_MONOTONIC, _TIMER_ABSTIME, _INTERRUPTED = 1, 1, 4
"""Constants of Linux: CLOCK_MONOTONIC and TIMER_ABSTIME (time.h), EINTR (errno.h)."""


def _make_caller(result_type: Any) -> Any:
    """Make a numba function call(address, arguments) that calls the C function at an address. result_type: numba type
    of its return value; arguments: a tuple."""

    @_intrinsic
    def call(context: Any, address: Any, arguments: Any) -> Any:
        """Signature, and code that converts the address to a function pointer and calls it."""

        def generate_code(_context: Any, builder: Any, signature: Any, values: Any) -> Any:
            c_arguments = _cgutils.unpack_tuple(builder, values[1])
            function_type = ir.FunctionType(
                _context.get_value_type(result_type), [argument.type for argument in c_arguments]
            )
            return builder.call(builder.inttoptr(values[0], function_type.as_pointer()), c_arguments)

        return result_type(types.int64, arguments), generate_code

    return call


call_int = _make_caller(types.int32)
"""call_int(address, arguments): call a C function that returns an int, or nothing (the value is then meaningless)."""
call_float = _make_caller(types.float64)
"""call_float(address, arguments): call a C function that returns a double."""


def _make_stack_allocator(word_count: int) -> Any:
    """Make a numba function that allocates `word_count` words of 8 bytes on the stack and returns their address."""

    @_intrinsic
    def allocate(context: Any) -> Any:
        """Signature, and code that allocates the zeroed words."""

        def generate_code(_context: Any, builder: Any, signature: Any, values: Any) -> Any:
            pointer = _cgutils.alloca_once(builder, ir.ArrayType(ir.IntType(64), word_count), zfill=True)
            return builder.ptrtoint(pointer, ir.IntType(64))

        return types.int64(), generate_code

    return allocate


allocate_2_words, allocate_16_words = _make_stack_allocator(2), _make_stack_allocator(16)
"""Return the address of 2 or 16 words of 8 bytes on the stack of the calling function: zero after each such call, and
invalid after the end of that function."""


@_intrinsic
def read_word(context: Any, address: Any, index: Any) -> Any:
    """Read the 64-bit word with index `index` of an array at `address`."""

    def generate_code(_context: Any, builder: Any, signature: Any, values: Any) -> Any:
        start = builder.inttoptr(values[0], ir.IntType(64).as_pointer())
        return builder.load(builder.gep(start, [values[1]]))

    return types.int64(types.int64, types.int64), generate_code


@_intrinsic
def write_word(context: Any, address: Any, index: Any, value: Any) -> Any:
    """Write the 64-bit word with index `index` of an array at `address`."""

    def generate_code(_context: Any, builder: Any, signature: Any, values: Any) -> Any:
        start = builder.inttoptr(values[0], ir.IntType(64).as_pointer())
        builder.store(values[2], builder.gep(start, [values[1]]))
        return _context.get_dummy_value()

    return types.void(types.int64, types.int64, types.int64), generate_code


@njit_inline
def read_clock_s(system: Addresses) -> float:
    """Monotonic time (s), bit for bit equal to `time.monotonic`."""
    if system[CLOCK] == 0:
        return float(call_float(system[MONOTONIC], ()))
    timespec = allocate_2_words()
    call_int(system[CLOCK], (np.int32(_CLOCK_MONOTONIC), timespec))
    seconds, nanoseconds = read_word(timespec, 0), read_word(timespec, 1)
    if nanoseconds == 0:
        return float(seconds)
    return float(seconds * 1_000_000_000 + nanoseconds) / 1e9


@njit_inline
def sleep_until(system: Addresses, wake_time_s: float) -> None:
    """Sleep until wake_time_s (s, by `read_clock_s`); resumed after interruptions by signals. To be called only where
    `system[SLEEP]` is not 0."""
    timespec = allocate_2_words()
    whole_seconds = int(wake_time_s)
    write_word(timespec, 0, whole_seconds)
    write_word(timespec, 1, int((wake_time_s - whole_seconds) * 1e9))
    arguments = (np.int32(_CLOCK_MONOTONIC), np.int32(_TIMER_ABSTIME), timespec, np.int64(0))
    while call_int(system[SLEEP], arguments) == _INTERRUPTED:
        pass


@njit_inline
def acquire(system: Addresses, timeout_s: float) -> bool:
    """Take the lock at `system[LOCK]`. Returns False where it was not free within timeout_s (s)."""
    arguments = (system[LOCK], np.int64(timeout_s * 1e6), np.int32(0))
    return bool(call_int(system[ACQUIRE], arguments) == 1)


@njit_inline
def release(system: Addresses) -> None:
    """Release the lock at `system[LOCK]`."""
    call_int(system[RELEASE], (system[LOCK],))


class SharedLock:
    """A lock for Python and compiled code: a PyThread lock of CPython's C interface, whose functions do not need the
    interpreter lock. Its memory is never freed, because a call that hangs may still use it."""

    def __init__(self) -> None:
        interpreter = ctypes.pythonapi
        interpreter.PyThread_allocate_lock.restype = ctypes.c_void_p
        self.address = int(interpreter.PyThread_allocate_lock())
        # As CFUNCTYPE functions, which release the interpreter lock while they wait, unlike those of `pythonapi`.
        acquire_type = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_void_p, ctypes.c_longlong, ctypes.c_int)
        self._acquire = acquire_type(find_address(interpreter.PyThread_acquire_lock_timed))
        self._release = ctypes.CFUNCTYPE(None, ctypes.c_void_p)(find_address(interpreter.PyThread_release_lock))

    def acquire(self, timeout_s: float) -> bool:
        """Take the lock. Returns False where it was not free within timeout_s (s)."""
        return bool(self._acquire(self.address, int(timeout_s * 1e6), 0) == 1)

    def release(self) -> None:
        """Release the lock; may be called from any thread, but only while the lock is held."""
        self._release(self.address)

    def __enter__(self) -> None:
        self._acquire(self.address, -1, 0)

    def __exit__(self, *_: object) -> None:
        self.release()


_MONOTONIC_CLOCK = ctypes.CFUNCTYPE(ctypes.c_double)(time.monotonic)
"""Clock for systems whose own is not used: `time.monotonic` as a C function, which takes the interpreter lock."""


def find_address(function: Any) -> int:
    """Find the address of a function of a loaded library; 0 for a null pointer."""
    return int(ctypes.cast(function, ctypes.c_void_p).value or 0)


def collect_system_calls(lock: SharedLock) -> Addresses:
    """Collect the addresses (SYSTEM_SIZE,) of the functions for clock, sleep and lock, and of the lock itself, for
    compiled code."""
    addresses = np.zeros(SYSTEM_SIZE, dtype=np.int64)
    addresses[MONOTONIC] = find_address(_MONOTONIC_CLOCK)
    if sys.platform == "linux" and time.get_clock_info("monotonic").implementation == "clock_gettime(CLOCK_MONOTONIC)":
        system = ctypes.CDLL(None)
        addresses[CLOCK], addresses[SLEEP] = find_address(system.clock_gettime), find_address(system.clock_nanosleep)
    addresses[ACQUIRE] = find_address(ctypes.pythonapi.PyThread_acquire_lock_timed)
    addresses[RELEASE] = find_address(ctypes.pythonapi.PyThread_release_lock)
    addresses[LOCK] = lock.address
    return addresses
