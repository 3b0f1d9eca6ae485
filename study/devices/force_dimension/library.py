"""Bindings of Force Dimension's DHD functions by ctypes: loading, signatures, version, and error handling.

A return value that is no success becomes a `LibraryError` with the library's own text, if it gives one. The library
keeps its last error per thread, so that the text must be fetched at once, in the thread whose call failed. Loaded by
`connect.load_library`; `connect`, `handle` and `linkage` call the functions, `rig` passes the addresses of some to its
compiled ticks. Names, types and codes are those of the vendor's `dhdc.h`."""

import ctypes
from collections.abc import Callable
from ctypes import POINTER, c_byte, c_char_p, c_double, c_int, c_ubyte, c_uint, c_ushort
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from study.devices.native import find_address
from study.errors import DeviceError

OLDEST_SDK = (3, 16, 0)
"""Oldest version of the vendor's library that is accepted: it has all functions below, with these types."""

GEOMETRY_ERROR, DEVICE_IN_USE = 8, 20
"""Error codes of the library that callers handle in a particular way: position out of reach (`linkage`), device open in
another program (`connect`)."""

HIGHEST_NOTICE = 2
"""Highest return value that means success with a notice, from 1 on (`handle.REPEATED_READING`, `handle.SCALED_FORCE`).
The meaning of a higher value is not known, so it is treated as an error."""

RESULT_FUNCTIONS = ("dhdOpenID", "dhdGetSystemType")
"""Functions whose non-negative return value is the result itself, not a status."""

_ID, _DOUBLE, _DOUBLE_POINTER = c_byte, c_double, POINTER(c_double)
_VECTOR_POINTERS = (_DOUBLE_POINTER, _DOUBLE_POINTER, _DOUBLE_POINTER, _ID)
"""Argument types of functions that write a vector: pointers to x, y, z, then the device's ID."""

SIGNATURES: dict[str, tuple[Any, tuple[Any, ...]]] = {
    "dhdErrorGetLast": (c_int, ()),
    "dhdErrorGetLastStr": (c_char_p, ()),
    "dhdGetSDKVersion": (None, (POINTER(c_int),) * 4),
    "dhdGetDeviceCount": (c_int, ()),
    "dhdOpenID": (c_int, (_ID,)),
    "dhdClose": (c_int, (_ID,)),
    "dhdStop": (c_int, (_ID,)),
    "dhdGetSystemType": (c_int, (_ID,)),
    "dhdGetSystemName": (c_char_p, (_ID,)),
    "dhdGetSerialNumber": (c_int, (POINTER(c_ushort), _ID)),
    "dhdGetVersion": (c_int, (_DOUBLE_POINTER, _ID)),
    "dhdGetStatus": (c_int, (POINTER(c_int), _ID)),
    "dhdEnableForce": (c_int, (c_ubyte, _ID)),
    "dhdSetBrakes": (c_int, (c_int, _ID)),
    "dhdGetPosition": (c_int, _VECTOR_POINTERS),
    "dhdGetLinearVelocity": (c_int, _VECTOR_POINTERS),
    "dhdGetForce": (c_int, _VECTOR_POINTERS),
    "dhdSetForce": (c_int, (_DOUBLE, _DOUBLE, _DOUBLE, _ID)),
    "dhdGetButtonMask": (c_uint, (_ID,)),
    "dhdSetGravityCompensation": (c_int, (c_int, _ID)),
    "dhdSetEffectorMass": (c_int, (_DOUBLE, _ID)),
    "dhdSetMaxForce": (c_int, (_DOUBLE, _ID)),
    "dhdReset": (c_int, (_ID,)),
    "dhdWaitForReset": (c_int, (c_int, _ID)),
    "dhdEnableExpertMode": (c_int, ()),
    "dhdSetTimeGuard": (c_int, (c_int, _ID)),
    "dhdSetWatchdog": (c_int, (c_ubyte, _ID)),
    "dhdGetWatchdog": (c_int, (POINTER(c_ubyte), _ID)),
}
"""Types of result and arguments of each required function. The device's ID (`char`), where there is one, is the last
argument; C has no default for it."""

_THREE_NUMBERS, _THREE_COUNTS = (_DOUBLE,) * 3, (c_int,) * 3

LINKAGE_SIGNATURES: dict[str, tuple[Any, tuple[Any, ...]]] = {
    "dhdGetJointAngles": (c_int, (_DOUBLE_POINTER, _ID)),
    "dhdDeltaPositionToEncoder": (c_int, (*_THREE_NUMBERS, *(POINTER(c_int),) * 3, _ID)),
    "dhdDeltaEncoderToPosition": (c_int, (*_THREE_COUNTS, *_VECTOR_POINTERS)),
    "dhdDeltaEncodersToJointAngles": (c_int, (*_THREE_COUNTS, *_VECTOR_POINTERS)),
    "dhdDeltaJointAnglesToJacobian": (c_int, (*_THREE_NUMBERS, _DOUBLE_POINTER, _ID)),
    "dhdJointAnglesToInertiaMatrix": (c_int, (_DOUBLE_POINTER, _DOUBLE_POINTER, _ID)),
    "dhdJointAnglesToGravityJointTorques": (c_int, (_DOUBLE_POINTER, _DOUBLE_POINTER, c_ubyte, _ID)),
}
"""Types of result and arguments of functions that only the calibration of the linkage needs: a library without them can
still drive a device."""


