"""The example of docs/importing.md is run as it stands."""

import re
from pathlib import Path

import numpy as np
import pytest
from scipy import signal as sg

from study.importing.map_library import list_shipped_maps
from study.workflows.recording.import_recording import ImportPlan, import_recording

PAGE = (Path(__file__).parents[4] / "docs" / "importing.md").read_text("utf-8")
FINE_HZ = 60_000.0


@pytest.fixture
def velocity_mm_per_s():
    noise = np.random.default_rng(7).standard_normal(int(2.2 * FINE_HZ))
    fine = sg.sosfiltfilt(sg.butter(3, [3.0, 60.0], "bandpass", fs=FINE_HZ, output="sos"), noise)
    return lambda times_s: np.interp(times_s, np.arange(len(fine)) / FINE_HZ, 50 * fine / fine.std())


def write(path, header, columns):
    rows = [",".join(f"{value:.9g}" for value in row) for row in np.column_stack(columns)]
    path.write_text("\n".join([header, *rows]) + "\n")


def test_the_example_aligns_two_loggers_and_reports_it(tmp_path, velocity_mm_per_s):
    daq_s, drive_s = np.arange(0, 2.0, 1 / 2000), np.arange(0.1, 2.1, 1 / 1000)
    fine_s = np.arange(0, 2.1, 1 / FINE_HZ)
    place_mm = np.cumsum(velocity_mm_per_s(fine_s)) / FINE_HZ
    counts = np.round(np.interp(drive_s, fine_s, place_mm) * 5000)
    current = np.random.default_rng(8).choice([-10.0, 10.0], len(drive_s))
    load = 0.3 + 0.001 * velocity_mm_per_s(daq_s) * (daq_s > 0.06)
    write(tmp_path / "daq_3.csv", "time [s],velocity [mm/s],load cell [V]", [daq_s, velocity_mm_per_s(daq_s), load])
    write(tmp_path / "drive_3.csv", "t,counts,current", [1e3 * (drive_s - 0.1), counts, current])
    (tmp_path / "m.toml").write_text(re.findall(r"```toml\n(.*?)```", PAGE, re.DOTALL)[0])
    files = (tmp_path / "daq_3.csv", tmp_path / "drive_3.csv")
    done = import_recording(ImportPlan(files, str(tmp_path / "m.toml"), tmp_path / "r.h5"))
    assert done.recording.meta["parts"][0]["clock_offsets_s"]["drive"] == pytest.approx(0.1, abs=1e-4)
    assert done.notes[0].startswith("Clock 'drive' is moved by 100")
    assert done.recording.response.units == ("m/s", "N")
    assert set(np.unique(done.recording.command.samples.round(12))) == {-0.231, 0.231}
    assert [segment.role for segment in done.recording.segments] == ["fit", "test"]
    assert done.recording.position is not None


def test_a_table_with_the_headers_of_the_page_needs_no_map(tmp_path):
    """It named x_mm, whose unit is not sure."""
    (headers,) = re.findall(r"# header with units: (.*)", PAGE)
    for number, header in enumerate(headers.split("; ")):
        header = f"{header},ax [g]"  # the first example has no response
        times_s = np.arange(200) / 1000
        columns = [times_s, *(np.sin(factor * times_s) for factor in range(9, 9 + header.count(",")))]
        write(tmp_path / f"{number}.csv", header, columns)
        done = import_recording(ImportPlan((tmp_path / f"{number}.csv",), None, tmp_path / f"{number}.h5"))
        assert done.map == "header" and len(done.recording) == 200
    assert number == 1


def test_every_shipped_map_is_on_the_page():
    assert all(f"| `{name}` |" in PAGE for name in list_shipped_maps())
