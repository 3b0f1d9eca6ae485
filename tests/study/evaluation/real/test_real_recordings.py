"""A folder of recordings, diagnosed one by one: what goes through, what is said of the rest, what is kept."""

from pathlib import Path

import numpy as np
import pytest
from scipy.signal import cont2discrete, lfilter

from analysis.diagnosis.diagnosis_settings import DiagnosisSettings
from analysis.diagnosis.search.guard import Guard
from study.errors import StudyError, UserInterruptError
from study.evaluation.real import diagnose_real
from study.evaluation.real.real_folder import read_real_folder
from study.evaluation.real.real_recordings import RealPlan, diagnose_folder, diagnose_sent_recording
from study.evaluation.real.real_summary import format_real_lines
from study.evaluation.real.write_real import INJECTED_TABLE_NAME, RealResults, write_real_results
from study.importing.model_library import find_model_path, list_shipped_models
from study.store.disk.folder_contents import read_files, write_files
from study.store.formats.mechanical_model_file import read_mechanical_model
from study.store.formats.real_answer_file import read_real_answer
from study.workflows.files.validate import validate_file
from tests.one_axis_recording import DAMPING, MAP, MASS, MODEL, OFFSET, RATE_HZ, SECONDS, STIFFNESS, played


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """One recording with a wrong zero, one folder that no map reads, one whose file is broken."""
    whole = tmp_path / "recordings"
    for name in ("axis", "without_map", "torn"):
        (whole / name).mkdir(parents=True)
    np.savez(whole / "axis" / "run.npz", **played(OFFSET))
    (whole / "axis" / "run.toml").write_text(MAP)
    (whole / "axis" / "axis.model.toml").write_text(MODEL)
    (whole / "without_map" / "notes.txt").write_text("nothing")
    (whole / "torn" / "run.npz").write_bytes(b"no archive")
    (whole / "torn" / "run.toml").write_text(MAP.replace("axis.model.toml", ""))
    return whole


def silent(what: str, share: float) -> None:
    return None


@pytest.mark.slow
def test_one_recording_is_answered_and_the_others_are_reported(folder: Path, tmp_path: Path) -> None:
    done = diagnose_folder(RealPlan(folder, tmp_path / "out"), silent)
    axis, torn = done.results.answers
    assert axis.effects == ("sensor_offset",)
    assert axis.verdict in ("explained", "partly_explained")
    assert axis.held_out.after < 0.1 * axis.held_out.retuned
    assert axis.numbers[0].name == "mass" and axis.numbers[0].holds_nominal
    assert axis.objections == ("It is simulated.",)
    assert torn.verdict == "refused" and "run.npz" in torn.answer
    assert [trouble.location for trouble in done.results.troubles] == ["without_map"]
    page = done.page.read_text()
    assert "It is simulated." in page and "without_map" in page
    assert done.table.read_text().splitlines()[1].startswith(f"axis,run,{axis.verdict},sensor_offset")
    assert (tmp_path / "out" / "figures" / "held-out-axis-run.svg").is_file()
    assert any("sensor_offset" in line for line in format_real_lines(done))
    kept = tmp_path / "out" / "axis" / "run" / "answer.json"
    assert read_real_answer(kept) == axis
    assert validate_file(kept).kind.startswith("answer to the real recording run of axis")
    before = kept.stat().st_mtime_ns
    assert diagnose_folder(RealPlan(folder, tmp_path / "out"), silent).results.answers[0] == axis
    assert kept.stat().st_mtime_ns == before


def test_recordings_that_are_links_are_sent_to_workers_too(folder: Path, tmp_path: Path) -> None:
    linked, there = tmp_path / "linked" / "axis", tmp_path / "there"
    linked.mkdir(parents=True)
    for path in (folder / "axis").iterdir():
        (linked / path.name).symlink_to(path)
    (linked / "gone.npz").symlink_to(folder / "no_such_file")
    write_files(there / "axis", read_files(linked))
    (sent,) = read_real_folder(there).recordings
    assert (sent.name, [path.name for path in sent.found_map.files]) == ("run", ["run.npz"])
    assert sent.read_model() is not None


