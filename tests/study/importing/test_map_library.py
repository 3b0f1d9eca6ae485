import numpy as np
import pytest

from study.errors import WrongUseError
from study.importing.map_library import (
    find_map_for_files,
    find_maps_for_folder,
    list_shipped_maps,
    make_map_from_headers,
    read_map,
)
from study.store.disk.file_errors import UnusableFileError

OWN = """
device = "rig"
files = ["run*.npz"]
separate = true
[[clock]]
rate_hz = 100
[[channel]]
role = "command"
name = "fx"
value = "u"
unit = "N"
[[channel]]
role = "response"
name = "ax"
value = "y"
unit = "m/s^2"
"""


@pytest.mark.parametrize("name", list_shipped_maps())
def test_every_shipped_map_is_sound_and_says_what_it_is_of(name):
    found = read_map(name)
    assert found.map.title
    assert found.map.files != ("*",)
    assert found.map.segment


def test_a_map_that_is_not_there_is_wrong_use_with_those_that_are():
    with pytest.raises(WrongUseError) as refused:
        read_map("silverbocks")
    assert "'silverbocks' is neither a file nor a map that comes with hapteq; did you mean 'silverbox'" in str(
        refused.value
    )


def test_a_map_in_the_folder_goes_before_ours(tmp_path):
    for name in ("run1.npz", "run2.npz", "other.npz"):
        np.savez(tmp_path / name, u=np.zeros(9), y=np.zeros(9))
    (tmp_path / "own.toml").write_text(OWN)
    (tmp_path / "nothing_of_the_kind.toml").write_text("[tool]\n")
    found = find_maps_for_folder(tmp_path)
    assert [(entry.name, [path.name for path in entry.files]) for entry in found] == [
        ("own_run1", ["run1.npz"]), ("own_run2", ["run2.npz"]),
    ]  # fmt: skip


def test_a_map_in_the_folder_that_is_wrong_is_reported_and_not_passed_over(tmp_path):
    (tmp_path / "own.toml").write_text(OWN.replace("unit", "uint"))
    with pytest.raises(UnusableFileError, match="did you mean unit"):
        find_maps_for_folder(tmp_path)


def test_a_file_of_the_same_name_with_other_arrays_is_not_ours(tmp_path):
    for name in ("estimation.npz", "validation.npz"):
        np.savez(tmp_path / name, u=np.zeros(9))
    assert find_maps_for_folder(tmp_path) == ()


def test_half_of_a_recording_is_not_found(tmp_path):
    np.savez(
        tmp_path / "estimation.npz", t_s=np.arange(9.0), u_V=0.0, y_m=0.0, y_ref_m=0.0, gain_N_per_V=1.0, kp=1, kv=1
    )
    assert find_maps_for_folder(tmp_path) == ()


def emps_like(folder, *names):
    for name in names:
        samples = np.arange(40.0)
        np.savez(
            folder / name, t_s=samples / 1000, u_V=samples, y_m=samples, y_ref_m=samples, gain_N_per_V=1.0, kp=1, kv=1
        )
    return [folder / name for name in names]


def test_files_that_one_map_of_ours_fits_name_it(tmp_path):
    found = find_map_for_files(emps_like(tmp_path, "estimation.npz", "validation.npz"))
    assert found is not None
    assert found.name == "emps"


def test_some_files_of_a_map_or_one_more_name_none(tmp_path):
    files = emps_like(tmp_path, "estimation.npz", "validation.npz", "other.npz")
    assert find_map_for_files(files[:1]) is None
    assert find_map_for_files(files) is None


def test_a_raised_digit_in_a_file_name_is_no_number(tmp_path):
    rows = "".join(f"{k / 100},{k},{k * k}\n" for k in range(50))
    for name in ("²10.csv", "²9.csv"):
        (tmp_path / name).write_text(f"time [s],fx [N],ax [m/s^2]\n{rows}")
    assert [path.name for path in make_map_from_headers(tmp_path).files] == ["²9.csv", "²10.csv"]
