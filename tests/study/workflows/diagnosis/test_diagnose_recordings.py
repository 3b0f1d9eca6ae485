"""From files to the folder of a diagnosis: what is written, what is refused, and that nothing half done is left."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from analysis.diagnosis.errors.choose_measure import measure_of
from analysis.diagnosis.reference.learn_model_error import NothingLearned
from equalizer.plant.mechanical_model import MechanicalModel, ModelEffect
from study.errors import LeftError, StudyError, WrongUseError
from study.store.disk.json_document import read_json
from study.store.formats.diagnosis_file import read_diagnosis
from study.store.formats.mechanical_model_file import read_mechanical_model, write_mechanical_model
from study.store.formats.recording_file import write_recording
from study.workflows.diagnosis.diagnose_at_screen import diagnose_at_screen, free_out
from study.workflows.diagnosis.diagnose_recordings import DiagnosePlan, answered, diagnose_recordings, written
from study.workflows.diagnosis.diagnosed_summary import answer_lines, file_lines, summary
from study.workflows.diagnosis.diagnosis_input import read_input

pytestmark = pytest.mark.usefixtures("sketched")


@pytest.fixture(scope="module")
def made(module_at):
    return module_at(Path(__file__).parents[3] / "diagnosed.py")


@pytest.fixture(scope="module")
def recording(made):
    return made.recorded(1)


@pytest.fixture(scope="module")
def files(made, recording, tmp_path_factory):
    folder = tmp_path_factory.mktemp("diagnose")
    write_recording(folder / "rec.h5", recording)
    write_mechanical_model(folder / "model.toml", made.device(1))
    return folder


@pytest.fixture(scope="module")
def findings(made, recording):
    return made.diagnosed(recording, made.device(1))


class Scripted:
    """An engine that finds what was found before, and writes down what it was asked."""

    def __init__(self, findings, ends_with=None):
        self.findings, self.ends_with = findings, ends_with

    def __call__(self, recordings, model, settings, map_, progress):
        self.recordings, self.model, self.settings = recordings, model, settings
        self.mapped = list(map_(abs, [-3, -1, -2]))
        progress("half of it", 0.5)
        if self.ends_with is not None:
            raise self.ends_with
        return self.findings


def quiet(what, share):
    pass


class EnoughSeenError(Exception):
    """Ends a diagnosis before it is written, which takes long."""


def asked_of_engine(a_plan, findings) -> Scripted:
    engine = Scripted(findings, EnoughSeenError())
    with pytest.raises(EnoughSeenError):
        diagnose_recordings(a_plan, quiet, engine)
    return engine


def plan(files, out, **more) -> DiagnosePlan:
    return DiagnosePlan(**{"sources": (files / "rec.h5",), "out": out, "model": files / "model.toml", **more})


@pytest.fixture(scope="module")
def in_two_steps(files, findings, tmp_path_factory):
    """The answer, what lay in its folder then, and what was written after it."""
    folder = tmp_path_factory.mktemp("done")
    answer = answered(plan(files, folder / "out"), quiet, Scripted(findings))
    there = list(folder.iterdir())
    return answer, there, written(answer, quiet)


@pytest.fixture(scope="module")
def done(in_two_steps):
    return in_two_steps[2]


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


def test_it_knows_where_it_comes_from(done):
    origin = read_json(done.out / "diagnosis.json", "hapteq-diagnosis", 1)["provenance"]
    assert [parent["file"] for parent in origin["parents"]] == ["rec.h5", "model.toml"]
    assert all(len(parent["sha256"]) == 64 for parent in origin["parents"])
    assert "hapteq" in origin["versions"]


def test_the_answer_is_there_before_anything_is_written(in_two_steps, findings):
    answer, there, done = in_two_steps
    assert answer_lines(answer.findings) == answer_lines(findings)
    assert there == []
    assert done.out == answer.plan.out
    assert (done.out / "report.html").is_file()


def test_the_summary_begins_with_the_verdict_and_then_says_where_the_files_are(done):
    lines = answer_lines(done.findings)
    assert lines[0].startswith("Missing in the model: dry friction on the x drive.")
    assert file_lines(done.out)[1:] == (f"Report: {done.out}/report.html", f"Improved model: {done.out}/improved.toml")
    assert any(line.startswith("  held out  as given") for line in lines)
    document = summary(done.findings)
    assert (document["format"], document["version"], document["verdict"]) == ("hapteq-diagnosis", 1, "explained")


def test_the_engine_gets_recordings_model_names_and_a_parallel_map(files, findings, tmp_path):
    engine = asked_of_engine(plan(files, tmp_path / "out", without=("backlash",)), findings)
    assert (engine.settings.names, engine.settings.without) == (("rec.h5",), ("backlash",))
    assert engine.mapped == [3, 1, 2]
    assert engine.model.inputs == len(engine.recordings[0].command.channels) == 1


def test_without_a_model_a_linear_one_is_fitted_first_and_it_is_said(files, findings, tmp_path):
    engine, shares = Scripted(findings), []
    alone = plan(files, tmp_path / "out", model=None)
    found = diagnose_recordings(alone, lambda what, share: shares.append(share), engine)
    assert shares == sorted(shares) and (shares[0], shares[-1]) == (0.0, 1.0)
    assert 0.1 < engine.model.mass[0, 0] < 0.5
    assert found.findings.remarks[0].startswith("No model was given. A linear one was fitted")
    assert "No model was given" in (tmp_path / "out" / "report.html").read_text()


@pytest.mark.parametrize("end", [KeyboardInterrupt(), ValueError("a bug")])
def test_interrupted_it_leaves_nothing(files, findings, tmp_path, end):
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


def test_an_effect_that_nobody_knows_is_wrong_use_with_a_suggestion(files, findings, tmp_path):
    with pytest.raises(WrongUseError) as refused:
        diagnose_recordings(plan(files, tmp_path / "out", without=("backlsh",)), quiet, Scripted(findings))
    assert refused.value.title == "There is no effect 'backlsh' to do without"
    assert "did you mean 'backlash'?" in refused.value.happened
    assert "coulomb_friction" in refused.value.do_now


def refused_with(files, findings, tmp_path, **more) -> StudyError:
    with pytest.raises(StudyError) as refused:
        diagnose_recordings(plan(files, tmp_path / "out", **more), quiet, Scripted(findings))
    assert not (tmp_path / "out").exists()
    return refused.value


def test_a_model_of_another_size_is_named(files, findings, tmp_path, made):
    write_mechanical_model(tmp_path / "three.toml", made.device(3))
    error = refused_with(files, findings, tmp_path, model=tmp_path / "three.toml")
    assert error.title == "Model and recording do not belong together"
    assert "The model has 3 inputs, but the recording has 1 command channel (fx)." in error.happened
    assert "three.toml" in error.do_now and error.saved == "Nothing was written."


def test_an_unstable_model_is_named(files, findings, tmp_path, made):
    one = made.device(1)
    wild = MechanicalModel("wild", "acceleration", one.mass, -one.damping, one.stiffness, one.input, one.output)
    write_mechanical_model(tmp_path / "wild.toml", wild)
    assert "unstable" in refused_with(files, findings, tmp_path, model=tmp_path / "wild.toml").happened


def test_a_recording_that_is_too_short_or_all_noise_is_named(files, findings, tmp_path, recording):
    cut = replace(
        recording, command=recording.command.part(0, 90), response=recording.response.part(0, 90), position=None,
        segments=(),
    )  # fmt: skip
    write_recording(tmp_path / "short.h5", cut)
    error = refused_with(files, findings, tmp_path, sources=(tmp_path / "short.h5",))
    assert error.title == "These recordings cannot be diagnosed"
    assert "90 samples are too short" in error.happened
    noise = np.random.default_rng(1).standard_normal(recording.response.samples.shape)
    write_recording(tmp_path / "noise.h5", replace(recording, response=replace(recording.response, samples=noise)))
    assert (
        "nothing to do with the commands"
        in refused_with(files, findings, tmp_path, sources=(tmp_path / "noise.h5",)).happened
    )


def test_recordings_of_two_devices_are_told_apart_by_name(files, findings, tmp_path, made):
    write_recording(tmp_path / "three.h5", made.recorded(3))
    error = refused_with(files, findings, tmp_path, sources=(files / "rec.h5", tmp_path / "three.h5"))
    assert "Three.h5 has the command" in error.happened or "three.h5 has the command" in error.happened


def test_a_position_that_not_all_recordings_have_is_left_out_and_it_is_said(files, findings, tmp_path, made):
    write_recording(tmp_path / "blind.h5", replace(made.recorded(1, seed=8), position=None))
    sources = (files / "rec.h5", tmp_path / "blind.h5")
    engine = asked_of_engine(plan(files, tmp_path / "out", sources=sources), findings)
    assert all(one.position is None for one in engine.recordings)
    assert "the position was left out" in read_input(sources, seed=1).remarks[0]


@pytest.mark.parametrize(
    "stands",
    [lambda x: 0 * x, lambda x: 0 * x + 0.01, lambda x: 0.01 + 1e-12 * x, lambda x: np.where(x > 0, 0.01, np.nan)],
    ids=["zero", "somewhere", "rounding", "gaps"],
)
def test_a_position_that_stands_still_is_left_out_and_it_is_said(tmp_path, recording, stands):
    dead = replace(recording.position, samples=stands(recording.position.samples))
    write_recording(tmp_path / "dead.h5", replace(recording, position=dead))
    found = read_input((tmp_path / "dead.h5",), seed=1)
    assert found.recordings[0].position is None
    assert found.remarks == ("Position x never changes: the position was left out of the comparison.",)


def test_few_cycles_are_a_remark_where_no_model_is_given_and_else_refused(tmp_path, recording):
    count, channels = recording.command.samples.shape
    slow = np.sin(2 * np.pi * 1.5 * np.arange(count) / count)[:, None] * np.ones(channels)
    write_recording(tmp_path / "slow.h5", replace(recording, command=replace(recording.command, samples=slow)))
    with pytest.raises(StudyError, match="cycles of what was commanded"):
        read_input((tmp_path / "slow.h5",), seed=1)
    assert any("cycles of what was commanded" in said for said in read_input((tmp_path / "slow.h5",), 1, True).remarks)


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


def test_recordings_of_one_name_are_told_apart_by_their_folders(files, findings, tmp_path, made):
    write_recording(tmp_path / "rec.h5", made.recorded(1, seed=8))
    both = (files / "rec.h5", tmp_path / "rec.h5")
    engine = asked_of_engine(plan(files, tmp_path / "out", sources=both), findings)
    assert len(set(engine.settings.names)) == 2


def test_clean_recordings_go_to_the_engine_and_are_named_as_parents(files, findings, tmp_path, made):
    write_recording(tmp_path / "clean.h5", made.recorded(1, (), seed=9))
    engine = Scripted(findings)
    done = diagnose_recordings(plan(files, tmp_path / "out", clean=(tmp_path / "clean.h5",)), quiet, engine)
    assert len(engine.settings.clean) == 1
    origin = read_json(done.out / "diagnosis.json", "hapteq-diagnosis", 1)["provenance"]
    assert [parent["file"] for parent in origin["parents"]] == ["rec.h5", "clean.h5", "model.toml"]


def test_without_a_model_the_clean_recordings_are_what_one_is_fitted_to(files, findings, tmp_path, made):
    write_recording(tmp_path / "clean.h5", made.recorded(1, (), seed=9))
    engine = Scripted(findings)
    wanted = plan(files, tmp_path / "out", model=None, clean=(tmp_path / "clean.h5",))
    found = answered(wanted, quiet, engine)
    assert engine.model.name == "fitted to the clean recordings"
    assert found.findings.remarks[0].startswith("No model was given. A linear one was fitted to the clean recordings")


def test_a_recording_cannot_be_diagnosed_and_be_clean(files, findings, tmp_path):
    with pytest.raises(StudyError, match=r"rec.h5 cannot be diagnosed and be clean at the same time"):
        diagnose_recordings(plan(files, tmp_path / "out", clean=(files / "rec.h5",)), quiet, Scripted(findings))


def test_clean_recordings_of_another_device_are_refused(files, findings, tmp_path, made):
    write_recording(tmp_path / "clean.h5", made.recorded(2, ()))
    with pytest.raises(StudyError, match=r"clean.h5 has the command .*one says nothing of the other") as refused:
        diagnose_recordings(plan(files, tmp_path / "out", clean=(tmp_path / "clean.h5",)), quiet, Scripted(findings))
    assert "leave --clean out" in str(refused.value.do_now)


def test_clean_recordings_that_say_nothing_of_the_others_are_refused(files, findings, tmp_path):
    engine = Scripted(findings, NothingLearned("the clean recordings can only be compared by windows"))
    with pytest.raises(StudyError, match=r"The clean recordings can only be compared by windows"):
        diagnose_recordings(plan(files, tmp_path / "out"), quiet, engine)
    assert not (tmp_path / "out").exists()


def test_a_position_that_the_clean_ones_lack_is_left_out_of_all(files, findings, tmp_path, made):
    write_recording(tmp_path / "clean.h5", replace(made.recorded(1, ()), position=None))
    engine = asked_of_engine(plan(files, tmp_path / "out", clean=(tmp_path / "clean.h5",)), findings)
    assert engine.recordings[0].position is None


def test_a_folder_beside_recordings_is_refused(files, findings, tmp_path):
    error = refused_with(files, findings, tmp_path, sources=(files / "rec.h5", tmp_path))
    assert "is a folder: a session is diagnosed by itself" in error.happened


def test_where_no_model_can_be_fitted_it_is_asked_for(files, findings, tmp_path, recording):
    # A third of it: three commands and two responses are weighed for long before nothing holds.
    count = len(recording) // 3
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


def test_two_commands_of_one_motion_are_made_one_and_it_is_said(files, findings, tmp_path, recording):
    pushed = recording.command.samples
    both = replace(recording.command, samples=np.hstack([pushed, 0.5 * pushed[::-1]]), channels=("fx", "fy"))
    write_recording(tmp_path / "two.h5", replace(recording, command=both))
    engine = asked_of_engine(plan(files, tmp_path / "out", sources=(tmp_path / "two.h5",), model=None), findings)
    assert len(engine.recordings[0].command.channels) == 1
    unlike = tmp_path / "two.h5", files / "rec.h5"
    error = refused_with(files, findings, tmp_path, sources=unlike, model=None)
    assert "rec.h5 has the command" in error.happened.lower()


def test_at_the_screen_a_stop_is_said_and_leaves_nothing(files, tmp_path):
    def stop(what, share):
        raise KeyboardInterrupt

    with pytest.raises(LeftError) as left:
        diagnose_at_screen(plan(files, tmp_path / "out"), stop)
    assert (left.value.title, left.value.saved) == ("The diagnosis was stopped", "Nothing was written.")
    assert list(tmp_path.iterdir()) == []


def test_results_of_the_screen_lie_in_a_session_or_beside_a_recording(tmp_path):
    assert free_out(tmp_path / "rec.h5") == tmp_path / "rec-diagnosis"
    (tmp_path / "rec-diagnosis").mkdir()
    assert free_out(tmp_path / "rec.h5") == tmp_path / "rec-diagnosis-2"
    assert free_out(tmp_path) == tmp_path / "diagnosis"


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
    assert measure_of([recording], model).measure.name == "free simulation"
    assert measure_of([recording], model, compared="force").measure.name == "predicted force"
    imposed = replace(recording, meta={**recording.meta, "imposed": "position"})
    assert measure_of([imposed], model).measure.name == "predicted force"
    assert measure_of([imposed], model, compared="motion").measure.name != "predicted force"
