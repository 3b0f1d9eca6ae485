"""Dates, clock times, gaps and equal clocks in files that were not prepared for an import."""

import re

import h5py
import numpy as np
import pytest

from study.importing.arrays.read_arrays import read_arrays
from study.importing.header_map import make_header_map
from study.importing.map_format.import_map import CsvMap
from study.importing.map_format.map_errors import ImportRefusedError, MapNeededError
from study.importing.map_skeleton import make_map_skeleton
from study.store.disk.file_errors import UnusableFileError
from study.workflows.recording.import_recording import read_foreign
from tests.recording_maps import N, U, Y, built, map_text, refusal
from tests.whole_arrays import read_whole

CLOCK = 'time = "t"\ntime_unit = "s"'


def table(tmp_path, stamps, header="Logged,fx [N],ax [m/s^2]", mark=","):
    path = tmp_path / "a.csv"
    rows = [mark.join((stamp, str(k % 7), str(k % 5))) for k, stamp in enumerate(stamps)]
    path.write_text("\n".join((header, *rows)) + "\n")
    return path


@pytest.mark.parametrize(
    "stamp",
    ["2024-03-01T12:00:{:06.3f}", "2024-03-01 12:00:{:06.3f}", "2024-03-01T12:00:{:06.3f}Z", "12:00:{:06.3f}",
     "2024-03-01T12:00:{:09.6f}+01:00", "2024/03/01 12:00:{:06.3f}", "01.03.2024 12:00:{:06.3f}",
     "03/01/2024 11:59:{:06.3f} PM"],
)  # fmt: skip
def test_a_date_or_clock_time_is_the_time(tmp_path, stamp):
    found = read_foreign((table(tmp_path, [stamp.format(5 + k / 50) for k in range(60)]),), None)
    assert (found.recording.sample_rate_hz, len(found.recording)) == (50.0, 60)
    assert f"Logged: read as seconds since {stamp.format(5)}." in found.notes


@pytest.mark.parametrize("header", ["Date,Time,fx [N],ax [m/s^2]", "Time fx_N ax_mps2 [m/s^2]"])
def test_a_date_and_a_clock_time_in_columns_of_their_own_are_one_time(tmp_path, header):
    mark = "," if "," in header else " "
    evening = [f"2024-03-01{mark}23:59:{54 + k / 5:04.1f}" for k in range(30)]
    stamps = evening + [f"2024-03-02{mark}00:00:{k / 5:04.1f}" for k in range(30)]
    found = read_arrays(table(tmp_path, stamps, header, mark), CsvMap())
    assert found.clocks == ("Time [s]",)
    np.testing.assert_allclose(found.by_name["Time [s]"], np.arange(60) / 5, atol=1e-9)


def test_clock_times_without_a_date_pass_midnight(tmp_path):
    stamps = ["23:59:59.8", "23:59:59.9", "00:00:00.0", "00:00:00.1"]
    found = read_arrays(table(tmp_path, stamps), CsvMap()).by_name["Logged [s]"]
    np.testing.assert_allclose(found, np.arange(4) / 10, atol=1e-9)


@pytest.mark.parametrize("missing", [0, 2])
def test_a_missing_stamp_leaves_the_others_as_they_are(tmp_path, missing):
    stamps = ["23:59:59.8", "23:59:59.9", "00:00:00.0", "00:00:00.1"]
    stamps[missing] = ""
    seconds = np.arange(4) / 10 - (0.1 if missing == 0 else 0.0)
    seconds[missing] = np.nan
    found = read_arrays(table(tmp_path, stamps), CsvMap()).by_name["Logged [s]"]
    np.testing.assert_allclose(found, seconds, atol=1e-9)


def test_a_missing_first_date_of_a_stored_array_leaves_the_others_as_they_are(tmp_path):
    np.savez(tmp_path / "a.npz", when=np.array(["NaT", "2024-03-01T12:00:01", "2024-03-01T12:00:02"], "M8[s]"))
    found = read_arrays(tmp_path / "a.npz", CsvMap())
    np.testing.assert_array_equal(found.by_name["when [s]"], [np.nan, 0.0, 1.0])
    assert found.notes == ("when: read as seconds since 2024-03-01T12:00:01.",)


