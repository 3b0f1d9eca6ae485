"""Clean recordings beside those that are diagnosed."""

from dataclasses import replace

import pytest

from analysis.diagnosis.localisation.model_error_floor import IncomparableRecordingsError
from study.errors import StudyError
from study.store.disk.json_document import read_json
from study.store.formats.recording_file import write_recording
from study.workflows.diagnosis.diagnose_recordings import diagnose_recordings, run_diagnosis
from tests.study.workflows.diagnosis.recordings.scripted import Scripted, asked_of_engine, plan, quiet, refused_with

pytestmark = pytest.mark.usefixtures("sketched")


@pytest.mark.slow
def test_clean_recordings_go_to_the_engine_and_are_named_as_parents(files, findings, tmp_path, made):
    write_recording(tmp_path / "clean.h5", made.recorded(1, (), seed=9))
    engine = Scripted(findings)
    done = diagnose_recordings(plan(files, tmp_path / "out", clean=(tmp_path / "clean.h5",)), quiet, engine)
    assert len(engine.settings.clean) == 1
    origin = read_json(done.out / "diagnosis.json", "hapteq-diagnosis", 1)["provenance"]
    assert [parent["file"] for parent in origin["parents"]] == ["rec.h5", "clean.h5", "model.toml"]


@pytest.mark.slow
def test_without_a_model_the_clean_recordings_are_what_one_is_fitted_to(files, findings, tmp_path, made):
    write_recording(tmp_path / "clean.h5", made.recorded(1, (), seed=9))
    engine = Scripted(findings)
    wanted = plan(files, tmp_path / "out", model=None, clean=(tmp_path / "clean.h5",))
    found = run_diagnosis(wanted, quiet, engine)
    assert engine.model.name == "fitted to the clean recordings"
    assert found.findings.remarks[0].startswith("No model was given. A linear model was fitted to the clean recordings")


def test_a_recording_cannot_be_diagnosed_and_be_clean(files, findings, tmp_path):
    with pytest.raises(StudyError, match=r"rec.h5 cannot be diagnosed and be clean at the same time"):
        diagnose_recordings(plan(files, tmp_path / "out", clean=(files / "rec.h5",)), quiet, Scripted(findings))


def test_a_copy_of_a_diagnosed_recording_cannot_be_clean(files, findings, tmp_path, made):
    other = made.recorded(1, seed=8)
    write_recording(tmp_path / "other.h5", other)
    write_recording(tmp_path / "copy.h5", replace(other, device="copy"))
    sources = (files / "rec.h5", tmp_path / "other.h5")
    with pytest.raises(StudyError, match=r"copy\.h5 holds the same samples as other\.h5"):
        diagnose_recordings(
            plan(files, tmp_path / "out", sources=sources, clean=(tmp_path / "copy.h5",)), quiet, Scripted(findings)
        )


def test_clean_recordings_of_another_device_are_refused(files, findings, tmp_path, made):
    write_recording(tmp_path / "clean.h5", made.recorded(2, ()))
    with pytest.raises(StudyError, match=r"clean.h5 has the command .*one says nothing of the other") as refused:
        diagnose_recordings(plan(files, tmp_path / "out", clean=(tmp_path / "clean.h5",)), quiet, Scripted(findings))
    assert "leave --clean out" in str(refused.value.do_now)


def test_clean_recordings_that_say_nothing_of_the_others_are_refused(files, findings, tmp_path):
    engine = Scripted(findings, IncomparableRecordingsError("the clean recordings can only be compared by windows"))
    with pytest.raises(StudyError, match=r"The clean recordings can only be compared by windows"):
        diagnose_recordings(plan(files, tmp_path / "out"), quiet, engine)
    assert not (tmp_path / "out").exists()


def test_a_position_that_the_clean_ones_lack_is_left_out_of_all(files, findings, tmp_path, made):
    write_recording(tmp_path / "clean.h5", replace(made.recorded(1, ()), position=None))
    engine = asked_of_engine(plan(files, tmp_path / "out", clean=(tmp_path / "clean.h5",)), findings)
    assert engine.recordings[0].position is None


def test_a_folder_beside_recordings_is_refused(files, findings, tmp_path):
    error = refused_with(files, findings, tmp_path, sources=(files / "rec.h5", tmp_path))
    assert "is a folder: a session is diagnosed alone" in error.happened
