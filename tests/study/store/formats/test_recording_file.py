from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from equalizer.signals.recording import SEGMENT_KINDS, SEGMENT_ROLES, Hold, Recording, Segment
from equalizer.signals.recording_checks import signals_of
from equalizer.signals.signal import Signal
from study.store.disk.file_errors import AlreadyThereError, CannotReadError, UnusableFileError
from study.store.formats.recording_file import read_recording, write_recording
from study.store.formats.recording_layout import LAYOUT, SEGMENT_FIELDS, SIGNAL_ATTRIBUTES

CASES = Path(__file__).parents[4].parent / "shared" / "cases"

words = st.text(st.characters(exclude_categories=("Cs", "Cc")), max_size=12)
json_values = st.recursive(
    st.none() | st.booleans() | st.integers(-9, 9) | st.floats(-1e9, 1e9) | words,
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(words, inner, max_size=3),
    max_leaves=6,
)


@st.composite
def recordings(draw):
    n, rate_hz = draw(st.integers(1, 12)), draw(st.sampled_from([100.0, 610.35, 1000.0]))

    def signal(prefix: str, quantity: str, unit: str, channels: int) -> Signal:
        samples = draw(arrays(np.float64, (n, channels), elements=st.floats(-1e6, 1e6, width=32) | st.just(np.nan)))
        return Signal(samples, rate_hz, quantity, unit, tuple(f"{prefix}{i}" for i in range(channels)))

    inputs = draw(st.integers(1, 3))
    cuts = sorted(draw(st.sets(st.integers(0, n), min_size=2, max_size=4)))
    segments = tuple(
        Segment(start, stop, draw(st.sampled_from(SEGMENT_KINDS)), draw(st.floats(0, 3)), draw(st.integers(0, 9)), role)
        for (start, stop), role in zip(pairwise(cuts), SEGMENT_ROLES, strict=False)
    )
    return Recording(
        device=draw(words),
        command=signal("f", "force", "N", inputs),
        response=signal("a", "acceleration", "m/s^2", draw(st.integers(1, 3))),
        position=signal("x", "position", "m", 2) if draw(st.booleans()) else None,
        excitation=signal("f", "force", "N", inputs) if draw(st.booleans()) else None,
        condition=signal("t", "temperature", "K", 2) if draw(st.booleans()) else None,
        time_s=np.cumsum(np.full(n, 1e-3)) if draw(st.booleans()) else None,
        hold=draw(st.sampled_from(Hold)),
        segments=segments,
        meta=draw(st.dictionaries(st.text("abcdef_", min_size=1, max_size=8), json_values, max_size=3)),
    )


def same(one, other):
    if one is None or other is None:
        return one is other
    described = (one.sample_rate_hz, one.quantity, one.unit, one.channels)
    return described == (other.sample_rate_hz, other.quantity, other.unit, other.channels) and np.array_equal(
        one.samples, other.samples, equal_nan=True
    )


@given(recording=recordings(), precision=st.sampled_from(["float32", "float64"]))
@settings(max_examples=40, deadline=None)
def test_a_written_recording_is_read_back_whole(tmp_path_factory, recording, precision):
    path = tmp_path_factory.mktemp("recordings") / "a.h5"
    write_recording(path, recording, precision=precision)
    read = read_recording(path)
    for name in ("command", "response", "position", "excitation", "condition"):
        assert same(getattr(read, name), getattr(recording, name)), name
    for name in ("device", "hold", "segments", "meta"):
        assert getattr(read, name) == getattr(recording, name)
    assert (read.time_s is None) == (recording.time_s is None)


@pytest.fixture
def recording():
    rng = np.random.default_rng(7)

    def signal(quantity: str, unit: str, channels: tuple[str, ...]) -> Signal:
        return Signal(rng.normal(size=(200, len(channels))), 1000.0, quantity, unit, channels)

    force = signal("force", "N", ("fx", "fy"))
    return Recording(
        "bench",
        force,
        signal("acceleration", "m/s^2", ("ax", "ay")),
        signal("position", "m", ("x", "y")),
        force,
        np.arange(200) * 1e-3,
        segments=(Segment(0, 100, "multisine", 1.5, 50, "fit"), Segment(120, 200, "sweep", 1.0, 0, "test")),
        meta={"place_m": [0.0, 0.1, 0.0], "sensor": {"name": "ADXL335"}},
        condition=signal("temperature", "K", ("motor",)),
    )


@pytest.fixture
def written(tmp_path, recording):
    path = tmp_path / "a.h5"
    write_recording(path, recording)
    return path


