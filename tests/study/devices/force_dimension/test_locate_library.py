"""Where the library is looked for, on each system, and which of several is taken."""

from pathlib import Path

import pytest

from study.devices.force_dimension.locate_library import Computer, find_library
from study.devices.force_dimension.usb import UsbDevice, find_usb_devices


def computer(root: Path, system: str = "linux", machine: str = "x86_64", **environ: str) -> Computer:
    return Computer(system, machine, environ, root / "home")


def laid(path: Path) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text("")
    return path


@pytest.mark.parametrize(
    ("system", "machine", "file"),
    [
        ("linux", "x86_64", "lib/release/lin-x86_64-gcc/libdrd.so.3.17.5"),
        ("linux", "aarch64", "lib/release/lin-aarch64-gcc/libdhd.so.3.17.5"),
        ("darwin", "arm64", "lib/release/mac-arm64-clang/libdrd.3.17.5.dylib"),
        ("win32", "AMD64", "bin/drd64.dll"),
        ("win32", "AMD64", "bin/dhd64.dll"),
    ],
)
@pytest.mark.parametrize("variable", ["FDSDK", "FORCEDIM_SDK"])
def test_the_library_is_found_in_the_sdk_named_by_a_variable(tmp_path, system, machine, file, variable):
    path = laid(tmp_path / "sdk" / file)
    assert find_library(computer(tmp_path, system, machine, **{variable: str(tmp_path / "sdk")})) == path


def test_the_library_is_found_in_the_home_folder_and_below_program_files(tmp_path):
    path = laid(tmp_path / "home" / ".local" / "lib" / "libdrd.so.3")
    assert find_library(computer(tmp_path)) == path
    laid(tmp_path / "programs" / "Force Dimension" / "sdk-3.16.1" / "bin" / "drd64.dll")
    newer = laid(tmp_path / "programs" / "Force Dimension" / "sdk-3.17.5" / "bin" / "drd64.dll")
    laid(tmp_path / "programs" / "Force Dimension" / "sdk-3.9.0" / "bin" / "drd64.dll")  # its name sorts last
    assert find_library(computer(tmp_path, "win32", ProgramFiles=str(tmp_path / "programs"))) == newer


def test_on_windows_the_folder_of_the_account_comes_before_that_of_all_and_a_variable_before_both(tmp_path):
    folder = "Force Dimension/sdk-3.17.5/bin/drd64.dll"
    of_all, own = laid(tmp_path / "programs" / folder), laid(tmp_path / "local" / folder)
    named = laid(tmp_path / "sdk" / "bin" / "dhd64.dll")
    places = {"ProgramFiles": str(tmp_path / "programs")}
    assert find_library(computer(tmp_path, "win32", **places)) == of_all
    places["LOCALAPPDATA"] = str(tmp_path / "local")
    assert find_library(computer(tmp_path, "win32", **places)) == own
    places["FDSDK"] = str(tmp_path / "sdk")
    assert find_library(computer(tmp_path, "win32", **places)) == named
    assert find_library(computer(tmp_path, "win32")) is None


def test_the_newest_library_is_taken_and_libdrd_before_libdhd(tmp_path):
    for name in ("libdhd.so.3.20.0", "libdrd.so.3.9.0", "libdrd.so.3.17.5"):
        laid(tmp_path / "sdk" / "lib" / name)
    assert find_library(computer(tmp_path, FDSDK=str(tmp_path / "sdk"))) == tmp_path / "sdk/lib/libdrd.so.3.17.5"


def test_without_a_library_none_is_found(tmp_path):
    laid(tmp_path / "sdk" / "lib" / "libdrd.dylib")  # of another system
    assert find_library(computer(tmp_path, FDSDK=str(tmp_path / "sdk"))) is None


def test_devices_of_the_vendor_are_seen_on_the_bus(tmp_path):
    for name, vendor, number in (("1-1", "1451", "7"), ("1-2", "046d", "8"), ("usb1", "", "")):
        for key, text in (("idVendor", vendor), ("busnum", "1"), ("devnum", number), ("product", "omega.3")):
            laid(tmp_path / "sys" / name / key).write_text(f"{text}\n")
    assert find_usb_devices(tmp_path / "sys", tmp_path / "bus") == (UsbDevice("omega.3", may_open=False),)
    laid(tmp_path / "bus" / "001" / "007")
    assert find_usb_devices(tmp_path / "sys", tmp_path / "bus") == (UsbDevice("omega.3", may_open=True),)
    assert find_usb_devices(tmp_path / "elsewhere") is None
