"""Recordings and models that do not go together are refused by name, or what is left out of them is said."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from equalizer.plant.mechanical_model import MechanicalModel, ModelEffect
from study.errors import StudyError
from study.store.formats.mechanical_model_file import write_mechanical_model
from study.store.formats.recording_file import write_recording
from study.workflows.diagnosis.diagnose_recordings import diagnose_recordings
from study.workflows.diagnosis.diagnosis_input import read_input
from tests.study.workflows.diagnosis.recordings.scripted import Scripted, asked_of_engine, plan, quiet, refused_with

pytestmark = pytest.mark.usefixtures("sketched")


def test_a_model_of_another_size_is_named(files, findings, tmp_path, made):
    write_mechanical_model(tmp_path / "three.toml", made.device(3))
    error = refused_with(files, findings, tmp_path, model=tmp_path / "three.toml")
    assert error.title == "Model and recording do not belong together"
    assert "The model has 3 inputs, but the recording has 1 command channel (fx)." in error.happened
    assert "three.toml" in error.do_now and error.saved == "Nothing was written."


def test_an_unstable_model_is_named(files, findings, tmp_path, made):
    sound = made.device(1)
    wild = MechanicalModel(
        "wild", "acceleration", sound.mass, -sound.damping, sound.stiffness, sound.input, sound.output
    )
    write_mechanical_model(tmp_path / "wild.toml", wild)
    assert "unstable" in refused_with(files, findings, tmp_path, model=tmp_path / "wild.toml").happened


def test_a_recording_that_is_too_short_or_all_noise_is_named(files, findings, tmp_path, recording):
    command, response = recording.command.select_samples(0, 90), recording.response.select_samples(0, 90)
    cut = replace(recording, command=command, response=response, position=None, segments=())
    write_recording(tmp_path / "short.h5", cut)
    error = refused_with(files, findings, tmp_path, sources=(tmp_path / "short.h5",))
    assert error.title == "These recordings cannot be diagnosed"
    assert "90 samples are too short" in error.happened
    noise = np.random.default_rng(1).standard_normal(recording.response.samples.shape)
    write_recording(tmp_path / "noise.h5", replace(recording, response=replace(recording.response, samples=noise)))
    assert (
        "not related to the commands"
        in refused_with(files, findings, tmp_path, sources=(tmp_path / "noise.h5",)).happened
    )


def test_recordings_of_two_devices_are_distinguished_by_name(files, findings, tmp_path, made):
    write_recording(tmp_path / "three.h5", made.recorded(3))
    error = refused_with(files, findings, tmp_path, sources=(files / "rec.h5", tmp_path / "three.h5"))
    assert "Three.h5 has the command" in error.happened or "three.h5 has the command" in error.happened


def test_a_position_that_not_all_recordings_have_is_left_out_and_reported(files, findings, tmp_path, made):
    write_recording(tmp_path / "blind.h5", replace(made.recorded(1, seed=8), position=None))
    sources = (files / "rec.h5", tmp_path / "blind.h5")
    engine = asked_of_engine(plan(files, tmp_path / "out", sources=sources), findings)
    assert all(recording.position is None for recording in engine.recordings)
    assert "the position was left out" in read_input(sources, seed=1).remarks[0]


@pytest.mark.parametrize(
    "stands",
    [lambda x: 0 * x, lambda x: 0 * x + 0.01, lambda x: 0.01 + 1e-12 * x, lambda x: np.where(x > 0, 0.01, np.nan)],
    ids=["zero", "somewhere", "rounding", "gaps"],
)
def test_a_position_that_stands_still_is_left_out_and_reported(tmp_path, recording, stands):
    dead = replace(recording.position, samples=stands(recording.position.samples))
    write_recording(tmp_path / "dead.h5", replace(recording, position=dead))
    found = read_input((tmp_path / "dead.h5",), seed=1)
    assert found.recordings[0].position is None
    assert found.remarks == ("Position x never changes: the position was left out of the comparison.",)


def test_few_cycles_are_a_remark_where_no_model_is_given_and_else_refused(tmp_path, recording):
    count, channels = recording.command.samples.shape
    slow = np.sin(2 * np.pi * 1.5 * np.arange(count) / count)[:, None] * np.ones(channels)
    write_recording(tmp_path / "slow.h5", replace(recording, command=replace(recording.command, samples=slow)))
    with pytest.raises(StudyError, match="cycles of the command"):
        read_input((tmp_path / "slow.h5",), seed=1)
    assert any("cycles of the command" in said for said in read_input((tmp_path / "slow.h5",), 1, True).remarks)


def test_names_of_files_and_effects_keep_their_letters(files, findings, tmp_path, made):
    rubbing = replace(made.device(1), effects=(ModelEffect("coulomb_friction", "q", {"level": 0.1}),))
    write_mechanical_model(tmp_path / "model.toml", rubbing)
    with pytest.raises(StudyError, match=r" coulomb_friction: the axis 'q' is none of fx"):
        diagnose_recordings(plan(files, tmp_path / "out", model=tmp_path / "model.toml"), quiet, Scripted(findings))


def test_a_recording_that_is_given_twice_is_refused(files, findings, tmp_path, recording):
    write_recording(tmp_path / "copy.h5", recording)
    for other in (files / "rec.h5", tmp_path / "copy.h5"):
        with pytest.raises(StudyError, match=r"holds the same samples as .*, and a recording counts once"):
            diagnose_recordings(
                plan(files, tmp_path / "out", sources=(files / "rec.h5", other)), quiet, Scripted(findings)
            )


def test_a_file_in_the_current_folder_is_named_without_a_folder(files, findings, tmp_path, monkeypatch):
    monkeypatch.chdir(files)
    error = refused_with(files, findings, tmp_path, sources=(Path("rec.h5"), Path("rec.h5")))
    assert "ec.h5 (2) holds the same samples as rec.h5 (1)" in error.happened and "/rec.h5" not in error.happened


def test_recordings_of_one_name_are_distinguished_by_their_folders(files, findings, tmp_path, made):
    write_recording(tmp_path / "rec.h5", made.recorded(1, seed=8))
    both = (files / "rec.h5", tmp_path / "rec.h5")
    engine = asked_of_engine(plan(files, tmp_path / "out", sources=both), findings)
    assert len(set(engine.settings.names)) == 2
