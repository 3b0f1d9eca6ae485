"""Answers to real recordings are kept as long as they were made from what is there. Nothing here is diagnosed: the
recording is torn, and refused at once."""

import json
from pathlib import Path

import numpy as np
import pytest

from analysis.diagnosis.search.time_budget import CountedBudget
from study.errors import StudyError
from study.evaluation.real.real_folder import read_real_folder
from study.evaluation.real.real_recordings import RealPlan, diagnose_folder
from tests.recording_maps import NOISE_ON_ONE_AXIS

MAP = f"""{NOISE_ON_ONE_AXIS}
[[segment]]
kind = "noise"

[diagnosis]
model = "axis.model.toml"
"""


def silent(what: str, share: float) -> None:
    return None


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A recording, one that only tests what was found in it, a map for each, and a model."""
    axis = tmp_path / "recordings" / "axis"
    axis.mkdir(parents=True)
    for name in ("run.npz", "later.npz"):
        (axis / name).write_bytes(b"no archive")
    (axis / "run.toml").write_text(MAP)
    (axis / "later.toml").write_text(MAP.replace("run.npz", "later.npz") + 'tests = "run"\n')
    (axis / "axis.model.toml").write_text("no model")
    return axis.parent


@pytest.fixture
def answered(folder: Path, tmp_path: Path) -> RealPlan:
    plan = RealPlan(folder, tmp_path / "out", seconds=20.0)
    (answer,) = diagnose_folder(plan, silent).results.answers
    assert answer.verdict == "refused"
    return plan


def kept(plan: RealPlan) -> Path:
    return plan.out / "axis" / "run" / "answer.json"


def refusal(plan: RealPlan) -> StudyError:
    """Of a second run, which changes nothing of what is there."""
    before = {path: path.read_bytes() for path in plan.out.rglob("*") if path.is_file()}
    with pytest.raises(StudyError) as refused:
        diagnose_folder(plan, silent)
    assert {path: path.read_bytes() for path in plan.out.rglob("*") if path.is_file()} == before
    return refused.value


def test_an_answer_says_all_that_it_was_made_from(answered: RealPlan) -> None:
    origin = json.loads(kept(answered).read_text())["provenance"]
    names = ["run.npz", "run.toml", "axis.model.toml", "later.npz", "later.toml"]
    assert [each["file"] for each in origin["parents"]] == names
    assert origin["settings"] == {"seconds": 20.0}


def test_where_nothing_changed_the_answer_is_kept(answered: RealPlan) -> None:
    before = kept(answered).stat().st_mtime_ns
    assert len(diagnose_folder(answered, silent).results.answers) == 1
    assert kept(answered).stat().st_mtime_ns == before


@pytest.mark.parametrize("name", ["run.npz", "run.toml", "axis.model.toml", "later.npz", "later.toml"])
def test_an_old_answer_is_not_reused_after_a_change_of_any_file(answered: RealPlan, name: str) -> None:
    path = answered.folder / "axis" / name
    path.write_bytes(path.read_bytes() + b"\n")
    error = refusal(answered)
    assert error.title == "Inputs of existing answers have changed"
    assert error.happened == f"axis/run/answer.json: {name} has changed."
    assert f"move away {answered.out / 'axis' / 'run'}." in error.do_now
    assert "are unchanged" in error.saved


def test_a_file_that_came_or_went_is_reported(answered: RealPlan) -> None:
    axis = answered.folder / "axis"
    (axis / "later.toml").write_text((axis / "later.toml").read_text().replace("later", "third"))
    (axis / "later.npz").rename(axis / "third.npz")
    said = refusal(answered).happened
    assert "later.npz is gone" in said
    assert "third.npz is not among its recorded inputs" in said


def test_other_seconds_are_reported(answered: RealPlan) -> None:
    error = refusal(RealPlan(answered.folder, answered.out, seconds=180.0))
    assert error.happened == "axis/run/answer.json: --seconds was 20, and is 180."


def test_a_count_of_evaluations_is_another_limit_than_seconds(answered: RealPlan) -> None:
    said = refusal(RealPlan(answered.folder, answered.out)).happened
    assert said == "axis/run/answer.json: --seconds was 20, and is left out."


def test_a_patience_that_counts_is_asked_as_often_everywhere() -> None:
    patient = CountedBudget(3)
    assert [patient() for _ in range(5)] == [True, True, True, False, False]


def test_faults_that_were_injected_into_it_go_with_it(answered: RealPlan) -> None:
    (answered.out / "injected").mkdir()
    error = refusal(RealPlan(answered.folder, answered.out, seconds=180.0))
    assert f"{answered.out / 'injected'}, which was computed from them" in error.do_now


@pytest.mark.parametrize("origin", [None, "hand-made", {"parents": 3, "settings": 4}, {"parents": ["a"]}])
def test_an_answer_that_does_not_say_what_it_was_made_from_is_not_taken(answered: RealPlan, origin: object) -> None:
    document = json.loads(kept(answered).read_text())
    kept(answered).write_text(json.dumps({**document, "provenance": origin}))
    said = refusal(answered).happened
    assert "run.npz is not among its recorded inputs" in said
    assert "its --seconds is not recorded" in said


@pytest.mark.parametrize("torn", ["", "{", '{"format": "hapteq-real-answer", "version": 1}'])
def test_a_torn_answer_is_named_by_its_folder(answered: RealPlan, torn: str) -> None:
    kept(answered).write_text(torn)
    error = refusal(answered)
    assert error.title.startswith("axis/run/answer.json is not a usable ")
    assert f"Move {answered.out / 'axis' / 'run'} away" in error.do_now
    assert "pydantic" not in str(error)


def test_moved_away_it_is_answered_again(answered: RealPlan) -> None:
    (answered.folder / "axis" / "run.npz").write_bytes(b"another")
    kept(answered).parent.rename(answered.out.parent / "old")
    assert len(diagnose_folder(answered, silent).results.answers) == 1
    assert kept(answered).is_file()


def test_an_unknown_model_is_no_parent(folder: Path) -> None:
    (folder / "axis" / "axis.model.toml").unlink()
    (one,) = read_real_folder(folder).recordings
    assert [path.name for path in one.parents] == ["run.npz", "run.toml"]


def test_a_map_and_a_model_of_ours_are_parents_too(tmp_path: Path) -> None:
    pair = tmp_path / "axis"
    pair.mkdir()
    np.savez(pair / "run.npz", u=np.zeros(9), y=np.zeros(9))
    (pair / "run.toml").write_text(MAP.replace("axis.model.toml", "haptic_paddle"))
    (one,) = read_real_folder(tmp_path).recordings
    assert [path.name for path in one.parents] == ["run.npz", "run.toml", "haptic_paddle.toml"]
    assert all(path.is_file() for path in one.parents)


def test_a_folder_without_a_recording_is_an_error_and_nothing_is_written(tmp_path: Path) -> None:
    (tmp_path / "recordings").mkdir()
    with pytest.raises(StudyError, match="There is no recording to diagnose") as refused:
        diagnose_folder(RealPlan(tmp_path / "recordings", tmp_path / "out"), silent)
    assert refused.value.happened.startswith("recordings: No map is for the files of the folder recordings")
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("seconds", [float("nan"), float("inf")])
def test_seconds_that_are_no_number_are_wrong_use(folder: Path, tmp_path: Path, seconds: float) -> None:
    with pytest.raises(StudyError, match="This is not a valid number of seconds") as refused:
        diagnose_folder(RealPlan(folder, tmp_path / "out", seconds), silent)
    assert refused.value.exit_code == 2
    assert not (tmp_path / "out").exists()


def test_results_in_the_folder_of_the_recordings_are_no_recordings(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The folder itself is taken where it has no other sub-folders, by its name even where it is given as "."."""
    monkeypatch.chdir(folder / "axis")
    plan = RealPlan(Path(), Path("results"))
    for _ in range(2):
        done = diagnose_folder(plan, silent)
        assert (len(done.results.answers), done.results.troubles) == (1, ())
    assert (folder / "axis" / "results" / "axis" / "run" / "answer.json").is_file()


