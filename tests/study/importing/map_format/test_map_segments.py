import numpy as np
import pytest

from study.importing.map_format.import_map import SegmentMap
from study.importing.map_format.map_errors import ImportProblemError
from study.importing.map_format.map_segments import place_segments

COMMAND = np.linspace(-3, 2, 1000)[:, None]


def found(*entries, part=("a.npz", "")):
    return [(s.start, s.stop, s.role, round(s.amplitude, 3)) for s in place_segments(entries, part, COMMAND, 100.0)]


def test_a_segment_is_the_whole_part_with_its_measured_peak():
    assert found(SegmentMap("noise")) == [(0, 1000, "", 3.0)]


def test_ends_may_be_counted_from_behind_or_in_seconds():
    assert found(SegmentMap("noise", start=-100, stop=-10)) == [(900, 990, "", 1.95)]
    assert found(SegmentMap("noise", start_s=1.0, stop_s=2.5, amplitude=7.0)) == [(100, 250, "", 7.0)]


def test_roles_by_shares_cut_a_segment():
    two = SegmentMap("noise", amplitude=1.0, split={"fit": 0.5, "": 0.1, "test": 0.4})
    assert found(two) == [(0, 500, "fit", 1.0), (500, 600, "", 1.0), (600, 1000, "test", 1.0)]


def test_pieces_repeat_and_go_whole_to_their_share():
    ten = SegmentMap("multisine", every=100, length=90, amplitude=1.0, split={"fit": 0.9, "test": 0.1})
    pieces = found(ten)
    assert [(start, stop) for start, stop, _, _ in pieces] == [(k * 100, k * 100 + 90) for k in range(10)]
    assert [role for _, _, role, _ in pieces] == ["fit"] * 9 + ["test"]


def test_entries_belong_to_files_and_prefixes_that_fit():
    entries = SegmentMap("noise", file="a*"), SegmentMap("step", file="b*"), SegmentMap("sine", prefix="one*")
    assert len(found(*entries)) == 1
    assert len(found(*entries, part=("a.npz", "one_"))) == 2
    assert len(found(*entries, part=("c.npz", ""))) == 0


@pytest.mark.parametrize(
    ("entry", "sentence"),
    [
        (SegmentMap("noise", stop=2000), "it goes from sample 0 to 2000, but the part has 1000 samples"),
        (SegmentMap("noise", start=500, stop=100), "it goes from sample 500 to 100"),
        (SegmentMap("noise", every=2000), "no piece of 2000 samples fits between 0 and 1000"),
        (SegmentMap("noise", every=10, length=20), "its length, 20, is more than one every 10 samples leaves room for"),
        (SegmentMap("noise", split={"fit": 0.9999, "test": 0.0001}), "1000 samples cannot be split into shares"),
    ],
)
def test_a_segment_that_cannot_be_is_named(entry, sentence):
    with pytest.raises(ImportProblemError, match=r"segment\[1\] in a\.npz: ") as refused:
        found(entry)
    assert sentence in str(refused.value)
