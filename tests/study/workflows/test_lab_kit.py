"""A laboratory's blind test: drawn, sealed, scored, and not to be changed between."""

import hashlib
from pathlib import Path

import pytest

from analysis.diagnosis.document import Diagnosis, Errors, Estimate, Fit, Mismatch, NamedEffect, Rival
from analysis.proof.lab_kit import CHANGES, NOTHING
from equalizer.plant.effect_vocabulary import EFFECTS_BY_NAME
from study.cli.main import main
from study.errors import StudyError
from study.store.diagnosis_file import write_diagnosis
from study.workflows.lab_kit import draw_labels, read_labels, score_kit, score_lines, seal_labels


def diagnosis(effect: str = "", rivals: tuple[str, ...] = (), value: float = 0.05) -> Diagnosis:
    known = EFFECTS_BY_NAME.get(effect)
    errors = Errors(0.5, 0.4, 0.1 if effect else 0.4, 0.05)
    estimate = Estimate(value, "kg", (0.9 * value, 1.1 * value))
    beside = tuple(Rival(one, 0.3, True, "as good") for one in rivals)
    named = (
        ()
        if known is None
        else (NamedEffect(effect, known.place, None, 0.9, 0.9, {known.main.name: estimate}, beside),)
    )
    place = Mismatch("ax", "fx", (1.0, 2.0), None, None, 0.4, 0.001)
    verdict = "explained" if effect else "parameters"
    return Diagnosis(verdict, (place,), named, {}, (), Fit(errors, errors), "free simulation", None)


def test_every_right_answer_is_a_name_of_the_vocabulary():
    assert {effect for change in CHANGES for effect in change.effects} <= set(EFFECTS_BY_NAME)


def test_nothing_is_changed_twice_as_often_and_the_order_is_drawn(tmp_path: Path) -> None:
    labels = draw_labels(tmp_path / "one.csv", 2, seed=1)
    other = draw_labels(tmp_path / "other.csv", 2, seed=2)
    assert [one.recording for one in labels] == [f"rec_{n:02d}" for n in range(1, 15)]
    assert [one.change for one in labels].count(NOTHING) == 4
    assert [one.change for one in labels] != [one.change for one in other]
    assert len({one.salt for one in labels}) == 14
    assert read_labels(tmp_path / "one.csv") == labels


def test_what_was_sealed_is_scored(tmp_path: Path) -> None:
    table = tmp_path / "labels.csv"
    table.write_text(
        "recording,change,value,note,salt\n"
        "rec_01,added_mass,0.05,,a\nrec_02,nothing,,,b\nrec_03,tilted_sensor,8,,c\nrec_04,held_handle,,,d\n"
    )
    assert seal_labels(table) == hashlib.sha256(table.read_bytes()).hexdigest()
    said = {"rec_01": diagnosis("added_mass"), "rec_02": diagnosis(), "rec_03": diagnosis("sensor_gain")}
    for name, one in said.items():
        (tmp_path / "d" / name).mkdir(parents=True)
        write_diagnosis(tmp_path / "d" / name / "diagnosis.json", one)
    score = score_kit(table, tmp_path / "d", tmp_path / "score.csv")
    assert [one.right for one in score.rows] == [True, True, False]
    assert score.rows[0].inside is True
    assert score.missing == ("rec_04",)
    lines = score_lines(score)
    assert lines[0].startswith("changes named: 1 of 2, 50 %")
    assert any("Missed: rec_03, tilted_sensor" in line for line in lines)


def test_a_rival_that_cannot_be_told_apart_counts(tmp_path: Path) -> None:
    table = tmp_path / "labels.csv"
    table.write_text("recording,change,value,note,salt\nrec_01,magnet_brake,,,a\n")
    seal_labels(table)
    (tmp_path / "rec_01").mkdir()
    write_diagnosis(tmp_path / "rec_01" / "diagnosis.json", diagnosis("force_gain", ("viscous_damping",)))
    assert score_kit(table, tmp_path, tmp_path / "score.csv").rows[0].right


def test_a_table_that_was_changed_since_is_refused(tmp_path: Path) -> None:
    table = tmp_path / "labels.csv"
    draw_labels(table, 1, seed=3)
    with pytest.raises(StudyError, match="not those that were sealed") as unsealed:
        score_kit(table, tmp_path, tmp_path / "score.csv")
    assert "There is no seal" in unsealed.value.happened
    seal_labels(table)
    table.write_text(table.read_text().replace("added_mass", "nothing"))
    with pytest.raises(StudyError) as changed:
        score_kit(table, tmp_path, tmp_path / "score.csv")
    assert "another hash" in changed.value.happened


def test_a_table_of_something_else_is_refused(tmp_path: Path) -> None:
    table = tmp_path / "labels.csv"
    table.write_text("recording,change,value,note,salt\nrec_01,added_masss,,,a\nrec_01,nothing,,,b\n")
    with pytest.raises(StudyError) as refusal:
        read_labels(table)
    assert "'added_masss' is no change of the kit" in str(refusal.value)
    assert "rec_01 is there twice" in str(refusal.value)


def test_the_commands_of_the_kit_do_the_same(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    table = tmp_path / "labels.csv"
    assert main(["kit", "draw", "--out", str(table), "--repeats", "1", "--seed", "5"]) == 0
    assert "7 recordings, rec_01 to rec_07" in capsys.readouterr().out
    assert main(["kit", "seal", str(table)]) == 0
    assert capsys.readouterr().out.strip() == hashlib.sha256(table.read_bytes()).hexdigest()
    arguments = ["kit", "score", str(table), "--diagnoses", str(tmp_path), "--out", str(tmp_path / "score.csv")]
    assert main(arguments) == 0
    assert "Without a diagnosis: rec_01" in capsys.readouterr().out