@pytest.mark.parametrize("outs", [("results/first", "results/first"), ("first", "second")])
def test_results_of_other_runs_or_deeper_in_the_folder_hide_no_recordings(folder: Path, outs: tuple[str, str]) -> None:
    axis = folder / "axis"
    for out in outs:
        done = diagnose_folder(RealPlan(axis, axis / out), silent)
        assert len(done.results.answers) == 1
    assert all("results" not in trouble.location for trouble in done.results.troubles)


@pytest.mark.parametrize(("name", "inject"), [("injected", 4), ("recordings.csv", 0)])
def test_a_sub_folder_with_the_name_of_a_result_is_refused_before_any_work(
    folder: Path, tmp_path: Path, name: str, inject: int
) -> None:
    (folder / "axis").rename(folder / name)
    with pytest.raises(StudyError, match="A sub-folder has the name of a result") as refused:
        diagnose_folder(RealPlan(folder, tmp_path / "out", inject=inject), silent)
    assert name in refused.value.happened
    assert not (tmp_path / "out").exists()


def test_a_folder_that_is_a_link_keeps_its_name_and_so_its_answers(folder: Path, tmp_path: Path) -> None:
    (tmp_path / "link").symlink_to(folder / "axis")
    (recording,) = read_real_folder(tmp_path / "link").recordings
    assert recording.folder.name == "link"


def test_recordings_of_the_same_name_are_reported_before_any_is_diagnosed(folder: Path) -> None:
    """Their results would lie in one folder: each run would find those of the other."""
    (folder / "axis" / "run.csv").write_text("no table")
    (folder / "axis" / "run.toml").write_text(MAP.replace('files = ["run.npz"]', 'files = ["run.*"]\nseparate = true'))
    assert "separate = true" in (folder / "axis" / "run.toml").read_text()
    read = read_real_folder(folder)
    assert read.recordings == ()
    assert "Several recordings have the name run_run" in read.troubles[0].reason


def test_a_recording_whose_header_is_its_map_is_answered(tmp_path: Path) -> None:
    (tmp_path / "recordings" / "rig").mkdir(parents=True)
    rows = "".join(f"{0.001 * row},{row % 3},{row % 2}\n" for row in range(9))
    (tmp_path / "recordings" / "rig" / "data.csv").write_text(f"time [s],force fx [N],position x [m]\n{rows}")
    for _ in range(2):
        (answer,) = diagnose_folder(RealPlan(tmp_path / "recordings", tmp_path / "out"), silent).results.answers
        assert (answer.recording, answer.verdict) == ("rig", "refused")
