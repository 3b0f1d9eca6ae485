"""Recording files of others and damaged ones: what is understood, and each fault named."""

from typing import Any

import h5py
import numpy as np
import pytest

from equalizer.signals.recording import Hold
from study.store.disk.file_errors import CannotReadError, UnusableFileError
from study.store.formats.recording_file import read_recording


def test_text_of_fixed_length_and_numbers_in_lists_of_one_are_understood(written):
    with h5py.File(written, "r+") as file:
        file.attrs["device"] = np.bytes_("bench")
        file.attrs["sample_rate_hz"] = np.array([[1000]])
        file["command"].attrs["channels"] = np.array([b"fx", b"fy"])
    read = read_recording(written)
    assert (read.device, read.sample_rate_hz, read.command.channels) == ("bench", 1000.0, ("fx", "fy"))


def test_what_is_optional_may_be_left_out(written):
    with h5py.File(written, "r+") as file:
        for name in ("position", "excitation", "time_s", "segments", "meta"):
            del file[name]
        del file.attrs["hold"]
    read = read_recording(written)
    assert (read.position, read.time_s, read.segments, dict(read.meta)) == (None, None, (), {})
    assert read.hold is Hold.ZERO_ORDER


def without(name):
    return lambda file: file.__delitem__(name)


def attribute(name, value, of="/"):
    return lambda file: file[of].attrs.__setitem__(name, value)


def lost(name, of="/"):
    return lambda file: file[of].attrs.__delitem__(name)


def dataset(name, data):
    def change(file: Any) -> None:
        attributes = dict(file[name].attrs) if name in file else {}
        if name in file:
            del file[name]
        file[name] = data
        file[name].attrs.update(attributes)

    return change


@pytest.mark.parametrize(
    ("said", "read"), [("x, y", ("x", "y")), ("x y", ("x", "y")), ("handle", ("handle 1", "handle 2"))]
)
def test_one_text_may_name_all_channels(written, said, read):
    with h5py.File(written, "r+") as file:
        attribute("channels", said, "response")(file)
    assert read_recording(written).response.channels == read


@pytest.mark.parametrize(
    ("change", "problem"),
    [
        (lost("format"), "the attribute 'format' is missing"),
        (attribute("format", "hapteq-model"), "its format is 'hapteq-model', not 'hapteq-recording'"),
        (attribute("version", 2), "its version is 2; this program reads version 1"),
        (lost("version"), "the attribute 'version' is missing"),
        (lost("sample_rate_hz"), "the attribute 'sample_rate_hz' is missing"),
        (attribute("sample_rate_hz", np.nan), "sample_rate_hz is nan; it must be a positive number"),
        (attribute("sample_rate_hz", -1000.0), "sample_rate_hz is -1000; it must be a positive number"),
        (attribute("sample_rate_hz", "fast"), "the attribute 'sample_rate_hz' is 'fast'; it must be a number"),
        (lost("device"), "the attribute 'device' is missing"),
        (attribute("device", 3), "the attribute 'device' is 3; it must be text"),
        (attribute("device", ["a", "b"]), "the attribute 'device' holds 2 texts; it must be one"),
        (attribute("device", np.bytes_(b"\xff")), "the attribute 'device' is not text in UTF-8"),
        (attribute("hold", "cubic"), "hold is 'cubic'; allowed are zero-order, band-limited, linear"),
        (without("response"), "the dataset 'response' is missing"),
        (without("command"), "the dataset 'command' is missing"),
        (dataset("response", np.zeros(200)), "response has shape (200,); it must be (samples, channels)"),
        (
            dataset("response", np.zeros((200, 2), dtype=int)),
            "response is of type int64; it must be float32 or float64",
        ),
        (dataset("response", np.zeros((199, 2))), "command has 200 samples, but response has 199; all must be equally"),
        (dataset("response", np.zeros((200, 3))), "response: 3 columns of samples but 2 channel names"),
        (dataset("response", np.full((200, 2), np.inf)), "response holds infinite values; a missing sample is NaN"),
        (lost("unit", "response"), "the attribute 'unit' of response is missing"),
        (lost("quantity", "position"), "the attribute 'quantity' of position is missing"),
        (attribute("unit", "furlong", "response"), "response, channel 'ax': 'furlong' is not a unit known here"),
        (attribute("unit", "", "response"), "response, channel 'ax': the unit is missing; allowed are"),
        (attribute("unit", "V", "command"), "command, channel 'fx': the quantity 'force' cannot be in V"),
        (attribute("unit", ["m", "m", "m"], "position"), "position: 3 entries of unit for 2 channels"),
        (dataset("time_s", np.zeros((200, 1))), "time_s has shape (200, 1); it must be (samples)"),
        (dataset("time_s", np.zeros(200)), "time_s does not grow at sample 1"),
        (
            dataset("segments", np.array([(0, 1)], dtype=[("start", int), ("stop", int)])),
            "segments lacks kind, amplitude",
        ),
        (attribute("place", "{not json", "meta"), "the attribute 'place' of meta is not JSON"),
    ],
)
def test_every_fault_of_a_file_is_named(written, change, problem):
    with h5py.File(written, "r+") as file:
        change(file)
    with pytest.raises(UnusableFileError) as refused:
        read_recording(written)
    assert refused.value.title == "a.h5 is not a usable recording"
    assert any(found.startswith(problem) for found in refused.value.problems), refused.value.problems
    assert "`hapteq validate` checks it" in str(refused.value)


def test_all_faults_are_named_at_once(written):
    with h5py.File(written, "r+") as file:
        del file.attrs["device"]
        file.attrs["hold"] = "cubic"
        file["response"].attrs["unit"] = "furlong"
    with pytest.raises(UnusableFileError) as refused:
        read_recording(written)
    assert len(refused.value.problems) == 3


@pytest.mark.parametrize("keep", [0, 100, 0.5, 0.95])
def test_a_file_that_is_cut_off_is_reported(written, keep):
    content = written.read_bytes()
    written.write_bytes(content[: int(keep * len(content)) if keep < 1 else keep])
    with pytest.raises(UnusableFileError, match="It is not HDF5 that can be read, or it is cut off"):
        read_recording(written)


def test_a_file_with_a_damaged_description_is_reported(written):
    text_of_unknown_alphabet = written.read_bytes().replace(b"\x19\x01\x01\x00", b"\x19\x01\x0f\x00")
    written.write_bytes(text_of_unknown_alphabet)
    with pytest.raises(UnusableFileError, match=r"It is not HDF5 that can be read.*Unknown string encoding"):
        read_recording(written)


def test_a_file_that_is_not_there_is_reported(tmp_path):
    with pytest.raises(CannotReadError, match=r"none\.h5 cannot be read\. There is no file"):
        read_recording(tmp_path / "none.h5")
