"""The sample rate, or the step, in the first row of a table without a time."""

import numpy as np
import pytest

from study.importing.arrays.read_arrays import read_arrays
from study.importing.map_format.import_map import CsvMap
from study.importing.map_format.map_errors import MapNeededError
from study.workflows.recording.import_recording import read_foreign
from tests.recording_maps import built, map_text


def table(tmp_path, header, first):
    path = tmp_path / "run.csv"
    path.write_text("\n".join((header, *(f"{k % 7},{k % 5},{'' if k else first}" for k in range(30)))) + "\n")
    return path


@pytest.mark.parametrize("first", ["250", "250.0"])
def test_a_number_in_the_first_row_alone_is_a_single_number(tmp_path, first):
    found = read_arrays(table(tmp_path, "u,y,fs", first), CsvMap()).by_name
    assert (found["fs"].shape, float(found["fs"])) == ((), 250)
    assert found["u"].shape == (30,)


@pytest.mark.parametrize(
    ("name", "first"),
    [
        ("fs_Hz", "250"),
        ("Fs [Hz]", "250"),
        ("sampling rate [Hz]", "250"),
        ("sample_rate_hz", "250"),
        ("Ts_s", "0.004"),
        ("dt [s]", "0.004"),
    ],
)
def test_it_is_the_rate_where_its_name_says_so(tmp_path, name, first):
    found = read_foreign((table(tmp_path, f"force [N],travel [mm],{name}", first),), None)
    assert found.recording.sample_rate_hz == pytest.approx(250, rel=1e-12)
    np.testing.assert_array_equal(found.recording.command.samples[:, 0], [k % 7 for k in range(30)])
    assert not any("is no column" in note for note in found.notes)
    assert f"The sample rate is taken from '{name}'." in found.notes


@pytest.mark.parametrize("name", ["excitation rate [Hz]", "frequency [Hz]"])
def test_another_number_in_hertz_is_not_the_rate(tmp_path, name):
    with pytest.raises(MapNeededError, match="no number is the sample rate") as needed:
        read_foreign((table(tmp_path, f"force [N],travel [mm],{name}", "2"),), None)
    assert "\nrate = " not in needed.value.skeleton


def test_a_number_whose_name_is_part_of_that_of_the_rate_is_said_to_be_no_column(tmp_path):
    path = tmp_path / "run.csv"
    rows = (f"{k % 7},{k % 5},{'' if k else 250},{'' if k else 3}" for k in range(30))
    path.write_text("\n".join(("force [N],travel [mm],fs_Hz,s", *rows)) + "\n")
    assert "Left out: 's' is no column." in read_foreign((path,), None).notes


@pytest.mark.parametrize(
    ("name", "first", "line"),
    [("fs", "250", 'rate = "fs"'), ("Fs", "250", 'rate = "Fs"'), ("Ts", "0.004", 'rate = "1 / Ts"')],
)
def test_a_proposed_map_takes_it_and_is_right(tmp_path, name, first, line):
    path = table(tmp_path, f"u,y,{name}", first)
    with pytest.raises(MapNeededError) as needed:
        read_foreign((path,), None)
    assert line in needed.value.skeleton
    assert needed.value.skeleton.count("[[channel]]") == 2
    assert built(map_text(line), path).recording.sample_rate_hz == pytest.approx(250, rel=1e-12)


@pytest.mark.parametrize(
    ("name", "first", "rate"), [("fs_kHz", "0.25", "1000 * fs_kHz"), ("dt_ms", "4", "1000 / dt_ms"),
                                ("Ts [us]", "4000", "1000000 / array('Ts [us]')")]
)  # fmt: skip
def test_its_unit_counts(tmp_path, name, first, rate):
    found = read_foreign((table(tmp_path, f"force [N],travel [mm],{name}", first),), None)
    assert found.recording.sample_rate_hz == pytest.approx(250, rel=1e-12)
    with pytest.raises(MapNeededError) as needed:
        read_foreign((table(tmp_path, f"u,y,{name}", first),), None)
    assert f'rate = "{rate}"           # in hertz\n' in needed.value.skeleton


@pytest.mark.parametrize("name", ["sampling [s]", "rate [ms]", "dt_Hz"])
def test_a_rate_in_seconds_and_a_step_in_hertz_are_not_taken(tmp_path, name):
    with pytest.raises(MapNeededError, match="no number is the sample rate") as needed:
        read_foreign((table(tmp_path, f"force [N],travel [mm],{name}", "0.004"),), None)
    assert "\nrate = " not in needed.value.skeleton


def test_a_rate_whose_name_has_the_word_of_a_step_is_a_rate_only(tmp_path):
    found = read_foreign((table(tmp_path, "force [N],travel [mm],ts sampling rate [Hz]", "250"),), None)
    assert found.recording.sample_rate_hz == 250