def test_a_date_whose_order_is_open_is_refused(tmp_path):
    with pytest.raises(ImportRefusedError, match="'02/03/2024' may be day and month or month and day; write dates as"):
        read_arrays(table(tmp_path, ["02/03/2024 12:00:00", "03/03/2024 12:00:00"]), CsvMap())


def test_a_stamp_that_is_none_is_named_with_what_is_understood(tmp_path):
    with pytest.raises(
        ImportRefusedError, match=r"Line 3, .*'2024-03-01T12:60' is not a number; dates and clock times"
    ):
        read_whole(table(tmp_path, ["2024-03-01T12:59:00", "2024-03-01T12:60"]), CsvMap())


def test_dates_in_stored_arrays_are_read_too(tmp_path):
    stamps = np.datetime64("2024-03-01T12:00:00.000000") + np.arange(40) * np.timedelta64(2500, "us")
    np.savez(tmp_path / "a.npz", when=stamps, said=stamps.astype(str))
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["when"] = [str(stamp) for stamp in stamps]
    for name in ("a.npz", "a.h5"):
        found = read_arrays(tmp_path / name, CsvMap())
        assert found.clocks[0] == "when [s]"
        for clock in found.clocks:
            np.testing.assert_allclose(found.by_name[clock], np.arange(40) / 400, atol=1e-9)


@pytest.mark.parametrize(("turn", "word"), [(-3600.0, "set back by an hour"), (3600.0, "set to summer time")])
def test_a_clock_change_is_named_and_the_key_that_mends_it_works(files, turn, word):
    path = files(u=U, y=Y, t=np.arange(N) / 50 + turn * (np.arange(N) >= 100))
    said = refusal(map_text(CLOCK), path)
    assert word in said
    assert "at sample 100" in said
    mended = said[said.index('time = "') :].rstrip(".")
    found = built(map_text(f'{mended}\ntime_unit = "s"'), path).recording
    assert (found.sample_rate_hz, len(found)) == (50.0, N)


def test_a_log_of_changes_says_its_gaps_and_the_key_that_bridges_them(files):
    kept = np.r_[0:200, 205:N]
    path = files(u=U[kept], y=Y[kept], t=kept / 100)
    (gaps,) = [note for note in built(map_text(CLOCK), path).notes if "gap" in note]
    key = gaps[gaps.index("gap_s = ") :].split(" and ")[0]
    assert key == "gap_s = 0.0606"
    said = refusal(map_text(f"{CLOCK}\n{key}"), path)
    assert 'state how: resample = "held"' in said
    assert 'at the top of the map, hold = "linear"' in said
    bridged = map_text(f"{CLOCK}\n{key}", 'resample = "linear"', 'resample = "linear"', 'hold = "linear"\n')
    found = built(bridged, path)
    assert np.isfinite(found.recording.command.samples).all()
    assert not [note for note in found.notes if "missing" in note]


def test_what_only_a_map_can_mend_comes_with_a_map_that_knows_the_header(tmp_path):
    stamps = [f"{k / 100 + 0.004 * (k % 2):.3f}" for k in range(60)]
    with pytest.raises(MapNeededError) as needed:
        read_foreign((table(tmp_path, stamps, "time [s],fx [N],ax [m/s^2]"),), None)
    assert "at the top of the map rate_hz = " in needed.value.happened
    assert 'hold = "linear"' in needed.value.happened
    assert 'role = "command"' in needed.value.skeleton
    assert 'time_unit = "s"' in needed.value.skeleton


def test_equal_clocks_and_empty_columns_are_left_out_and_that_is_said(tmp_path):
    header = "time [s],time_ms [ms],Time rel [s],fx [N],spare [V],ax [m/s^2]"
    rows = [f"{5 + k / 50:.2f},{20 * k + 7},{k / 50:.2f},{k % 7},,{k % 5}" for k in range(60)]
    (tmp_path / "a.csv").write_text("\n".join((header, *rows)) + "\n")
    found = read_foreign((tmp_path / "a.csv",), None)
    assert (found.recording.command.channels, found.recording.response.channels) == (("fx",), ("ax",))
    assert found.recording.condition is None
    assert [note for note in found.notes if note.startswith("Left out")] == [
        "Left out: 'spare [V]' holds no numbers at all.",
        "Left out: 'time_ms [ms]' is the same time as 'time [s]'.",
        "Left out: 'Time rel [s]' is the same time as 'time [s]'.",
    ]
    text = make_map_skeleton(read_arrays(tmp_path / "a.csv", CsvMap()))
    assert (text.count("[[clock]]"), text.count("[[channel]]")) == (1, 2)
    assert "# spare [V] holds no numbers at all" in text


