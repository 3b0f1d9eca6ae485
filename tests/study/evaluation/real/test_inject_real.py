"""A real recording in two halves: both can be played from rest, and a fault is put into the second alone."""

import json
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from analysis.diagnosis.errors.prediction_error import compute_prediction_error
from equalizer.effects.simulation.simulator import simulate_mechanism
from equalizer.plant.mechanical_model import MechanicalModel, SensorLimits
from equalizer.signals.recording import Recording, Segment
from equalizer.signals.signal import Signal
from study.errors import StudyError
from study.evaluation.bank.proof_folder import open_proof_folder
from study.evaluation.bank.proof_seals import hash_case_files
from study.evaluation.real.inject_real import PROCESSOR_S, InjectableRecording, run_injections, seal_injections
from study.evaluation.real.injected_halves import blank_lead_responses, compute_held_out_change, draw_halves
from study.store.disk.provenance import compute_sha256
from study.store.formats.recording_file import read_recording

RATE_HZ, SAMPLES = 500.0, 6000
LATER = 0
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
def carrier(recording, model) -> InjectableRecording:
    return InjectableRecording("rig", model, recording)


@pytest.fixture(scope="module")
def split(recording) -> tuple[Recording, Recording]:
    """The later half is the one to be spoiled."""
    return draw_halves(recording, np.random.default_rng(LATER))


def test_what_was_commanded_before_the_later_half_goes_before_it(recording, split):
    sound, rest = split
    lead = rest.segments[0].start
    assert 0 < lead < len(rest) <= SAMPLES
    given = blank_lead_responses(rest)
    begun = np.flatnonzero((recording.command.samples == rest.command.samples[0]).all(axis=1))[0]
    assert np.array_equal(given.command.samples, recording.command.samples[begun : begun + len(rest)])
    assert np.isnan(given.response.samples[:lead]).all()
    assert np.array_equal(given.response.samples[lead:], rest.response.samples[lead:])
    own = blank_lead_responses(sound).response.samples
    assert not np.isin(own[np.isfinite(own)], given.response.samples).any()


def test_both_halves_are_played_from_rest_equally_well(split, model):
    errors = [compute_prediction_error(blank_lead_responses(half), model, "all").without_gain for half in split]
    assert errors == pytest.approx([0.002, 0.002], rel=0.2)


def test_splits_differ_and_the_same_draw_gives_the_same():
    def of(seed: int) -> tuple[int, int]:
        first, second = draw_halves(in_parts(), np.random.default_rng(seed))
        return len(first), len(second)

    assert of(1) == of(1)
    assert len({of(seed) for seed in range(12)}) > 3


def in_parts() -> Recording:
    random, ends = np.random.default_rng(3), np.cumsum([0, 300, 500, 400, 700, 600])
    moved = random.normal(size=(ends[-1], 1))
    return Recording(
        "rig",
        Signal(moved, RATE_HZ, "force", "N", ("fx",)),
        Signal(moved, RATE_HZ, "position", "m", ("x",)),
        meta={"parts": [{"start": int(a), "stop": int(b)} for a, b in pairwise(ends)]},
    )


def test_parts_by_chance_are_whole_and_in_one_half_only():
    for seed in range(20):
        halves = draw_halves(in_parts(), np.random.default_rng(seed))
        if all(len(half.meta.get("parts", ())) > 1 and half.segments[0].start == 0 for half in halves):
            samples = np.concatenate([half.command.samples for half in halves])
            assert np.array_equal(np.sort(samples, axis=0), np.sort(in_parts().command.samples, axis=0))
            return
    pytest.fail("no seed made halves of parts")


@pytest.mark.slow
def test_what_a_fault_changes_is_what_a_base_of_the_clean_half_misses(split):
    sound, rest = (blank_lead_responses(half) for half in split)
    assert compute_held_out_change(sound, rest, rest) == 1.0
    doubled = replace(rest, command=replace(rest.command, samples=2 * rest.command.samples))
    slightly = replace(rest, command=replace(rest.command, samples=1.0001 * rest.command.samples))
    assert compute_held_out_change(sound, rest, doubled) > 1.25
    assert compute_held_out_change(sound, rest, slightly) == pytest.approx(1.0, abs=0.05)


@pytest.mark.slow
def test_the_labels_say_what_was_put_in_and_the_clean_half_stays(carrier, tmp_path: Path):
    folder = open_proof_folder(tmp_path / "bank", 4, False)
    names = seal_injections(folder, (carrier,), 8, 4)
    labels = [json.loads(folder.get_label_file(number).read_text()) for number in range(8)]
    assert [each["name"] for each in labels] == list(names)
    assert {bool(each["effects"]) for each in labels} == {True, False}
    readings, commands = carrier.recording.response.samples, carrier.recording.command.samples
    for label in labels:
        place = folder.open / label["name"]
        clean, given = read_recording(place / "clean" / "recording.h5"), read_recording(place / "recording.h5")
        known = clean.response.samples[np.isfinite(clean.response.samples)]
        assert np.isin(known, readings).all()
        known = given.response.samples[np.isfinite(given.response.samples)]
        plain = np.isin(known, readings).all() and np.isin(given.command.samples, commands).all()
        assert plain == (not label["effects"])
        assert len(label["effects"]) == len(label["places"])
        assert label["effects"] or label["change"] == 1.0


def test_labels_bind_recording_model_and_clean_half_and_the_search_has_its_time(carrier, tmp_path: Path):
    folder = open_proof_folder(tmp_path / "bank", 4, False)
    (name,) = seal_injections(folder, (carrier,), 1, 4)
    label, place = json.loads(folder.get_label_file(0).read_text()), folder.open / name
    assert label["model_sha256"] == compute_sha256(place / "model.toml")
    assert label["others_sha256"] == {"clean/recording.h5": compute_sha256(place / "clean" / "recording.h5")}
    assert json.loads((place / "settings.json").read_text()) == {"without": [], "processor_s": PROCESSOR_S}


def test_a_label_that_was_changed_breaks_its_seal(carrier, tmp_path: Path):
    folder = open_proof_folder(tmp_path / "bank", 4, False)
    seal_injections(folder, (carrier,), 1, 4)
    folder.get_label_file(0).write_text(folder.get_label_file(0).read_text().replace('"strength"', '"strength" '))
    with pytest.raises(StudyError, match="A seal is broken"):
        seal_injections(folder, (carrier,), 1, 4)


def test_a_label_that_is_changed_during_the_diagnoses_breaks_its_seal(carrier, tmp_path: Path, monkeypatch):
    def answer_and_change(folder, names, workers, on_answered):
        for name in names:
            answer = {"failed": "", "knows_the_challenge": False, **hash_case_files(folder.open / name)}
            (folder.open / name / "answer.json").write_text(json.dumps(answer))
        path = folder.get_label_file(0)
        path.write_text(path.read_text().replace('"strength"', '"strength" '))

    monkeypatch.setattr("study.evaluation.bank.ask_engine.diagnose_cases", answer_and_change)
    with pytest.raises(StudyError, match="A seal is broken"):
        run_injections(tmp_path / "bank", (carrier,), (1, 4), lambda done, of: None)
