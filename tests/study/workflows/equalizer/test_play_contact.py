"""A transient at a contact, on the simulated device."""

import json
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from equalizer.signals.signal import Signal
from equalizer.tracking.feedforward.trajectory import TRAJECTORY, TRANSIENT, Trajectory
from study.cli.main import main
from study.devices.device import Fault
from study.errors import StudyError, UserInterruptError
from study.store.formats.identified_model_file import read_identified_model, write_identified_model
from study.store.formats.trajectory_file import read_trajectory, write_trajectory
from study.workflows.equalizer import play_contact as play_contact_module
from study.workflows.equalizer import repeat_playback as repeat_playback_module
from study.workflows.equalizer.equalize_trajectory import EqualizePlan
from study.workflows.equalizer.play_contact import ContactPlan, format_contact, play_contact
from study.workflows.equalizer.repeat_trajectory import RepeatOptions, repeat_trajectory

NORMAL = (1.0, 2.0, -2.0)


def tap(level_mps2=6.0, kind=TRANSIENT) -> Trajectory:
    time_s = np.arange(200) / 1000
    samples = level_mps2 * np.exp(-time_s / 0.04) * np.sin(2 * np.pi * 22 * time_s)
    return Trajectory(Signal(np.tile(samples[:, None], (1, len(kind.header) - 1)), 1000.0, "acceleration", "m/s^2",
                             kind.header[1:]))  # fmt: skip


@pytest.fixture(scope="module")
def folder(tmp_path_factory, lab_model):
    folder = tmp_path_factory.mktemp("contact")
    write_identified_model(folder / "model.h5", lab_model)
    write_trajectory(folder / "tap.csv", tap())
    return folder


@pytest.fixture(scope="module")
def done(folder):
    told = []
    plan = ContactPlan(folder / "model.h5", folder / "tap.csv", NORMAL, folder / "out")
    return play_contact(plan, told.append), told


def refusal(folder, tmp_path, **more) -> StudyError:
    plan = replace(ContactPlan(folder / "model.h5", folder / "tap.csv", NORMAL, tmp_path / "out"), **more)
    with pytest.raises(StudyError) as refused:
        play_contact(plan, lambda _: None)
    assert not (tmp_path / "out").exists()
    return refused.value


@pytest.mark.parametrize("stiffness", ["100 N/m", None, [1.0], True])
def test_a_model_whose_spring_is_no_number_is_refused_with_its_words(folder, tmp_path, stiffness):
    model = read_identified_model(folder / "model.h5")
    feedback = {**model.provenance["feedback"], "stiffness_n_per_m": stiffness}
    path = tmp_path / "text.h5"
    write_identified_model(path, replace(model, provenance={**model.provenance, "feedback": feedback}))
    assert "as stiffness_n_per_m of `feedback`" in refusal(folder, tmp_path, model=path).happened


@pytest.mark.slow
def test_the_model_gives_the_transient_that_one_gain_misses(done):
    found, told = done
    assert found.equalized.error < 0.5 * found.single_gain.error
    assert found.start.compute_error(found.normal) <= found.start.worst_error
    across = found.equalized.measured - np.outer(found.equalized.measured @ found.normal, found.normal)
    plain = found.single_gain.measured - np.outer(found.single_gain.measured @ found.normal, found.normal)
    assert np.linalg.norm(across) < np.linalg.norm(plain)
    assert told[-1] == 1.0 and told == sorted(told)


@pytest.mark.slow
def test_no_force_acts_before_the_contact(done, folder):
    found, _ = done
    assert len(found.equalized.forces) == len(found.reference) > len(tap().signal)
    written = read_trajectory(folder / "out" / "forces.csv")
    assert written.start_s == 0.0
    np.testing.assert_array_equal(written.signal.samples, found.equalized.forces)


def test_what_was_played_is_written_with_a_picture(done, folder):
    found, _ = done
    assert {path.name for path in (folder / "out").iterdir()} == {
        "forces.csv",
        "wanted.csv",
        "measured.csv",
        "contact.json",
        "contact.svg",
        "contact.png",
    }
    document = json.loads((folder / "out" / "contact.json").read_text("utf-8"))
    assert document["measured_error"] == pytest.approx(found.equalized.error)
    assert document["normal"] == pytest.approx([1 / 3, 2 / 3, -2 / 3])
    assert f"As measured: error {100 * found.equalized.error:.1f} %" in format_contact(found)[1]


def test_forces_above_the_cap_are_refused_with_the_scale_that_fits(folder, tmp_path):
    refused = refusal(folder, tmp_path, scale=100.0)
    assert "above the cap of 3 N" in refused.happened
    fits = float(refused.do_now.split("--scale ")[1].split(" ")[0])
    plan = ContactPlan(folder / "model.h5", folder / "tap.csv", NORMAL, tmp_path / "out", scale=fits)
    assert np.linalg.norm(play_contact(plan, lambda _: None).equalized.forces, axis=1).max() <= 3.0


