"""A real recording in two halves: both can be played from rest, and a fault is put into the second alone."""

import json
from pathlib import Path

import numpy as np
import pytest

from analysis.diagnosis.errors.played_errors import played_error
from equalizer.effects.simulator import simulate_mechanism
from equalizer.plant.mechanical_model import MechanicalModel, SensorLimits
from equalizer.signals.recording import Recording, Segment
from equalizer.signals.signal import Signal
from study.errors import StudyError
from study.store.provenance import sha256_of
from study.store.recording_file import read_recording
from study.workflows.inject_real import PROCESSOR_S, Carrier, halves, seal_injections, without_lead
from study.workflows.proof_folder import opened

RATE_HZ, SAMPLES = 500.0, 6000
ONE = np.array([[1.0]])


@pytest.fixture(scope="module")
def model() -> MechanicalModel:
    return MechanicalModel(
        "one axis", "acceleration", 0.2 * ONE, 0.6 * ONE, 200.0 * ONE, ONE, ONE, SensorLimits(0.0, 0.0)
    )


@pytest.fixture(scope="module")
def recording(model) -> Recording:
    """Rings for a second; never at rest after its beginning."""
    random = np.random.default_rng(3)
    command = random.normal(size=(SAMPLES, 1))
    played = simulate_mechanism(model, command, RATE_HZ, ()).response
    read = played + 0.002 * played.std() * random.normal(size=played.shape)
    return Recording(
        "rig",
        Signal(command, RATE_HZ, "force", "N", ("fx",)),
        Signal(read, RATE_HZ, "acceleration", "m/s^2", ("ax",)),
        segments=(Segment(0, SAMPLES, "noise", 1.0, role="fit"),),
    )


@pytest.fixture(scope="module")
def carrier(recording, model) -> Carrier:
    sound, rest = halves(recording)
    return Carrier("rig", model, without_lead(sound), rest, 0.002)


def test_what_was_commanded_before_the_second_half_goes_before_it(recording):
    sound, rest = halves(recording)
    assert (len(sound), len(rest)) == (SAMPLES // 2, SAMPLES)
    given = without_lead(rest)
    assert np.array_equal(given.command.samples, recording.command.samples)
    assert np.isnan(given.response.samples[: SAMPLES // 2]).all()
    assert np.array_equal(given.response.samples[SAMPLES // 2 :], recording.response.samples[SAMPLES // 2 :])
    assert [(one.start, one.stop, one.role) for one in given.segments] == [(SAMPLES // 2, SAMPLES, "")]


def test_the_second_half_is_played_from_rest_as_well_as_the_first(recording, model):
    errors = [played_error(without_lead(half), model, "all").as_it_is for half in halves(recording)]
    assert errors == pytest.approx([0.002, 0.002], rel=0.2)


def test_the_labels_say_what_was_put_in_and_the_clean_half_stays(carrier, tmp_path: Path):
    folder = opened(tmp_path / "bank", 4, False)
    names = seal_injections(folder, (carrier,), 6, 4)
    labels = [json.loads(folder.label(number).read_text()) for number in range(6)]
    assert [one["name"] for one in labels] == list(names)
    for label in labels:
        place = folder.open / label["name"]
        clean, given = read_recording(place / "clean" / "recording.h5"), read_recording(place / "recording.h5")
        assert np.array_equal(clean.response.samples, carrier.sound.response.samples)
        before = without_lead(carrier.rest).response.samples
        changed = not np.array_equal(given.response.samples, before, equal_nan=True)
        changed |= not np.array_equal(given.command.samples, carrier.rest.command.samples)
        assert changed == bool(label["effect"])
        assert np.isnan(given.response.samples[: SAMPLES // 2]).all()
        assert label["adds"] <= label["adds_as_it_is"]


def test_what_re_tuning_takes_up_is_not_detectable(carrier, tmp_path: Path):
    """A slow sensor is a heavier, more damped device, as far as the model's tolerances go."""
    folder = opened(tmp_path / "bank", 4, False)
    seal_injections(folder, (carrier,), 12, 4)
    labels = [json.loads(folder.label(number).read_text()) for number in range(12)]
    taken_up = [one["adds"] / one["adds_as_it_is"] for one in labels if one["adds_as_it_is"] >= 1.25]
    assert taken_up
    assert min(taken_up) < 1.0


def test_labels_bind_recording_model_and_clean_half_and_the_search_has_its_time(carrier, tmp_path: Path):
    folder = opened(tmp_path / "bank", 4, False)
    (name,) = seal_injections(folder, (carrier,), 1, 4)
    label, place = json.loads(folder.label(0).read_text()), folder.open / name
    assert label["model_sha256"] == sha256_of(place / "model.toml")
    assert label["others_sha256"] == {"clean/recording.h5": sha256_of(place / "clean" / "recording.h5")}
    assert json.loads((place / "settings.json").read_text()) == {"without": [], "processor_s": PROCESSOR_S}


def test_a_label_that_was_changed_breaks_its_seal(carrier, tmp_path: Path):
    folder = opened(tmp_path / "bank", 4, False)
    seal_injections(folder, (carrier,), 1, 4)
    folder.label(0).write_text(folder.label(0).read_text().replace('"strength"', '"strength" '))
    with pytest.raises(StudyError, match="A seal is broken"):
        seal_injections(folder, (carrier,), 1, 4)