def test_clocks_that_differ_are_not_left_out(tmp_path):
    header = "time [s],time daq [s],fx [N],ax [m/s^2]"
    rows = [f"{k / 50:.3f},{k / 50.5:.3f},{k % 7},{k % 5}" for k in range(60)]
    (tmp_path / "a.csv").write_text("\n".join((header, *rows)) + "\n")
    arrays = read_arrays(tmp_path / "a.csv", CsvMap())
    assert make_header_map(arrays) is None
    assert make_map_skeleton(arrays).count("[[clock]]") == 2


def test_a_coarse_time_is_proposed_as_the_time_and_its_import_names_the_rate(files):
    path = files(t=np.floor(np.arange(N) / 2) / 100, u=U, y=Y)
    assert 'time = "t"' in make_map_skeleton(read_arrays(path, CsvMap()))
    assert "as in rate_hz = 200.5" in refusal(map_text(CLOCK), path)


def test_a_device_that_moves_freely_has_a_command_of_zeros(files, tmp_path):
    free = map_text().replace('role = "command"', 'role = "position"').replace('"N"', '"mm"')
    with pytest.raises(UnusableFileError, match="for a device that moves freely, write a force of zero") as refused:
        built(free, files())
    keys = 'role = "command"', 'name = "none"', 'value = "0 * clock_s"', 'unit = "N"'
    assert all(key in str(refused.value) for key in keys)
    found = built(free + "\n[[computed]]\n" + "\n".join(keys), files()).recording
    assert not found.command.samples.any()


@pytest.mark.parametrize(
    ("time", "unit", "step"),
    [
        ((np.arange(200) * 1000) % 65536, "us", 1e-3),
        ((2**32 - 50_000 + np.arange(100) * 1000) % 2**32, "us", 1e-3),
        (np.arange(5000) / 1000 + 7200 - 3600 * (np.arange(5000) > 2000), "s", 1e-3),
        (np.arange(5000) / 1000 + 7200 + 3600 * (np.arange(5000) > 2000), "s", 1e-3),
    ],
)
@pytest.mark.parametrize("name", ["time [{}]", "t_{}"])
def test_the_mend_that_is_said_of_a_clock_mends_it(tmp_path, time, unit, step, name):
    header = name.format(unit)
    path = table(
        tmp_path,
        [f"{stamp:.9g}" if unit == "s" else f"{stamp:d}" for stamp in time],
        f"{header},force_N,acceleration_mps2",
    )
    with pytest.raises(MapNeededError) as refused:
        read_foreign((path,), None)
    mended = re.search('mends it: (time = ".*")', refused.value.happened)
    assert mended is not None
    clock = f'[[clock]]\n{mended[1]}\ntime_unit = "{unit}"\n'
    channels = "".join(
        f'[[channel]]\nrole = "{role}"\nname = "{column}"\nvalue = "{column}"\nunit = "{of}"\n'
        for role, column, of in (("command", "force_N", "N"), ("response", "acceleration_mps2", "m/s^2"))
    )
    (tmp_path / "map.toml").write_text(f'device = "rig"\nhold = "zero-order"\n{clock}{channels}')
    found = read_foreign((path,), str(tmp_path / "map.toml")).recording
    assert (found.sample_rate_hz, len(found)) == (pytest.approx(1 / step), len(time))


@pytest.mark.parametrize(("step_s", "is_time"), [(0.001, True), (1.0, False)])
def test_an_even_first_column_without_a_name_is_proposed_as_time_unless_it_numbers_the_rows(tmp_path, step_s, is_time):
    (tmp_path / "a.txt").write_text("".join(f"{step_s * k:g} {(-1) ** k} {k % 5}\n" for k in range(40)))
    skeleton = make_map_skeleton(read_arrays(tmp_path / "a.txt", CsvMap()))
    assert ('time = "column1"' in skeleton) == is_time
    assert skeleton.count("[[channel]]") == 3 - is_time