@pytest.mark.parametrize("scale", [1e5, 1e6])
def test_the_scale_that_fits_is_never_nought(folder, tmp_path, scale):
    write_trajectory(tmp_path / "micrometres.csv", tap(6e6))
    refused = refusal(folder, tmp_path, transient=tmp_path / "micrometres.csv", scale=scale)
    assert 1e-8 < float(refused.do_now.split("--scale ")[1].split(" ")[0]) < 1e-5


def test_a_cap_without_end_is_refused(folder, tmp_path):
    assert "cap_n is inf; it must be a positive number" in refusal(folder, tmp_path, cap_n=np.inf).happened


def test_an_offset_of_the_sensor_is_no_part_of_what_was_measured(folder, tmp_path, done, monkeypatch):
    found, _ = done
    read = play_contact_module.read_measured_acceleration
    monkeypatch.setattr(play_contact_module, "read_measured_acceleration", lambda result: read(result) + 5.0)
    plan = ContactPlan(folder / "model.h5", folder / "tap.csv", NORMAL, tmp_path / "out")
    assert play_contact(plan, lambda _: None).equalized.error == pytest.approx(found.equalized.error)


def test_a_model_from_a_hand_is_not_played(folder, tmp_path):
    model = read_identified_model(folder / "model.h5")
    held = replace(model, provenance={**model.provenance, "hand": ["held"]})
    write_identified_model(tmp_path / "held.h5", held)
    assert "hand on the handle" in refusal(folder, tmp_path, model=tmp_path / "held.h5").happened


@pytest.mark.parametrize("normal", [(0.0, 0.0, 0.0), (float("nan"), 0.0, 1.0)])
def test_a_direction_that_is_none_is_refused(folder, tmp_path, normal):
    assert refusal(folder, tmp_path, normal=normal).title == "This is no normal"


@pytest.fixture
def real_device(monkeypatch):
    """In the simulated device's place: one that moves, and that fails the test if it does."""

    def play(*_):
        raise AssertionError("it moved")

    info = SimpleNamespace(name="omega.3", simulated=False, sample_rate_hz=1000.0)
    device = SimpleNamespace(info=info, play=play, fault=lambda: Fault.NONE, close=lambda: None)
    for module in (play_contact_module, repeat_playback_module):
        monkeypatch.setattr(module, "open_device", lambda *_: device)


def refuse_after(said):
    def refuse(notice):
        said.append(notice)
        raise KeyboardInterrupt

    return refuse


@pytest.mark.usefixtures("real_device")
def test_a_real_device_is_announced_and_does_not_move_for_a_person_who_says_no(folder, tmp_path):
    said = []
    plan = ContactPlan(folder / "model.h5", folder / "tap.csv", NORMAL, tmp_path / "out")
    with pytest.raises(UserInterruptError) as left:
        play_contact(plan, lambda _: None, refuse_after(said))
    assert "0 of 2 plays were measured" in left.value.happened
    assert "No person may hold the handle: 'omega.3' is going to move by itself" in said[0]
    assert not (tmp_path / "out").exists()


@pytest.mark.usefixtures("real_device")
def test_a_real_device_does_not_move_unannounced(folder, tmp_path):
    assert "without a warning" in refusal(folder, tmp_path).happened


@pytest.mark.usefixtures("real_device")
def test_repeats_on_a_real_device_are_announced_first(folder, tmp_path):
    signal = tap(kind=TRAJECTORY).signal
    padded = replace(signal, samples=0.3 * np.pad(signal.samples, ((500, 500), (0, 0))))
    write_trajectory(tmp_path / "wanted.csv", Trajectory(padded))
    plan = EqualizePlan((folder / "model.h5",), tmp_path / "wanted.csv", tmp_path / "forces.csv")
    order, said = RepeatOptions(repeats=1, device="omega3"), []
    with pytest.raises(StudyError, match="without a warning"):
        repeat_trajectory(plan, order, lambda *_: None)
    with pytest.raises(UserInterruptError) as left:
        repeat_trajectory(plan, order, lambda *_: None, refuse_after(said))
    assert "0 of up to 2 plays" in left.value.happened
    assert "No person may hold the handle" in said[0]


def test_a_table_of_three_axes_is_no_transient(folder, tmp_path):
    write_trajectory(tmp_path / "wanted.csv", tap(kind=TRAJECTORY))
    assert "its header must be time_s,a" in refusal(folder, tmp_path, transient=tmp_path / "wanted.csv").happened


def test_another_rate_is_refused(folder, tmp_path):
    slow = replace(tap().signal, sample_rate_hz=500.0)
    write_trajectory(tmp_path / "slow.csv", Trajectory(slow))
    assert "500 Hz" in refusal(folder, tmp_path, transient=tmp_path / "slow.csv").happened


@pytest.mark.slow
def test_the_command_says_what_was_measured(folder, tmp_path, capsys):
    files = ["contact", str(folder / "model.h5"), str(folder / "tap.csv"), "--out", str(tmp_path / "out")]
    assert main([*files, "--normal", "0", "0", "1", "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["normal"] == [0.0, 0.0, 1.0]
    assert document["measured_error"] < document["plain_error"]