def test_spikes_of_the_reference_are_replaced_like_those_of_the_recording(tmp_path: Path, monkeypatch) -> None:
    folder = tmp_path / "recordings" / "axis"
    folder.mkdir(parents=True)
    for name in ("before", "after"):
        signals = played(0.0)
        velocity = np.cumsum(signals["y"]) / RATE_HZ
        spiked = velocity.copy()
        spiked[500:3500:500] += 20 * velocity.std()
        np.savez(folder / f"{name}.npz", u=signals["u"], y=spiked)
    pair = '[[diagnosis.pair]]\nbefore = "before.npz"\nafter = "after.npz"\nchanged = "a body was added"\n'
    map_text = MAP.replace('files = ["run.npz"]', 'separate = true\nfiles = ["*.npz"]').replace("m/s^2", "m/s")
    (folder / "run.toml").write_text(map_text + pair)
    (folder / "axis.model.toml").write_text(MODEL.replace("acceleration", "velocity"))
    compared: list[DiagnosisSettings] = []

    def keep_settings(recordings, model, settings, *_: object) -> None:
        compared.append(settings)
        raise StudyError("kept", "kept", "kept")

    monkeypatch.setattr(diagnose_real, "diagnose", keep_settings)
    after = next(each for each in read_real_folder(folder.parent).recordings if each.reference is not None)
    bounds = (lambda: True), Guard(enabled=False)
    assert diagnose_real.diagnose_real(after, *bounds, silent).answer.verdict == "refused"
    assert np.abs(compared[0].clean[0].response.samples[:, 0] - velocity).max() < velocity.std()
    case = diagnose_real._import_case(after, bounds, silent)
    told = [remark for remark in case.remarks if "replaced by interpolated values: 6 of ax" in remark]
    assert [remark.split(":")[0] for remark in told] == ["Isolated samples that no motion can have, such as spikes of a"
        " sensor or lost samples, were replaced by interpolated values", "run_before"]  # fmt: skip


def test_a_recording_that_did_not_come_to_its_worker_is_named() -> None:
    with pytest.raises(StudyError, match="did not come") as told:
        diagnose_sent_recording("axis", "run", {"notes.txt": b"nothing"})
    assert told.value.happened.startswith("axis, run: it is not among the files")


PULLED = """
device = "spring"
files = ["FILE.npz"]

[[clock]]
rate_hz = 500

[[channel]]
role = "command"
name = "f"
value = "u"
unit = "N"

[[channel]]
role = "response"
name = "x"
value = "x"
unit = "m"

[diagnosis]
tests = "TESTS"
"""


@pytest.mark.slow
def test_which_way_a_command_is_counted_is_decided_once_for_the_tests_too(tmp_path: Path) -> None:
    """The test moves so slowly that a spring is all that it shows, which tells no sign."""
    whole, time_s = tmp_path / "recordings" / "spring", np.arange(int(RATE_HZ * SECONDS)) / RATE_HZ
    whole.mkdir(parents=True)
    a, b = np.array([[0.0, 1.0], [-STIFFNESS / MASS, -DAMPING / MASS]]), np.array([[0.0], [1 / MASS]])
    rows, below, _ = cont2discrete((a, b, np.array([[1.0, 0.0]]), np.zeros((1, 1))), 1 / RATE_HZ)[:3]
    noise = lfilter([0.1], [1.0, -0.9], np.random.default_rng(4).normal(size=len(time_s)))
    slow = np.sin(2 * np.pi * 0.25 * time_s) * np.minimum(time_s, 1.0)
    for name, tests, u, read in (("run", "", noise, 1e-7), ("slow", "run", slow, 5e-5)):
        state, x = np.zeros(2), np.zeros(len(u))
        for k, force in enumerate(u):
            x[k] = state[0]
            state = rows @ state + below[:, 0] * force
        np.savez(whole / f"{name}.npz", u=-u, x=x + read * np.random.default_rng(5).normal(size=len(x)))
        (whole / f"{name}.toml").write_text(PULLED.replace("FILE", name).replace("TESTS", tests))

    (answer,) = diagnose_folder(RealPlan(whole.parent, tmp_path / "out"), silent).results.answers

    assert any("opposite in sign to the motion" in remark for remark in answer.remarks)
    (further,) = answer.further
    assert further.retuned < 0.2
    for name in ("improved.toml", "retuned.toml"):
        assert read_mechanical_model(tmp_path / "out" / "spring" / "run" / name).input[0, 0] == -1


