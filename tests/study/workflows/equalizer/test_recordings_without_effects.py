"""A device that rubs, friction that is known: from recordings over a model of the rest to forces, all through files."""

from dataclasses import replace

import numpy as np
import pytest

from equalizer.laws.law import parse_law
from equalizer.plant.mechanical_model import ActuatorLimits, MechanicalModel, ModelEffect, SensorLimits
from equalizer.signals.recording import Recording, Segment
from equalizer.signals.signal import Signal
from equalizer.tracking.feedforward.band_pass import filter_to_band
from equalizer.tracking.feedforward.trajectory import Trajectory
from equalizer.tracking.learning.iteration import rms
from study.cli.main import main
from study.errors import StudyError
from study.store.formats.identified_model_file import read_identified_model
from study.store.formats.mechanical_model_file import write_mechanical_model
from study.store.formats.recording_file import read_recording, write_recording
from study.store.formats.trajectory_file import read_trajectory, write_trajectory
from study.workflows.equalizer.identify_model import IdentifyPlan, identify_model
from study.workflows.equalizer.recordings_without_effects import (
    explain_unremovable_effects,
    find_excitation_band,
    list_removable_effects,
)

pytestmark = pytest.mark.usefixtures("sketched")

RATE_HZ, BAND_HZ, PERIOD, LEVEL_N = 1000.0, (5.0, 35.0), 10_000, 0.1


def mechanical(*effects) -> MechanicalModel:
    one = np.eye(3)
    sensor, actuator = SensorLimits(bandwidth_hz=500), ActuatorLimits(delay_s=0.001, bandwidth_hz=600)
    return MechanicalModel("device", "acceleration", 0.28 * one, one, one, one, one, sensor, actuator, effects)


def recorded(device, commands, seed) -> Recording:
    twice = np.tile(commands, (2, 1))
    force = Signal(twice, RATE_HZ, "force", "N", ("fx", "fy", "fz"))
    response = Signal(device.measured(twice, seed), RATE_HZ, "acceleration", "m/s^2", ("ax", "ay", "az"))
    segment = Segment(0, 2 * PERIOD, "multisine", float(np.abs(commands).max()), PERIOD)
    return Recording("rubbing", force, response, excitation=force, segments=(segment,), meta={"place_m": [0, 0, 0]})


@pytest.fixture(scope="module")
def device(rubbing, plants):
    return rubbing.rubbing(plants.modes_of(), LEVEL_N)


@pytest.fixture(scope="module")
def folder(device, plants, tmp_path_factory):
    """Multisines on all axes at once, three times with phases turned by thirds; what is known; what is wanted."""
    folder = tmp_path_factory.mktemp("freed")
    lines = np.fft.rfft(plants.multisine(4.5, 37, PERIOD / RATE_HZ, 1.0, seed=5), axis=0)
    for number in range(3):
        turned = np.fft.irfft(lines * np.exp(2j * np.pi / 3 * number * np.arange(3)), PERIOD, axis=0)
        write_recording(folder / f"{number}.h5", recorded(device, turned, number))
    friction = ModelEffect("coulomb_friction", None, {"level": LEVEL_N})
    write_mechanical_model(folder / "improved.toml", mechanical(friction))
    noise = filter_to_band(np.random.default_rng(7).standard_normal((6000, 3)), RATE_HZ, BAND_HZ)[2000:4000]
    fade = np.clip(np.minimum(np.arange(2000), np.arange(2000)[::-1]) / 100, 0, 1)[:, None]
    rows = np.zeros((2600, 3))
    rows[300:-300] = 1.8 * noise / noise.std(axis=0) * (0.5 - 0.5 * np.cos(np.pi * fade))
    signal = Signal(filter_to_band(rows, RATE_HZ, BAND_HZ), RATE_HZ, "acceleration", "m/s^2", ("ax", "ay", "az"))
    write_trajectory(folder / "wanted.csv", Trajectory(signal))
    return folder


