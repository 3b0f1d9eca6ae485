"""Bindings of the vendor's functions by ctypes: a negative return value becomes an error with the library's own text.

The library keeps its last error per thread, so the text is fetched at once, in the thread whose call failed.
"""

import ctypes
from collections.abc import Callable
from ctypes import POINTER, c_byte, c_char_p, c_double, c_int, c_ubyte, c_uint, c_ushort
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from study.devices.native import address_of
from study.errors import DeviceError

OLDEST_SDK = (3, 16, 0)
"""Oldest version of the vendor's library that has all functions with the types below."""

GEOMETRY_ERROR, DEVICE_IN_USE = 8, 20
"""Error codes of the library on which a decision depends."""

HIGHEST_NOTICE = 2
"""Answers from 1 to this tell something beside success (`handle.STALE`, `handle.SCALED`). What a higher one means is
not known, so it is an error."""

ANSWER_A_NUMBER = ("dhdOpenID", "dhdGetSystemType")
"""Functions whose answer, where it is not negative, is what was asked for."""

_ID, _NUMBER, _NUMBERS = c_byte, c_double, POINTER(c_double)
_THREE = (_NUMBERS, _NUMBERS, _NUMBERS, _ID)
"""Arguments of functions that give a vector: x, y, z, device."""

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
    "dhdGetVersion": (c_int, (_NUMBERS, _ID)),
    "dhdGetStatus": (c_int, (POINTER(c_int), _ID)),
    "dhdEnableForce": (c_int, (c_ubyte, _ID)),
    "dhdSetBrakes": (c_int, (c_int, _ID)),
    "dhdGetPosition": (c_int, _THREE),
    "dhdGetLinearVelocity": (c_int, _THREE),
    "dhdGetForce": (c_int, _THREE),
    "dhdSetForce": (c_int, (_NUMBER, _NUMBER, _NUMBER, _ID)),
    "dhdGetButtonMask": (c_uint, (_ID,)),
    "dhdSetGravityCompensation": (c_int, (c_int, _ID)),
    "dhdSetEffectorMass": (c_int, (_NUMBER, _ID)),
    "dhdSetMaxForce": (c_int, (_NUMBER, _ID)),
    "dhdReset": (c_int, (_ID,)),
    "dhdWaitForReset": (c_int, (c_int, _ID)),
    "dhdEnableExpertMode": (c_int, ()),
    "dhdSetTimeGuard": (c_int, (c_int, _ID)),
    "dhdSetWatchdog": (c_int, (c_ubyte, _ID)),
    "dhdGetWatchdog": (c_int, (POINTER(c_ubyte), _ID)),
}
"""Result and arguments of each function; `char ID` is the last argument and has no default in C."""

_ANGLES, _COUNTS = (_NUMBER,) * 3, (c_int,) * 3

LINKAGE_SIGNATURES: dict[str, tuple[Any, tuple[Any, ...]]] = {
    "dhdGetJointAngles": (c_int, (_NUMBERS, _ID)),
    "dhdDeltaPositionToEncoder": (c_int, (*_ANGLES, *(POINTER(c_int),) * 3, _ID)),
    "dhdDeltaEncoderToPosition": (c_int, (*_COUNTS, *_THREE)),
    "dhdDeltaEncodersToJointAngles": (c_int, (*_COUNTS, *_THREE)),
    "dhdDeltaJointAnglesToJacobian": (c_int, (*_ANGLES, _NUMBERS, _ID)),
    "dhdJointAnglesToInertiaMatrix": (c_int, (_NUMBERS, _NUMBERS, _ID)),
    "dhdJointAnglesToGravityJointTorques": (c_int, (_NUMBERS, _NUMBERS, c_ubyte, _ID)),
}
"""Functions for the calibration of the linkage alone: a library without them can drive a device."""


class LibraryError(Exception):
    """A function of the library answered that it failed."""

    def __init__(self, function: str, code: int, text: str) -> None:
        super().__init__(f"{function}: {text} (error {code})")
        self.function, self.code, self.text = function, code, text


class Library:
    """The loaded library. Raises `DeviceError` where it cannot be loaded or is too old."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self._functions = _bind(_load(path), path)
        self.version = self._version()
        if self.version[:3] < OLDEST_SDK:
            raise _too_old(f"{path} is version {_version_words(self.version)}")

    @property
    def version_text(self) -> str:
        """Version of the vendor's SDK in words, as "3.17.5"."""
        return _version_words(self.version)

    def function(self, name: str) -> Callable[..., Any]:
        """Unchecked, for calls at every tick: what it returns is for `check_answer` to judge. Raises `DeviceError`
        where a function that not every use needs is missing."""
        if name not in self._functions:
            raise _too_old(f"{self.path} has no {name}")
        return self._functions[name]

    def check_answer(self, name: str, answer: int) -> int:
        """The answer. Raises `LibraryError` where it is below zero, or unknown; to be asked in the thread of the
        call."""
        if 0 <= answer <= HIGHEST_NOTICE or (answer > 0 and name in ANSWER_A_NUMBER):
            return answer
        raise self.last_error(name)

    def last_error(self, name: str) -> LibraryError:
        """The error of this function, whose call just failed in this thread."""
        code = int(self._functions["dhdErrorGetLast"]())
        if code == 0:
            return LibraryError(name, code, "an answer that is neither success nor a known error")
        text = self._functions["dhdErrorGetLastStr"]() or b"no reason given"
        return LibraryError(name, code, text.decode("utf-8", "replace"))

    def addresses(self, names: tuple[str, ...]) -> npt.NDArray[np.int64]:
        """Addresses of the library's functions, for calls from compiled code."""
        return np.array([address_of(self._functions[name]) for name in names], dtype=np.int64)

    def call(self, name: str, *arguments: Any) -> int:
        """Call a function of the library. Raises `LibraryError`."""
        return self.check_answer(name, int(self.function(name)(*arguments)))

    def _version(self) -> tuple[int, int, int, int]:
        parts = [c_int() for _ in range(4)]
        self._functions["dhdGetSDKVersion"](*map(ctypes.byref, parts))
        major, minor, release, revision = (part.value for part in parts)
        return major, minor, release, revision


def _load(path: Path) -> ctypes.CDLL:
    try:
        # Windows looks for what it needs itself beside a library only where that is named in full.
        return ctypes.CDLL(str(path.absolute()))
    except OSError as error:
        raise DeviceError(
            "The device's library cannot be loaded",
            f"{path}: {error}.",
            "On Linux it needs libusb (package libusb-1.0-0). Else take the SDK for this kind of computer from the "
            "vendor, and set FDSDK to its folder.",
        ) from error


def _bind(loaded: ctypes.CDLL, path: Path) -> dict[str, Callable[..., Any]]:
    missing = [name for name in SIGNATURES if not hasattr(loaded, name)]
    if missing:
        raise _too_old(f"{path} has no {', '.join(missing)}")
    functions: dict[str, Callable[..., Any]] = {}
    there = {name: types for name, types in LINKAGE_SIGNATURES.items() if hasattr(loaded, name)}
    for name, (result, arguments) in (SIGNATURES | there).items():
        function = getattr(loaded, name)
        function.restype, function.argtypes = result, list(arguments)
        functions[name] = function
    return functions


def _version_words(version: tuple[int, ...]) -> str:
    return ".".join(map(str, version))


def _too_old(happened: str) -> DeviceError:
    return DeviceError(
        "The device's library is too old",
        f"{happened}.",
        f"Install the vendor's SDK {_version_words(OLDEST_SDK)} or newer, and set FDSDK to its folder.",
    )
