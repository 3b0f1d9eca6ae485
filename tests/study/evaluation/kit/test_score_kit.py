"""A laboratory's blind test: revealed, and scored by all that was recorded."""

import shutil
from pathlib import Path

import pytest

from analysis.diagnosis.document import Diagnosis, Errors, Estimate, Fit, Mismatch, NamedEffect, Rival
from equalizer.plant.effect_vocabulary import EFFECTS_BY_NAME
from study.cli.main import main
from study.errors import StudyError
from study.evaluation.kit.lab_kit import seal_labels
from study.evaluation.kit.score_kit import format_score_lines, score_kit
from study.store.disk.provenance import gather_provenance
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


def sealed(folder: Path, text: str = LABELS) -> Path:
    table = labels_in(folder, text)
    seal_labels(table)
    return table


def test_what_was_sealed_is_scored(tmp_path: Path) -> None:
    table = sealed(tmp_path)
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
    table = sealed(tmp_path)
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
    table = sealed(tmp_path)
    said = {"rec_02": diagnosis(), "rec_03": diagnosis("sensor_misalignment", value=8.0)}
    score = score_kit(table, answered(tmp_path / "d", said), tmp_path / "score.csv")
    assert [row.inside for row in score.rows] == [False, None, True, None]


@pytest.mark.parametrize(
    ("row", "answer", "inside"),
    [
        # A grip force in newtons must not be compared with the hand's mass in kilograms.
        ("held_handle,2,grip force in N", diagnosis("hand_impedance"), None),
        ("loosened_cable,0.0002,", diagnosis("loose_joint", value=0.0002), True),
        ("loosened_cable,0.0002,", diagnosis("loose_joint", value=0.002), False),
        # On a rotating device an added mass is a moment of inertia.
        ("added_mass,0.05,", diagnosis("added_mass", value=0.0004, unit="kg m^2"), None),
        ("magnet_brake,,", diagnosis("force_gain", ("viscous_damping",)), None),
    ],
    ids=["no unit", "inside", "outside", "other unit", "rival that cannot be told apart"],
)
def test_a_value_is_compared_with_the_interval_of_the_named_effect_in_its_unit(
    tmp_path: Path, row: str, answer: Diagnosis, inside: bool | None
) -> None:
    table = sealed(tmp_path, f"recording,change,value,note,salt\nrec_01,{row},a\n")
    scored = score_kit(table, answered(tmp_path / "d", {"rec_01": answer}), tmp_path / "score.csv").rows[0]
    assert (scored.right, scored.inside) == (True, inside)


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
    table = sealed(tmp_path)
    with pytest.raises(StudyError, match="That is no SHA-256") as refusal:
        score_kit(table, tmp_path, tmp_path / "score.csv", typed)
    assert refusal.value.exit_code == 2
    assert f"--seal gives '{typed}'" in refusal.value.happened


def test_a_folder_without_diagnoses_is_an_error_and_the_right_one_scores_after(tmp_path: Path) -> None:
    table, out = sealed(tmp_path), tmp_path / "score.csv"
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
    table = sealed(tmp_path)
    folder = answered(tmp_path / "d", {"rec_01": diagnosis("added_mass"), "rec_03": diagnosis("sensor_gain")})
    torn = folder / "rec_03" / "diagnosis.json"
    torn.write_text(torn.read_text()[:200])
    with pytest.raises(StudyError, match=r"rec_03/diagnosis.json is not a usable") as refusal:
        score_kit(table, folder, tmp_path / "score.csv")
    assert f"Get {torn.parent} again" in refusal.value.do_now
    assert not (tmp_path / "score.csv").exists()


def test_a_copied_diagnosis_is_not_counted_twice(tmp_path: Path) -> None:
    table = sealed(tmp_path, LABELS.replace("nothing", "added_mass"))
    for name in ("rec_01", "rec_02"):
        (tmp_path / f"{name}.h5").write_text("two recordings of the simulated device have the same content")
        (tmp_path / "d" / name).mkdir(parents=True)
        origin = gather_provenance(parents=[tmp_path / f"{name}.h5"])
        write_diagnosis(tmp_path / "d" / name / "diagnosis.json", diagnosis("added_mass"), origin)
    assert score_kit(table, tmp_path / "d", tmp_path / "score.csv").figures[0].hits == 2
    shutil.copytree(tmp_path / "d" / "rec_01", tmp_path / "d" / "rec_02", dirs_exist_ok=True)
    with pytest.raises(StudyError, match="Two diagnoses are of the same recording") as refusal:
        score_kit(table, tmp_path / "d", tmp_path / "second.csv")
    assert "rec_01/diagnosis.json and rec_02/diagnosis.json" in refusal.value.happened
    assert not (tmp_path / "second.csv").exists()


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