def error(device, folder, name, *options) -> float:
    """Of the device's true motion, from the command line's own files."""
    recordings = [str(folder / f"{number}.h5") for number in range(3)]
    assert main(["identify", *recordings, "--out", str(folder / f"{name}.h5"), *options]) == 0
    forces = folder / f"{name}.csv"
    wanted_file = str(folder / "wanted.csv")
    assert main(["equalize", str(folder / f"{name}.h5"), wanted_file, "--out", str(forces), *options]) == 0
    wanted = read_trajectory(folder / "wanted.csv").signal.samples
    played = device.play(read_trajectory(forces).signal.samples)
    return rms(filter_to_band(played - wanted, RATE_HZ, BAND_HZ)) / rms(wanted)


@pytest.mark.slow
def test_a_model_of_freed_recordings_plays_with_the_friction_compensated_wholly(device, folder, capsys):
    plain = error(device, folder, "plain")
    freed = error(device, folder, "freed", "--physics", str(folder / "improved.toml"))
    assert plain > 0.07
    assert freed < 0.03
    said = capsys.readouterr().out
    assert "Subtracted from the recordings: coulomb_friction (level 0.1); give --physics when" in said
    provenance = read_identified_model(folder / "freed.h5").provenance
    assert provenance["amplitude_n"] is None
    assert provenance["freed_of"] == ["coulomb_friction (level 0.1)"]
    assert [parent["file"] for parent in provenance["parents"]][-1] == "improved.toml"
    assert read_identified_model(folder / "plain.h5").provenance["freed_of"] == []


def refused(folder, tmp_path, model, recording="0.h5") -> StudyError:
    write_mechanical_model(tmp_path / "known.toml", model)
    plan = IdentifyPlan((folder / recording,), tmp_path / "m.h5", physics=tmp_path / "known.toml")
    with pytest.raises(StudyError) as refusal:
        identify_model(plan, lambda share: None)
    assert not plan.out.exists()
    return refusal.value


@pytest.mark.slow
def test_physics_that_name_nothing_to_take_off_are_refused_with_the_reason(folder, tmp_path):
    said = refused(folder, tmp_path, mechanical(ModelEffect("viscous_damping", None, {"damping": 3.0})))
    assert "cannot be subtracted" in said.title
    assert (
        "known.toml names no effect that can be subtracted from a recording. viscous_damping: it is linear"
        in said.happened
    )


def test_what_stays_in_the_recordings_is_told(folder, tmp_path):
    friction = ModelEffect("coulomb_friction", None, {"level": LEVEL_N})
    teeth = ModelEffect("cogging", None, {"amplitude": 0.1, "pitch": 0.01})
    write_mechanical_model(tmp_path / "known.toml", mechanical(friction, teeth))
    recordings = tuple(folder / f"{number}.h5" for number in range(3))
    plan = IdentifyPlan(recordings, tmp_path / "m.h5", order=6, smooth=False, physics=tmp_path / "known.toml")
    told = identify_model(plan, lambda share: None).remarks
    (said,) = [sentence for sentence in told if sentence.startswith("Not subtracted from the recordings: ")]
    assert "cogging: amplitude and pitch" in said


def test_a_law_is_removable_where_it_names_the_axes_of_the_recording():
    law = ModelEffect("discovered_law", "x", {}, parse_law("-5.0*vx*abs(vx)", "force", "x"))
    for inputs, is_removable in ((("fy", "fx"), True), (("u",), True), (("fy", "fz"), False)):
        assert bool(list_removable_effects(mechanical(law), inputs)) is is_removable
        assert bool(explain_unremovable_effects(mechanical(law), inputs)) is not is_removable


def test_an_effect_on_an_axis_that_is_not_there_is_refused(folder, tmp_path):
    said = refused(folder, tmp_path, mechanical(ModelEffect("coulomb_friction", "q", {"level": 0.1})))
    assert "coulomb_friction is on the axis 'q'" in said.happened


def test_what_was_excited_is_read_off_the_excitation(folder):
    recording = read_recording(folder / "0.h5")
    assert find_excitation_band(recording) == pytest.approx((4.6, 36.8), abs=0.4)
    silent = Signal(np.full((100, 3), 0.2), RATE_HZ, "force", "N", ("fx", "fy", "fz"))
    with pytest.raises(ValueError, match="contains no excitation"):
        find_excitation_band(replace(recording, command=silent, excitation=None))
