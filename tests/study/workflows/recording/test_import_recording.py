from dataclasses import replace

import numpy as np
import pytest
from scipy.io import savemat

from analysis.look.clock import check_clock
from equalizer.signals.recording import Hold, Recording, find_parts
from equalizer.signals.signal import Signal
from study.errors import StudyError, WrongUseError
from study.importing.header_map import HOLD_REMARK
from study.importing.map_format.map_errors import ImportRefusedError, MapNeededError
from study.store.disk.file_errors import CannotReadError
from study.store.formats.recording_file import read_recording, write_recording
from study.workflows.recording.import_recording import ImportPlan, import_recording, read_foreign
from study.workflows.recording.read_any_recording import read_any_recording

T = np.arange(200) / 1000
TABLE = "time [s],fx [N],ax [g]\n" + "\n".join(f"{t:.3f},{np.sin(99 * t):.6f},{t * t:.9f}" for t in T) + "\n"
MAP = """
device = "rig"
[meta]
place_m = [0.0, 0.01, 0.0]
[[clock]]
rate = "data.fs"
[[channel]]
role = "command"
name = "fx"
value = "array('data.u')"
unit = "N"
[[channel]]
role = "response"
name = "ax"
value = "data.y"
unit = "m/s^2"
[[segment]]
kind = "noise"
split = { fit = 0.5, test = 0.5 }
"""


def test_a_table_whose_header_says_all_needs_no_map(tmp_path):
    (tmp_path / "a.csv").write_text(TABLE)
    done = import_recording(ImportPlan((tmp_path / "a.csv",), None, tmp_path / "r.h5"))
    found = read_recording(tmp_path / "r.h5")
    np.testing.assert_allclose(found.response.samples[:, 0], 9.80665 * T**2, atol=1e-7)
    assert (found.sample_rate_hz, found.hold) == (1000, Hold.ZERO_ORDER)  # as the remark says
    assert done.notes == ("Taken from the header: fx as command, ax as response.", HOLD_REMARK)
    assert found.meta["import"] == {"map": "header", "notes": list(done.notes)}


def test_matlab_structures_by_a_map(tmp_path):
    savemat(tmp_path / "a.mat", {"data": {"u": T[:, None], "y": 2 * T, "fs": 1000.0}})
    (tmp_path / "m.toml").write_text(MAP)
    import_recording(ImportPlan((tmp_path / "a.mat",), str(tmp_path / "m.toml"), tmp_path / "r.h5"))
    found = read_recording(tmp_path / "r.h5")
    np.testing.assert_allclose(found.response.samples, 2 * found.command.samples)
    assert [segment.role for segment in found.segments] == ["fit", "test"]
    assert found.meta["place_m"] == [0.0, 0.01, 0.0]
    assert found.meta["import"]["map"] == "m"
    assert len(found.meta["import"]["map_sha256"]) == 64
    assert [parent["file"] for parent in found.meta["provenance"]["parents"]] == ["a.mat"]


def test_a_folder_with_a_map_of_its_own(tmp_path):
    folder = tmp_path / "lab"
    folder.mkdir()
    savemat(folder / "a.mat", {"data": {"u": T, "y": 2 * T, "fs": 1000.0}})
    (folder / "m.toml").write_text(MAP)
    done = import_recording(ImportPlan((folder,), None, tmp_path / "r.h5"))
    assert (done.map, len(done.recording)) == ("m", 200)


def test_of_a_folder_a_named_map_takes_its_own_files(tmp_path):
    savemat(tmp_path / "a.mat", {"data": {"u": T, "y": T, "fs": 1000.0}})
    savemat(tmp_path / "b.mat", {"data": {"u": T, "y": T, "fs": 1000.0}})
    (tmp_path / "m.toml").write_text('files = ["b*"]\n' + MAP)
    done = import_recording(ImportPlan((tmp_path,), str(tmp_path / "m.toml"), tmp_path / "r.h5"))
    assert [part["file"] for part in done.recording.meta["parts"]] == ["b.mat"]
    (tmp_path / "m.toml").write_text('files = ["c*"]\n' + MAP)
    with pytest.raises(ImportRefusedError, match=r"None of its files is one of c\*"):
        import_recording(ImportPlan((tmp_path,), str(tmp_path / "m.toml"), tmp_path / "s.h5"))


