"""A laboratory's blind test: revealed, and scored by all that was recorded."""

from pathlib import Path

import pytest

from analysis.diagnosis.document import Diagnosis, Errors, Estimate, Fit, Mismatch, NamedEffect, Rival
from equalizer.plant.effect_vocabulary import EFFECTS_BY_NAME
from study.cli.main import main
from study.errors import StudyError
from study.evaluation.kit.lab_kit import seal_labels
from study.evaluation.kit.score_kit import format_score_lines, score_kit
from study.store.formats.diagnosis_file import write_diagnosis

LABELS = (
    "recording,change,value,note,salt\n"
    "rec_01,added_mass,0.05,,a\nrec_02,nothing,,,b\nrec_03,tilted_sensor,8,,c\nrec_04,held_handle,,,d\n"
)


def diagnosis(effect: str = "", rivals: tuple[str, ...] = (), value: float = 0.05, unit: str = "") -> Diagnosis:
    known = EFFECTS_BY_NAME.get(effect)
    errors = Errors(0.5, 0.4, 0.1 if effect else 0.4, 0.05)
    estimate = Estimate(value, unit or (known.main.unit if known else "1"), (0.9 * value, 1.1 * value))
    beside = tuple(Rival(rival, 0.3, True, "as good") for rival in rivals)
    named = (
        ()
        if known is None
        else (NamedEffect(effect, known.place, None, 0.9, 0.9, {known.main.name: estimate}, beside),)
    )
    place = Mismatch("ax", "fx", (1.0, 2.0), None, None, 0.4, 0.001)
    verdict = "explained" if effect else "parameters"
    return Diagnosis(verdict, (place,), named, {}, (), Fit(errors, errors), "free simulation", None)


def answered(folder: Path, said: dict[str, Diagnosis]) -> Path:
    for name, each in said.items():
        (folder / name).mkdir(parents=True)
        write_diagnosis(folder / name / "diagnosis.json", each)
    return folder


def labels_in(folder: Path, text: str = LABELS) -> Path:
    (folder / "labels.csv").write_text(text)
    return folder / "labels.csv"


def test_what_was_sealed_is_scored(tmp_path: Path) -> None:
    table = labels_in(tmp_path)
    seal_labels(table)
    said = {"rec_01": diagnosis("added_mass"), "rec_02": diagnosis(), "rec_03": diagnosis("sensor_gain")}
    score = score_kit(table, answered(tmp_path / "d", said), tmp_path / "score.csv")
    assert [row.right for row in score.rows] == [True, True, False, False]
    assert score.rows[0].inside is True
    lines = format_score_lines(score)
    assert lines[0].startswith("changes named: 1 of 3, 33 %")
    assert lines[1].startswith("nothing changed, nothing named: 1 of 1, 100 %")
    assert "Missed: rec_03, tilted_sensor: explained, named sensor_gain." in lines
    assert "Missing: rec_04, held_handle: no diagnosis; it counts as not right." in lines
    assert (tmp_path / "score.csv").read_text().splitlines()[4] == "rec_04,held_handle,,missing,,,false,"


def test_leaving_out_a_diagnosis_raises_no_figure(tmp_path: Path) -> None:
    """Each of the three is wrong in another way: a change not named, a false alarm, a number outside its interval."""
    table = labels_in(tmp_path)
    seal_labels(table)
    bad = {
        "rec_01": diagnosis("added_mass", value=0.5),
        "rec_02": diagnosis("added_mass"),
        "rec_03": diagnosis("sensor_gain"),
        "rec_04": diagnosis("hand_impedance"),
    }
    whole = score_kit(table, answered(tmp_path / "all", bad), tmp_path / "all.csv").figures
    for name in ("rec_01", "rec_02", "rec_03"):
        kept = {other: each for other, each in bad.items() if other != name}
        fewer = score_kit(table, answered(tmp_path / f"no_{name}", kept), tmp_path / f"no_{name}.csv").figures
        assert [each.name for each in fewer] == [each.name for each in whole]
        assert all((less.value or 0.0) <= (more.value or 0.0) for less, more in zip(fewer, whole, strict=True))