def test_everything_in_the_file_is_in_its_documented_layout_and_the_other_way_round(written):
    with h5py.File(written) as file:
        assert {*file, *file.attrs} == {entry.name for entry in LAYOUT}
        assert set(file["command"].attrs) == {entry.name for entry in SIGNAL_ATTRIBUTES}
        assert file["segments"].dtype.names == tuple(entry.name for entry in SEGMENT_FIELDS)


def test_single_precision_keeps_seven_digits_and_positions_keep_all(tmp_path, recording):
    path = tmp_path / "single.h5"
    write_recording(path, recording, precision="float32")
    read = read_recording(path)
    assert not np.array_equal(read.response.samples, recording.response.samples)
    assert read.response.samples == pytest.approx(recording.response.samples, rel=6e-8)
    assert np.array_equal(read.position.samples, recording.position.samples)


def test_long_recordings_are_packed(tmp_path):
    still = Signal(np.zeros((100_000, 1)), 1000.0, "force", "N", ("fx",))
    write_recording(tmp_path / "long.h5", Recording("bench", still, still))
    assert (tmp_path / "long.h5").stat().st_size < 50_000


def test_a_large_note_fits_into_meta(tmp_path, recording):
    write_recording(tmp_path / "b.h5", replace(recording, meta={"notes": "x" * 200_000}))
    assert len(read_recording(tmp_path / "b.h5").meta["notes"]) == 200_000


def test_nothing_existing_is_overwritten_unless_asked_for(written, recording):
    before = written.read_bytes()
    with pytest.raises(AlreadyThereError, match=r"a\.h5 already exists. Nothing that exists is overwritten"):
        write_recording(written, recording)
    assert written.read_bytes() == before
    write_recording(written, replace(recording, device="other"), overwrite=True)
    assert read_recording(written).device == "other"


def test_an_inconsistent_recording_is_not_written(tmp_path, recording):
    wrong = replace(recording, segments=(Segment(0, 300, "sine"),))
    with pytest.raises(ValueError, match="this recording cannot be written: segment 1 stops at 300"):
        write_recording(tmp_path / "b.h5", wrong)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("number", range(11))
def test_the_shared_cases_are_read_and_written_without_loss(number, tmp_path):
    path = CASES / f"open-{number:02d}.h5"
    if not path.exists():
        pytest.skip("the shared cases lie outside the repository and are not here")
    read = read_recording(path)
    assert (len(read), read.sample_rate_hz, len(read.segments)) == (105_000, 1000.0, 14)
    assert read.response.unit == "m/s^2"
    write_recording(tmp_path / "again.h5", read, precision="float32")
    again = read_recording(tmp_path / "again.h5")
    assert all(same(signal, signals_of(again)[name]) for name, signal in signals_of(read).items())
    assert again.segments == read.segments


def test_units_become_si_channel_by_channel(written):
    with h5py.File(written, "r+") as file:
        file["response"].attrs["unit"] = "g"
        file["position"].attrs["unit"] = ["mm", "deg"]
        file["command"].attrs["unit"] = "mN"
        given_g, given_mm = file["response"][0, 0], file["position"][0].copy()
    read = read_recording(written)
    assert (read.response.unit, read.position.unit, read.command.unit) == ("m/s^2", ("m", "rad"), "N")
    assert read.response.samples[0, 0] == pytest.approx(9.80665 * given_g)
    assert read.position.samples[0] == pytest.approx(given_mm * [1e-3, np.pi / 180])
    assert read.segments[0].amplitude == pytest.approx(1.5e-3)


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
        (attribute("unit", ["m", "m", "m"], "position"), "position: 3 words of unit for 2 channels"),
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
def test_a_file_that_is_cut_off_is_said_to_be_so(written, keep):
    content = written.read_bytes()
    written.write_bytes(content[: int(keep * len(content)) if keep < 1 else keep])
    with pytest.raises(UnusableFileError, match="It is not HDF5 that can be read, or it is cut off"):
        read_recording(written)


def test_a_file_with_a_damaged_description_is_said_to_be_so(written):
    text_of_unknown_alphabet = written.read_bytes().replace(b"\x19\x01\x01\x00", b"\x19\x01\x0f\x00")
    written.write_bytes(text_of_unknown_alphabet)
    with pytest.raises(UnusableFileError, match=r"It is not HDF5 that can be read.*Unknown string encoding"):
        read_recording(written)


def test_a_file_that_is_not_there_is_said_to_be_so(tmp_path):
    with pytest.raises(CannotReadError, match=r"none\.h5 cannot be read\. There is no file"):
        read_recording(tmp_path / "none.h5")
