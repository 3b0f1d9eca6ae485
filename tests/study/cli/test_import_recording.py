import json

import numpy as np
import pytest

from study.cli.main import main

pytestmark = pytest.mark.usefixtures("validated_here")

ROWS = [f"{k / 100:.2f},{k % 7},{k % 5}" for k in range(50)]


@pytest.fixture
def table(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text("time [s],fx [N],ax [m/s^2]\n" + "\n".join(ROWS) + "\n")
    return path


def test_the_recording_goes_to_stdout_and_what_was_done_to_stderr(table, tmp_path, capsys):
    out = tmp_path / "r.h5"
    assert main(["import", str(table), "--out", str(out)]) == 0
    said = capsys.readouterr()
    assert said.out == f"{out}\n"
    assert "Note: Taken from the header: fx as command, ax as response." in said.err
    assert main(["validate", str(out)]) == 0


def test_a_program_may_read_the_result(table, tmp_path, capsys):
    assert main(["import", str(table), "--json", "--out", str(tmp_path / "r.h5")]) == 0
    found = json.loads(capsys.readouterr().out)
    assert (found["sample_rate_hz"], found["samples"], found["command"]) == (100.0, 50, ["fx"])


def test_a_map_to_complete_goes_to_stdout_and_why_to_stderr(tmp_path, capsys):
    np.savez(tmp_path / "a.npz", u=np.arange(20.0), y=np.arange(20.0))
    assert main(["import", str(tmp_path / "a.npz"), "--out", str(tmp_path / "r.h5")]) == 2
    said = capsys.readouterr()
    assert said.out.startswith("# A map for a.npz.")
    assert "a.npz needs a map" in said.err
    assert "keep it as MAP.toml" in said.err
    assert not (tmp_path / "r.h5").exists()


def test_a_file_that_is_wrong_is_an_error_of_its_own(table, tmp_path, capsys):
    table.write_text(table.read_text().replace("0.10,", "ten,"))
    assert main(["import", str(table), "--out", str(tmp_path / "r.h5")]) == 1
    assert "Line 12, column 'time [s]': 'ten' is not a number; correct it, or leave it empty" in capsys.readouterr().err


def test_a_map_that_does_not_exist_is_wrong_use(table, tmp_path, capsys):
    assert main(["import", str(table), "--map", "emp", "--out", str(tmp_path / "r.h5")]) == 2
    assert "did you mean 'emps'" in capsys.readouterr().err


def test_a_recording_that_is_there_is_not_overwritten(table, tmp_path, capsys):
    assert main(["import", str(table), "--out", str(table)]) == 1
    assert "exists already, and recordings are never overwritten" in capsys.readouterr().err
