"""What a case's files say of how it was drawn."""

import math
from dataclasses import asdict, replace
from types import SimpleNamespace

import numpy as np
import pytest

from study.errors import StudyError
from study.evaluation.bank import proof_folder
from study.evaluation.bank.proof_folder import ANSWER_FILE, RECORDING_FILE
from study.evaluation.bank.proof_seals import read_answer
from study.evaluation.bank.seal_cases import BankPlan, list_drawable_cases, redraw_recording, write_redrawn_recording
from study.evaluation.challenge.draw_bank import generate_case
from study.store.disk.file_errors import UnusableFileError

SEED = 881_203_452


@pytest.mark.slow
def test_two_names_give_one_device_that_bears_its_name_and_nothing_of_its_draw():
    drawn = list_drawable_cases(BankPlan(SEED, cases=1, brief=True))[0]
    first, second = (generate_case(drawn, name) for name in ("a1b2", "c3d4"))
    assert (first.recording.device, first.model.name) == ("a1b2", "a1b2")
    assert (second.recording.device, second.model.name) == ("c3d4", "c3d4")
    np.testing.assert_array_equal(second.recording.response.samples, first.recording.response.samples)
    np.testing.assert_equal(asdict(replace(second.model, name="a1b2")), asdict(first.model))
    assert second.truth == first.truth
    for told in (repr(dict(first.recording.meta)), repr(first.recording.segments), repr(first.model)):
        assert str(SEED) not in told and str(drawn.seed) not in told


def test_a_device_of_mujoco_is_not_drawn_again_without_it(tmp_path, monkeypatch):
    def refuse(drawn, name):
        raise ModuleNotFoundError("No module named 'mujoco'")

    monkeypatch.setattr("study.evaluation.bank.seal_cases.generate_case", refuse)
    with pytest.raises(StudyError, match="MuJoCo, which is not installed") as told:
        redraw_recording(tmp_path, BankPlan(SEED, 1), {"number": 0, "name": "a1b2"})
    assert "pip install" in told.value.do_now


def test_a_device_that_is_drawn_otherwise_leaves_no_recording_that_would_be_diagnosed(tmp_path, monkeypatch):
    """A run of the right version, as the error asks for, draws it anew."""
    monkeypatch.setattr("study.evaluation.bank.seal_cases.write_recording", lambda path, *_, **__: path.touch())
    with pytest.raises(StudyError, match="another recording than the one that was sealed"):
        write_redrawn_recording(tmp_path, SimpleNamespace(recording=None), {"number": 0, "recording_sha256": "other"})
    assert not (tmp_path / RECORDING_FILE).exists()


def test_a_folder_whose_settings_could_not_be_written_is_begun_by_the_next_run(tmp_path, monkeypatch):
    def refuse(path, text):
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as full, pytest.raises(OSError, match="No space"):
        full.setattr(proof_folder, "write_text", refuse)
        proof_folder.open_proof_folder(tmp_path / "bank", SEED, True)
    folder = proof_folder.open_proof_folder(tmp_path / "bank", SEED, True)
    assert folder.open.is_dir() and folder.sealed.is_dir()


def test_an_answer_that_is_nested_without_end_is_named(tmp_path):
    (tmp_path / ANSWER_FILE).write_text("[" * 100_000)
    with pytest.raises(UnusableFileError, match="nested"):
        read_answer(tmp_path)
    (tmp_path / ANSWER_FILE).write_text('{"error": NaN}')
    assert math.isnan(read_answer(tmp_path)["error"])
