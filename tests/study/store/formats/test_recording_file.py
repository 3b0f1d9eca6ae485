"""Recordings written and read back: layout, precision, overwriting, units."""

from dataclasses import replace
from itertools import pairwise

import h5py
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from equalizer.signals.recording import SEGMENT_KINDS, SEGMENT_ROLES, Hold, Recording, Segment
from equalizer.signals.recording_checks import collect_signals
from equalizer.signals.signal import Signal
from study.store.disk.file_errors import AlreadyExistsError
from study.store.formats.recording_file import read_recording, write_recording
from study.store.formats.recording_layout import LAYOUT, SEGMENT_FIELDS, SIGNAL_ATTRIBUTES

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
    with pytest.raises(AlreadyExistsError, match=r"a\.h5 already exists. Nothing that exists is overwritten"):
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
def test_the_shared_cases_are_read_and_written_without_loss(shared, number, tmp_path):
    read = read_recording(shared / "cases" / f"open-{number:02d}.h5")
    assert (len(read), read.sample_rate_hz, len(read.segments)) == (105_000, 1000.0, 14)
    assert read.response.unit == "m/s^2"
    write_recording(tmp_path / "again.h5", read, precision="float32")
    again = read_recording(tmp_path / "again.h5")
    assert all(same(signal, collect_signals(again)[name]) for name, signal in collect_signals(read).items())
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


def test_a_file_name_that_is_no_text_does_not_spoil_the_recording(tmp_path):
    signal = Signal(np.zeros((2, 1)), 1000.0, "force", "N", ("fx",))
    meta = {"parts": [{"file": "messung_\udce4.csv"}], "operator": "Jörg"}
    write_recording(tmp_path / "a.h5", Recording("rig", signal, signal, meta=meta))
    assert read_recording(tmp_path / "a.h5").meta == {"parts": [{"file": "messung_?.csv"}], "operator": "Jörg"}