def test_a_folder_that_no_map_is_for_is_wrong_use(tmp_path):
    (tmp_path / "a.csv").write_text("x\n1\n")
    with pytest.raises(WrongUseError, match="No map is for the files of the folder"):
        import_recording(ImportPlan((tmp_path,), None, tmp_path / "r.h5"))


def test_seconds_that_are_called_milliseconds_are_noticed(tmp_path):
    (tmp_path / "a.csv").write_text(TABLE.replace("time [s]", "time [ms]"))
    (tmp_path / "b.csv").write_text(TABLE)
    _, notes = read_any_recording(tmp_path / "a.csv")
    assert any("1e+06 Hz is an unlikely rate" in note and "(s, called ms)" in note for note in notes)
    found, notes = read_any_recording(tmp_path / "b.csv")
    assert not any("unlikely" in note for note in notes)
    (check,) = check_clock(found, [(0, len(found))])
    assert (check.level, check.finding) == (
        "fine", "The time stamps of the file were even at its import; they give 1000 Hz."
    )  # fmt: skip


def test_of_two_forces_along_one_motion_it_is_said_that_the_motion_may_be_imposed(tmp_path):
    rows = [f"{t:.3f},{np.sin(99 * t):.6f},{np.cos(99 * t):.6f},{t:.6f}" for t in T]
    (tmp_path / "a.csv").write_text(
        "time [s],drive force [N],tip force [N],displacement [mm]\n" + "\n".join(rows) + "\n"
    )
    assert any("The motion is taken for the command" in note for note in read_any_recording(tmp_path / "a.csv")[1])
    (tmp_path / "b.csv").write_text(TABLE)
    assert not any("imposed" in note for note in read_any_recording(tmp_path / "b.csv")[1])


def write_runs(folder, *names):
    folder.mkdir()
    for name in names:
        (folder / name).write_text(TABLE)


def test_a_folder_of_numbered_tables_is_imported_by_their_header_in_order(tmp_path):
    write_runs(tmp_path / "fold", "rec_10.csv", "rec_2.csv", "rec_1.csv")
    done = import_recording(ImportPlan((tmp_path / "fold",), None, tmp_path / "r.h5"))
    assert [part["file"] for part in done.recording.meta["parts"]] == ["rec_1.csv", "rec_2.csv", "rec_10.csv"]
    assert done.notes[0] == "Taken from the header: fx as command, ax as response."


def test_of_a_folder_of_other_names_it_is_said_that_they_are_no_parts(tmp_path):
    write_runs(tmp_path / "fold", "before.csv", "after.csv")
    with pytest.raises(WrongUseError, match=r"parts of one recording by their names \(after\.csv, before\.csv\)"):
        import_recording(ImportPlan((tmp_path / "fold",), None, tmp_path / "r.h5"))


def test_of_recordings_put_one_after_another_it_is_said_which_signals_were_left_out(tmp_path):
    for name, gain in (("a.h5", 1.0), ("b.h5", 2.0), ("c.h5", 3.0)):
        position = None if name == "b.h5" else Signal(0 * T[:, None], 1000.0, "position", "m", ("x",))
        write_recording(tmp_path / name, replace(recording(gain=gain), position=position))
    files = (tmp_path / "a.h5", tmp_path / "b.h5")
    done = import_recording(ImportPlan(files, None, tmp_path / "r.h5"))
    assert done.recording.position is None
    assert done.notes[-1] == "Left out, because not every recording has it: position."
    whole = import_recording(ImportPlan((tmp_path / "a.h5", tmp_path / "c.h5"), None, tmp_path / "s.h5"))
    assert not any("Left out" in note for note in whole.notes)


def test_a_table_of_others_is_looked_at_and_read_as_it_is(tmp_path):
    (tmp_path / "a.csv").write_text(TABLE)
    found, notes = read_any_recording(tmp_path / "a.csv")
    assert (found.command.channels, found.response.unit) == (("fx",), "m/s^2")
    assert notes[0] == "a.csv is no hapteq recording: it was imported in memory."
    write_recording(tmp_path / "r.h5", found)
    assert read_any_recording(tmp_path / "r.h5")[1] == ()
    (tmp_path / "b.csv").write_text(TABLE.replace("fx [N]", "knob"))
    with pytest.raises(StudyError, match=r"Nothing says what 'knob' is\. hapteq import .*b\.csv --out REC\.h5"):
        read_any_recording(tmp_path / "b.csv")


