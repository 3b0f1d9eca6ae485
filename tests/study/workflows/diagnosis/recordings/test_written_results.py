"""From files to the folder of a diagnosis: what is written, and that nothing half done is left."""

import numpy as np
import pytest

from study.errors import StudyError, WrongUseError
from study.store.disk.json_document import read_json
from study.store.formats.diagnosis_file import read_diagnosis
from study.store.formats.mechanical_model_file import read_mechanical_model
from study.workflows.diagnosis.diagnose_recordings import diagnose_recordings
from study.workflows.diagnosis.diagnosed_summary import format_answer, format_paths, make_json
from tests.study.workflows.diagnosis.recordings.scripted import Scripted, asked_of_engine, plan, quiet

pytestmark = pytest.mark.usefixtures("sketched")


@pytest.mark.slow
def test_the_folder_holds_document_model_page_and_figures(done, findings):
    names = {path.name for path in done.out.iterdir()}
    assert names == {"diagnosis.json", "improved.toml", "report.html", "figures"}
    assert read_diagnosis(done.out / "diagnosis.json").effects == findings.diagnosis.effects
    assert any(path.suffix == ".svg" for path in (done.out / "figures").iterdir())
    assert "rec.h5" in (done.out / "report.html").read_text()


def test_the_improved_model_can_be_read_and_holds_what_was_named(done):
    improved = read_mechanical_model(done.out / "improved.toml")
    assert [effect.kind for effect in improved.effects] == [effect.kind for effect in done.findings.improved.effects]
    assert [parent["file"] for parent in improved.provenance["parents"]] == ["rec.h5", "model.toml"]


def test_results_hold_the_hashes_of_their_input_files(done):
    origin = read_json(done.out / "diagnosis.json", "hapteq-diagnosis", 1)["provenance"]
    assert [parent["file"] for parent in origin["parents"]] == ["rec.h5", "model.toml"]
    assert all(len(parent["sha256"]) == 64 for parent in origin["parents"])
    assert "hapteq" in origin["versions"]


def test_the_answer_is_there_before_anything_is_written(in_two_steps, findings):
    answer, there, done = in_two_steps
    assert format_answer(answer.findings) == format_answer(findings)
    assert there == []
    assert done.out == answer.plan.out
    assert (done.out / "report.html").is_file()


def test_the_summary_begins_with_the_verdict_and_then_says_where_the_files_are(done):
    lines = format_answer(done.findings)
    assert lines[0].startswith("Missing in the model: dry friction on the x drive.")
    assert format_paths(done.out)[1:] == (
        f"Report: {done.out}/report.html",
        f"Improved model: {done.out}/improved.toml",
    )
    assert any(line.startswith("  held out  as given") for line in lines)
    document = make_json(done.findings)
    assert (document["format"], document["version"], document["verdict"]) == ("hapteq-diagnosis", 1, "explained")


def test_the_engine_gets_recordings_model_names_and_a_parallel_map(files, findings, tmp_path):
    engine = asked_of_engine(plan(files, tmp_path / "out", excluded_effects=("backlash",)), findings)
    assert (engine.settings.names, engine.settings.without) == (("rec.h5",), ("backlash",))
    assert engine.mapped == [3, 1, 2]
    assert engine.model.inputs == len(engine.recordings[0].command.channels) == 1


@pytest.mark.slow
def test_without_a_model_a_linear_one_is_fitted_first_and_reported(files, findings, tmp_path):
    engine, shares = Scripted(findings), []
    alone = plan(files, tmp_path / "out", model=None)
    found = diagnose_recordings(alone, lambda what, share: shares.append(share), engine)
    assert shares == sorted(shares) and (shares[0], shares[-1]) == (0.0, 1.0)
    assert 0.1 < engine.model.mass[0, 0] < 0.5
    assert found.findings.remarks[0].startswith("No model was given. A linear model was fitted")
    assert "No model was given" in (tmp_path / "out" / "report.html").read_text()


@pytest.mark.parametrize("end", [KeyboardInterrupt(), ValueError("a bug")])
def test_an_interrupted_diagnosis_leaves_no_files(files, findings, tmp_path, end):
    with pytest.raises(type(end)):
        diagnose_recordings(plan(files, tmp_path / "out"), quiet, Scripted(findings, end))
    assert list(tmp_path.iterdir()) == []


def test_fits_that_break_down_are_an_error_in_words(files, findings, tmp_path):
    engine = Scripted(findings, np.linalg.LinAlgError("SVD did not converge"))
    with pytest.raises(StudyError) as refused:
        diagnose_recordings(plan(files, tmp_path / "out"), quiet, engine)
    assert refused.value.happened.startswith("The fits broke down (SVD did not converge)")
    assert "narrower tolerances" in refused.value.do_now


def test_a_folder_that_is_taken_is_refused_before_any_work(files, findings, tmp_path):
    (tmp_path / "mine").write_text("1")
    engine = Scripted(findings)
    with pytest.raises(StudyError, match="holds files already"):
        diagnose_recordings(plan(files, tmp_path), quiet, engine)
    assert not hasattr(engine, "model")


def test_an_unknown_effect_is_wrong_use_with_a_suggestion(files, findings, tmp_path):
    with pytest.raises(WrongUseError) as refused:
        diagnose_recordings(plan(files, tmp_path / "out", excluded_effects=("backlsh",)), quiet, Scripted(findings))
    assert refused.value.title == "There is no effect 'backlsh' to exclude"
    assert "did you mean 'backlash'?" in refused.value.happened
    assert "coulomb_friction" in refused.value.do_now