def test_a_missing_number_counts_as_outside_its_interval(tmp_path: Path) -> None:
    table = labels_in(tmp_path)
    seal_labels(table)
    said = {"rec_02": diagnosis(), "rec_03": diagnosis("sensor_misalignment", value=8.0)}
    score = score_kit(table, answered(tmp_path / "d", said), tmp_path / "score.csv")
    assert [row.inside for row in score.rows] == [False, None, True, None]


def test_a_value_of_a_change_without_a_unit_is_compared_with_no_interval(tmp_path: Path) -> None:
    """A grip force in newtons must not be compared with the hand's mass in kilograms."""
    table = labels_in(tmp_path, "recording,change,value,note,salt\nrec_01,held_handle,2,grip force in N,a\n")
    seal_labels(table)
    said = {"rec_01": diagnosis("hand_impedance")}
    assert score_kit(table, answered(tmp_path / "d", said), tmp_path / "score.csv").rows[0].inside is None


@pytest.mark.parametrize(("value", "inside"), [(0.0002, True), (0.002, False)])
def test_a_play_is_compared_with_the_interval_of_the_effect_that_was_named(
    tmp_path: Path, value: float, inside: bool
) -> None:
    table = labels_in(tmp_path, "recording,change,value,note,salt\nrec_01,loosened_cable,0.0002,,a\n")
    seal_labels(table)
    said = {"rec_01": diagnosis("loose_joint", value=value)}
    row = score_kit(table, answered(tmp_path / "d", said), tmp_path / "score.csv").rows[0]
    assert (row.right, row.inside) == (True, inside)


def test_a_value_is_not_compared_with_an_interval_in_another_unit(tmp_path: Path) -> None:
    """On a rotating device an added mass is a moment of inertia."""
    table = labels_in(tmp_path)
    seal_labels(table)
    said = {"rec_01": diagnosis("added_mass", value=0.0004, unit="kg m^2")}
    row = score_kit(table, answered(tmp_path / "d", said), tmp_path / "score.csv").rows[0]
    assert (row.right, row.inside) == (True, None)


def test_a_rival_that_cannot_be_told_apart_counts(tmp_path: Path) -> None:
    table = labels_in(tmp_path, "recording,change,value,note,salt\nrec_01,magnet_brake,,,a\n")
    seal_labels(table)
    said = {"rec_01": diagnosis("force_gain", ("viscous_damping",))}
    assert score_kit(table, answered(tmp_path / "d", said), tmp_path / "score.csv").rows[0].right


def test_a_table_that_was_changed_since_is_refused(tmp_path: Path) -> None:
    table = labels_in(tmp_path)
    with pytest.raises(StudyError, match="not those that were sealed") as unsealed:
        score_kit(table, tmp_path, tmp_path / "score.csv")
    assert "There is no seal" in unsealed.value.happened
    digest = seal_labels(table)
    table.write_text(LABELS.replace("added_mass", "nothing"))
    with pytest.raises(StudyError) as changed:
        score_kit(table, tmp_path, tmp_path / "score.csv")
    assert f"labels.csv.sha256 says {digest}" in changed.value.happened


def test_a_table_that_was_sealed_again_does_not_fit_the_hash_that_was_handed_over(tmp_path: Path) -> None:
    table = labels_in(tmp_path)
    handed_over = seal_labels(table)
    folder = answered(tmp_path / "d", {"rec_01": diagnosis("added_mass")})
    (tmp_path / "labels.csv.sha256").unlink()
    table.write_text(LABELS.replace("tilted_sensor,8", "added_mass,8"))
    anew = seal_labels(table)
    assert score_kit(table, folder, tmp_path / "unbound.csv").sha256 == anew
    with pytest.raises(StudyError, match="not those that were sealed") as refusal:
        score_kit(table, folder, tmp_path / "score.csv", handed_over)
    assert f"labels.csv has the hash {anew}; --seal gives {handed_over}" in refusal.value.happened
    assert not (tmp_path / "score.csv").exists()


