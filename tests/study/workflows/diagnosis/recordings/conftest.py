"""Files to be diagnosed, and what is found in them."""

from pathlib import Path

import pytest

from study.store.formats.mechanical_model_file import write_mechanical_model
from study.store.formats.recording_file import write_recording
from study.workflows.diagnosis.diagnose_recordings import run_diagnosis, write_result_folder
from tests.study.workflows.diagnosis.recordings.scripted import Scripted, plan, quiet


@pytest.fixture(scope="session")
def made(module_at):
    return module_at(Path(__file__).parents[4] / "diagnosed.py")


@pytest.fixture(scope="session")
def recording(made):
    return made.recorded(1)


@pytest.fixture(scope="session")
def files(made, recording, tmp_path_factory):
    folder = tmp_path_factory.mktemp("diagnose")
    write_recording(folder / "rec.h5", recording)
    write_mechanical_model(folder / "model.toml", made.device(1))
    return folder


@pytest.fixture(scope="session")
def findings(made, recording):
    return made.diagnosed(recording, made.device(1))


@pytest.fixture(scope="session")
def in_two_steps(files, findings, tmp_path_factory):
    """The answer, what lay in its folder then, and what was written after it."""
    folder = tmp_path_factory.mktemp("done")
    answer = run_diagnosis(plan(files, folder / "out"), quiet, Scripted(findings))
    there = list(folder.iterdir())
    return answer, there, write_result_folder(answer, quiet)


@pytest.fixture(scope="session")
def done(in_two_steps):
    return in_two_steps[2]
