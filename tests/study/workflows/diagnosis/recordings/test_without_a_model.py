"""Where no model is given; at the screen; and what is compared."""

from dataclasses import replace

import numpy as np
import pytest

from analysis.diagnosis.errors.choose_measure import make_measure
from study.errors import UserInterruptError, WrongUseError
from study.store.formats.recording_file import write_recording
from study.workflows.diagnosis.diagnose_at_screen import choose_result_folder, diagnose_at_screen
from study.workflows.diagnosis.diagnose_recordings import diagnose_recordings
from tests.study.workflows.diagnosis.recordings.scripted import asked_of_engine, plan, quiet, refused_with

pytestmark = pytest.mark.usefixtures("sketched")


@pytest.mark.slow
def test_where_no_model_can_be_fitted_it_is_asked_for(files, findings, tmp_path, recording):
    # A sixteenth of it: three commands and two responses are weighed for long before nothing holds.
    count = len(recording) // 16
    pushed, moved = recording.command.samples[:count], recording.response.samples[:count]
    three = replace(
        recording,
        command=replace(
            recording.command, samples=np.hstack([pushed, 0.5 * pushed, 2 * pushed]), channels=("fx", "fy", "fz")
        ),
        response=replace(recording.response, samples=np.hstack([moved, 0.5 * moved]), channels=("x", "y")),
        position=None,
        segments=(),
    )
    write_recording(tmp_path / "three.h5", three)
    error = refused_with(files, findings, tmp_path, sources=(tmp_path / "three.h5",), model=None)
    assert "No model was given, and none can be fitted" in error.happened
    assert "--model" in error.do_now


@pytest.mark.slow
def test_two_commands_of_one_motion_are_made_one_and_reported(files, findings, tmp_path, recording):
    pushed = recording.command.samples
    both = replace(recording.command, samples=np.hstack([pushed, 0.5 * pushed[::-1]]), channels=("fx", "fy"))
    write_recording(tmp_path / "two.h5", replace(recording, command=both))
    engine = asked_of_engine(plan(files, tmp_path / "out", sources=(tmp_path / "two.h5",), model=None), findings)
    assert len(engine.recordings[0].command.channels) == 1
    unlike = tmp_path / "two.h5", files / "rec.h5"
    error = refused_with(files, findings, tmp_path, sources=unlike, model=None)
    assert "rec.h5 has the command" in error.happened.lower()


def test_at_the_screen_a_stop_is_reported_and_leaves_nothing(files, tmp_path):
    def stop(what, share):
        raise KeyboardInterrupt

    with pytest.raises(UserInterruptError) as left:
        diagnose_at_screen(plan(files, tmp_path / "out"), stop)
    assert (left.value.title, left.value.saved) == ("The diagnosis was stopped", "Nothing was written.")
    assert list(tmp_path.iterdir()) == []


def test_results_of_the_screen_lie_in_a_session_or_beside_a_recording(tmp_path):
    assert choose_result_folder(tmp_path / "rec.h5") == tmp_path / "rec-diagnosis"
    (tmp_path / "rec-diagnosis").mkdir()
    assert choose_result_folder(tmp_path / "rec.h5") == tmp_path / "rec-diagnosis-2"
    assert choose_result_folder(tmp_path) == tmp_path / "diagnosis"


def test_compare_and_seconds_reach_the_engine(files, findings, tmp_path):
    engine = asked_of_engine(plan(files, tmp_path / "out", compare="force", seconds=1e-9), findings)
    assert engine.settings.compared == "force"
    assert not engine.settings.time_left()
    assert asked_of_engine(plan(files, tmp_path / "out"), findings).settings.time_left()


def test_forces_without_a_measured_motion_are_refused(files, recording, tmp_path):
    write_recording(tmp_path / "rec.h5", replace(recording, position=None))
    with pytest.raises(WrongUseError, match="Neither positions nor velocities"):
        diagnose_recordings(plan(files, tmp_path / "out", sources=(tmp_path / "rec.h5",), compare="force"), quiet)


def test_what_is_compared_is_what_was_asked_for(made, recording):
    model = made.device(1)
    assert make_measure([recording], model).measure.name == "free simulation"
    assert make_measure([recording], model, compared="force").measure.name == "predicted force"
    imposed = replace(recording, meta={**recording.meta, "imposed": "position"})
    assert make_measure([imposed], model).measure.name == "predicted force"
    assert make_measure([imposed], model, compared="motion").measure.name != "predicted force"