class LibraryError(Exception):
    """A function of the library reported a failure: its name, the error code and the library's text."""

    def __init__(self, function: str, code: int, text: str) -> None:
        super().__init__(f"{function}: {text} (error {code})")
        self.function, self.code, self.text = function, code, text


class Library:
    """The loaded library; path: its file, version: major, minor, release, revision. The constructor raises
    `DeviceError` where it cannot be loaded, lacks a required function or is too old."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self._functions = _bind_functions(_load_shared_library(path), path)
        self.version = self._read_version()
        if self.version[:3] < OLDEST_SDK:
            raise _make_outdated_error(f"{path} is version {_format_version(self.version)}")

    @property
    def version_text(self) -> str:
        """Version of the vendor's SDK as text, such as "3.17.5.0"."""
        return _format_version(self.version)

    def get_function(self, name: str) -> Callable[..., Any]:
        """Get the bound function without error handling; its return value must be passed to `check_return_value`,
        unless it is no status. Raises `DeviceError` where the library lacks the function."""
        if name not in self._functions:
            raise _make_outdated_error(f"{self.path} has no {name}")
        return self._functions[name]

    def check_return_value(self, name: str, return_value: int) -> int:
        """Return `return_value`, which function `name` returned. Raises `LibraryError` where it is negative, or above
        `HIGHEST_NOTICE` (except for `RESULT_FUNCTIONS`). To be called in the thread of the call, see the module."""
        if 0 <= return_value <= HIGHEST_NOTICE or (return_value > 0 and name in RESULT_FUNCTIONS):
            return return_value
        raise self.fetch_last_error(name)

    def fetch_last_error(self, name: str) -> LibraryError:
        """Read the library's last error in this thread, as the error of function `name`, whose call has just failed."""
        code = int(self._functions["dhdErrorGetLast"]())
        if code == 0:
            return LibraryError(name, code, "an answer that is neither success nor a known error")
        text = self._functions["dhdErrorGetLastStr"]() or b"no reason given"
        return LibraryError(name, code, text.decode("utf-8", "replace"))

    def find_addresses(self, names: tuple[str, ...]) -> npt.NDArray[np.int64]:
        """(len(names),): addresses of functions, for calls from compiled code. Raises `KeyError` for one that is not
        bound."""
        return np.array([find_address(self._functions[name]) for name in names], dtype=np.int64)

    def call(self, name: str, *arguments: Any) -> int:
        """Call a function of the library and check its return value. Raises `LibraryError`, and `DeviceError` where the
        library lacks the function."""
        return self.check_return_value(name, int(self.get_function(name)(*arguments)))

    def _read_version(self) -> tuple[int, int, int, int]:
        """Read the version of the SDK: major, minor, release, revision."""
        parts = [c_int() for _ in range(4)]
        self._functions["dhdGetSDKVersion"](*map(ctypes.byref, parts))
        major, minor, release, revision = (part.value for part in parts)
        return major, minor, release, revision


def _load_shared_library(path: Path) -> ctypes.CDLL:
    """Load the library from a file. Raises `DeviceError` where the system cannot load it."""
    try:
        # Windows searches a library's own folder for the libraries it depends on only if its full path is given.
        return ctypes.CDLL(str(path.absolute()))
    except OSError as error:
        raise DeviceError(
            "The device's library cannot be loaded",
            f"{path}: {error}.",
            "On Linux it needs libusb (package libusb-1.0-0). Else take the SDK for this kind of computer from the "
            "vendor, and set FDSDK to its folder.",
        ) from error


def _bind_functions(shared_library: ctypes.CDLL, path: Path) -> dict[str, Callable[..., Any]]:
    """Bind the library's functions, by name, with their types set. Raises `DeviceError` where a function of
    `SIGNATURES` is missing; those of `LINKAGE_SIGNATURES` may be missing."""
    missing_functions = [name for name in SIGNATURES if not hasattr(shared_library, name)]
    if missing_functions:
        raise _make_outdated_error(f"{path} has no {', '.join(missing_functions)}")
    functions: dict[str, Callable[..., Any]] = {}
    linkage_signatures = {name: types for name, types in LINKAGE_SIGNATURES.items() if hasattr(shared_library, name)}
    for name, (result_type, argument_types) in (SIGNATURES | linkage_signatures).items():
        function = getattr(shared_library, name)
        function.restype, function.argtypes = result_type, list(argument_types)
        functions[name] = function
    return functions


def _format_version(version: tuple[int, ...]) -> str:
    """Format a version with dots between its parts, such as 3.17.5.0."""
    return ".".join(map(str, version))


def _make_outdated_error(reason: str) -> DeviceError:
    """Make the error for a library that is too old. reason: a sentence without its full stop, on the version or the
    missing functions."""
    return DeviceError(
        "The device's library is too old",
        f"{reason}.",
        f"Install the vendor's SDK {_format_version(OLDEST_SDK)} or newer, and set FDSDK to its folder.",
    )