def test_a_folder_of_several_recordings_asks_which(tmp_path):
    for name in ("a.mat", "b.mat"):
        savemat(tmp_path / name, {"data": {"u": T, "y": T, "fs": 1000.0}})
    (tmp_path / "m.toml").write_text("separate = true\n" + MAP)
    with pytest.raises(WrongUseError, match=r"makes 2 recordings: m for a\.mat; m for b\.mat\."):
        import_recording(ImportPlan((tmp_path,), None, tmp_path / "r.h5"))


def recording(rate_hz=1000.0, gain=1.0):
    force = Signal(T[:, None], rate_hz, "force", "N", ("fx",))
    response = Signal(gain * T[:, None], rate_hz, "acceleration", "m/s^2", ("ax",))
    return Recording("rig", force, response, meta={"grip": "weak"})


def test_recordings_of_ours_are_taken_as_they_are_and_joined(tmp_path):
    write_recording(tmp_path / "a.h5", recording())
    write_recording(tmp_path / "b.h5", recording(gain=2.0))
    one = import_recording(ImportPlan((tmp_path / "a.h5",), None, tmp_path / "one.h5"))
    assert one.recording.meta["grip"] == "weak"
    two = import_recording(ImportPlan((tmp_path / "a.h5", tmp_path / "b.h5"), None, tmp_path / "two.h5"))
    assert len(two.recording) == 400
    assert two.notes == ("2 recordings were put one after another; time stamps were left out.",)
    assert [part["file"] for part in two.recording.meta["parts"]] == ["a.h5", "b.h5"]
    assert find_parts(two.recording) == ((0, 200), (200, 400))


def test_recordings_of_ours_that_do_not_fit_together_are_refused(tmp_path):
    write_recording(tmp_path / "a.h5", recording())
    write_recording(tmp_path / "b.h5", recording(500.0))
    with pytest.raises(ImportRefusedError, match="A recording of rig at 500 Hz cannot follow one of rig at 1000 Hz"):
        import_recording(ImportPlan((tmp_path / "a.h5", tmp_path / "b.h5"), None, tmp_path / "r.h5"))


def test_a_file_that_says_nothing_gets_a_map_to_complete(tmp_path):
    np.savez(tmp_path / "a.npz", u=T, y=T)
    with pytest.raises(MapNeededError) as refused:
        import_recording(ImportPlan((tmp_path / "a.npz",), None, tmp_path / "r.h5"))
    assert 'value = "u"' in refused.value.skeleton
    assert refused.value.happened == (
        "No column is the time (as in 'time [s]'), and no number is the sample rate (as in 'rate_Hz'); nothing says "
        "what 'y' is."
    )


@pytest.mark.parametrize("out", ["there.h5", "nowhere/r.h5"])
def test_a_name_that_cannot_be_written_is_reported_before_anything_is_read(tmp_path, out):
    (tmp_path / "there.h5").write_bytes(b"mine")
    with pytest.raises(StudyError, match="Nothing was imported"):
        import_recording(ImportPlan((tmp_path / "not_there.csv",), None, tmp_path / out))
    assert (tmp_path / "there.h5").read_bytes() == b"mine"


def test_what_is_refused_leaves_nothing_behind(tmp_path):
    (tmp_path / "a.csv").write_text(TABLE.replace("0.005,", "0.001,", 1))
    with pytest.raises(MapNeededError, match="runs backwards at sample 5"):
        import_recording(ImportPlan((tmp_path / "a.csv",), None, tmp_path / "r.h5"))
    assert [path.name for path in tmp_path.iterdir()] == ["a.csv"]


def test_tables_whose_command_repeats_get_segments_with_period_and_level(tmp_path):
    command = np.tile(np.random.default_rng(1).standard_normal(300), 4)
    for number, level in enumerate((1, 3), start=1):
        rows = [f"{k / 1000:.3f},{level * u:.6f},{u * u:.6f}" for k, u in enumerate(command)]
        (tmp_path / f"run_{number}.csv").write_text("time [s],fx [N],ax [g]\n" + "\n".join(rows) + "\n")
    files = (tmp_path / "run_1.csv", tmp_path / "run_2.csv")
    done = import_recording(ImportPlan(files, None, tmp_path / "r.h5"))
    found = read_recording(tmp_path / "r.h5").segments
    assert [(s.start, s.stop, s.kind, s.period) for s in found] == [
        (0, 1200, "multisine", 300), (1200, 2400, "multisine", 300)
    ]  # fmt: skip
    assert found[1].amplitude == pytest.approx(3 * found[0].amplitude)
    assert done.notes[-1].startswith("The excitation repeats exactly, every 300 samples, 4 times or more in each part")


