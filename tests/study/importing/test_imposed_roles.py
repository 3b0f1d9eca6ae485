import numpy as np
import pytest

from study.importing.arrays.read_arrays import read_arrays
from study.importing.map_format.import_map import CsvMap
from study.importing.map_skeleton import make_map_skeleton
from study.workflows.recording.import_recording import read_foreign
from tests.analysis.look.test_imposed_motion import TRIANGLE, driven_motion, hysteretic_force, smooth

COUNT = 4000
PULL = 5 * TRIANGLE[:COUNT]
NOISE = 9 * smooth(np.random.default_rng(4).standard_normal(COUNT))


def table(tmp_path, header, *columns):
    rows = np.column_stack([np.arange(COUNT) / 1000, *columns])
    (tmp_path / "a.csv").write_text(header + "\n" + "\n".join(",".join(f"{x:.6g}" for x in row) for row in rows) + "\n")
    return tmp_path / "a.csv"


@pytest.mark.parametrize("names", ["displacement [mm],load [kN]", "stroke_mm,force_N", "angle [deg],torque [N m]"])
def test_an_imposed_displacement_is_the_command_and_both_ways_are_said(tmp_path, names):
    path = table(tmp_path, f"time [s],{names}", PULL, hysteretic_force(TRIANGLE)[:COUNT])
    found = read_foreign((path,), None)
    assert found.recording.command.quantities[0] in ("position", "angle")
    assert found.recording.response.quantities[0] in ("force", "torque")
    (note,) = [note for note in found.notes if "taken for the command" in note]
    assert note.startswith("The motion is taken for the command")
    assert 'role = "command" for the force, role = "response" for the motion' in note


def test_a_force_that_is_no_answer_stays_the_command_and_both_ways_are_said(tmp_path):
    path = table(tmp_path, "time [s],displacement [mm],load [kN]", driven_motion(NOISE), NOISE)
    found = read_foreign((path,), None)
    assert found.recording.command.quantities == ("force",)
    (note,) = [note for note in found.notes if "taken for the command" in note]
    assert 'role = "command" for the motion, role = "response" for the force' in note


@pytest.mark.parametrize("names", ["displacement [mm],force command [N]", "speed [mm/s],force [N]"])
def test_where_names_say_the_command_the_data_are_not_asked(tmp_path, names):
    path = table(tmp_path, f"time [s],{names}", PULL, hysteretic_force(TRIANGLE)[:COUNT])
    found = read_foreign((path,), None)
    assert found.recording.command.quantities == ("force",)
    assert not [note for note in found.notes if "taken for the command" in note]


def test_the_map_that_is_proposed_has_the_same_roles_and_says_so(tmp_path):
    path = table(tmp_path, "clock,displacement [mm],load [kN]", PULL, hysteretic_force(TRIANGLE)[:COUNT])
    text = make_map_skeleton(read_arrays(path, CsvMap()))
    roles = [line.split('"')[1] for line in text.splitlines() if line.startswith("role = ")]
    assert roles[-2:] == ["command", "response"]
    assert "# The motion is taken for the command" in text


def test_of_more_forces_than_motions_it_is_said_that_they_may_be_the_response(tmp_path):
    path = table(tmp_path, "time [s],fx [N],fy [N],speed [mm/s]", NOISE, NOISE[::-1], PULL)
    assert any(note.startswith("The force is taken for the command.") for note in read_foreign((path,), None).notes)