def test_a_recording_at_which_the_program_crashes_is_reported_and_the_others_are_answered(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def crash(wanted: object, *more: object) -> object:
        raise ZeroDivisionError("a fault of the program")

    monkeypatch.setattr("study.evaluation.real.real_recordings.diagnose_real", crash)
    with pytest.raises(ZeroDivisionError):  # the tests themselves see it
        diagnose_folder(RealPlan(folder, tmp_path / "strict"), silent)
    monkeypatch.delenv("HAPTEQ_STRICT")
    done = diagnose_folder(RealPlan(folder, tmp_path / "out"), silent)
    assert [answer.verdict for answer in done.results.answers] == ["refused", "refused"]
    assert "crashed at this recording (ZeroDivisionError: a fault of the program)" in done.results.answers[0].answer
    assert "ZeroDivisionError" in done.page.read_text()


@pytest.mark.slow
def test_interrupted_the_same_command_continues(folder: Path, tmp_path: Path) -> None:
    def leave(what: str, share: float) -> None:
        if what.startswith("torn"):
            raise KeyboardInterrupt

    with pytest.raises(UserInterruptError) as left:
        diagnose_folder(RealPlan(folder, tmp_path / "out", seconds=1.0), leave)
    assert "continues where it stopped" in left.value.do_now
    assert (tmp_path / "out" / "axis" / "run" / "answer.json").is_file()
    assert not (tmp_path / "out" / "torn" / "run").exists()


def test_a_folder_that_is_none_is_refused(tmp_path: Path) -> None:
    with pytest.raises(StudyError, match="no such folder"):
        read_real_folder(tmp_path / "nowhere")


def test_an_unknown_model_is_refused_with_the_names_of_known_ones(tmp_path: Path) -> None:
    with pytest.raises(StudyError) as refusal:
        find_model_path("haptic_padle", tmp_path)
    assert "haptic_paddle" in refusal.value.happened
    assert all(find_model_path(name, tmp_path).is_file() for name in list_shipped_models())


@pytest.mark.slow
def test_faults_are_injected_under_a_seal_and_counted(folder: Path, tmp_path: Path) -> None:
    # What the answers are is not asked here.
    plan = RealPlan(folder, tmp_path / "out", inject=1, seed=6, seconds=1.0)
    done = diagnose_folder(plan, silent)
    assert len(done.results.injected) == 1
    sealed = sorted((tmp_path / "out" / "injected" / "sealed").glob("*.json"))
    assert len(sealed) == 1
    assert len((tmp_path / "out" / "injected" / "labels.sha256").read_text().splitlines()) == 1
    assert not any(each.failed for each in done.results.injected)
    assert "Faults injected into real recordings" in done.page.read_text()
    assert any(line.startswith("Injected: ") for line in format_real_lines(done))


def test_a_table_of_faults_of_an_earlier_run_is_removed(tmp_path: Path) -> None:
    (tmp_path / INJECTED_TABLE_NAME).write_text("recording,injected\nold,mass\n")
    done = write_real_results(tmp_path, RealResults((), ()), "2024-03-01")
    assert done.page.is_file() and done.table.is_file()
    assert not (tmp_path / INJECTED_TABLE_NAME).exists()


def test_every_folder_of_public_recordings_is_understood(shared: Path) -> None:
    if not (shared / "recordings").is_dir():
        pytest.skip("the public recordings are not beside this checkout")
    found = read_real_folder(shared / "recordings")
    by_name = {recording.name: recording for recording in found.recordings}
    # Folders that no shipped map describes are named as such, and stop none of the others.
    without_map = {trouble.location for trouble in found.troubles}
    assert all("no map is for its files" in trouble.reason for trouble in found.troubles)
    assert not without_map & {"emps", "f16_gvt", "haptic_paddle", "rack_drive", "silverbox", "vibration_actuator"}
    assert set(by_name) >= {
        "emps", "f16_gvt", "haptic_paddle_sensors", "haptic_paddle_torque", "rack_drive", "silverbox",
        "vibration_actuator_noise_condition1_noise", "vibration_actuator_noise_condition2_noise",
    }  # fmt: skip
    on_a_body = by_name["vibration_actuator_noise_condition2_noise"]
    assert on_a_body.reference is not None and on_a_body.reference.files[0].name == "condition1_noise.npz"
    assert [test.files[0].stem for test in on_a_body.tests] == ["condition2_clip"]
    assert [test.name for test in by_name["silverbox"].tests] == ["silverbox_growing_noise", "silverbox_schroeder"]
    assert all(recording.found_map.source.map.diagnosis.objections for recording in found.recordings)
    assert by_name["haptic_paddle_torque"].read_model().rotational


@pytest.mark.slow
def test_the_figures_of_the_public_recordings_are_reached(shared: Path, tmp_path: Path) -> None:
    """Those that are; docs/real.md says which are not."""
    if not (shared / "recordings").is_dir():
        pytest.skip("the public recordings are not beside this checkout")
    few = tmp_path / "recordings"
    few.mkdir()
    for name in ("emps", "haptic_paddle", "vibration_actuator"):
        (few / name).symlink_to(shared / "recordings" / name)
    done = diagnose_folder(RealPlan(few, tmp_path / "out"), silent)
    answers = {answer.recording: answer for answer in done.results.answers}
    axis, lever = answers["emps"], answers["haptic_paddle_torque"]
    assert axis.held_out.after <= 0.28 * axis.held_out.retuned
    assert axis.numbers[0].value == pytest.approx(95.1, rel=0.01)
    assert lever.held_out.after <= 0.25 * lever.held_out.retuned
    assert lever.numbers[0].holds_nominal
    pair = answers["vibration_actuator_noise_condition2_noise"].pair
    assert pair.with_effects <= 0.8 * pair.gain
    assert "body_on_actuator" in pair.returned
    assert not any(answer.verdict == "explained" for answer in answers.values())