def test_the_hash_that_was_handed_over_needs_no_file_beside_the_table(tmp_path: Path) -> None:
    table = labels_in(tmp_path)
    digest = seal_labels(table)
    (tmp_path / "labels.csv.sha256").unlink()
    folder = answered(tmp_path / "d", {"rec_01": diagnosis("added_mass")})
    pasted = f" {digest.upper()}  labels.csv\n"
    last = format_score_lines(score_kit(table, folder, tmp_path / "score.csv", pasted))[-1]
    assert last == f"Labels: SHA-256 {digest}, the hash that --seal gives."


def test_without_the_hash_it_is_said_that_only_the_file_beside_was_compared(tmp_path: Path) -> None:
    table = labels_in(tmp_path)
    digest = seal_labels(table)
    folder = answered(tmp_path / "d", {"rec_01": diagnosis("added_mass")})
    last = format_score_lines(score_kit(table, folder, tmp_path / "score.csv"))[-1]
    assert last.startswith(f"Labels: SHA-256 {digest}, compared only with labels.csv.sha256 in the same folder")
    assert "give --seal the hash" in last


@pytest.mark.parametrize("typed", ["", "abc", "0" * 63, "g" * 64])
def test_what_is_no_hash_is_wrong_use(tmp_path: Path, typed: str) -> None:
    table = labels_in(tmp_path)
    seal_labels(table)
    with pytest.raises(StudyError, match="That is no SHA-256") as refusal:
        score_kit(table, tmp_path, tmp_path / "score.csv", typed)
    assert refusal.value.exit_code == 2
    assert f"--seal gives '{typed}'" in refusal.value.happened


def test_a_folder_without_diagnoses_is_an_error_and_the_right_one_scores_after(tmp_path: Path) -> None:
    table, out = labels_in(tmp_path), tmp_path / "score.csv"
    seal_labels(table)
    (tmp_path / "empty").mkdir()
    with pytest.raises(StudyError, match="There is no such folder") as none:
        score_kit(table, tmp_path / "diagnosis", out)
    assert "diagnosis is no folder of diagnoses" in none.value.happened
    with pytest.raises(StudyError, match="There is no diagnosis to score") as empty:
        score_kit(table, tmp_path / "empty", out)
    assert "such as rec_01/diagnosis.json" in empty.value.happened
    assert not out.exists()
    assert score_kit(table, answered(tmp_path / "d", {"rec_02": diagnosis()}), out).rows[1].right


def test_a_torn_diagnosis_is_named_by_its_folder(tmp_path: Path) -> None:
    table = labels_in(tmp_path)
    seal_labels(table)
    folder = answered(tmp_path / "d", {"rec_01": diagnosis("added_mass"), "rec_03": diagnosis("sensor_gain")})
    torn = folder / "rec_03" / "diagnosis.json"
    torn.write_text(torn.read_text()[:200])
    with pytest.raises(StudyError, match=r"rec_03/diagnosis.json is not a usable") as refusal:
        score_kit(table, folder, tmp_path / "score.csv")
    assert f"Get {torn.parent} again" in refusal.value.do_now
    assert not (tmp_path / "score.csv").exists()


def test_the_commands_of_the_kit_do_the_same(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    table = tmp_path / "labels.csv"
    assert main(["kit", "draw", "--out", str(table), "--repeats", "1", "--seed", "5"]) == 0
    assert "7 recordings, rec_01 to rec_07" in capsys.readouterr().out
    assert main(["kit", "seal", str(table)]) == 0
    seal = capsys.readouterr().out.strip()
    folder = answered(tmp_path / "d", {"rec_01": diagnosis("added_mass")})
    arguments = ["--diagnoses", str(folder), "--out", str(tmp_path / "score.csv"), "--seal", seal]
    assert main(["kit", "score", str(table), *arguments]) == 0
    said = capsys.readouterr().out
    assert "Missing: rec_02" in said
    assert f"SHA-256 {seal}, the hash that --seal gives" in said
