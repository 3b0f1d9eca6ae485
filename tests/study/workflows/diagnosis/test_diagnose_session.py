"""A session's folder is diagnosed against a model of the handle without the spring that held it."""

import shutil
from pathlib import Path

import numpy as np
import pytest

from equalizer.plant.mechanical_model import MechanicalModel
from protocols.document.loading import load_protocol
from study.devices.clock import VirtualClock
from study.errors import StudyError
from study.store.formats.mechanical_model_file import read_mechanical_model, write_mechanical_model
from study.store.sessions.archive import SessionFolder
from study.store.sessions.written_elsewhere import read_written_folders
from study.workflows.diagnosis.diagnose_recordings import DiagnosePlan, diagnose_recordings
from study.workflows.diagnosis.write_diagnosis import note_sessions
from study.workflows.session.conduct_session import conduct_new
from study.workflows.session.open_session import SessionPlan
from study.workflows.session.simulated_participant import make_simulated_participant

pytestmark = pytest.mark.usefixtures("sketched")

SPRING = pytest.approx(136.5, abs=0.5)


@pytest.fixture(scope="module")
def session(tmp_path_factory, brief_text) -> Path:
    plan = SessionPlan(
        protocol=load_protocol(brief_text, "brief.toml"), protocol_text=brief_text, protocol_locked=False,
        subject="P01", observer="ideal", seed=3, data_folder=tmp_path_factory.mktemp("data"), participant_number=0,
    )  # fmt: skip
    return conduct_new(plan, "simulated", make_simulated_participant("ideal", 3, VirtualClock())).folder.path


@pytest.fixture(scope="module")
def findings(diagnosed):
    return diagnosed.diagnosed(diagnosed.recorded(1), diagnosed.device(1))


def test_the_spring_is_in_the_compared_model_and_not_in_the_improved_one(session, findings, tmp_path):
    one = np.eye(3)
    write_mechanical_model(
        tmp_path / "m.toml", MechanicalModel("handle", "acceleration", 0.3 * one, 8 * one, 20 * one, one, one)
    )
    compared = []

    def engine(recordings, model, settings, map_, progress):
        compared.append((recordings, model, settings.names))
        return findings

    plan = DiagnosePlan((session,), tmp_path / "out", tmp_path / "m.toml")
    done = diagnose_recordings(plan, lambda what, share: None, engine)
    ((recordings, model, names),) = compared
    assert len(recordings) == 1 and names == (session.name,)
    assert [*np.diag(model.stiffness - 20 * one)] == [SPRING] * 3
    improved = read_mechanical_model(tmp_path / "out" / "improved.toml")
    assert float((findings.improved.stiffness - improved.stiffness).max()) == SPRING
    assert any("spring of 137 N/m held the handle" in remark for remark in done.findings.remarks)


def test_a_diagnosis_that_was_under_way_during_a_withdrawal_leaves_nothing(session, findings, tmp_path):
    data, one = tmp_path / "data", np.eye(3)
    shutil.copytree(session, data / session.name)
    write_mechanical_model(
        tmp_path / "m.toml", MechanicalModel("handle", "acceleration", 0.3 * one, 8 * one, 20 * one, one, one)
    )

    def withdraw_meanwhile(recordings, model, settings, map_, progress):
        SessionFolder(data / session.name).withdrawal.write_text("{}")
        return findings

    plan = DiagnosePlan((data / session.name,), tmp_path / "out", tmp_path / "m.toml")
    with pytest.raises(StudyError, match="withdrew"):
        diagnose_recordings(plan, lambda what, share: None, withdraw_meanwhile)
    assert not (tmp_path / "out").exists()


def test_a_diagnosis_of_recordings_in_a_session_is_noted_in_its_data_folder(tmp_path):
    data, out = tmp_path / "data", tmp_path / "out"
    (data / "P01_001").mkdir(parents=True)
    (data / "P01_001" / "events.jsonl").touch()
    recordings = [data / "P01_001" / "recordings" / name for name in ("1.h5", "2.h5")]
    assert note_sessions((*recordings, tmp_path / "other.h5"), out) == (SessionFolder(data / "P01_001"),)
    assert read_written_folders(data) == (out,)
