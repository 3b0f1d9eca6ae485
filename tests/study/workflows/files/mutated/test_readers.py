"""Files of every kind, damaged at random: each reader reads them, or refuses them with a named error, and no more."""

import resource
import shutil
from pathlib import Path

import numpy as np
import pytest

from study.errors import StudyError
from study.importing.arrays.read_arrays import read_arrays
from study.importing.map_format.import_map import CsvMap
from study.store.formats.identified_model_file import read_identified_model
from study.store.formats.mechanical_model_file import read_mechanical_model
from study.store.formats.protocol_files import read_protocol
from study.store.formats.recording_file import read_recording, write_recording
from study.store.formats.trajectory_file import read_trajectory
from study.store.sessions.archive import SessionFolder
from study.store.sessions.event_log import read_valid_events
from study.store.sessions.live_file import read_live
from study.store.sessions.request_inbox import RequestInbox
from study.workflows.files.validate import validate_file
from study.workflows.recording.import_recording import read_foreign
from study.workflows.results.fold_session import fold_session
from study.workflows.views.session_line import make_session_line
from tests.study.workflows.files.mutated.mutations import COUNT, SEED, mutated

MOST_MEMORY_BYTES = 2**30


def read(path: Path, beside: Path) -> None:
    """All readers that such a file may meet."""
    validate_file(path)
    if path.name.endswith((".npz", ".npy", ".mat")) or path.name == "foreign.h5":
        read_arrays(path, CsvMap())
        read_foreign((path,), None)
    elif path.name.endswith(".h5") and path.name != "model.h5":
        write_recording(path.with_name("again.h5"), read_recording(path), overwrite=True)
    else:
        read_ours(path, beside)


def read_ours(path: Path, beside: Path) -> None:
    match path.name:
        case "lever_map.toml":
            read_foreign((beside / "lever.csv",), str(path))
        case "lever.csv":
            read_foreign((path,), str(beside / "lever_map.toml"))
        case "live.json" | "note-1.json":
            read_live(path.parent)
            (path.parent / "requests").mkdir(exist_ok=True)
            shutil.copy(path, path.parent / "requests")
            RequestInbox(path.parent).take()
        case "events.jsonl":
            read_valid_events(path)
            make_session_line(SessionFolder(path.parent))
            fold_session(SessionFolder(path.parent))
        case "model.h5":
            read_identified_model(path)
        case "twin.toml":
            read_mechanical_model(path)
        case "forces.csv" | "wanted.csv":
            read_trajectory(path)
        case "corpus_study.toml" | "corpus_recording.toml":
            read_protocol(str(path))
        case "corpus.lock.json":
            shutil.copy(beside / "corpus_study.toml", path.parent)
            read_protocol(str(path.parent / "corpus_study.toml"))


def test_the_sound_files_are_read(sound, tmp_path):
    """Or the mutations would prove nothing."""
    (tmp_path / "P01_001").mkdir()
    for path in sound:
        here = tmp_path / "P01_001" / path.name
        shutil.copy(path, here)
        try:
            read(here, path.parent)
        except StudyError as refused:
            assert type(refused).__name__ == "MapNeededError", refused


def attacked(sound, folder, seed, count):
    """How many of `count` mutated files were read and how many refused."""
    read_whole = refused = 0
    for number in range(count):
        rng = np.random.default_rng([seed, number])
        source = sound[number % len(sound)]
        place_of_it = folder / f"{number}" / "P01_001"
        place_of_it.mkdir(parents=True)
        path = place_of_it / source.name
        path.write_bytes(mutated(source.read_bytes(), source.name, rng))
        before = path.read_bytes()
        try:
            read(path, source.parent)
            read_whole += 1
        except StudyError as error:
            assert error.happened and error.do_now
            refused += 1
        except BaseException as error:
            error.add_note(f"seed {seed}, case {number}, {source.name}")
            raise
        assert path.read_bytes() == before
        shutil.rmtree(folder / f"{number}")
    return read_whole, refused


@pytest.mark.timeout(300)
def test_mutated_files_are_read_or_refused_by_name(sound, tmp_path):
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    read_whole, refused = attacked(sound, tmp_path, SEED, COUNT)
    assert read_whole + refused == COUNT
    assert refused > COUNT / 4
    assert read_whole > COUNT / 20
    assert (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - memory) * 1024 < MOST_MEMORY_BYTES


@pytest.mark.slow
@pytest.mark.timeout(3600)
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_three_thousand_mutated_files_are_read_or_refused_by_name(sound, tmp_path, seed):
    assert sum(attacked(sound, tmp_path, seed, 3000)) == 3000