@pytest.mark.parametrize("map_name", [None, "silverbox"])
def test_without_a_file_nothing_is_imported(tmp_path, map_name):
    with pytest.raises(WrongUseError, match="No file was given"):
        import_recording(ImportPlan((), map_name, tmp_path / "r.h5"))


def test_a_file_that_is_given_twice_is_refused(tmp_path):
    """Also by another path, and by its folder and its name: its samples would count twice."""
    table, matlab, map_path = tmp_path / "a.csv", tmp_path / "a.mat", tmp_path / "m.toml"
    table.write_text(TABLE)
    savemat(matlab, {"data": {"u": T, "y": T, "fs": 1000.0}})
    map_path.write_text('files = ["a.mat"]\n' + MAP)
    for files, map_name in (
        ((table, tmp_path / "." / ".." / tmp_path.name / "a.csv"), None),
        ((tmp_path, matlab), map_path),
    ):
        with pytest.raises(WrongUseError, match="A file is given twice"):
            read_foreign(files, None if map_name is None else str(map_name))


@pytest.mark.parametrize("has_map", [False, True])
def test_of_a_folder_a_link_to_another_of_its_files_is_refused(tmp_path, has_map):
    first = tmp_path / ("rec_1.mat" if has_map else "rec_1.csv")
    if has_map:
        savemat(first, {"data": {"u": T, "y": T, "fs": 1000.0}})
        (tmp_path / "m.toml").write_text('files = ["rec_*.mat"]\n' + MAP)
    else:
        first.write_text(TABLE)
    first.with_stem("rec_2").symlink_to(first)
    with pytest.raises(WrongUseError, match=r"A file is given twice.*rec_2"):
        read_foreign((tmp_path,), None)


def test_of_a_copy_it_is_said_that_it_counts_twice(tmp_path):
    write_recording(tmp_path / "a.h5", recording())
    import_recording(ImportPlan((tmp_path / "a.h5",), None, tmp_path / "copy.h5"))
    for name in ("a.csv", "b.csv"):
        (tmp_path / name).write_text(TABLE)
    for first, second in (("a.h5", "copy.h5"), ("a.csv", "b.csv")):
        notes = read_foreign((tmp_path / first, tmp_path / second), None).notes
        assert f"{second} holds the same samples as {first}, and a recording counts once: leave it out." in notes


def test_a_link_to_itself_is_a_file_that_cannot_be_read(tmp_path):
    (tmp_path / "a.csv").symlink_to(tmp_path / "a.csv")
    with pytest.raises(CannotReadError):
        read_foreign((tmp_path / "a.csv",), None)


def test_hidden_files_of_a_folder_are_no_recordings(tmp_path):
    write_runs(tmp_path / "fold", "rec_2.csv", "rec_1.csv")
    for name in (".DS_Store", "._rec_1.csv"):
        (tmp_path / "fold" / name).write_bytes(b"\0\5\x16\7")
    header = 'value = "fx [N]"', 'value = "ax [g]"', 'time = "time"\ntime_unit = "s"'
    text = MAP.replace("value = \"array('data.u')\"", header[0]).replace('value = "data.y"', header[1])
    (tmp_path / "m.toml").write_text(text.replace('rate = "data.fs"', header[2]))
    for map_name in (None, str(tmp_path / "m.toml")):
        found = read_foreign((tmp_path / "fold",), map_name).recording
        assert [part["file"] for part in found.meta["parts"]] == ["rec_1.csv", "rec_2.csv"]


def test_a_header_name_that_is_too_long_for_a_channel_needs_a_map(tmp_path):
    (tmp_path / "a.csv").write_text(TABLE.replace("fx [N]", f"{'force of the crosshead ' * 3}[N]"))
    with pytest.raises(MapNeededError, match="has 68 characters; that of a channel has up to 64"):
        import_recording(ImportPlan((tmp_path / "a.csv",), None, tmp_path / "r.h5"))


def test_a_header_name_that_is_only_a_unit_keeps_it(tmp_path):
    (tmp_path / "a.csv").write_text(TABLE.replace("ax [g]", "_rad"))
    assert read_any_recording(tmp_path / "a.csv")[0].response.channels == ("_rad",)
