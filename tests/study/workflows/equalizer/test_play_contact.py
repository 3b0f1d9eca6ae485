"""A transient at a contact, on the simulated device."""

import json
from dataclasses import replace

import numpy as np
import pytest

from equalizer.signals.signal import Signal
from equalizer.tracking.feedforward.trajectory import TRAJECTORY, TRANSIENT, Trajectory
from study.cli.main import main
from study.errors import StudyError
from study.store.formats.identified_model_file import read_identified_model, write_identified_model
from study.store.formats.trajectory_file import read_trajectory, write_trajectory
from study.workflows.equalizer.play_contact import ContactPlan, contact_lines, play_contact

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


def test_the_model_gives_the_transient_that_one_gain_misses(done):
    found, told = done
    assert found.equalized.error < 0.5 * found.plain.error
    assert found.start.error(found.normal) <= found.start.worst_error
    across = found.equalized.measured - np.outer(found.equalized.measured @ found.normal, found.normal)
    plain = found.plain.measured - np.outer(found.plain.measured @ found.normal, found.normal)
    assert np.linalg.norm(across) < np.linalg.norm(plain)
    assert told[-1] == 1.0 and told == sorted(told)


def test_nothing_acts_before_the_contact(done, folder):
    found, _ = done
    assert len(found.equalized.forces) == len(found.wanted) > len(tap().signal)
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
    assert f"As measured: error {100 * found.equalized.error:.1f} %" in contact_lines(found)[1]


def test_forces_above_the_cap_are_refused_with_the_scale_that_fits(folder, tmp_path):
    refused = refusal(folder, tmp_path, scale=100.0)
    assert "above the cap of 3 N" in refused.happened
    fits = float(refused.do_now.split("--scale ")[1].split(" ")[0])
    plan = ContactPlan(folder / "model.h5", folder / "tap.csv", NORMAL, tmp_path / "out", scale=fits)
    assert np.linalg.norm(play_contact(plan, lambda _: None).equalized.forces, axis=1).max() <= 3.0


def test_a_model_from_a_hand_is_not_played(folder, tmp_path):
    model = read_identified_model(folder / "model.h5")
    held = replace(model, provenance={**model.provenance, "hand": ["held"]})
    write_identified_model(tmp_path / "held.h5", held)
    assert "hand on the handle" in refusal(folder, tmp_path, model=tmp_path / "held.h5").happened


@pytest.mark.parametrize("normal", [(0.0, 0.0, 0.0), (float("nan"), 0.0, 1.0)])
def test_a_direction_that_is_none_is_refused(folder, tmp_path, normal):
    assert refusal(folder, tmp_path, normal=normal).title == "This is no normal"


def test_a_table_of_three_axes_is_no_transient(folder, tmp_path):
    write_trajectory(tmp_path / "wanted.csv", tap(kind=TRAJECTORY))
    assert "its header must be time_s,a" in refusal(folder, tmp_path, transient=tmp_path / "wanted.csv").happened


def test_another_rate_is_refused(folder, tmp_path):
    slow = replace(tap().signal, sample_rate_hz=500.0)
    write_trajectory(tmp_path / "slow.csv", Trajectory(slow))
    assert "500 Hz" in refusal(folder, tmp_path, transient=tmp_path / "slow.csv").happened


def test_the_command_says_what_was_measured(folder, tmp_path, capsys):
    files = ["contact", str(folder / "model.h5"), str(folder / "tap.csv"), "--out", str(tmp_path / "out")]
    assert main([*files, "--normal", "0", "0", "1", "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["normal"] == [0.0, 0.0, 1.0]
    assert document["measured_error"] < document["plain_error"]
