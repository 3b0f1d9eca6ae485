"""A laboratory's blind test: drawn, and sealed once."""

import hashlib
import shutil
import subprocess
from pathlib import Path

import pytest

from analysis.evaluation.blind_test.lab_kit import CHANGES, CONTROL_CHANGE
from equalizer.plant.effect_vocabulary import EFFECTS_BY_NAME
from study.errors import StudyError
from study.evaluation.kit.lab_kit import draw_labels, read_labels, seal_labels

BYTE_ORDER_MARK = b"\xef\xbb\xbf"


def test_every_right_answer_is_a_name_of_the_vocabulary():
    assert {effect for change in CHANGES for effect in change.effects} <= set(EFFECTS_BY_NAME)


def test_nothing_is_changed_twice_as_often_and_the_order_is_drawn(tmp_path: Path) -> None:
    labels = draw_labels(tmp_path / "one.csv", 2, seed=1)
    other = draw_labels(tmp_path / "other.csv", 2, seed=2)
    assert [label.recording for label in labels] == [f"rec_{n:02d}" for n in range(1, 15)]
    assert [label.change for label in labels].count(CONTROL_CHANGE) == 4
    assert [label.change for label in labels] != [each.change for each in other]
    assert len({label.salt for label in labels}) == 14
    assert read_labels(tmp_path / "one.csv") == labels


def test_a_table_of_something_else_is_refused(tmp_path: Path) -> None:
    table = tmp_path / "labels.csv"
    table.write_text("recording,change,value,note,salt\nrec_01,added_masss,,,a\nrec_01,nothing,,,b\n")
    with pytest.raises(StudyError) as refusal:
        read_labels(table)
    assert "'added_masss' is no change of the kit" in str(refusal.value)
    assert "rec_01 is there twice" in str(refusal.value)
    assert refusal.value.do_now.startswith("Correct it before it is sealed")


@pytest.mark.parametrize("name", ["../x", "./rec_01", "rec_01/", "/tmp/rec_01", "..", "", "rec_01 ", "a\\b"])
def test_a_recording_whose_name_is_a_path_is_not_sealed(tmp_path: Path, name: str) -> None:
    """Two spellings of one folder would count its diagnosis twice."""
    table = tmp_path / "labels.csv"
    table.write_text(f"recording,change,value,note,salt\nrec_01,nothing,,,a\n{name},nothing,,,b\n")
    with pytest.raises(StudyError, match="is no name of a recording"):
        seal_labels(table)
    assert not (tmp_path / "labels.csv.sha256").exists()


@pytest.mark.parametrize("value", ["nan", "inf", "-inf", "1e999"])
def test_a_value_that_is_not_finite_is_not_sealed(tmp_path: Path, value: str) -> None:
    table = tmp_path / "labels.csv"
    table.write_text(f"recording,change,value,note,salt\nrec_01,added_mass,{value},,a\n")
    with pytest.raises(StudyError, match="no finite number"):
        seal_labels(table)


def test_a_table_with_its_seal_keeps_it(tmp_path: Path) -> None:
    table = tmp_path / "labels.csv"
    draw_labels(table, 1, seed=3)
    digest = seal_labels(table)
    assert digest == hashlib.sha256(table.read_bytes()).hexdigest()
    assert (tmp_path / "labels.csv.sha256").read_text() == f"{digest}  labels.csv\n"
    assert seal_labels(table) == digest


def test_a_table_that_was_sealed_otherwise_is_not_sealed_again(tmp_path: Path) -> None:
    table = tmp_path / "labels.csv"
    draw_labels(table, 1, seed=3)
    first = seal_labels(table)
    table.write_text(table.read_text().replace("added_mass", "nothing"))
    with pytest.raises(StudyError, match="sealed before, with another hash") as refusal:
        seal_labels(table)
    assert f"labels.csv.sha256 says {first}" in refusal.value.happened
    assert hashlib.sha256(table.read_bytes()).hexdigest() in refusal.value.happened
    assert (tmp_path / "labels.csv.sha256").read_text() == f"{first}  labels.csv\n"


def test_a_seal_that_says_nothing_is_not_filled_in(tmp_path: Path) -> None:
    table = tmp_path / "labels.csv"
    draw_labels(table, 1, seed=3)
    (tmp_path / "labels.csv.sha256").write_text("")
    with pytest.raises(StudyError) as refusal:
        seal_labels(table)
    assert "labels.csv.sha256 says no hash" in refusal.value.happened
    assert (tmp_path / "labels.csv.sha256").read_text() == ""


def test_a_table_that_a_spreadsheet_program_saved_is_sealed_as_it_lies_there(tmp_path: Path) -> None:
    table = tmp_path / "labels.csv"
    drawn = draw_labels(table, 1, seed=3)
    table.write_bytes(BYTE_ORDER_MARK + table.read_bytes().replace(b"\n", b"\r\n"))
    assert seal_labels(table) == hashlib.sha256(table.read_bytes()).hexdigest()
    assert read_labels(table) == drawn
    if shutil.which("sha256sum"):
        subprocess.run(["sha256sum", "--check", "labels.csv.sha256"], cwd=tmp_path, check=True, capture_output=True)
