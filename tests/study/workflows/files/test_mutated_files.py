"""Files of every kind, damaged at random: each reader reads them or refuses them with a named error, and does no more.

A failing case says its seed, its number and its file: `HAPTEQ_MUTATIONS=SEED:COUNT` runs that seed again.
"""

import io
import json
import os
import re
import resource
import shutil
from pathlib import Path

import h5py
import numpy as np
import pytest
from scipy.io import savemat
from typer.testing import CliRunner

from study.cli.main import app
from study.errors import StudyError
from study.importing.arrays.arrays import read_arrays
from study.importing.map_format.import_map import CsvMap
from study.store.formats.identified_model_file import read_identified_model
from study.store.formats.mechanical_model_file import read_mechanical_model
from study.store.formats.protocol_files import read_protocol
from study.store.formats.recording_file import read_recording, write_recording
from study.store.formats.trajectory_file import read_trajectory
from study.store.sessions.archive import SessionFolder
from study.store.sessions.event_log import readable_events
from study.store.sessions.live_file import read_live
from study.store.sessions.request_inbox import RequestInbox
from study.workflows.files.validate import validate_file
from study.workflows.recording.import_recording import read_foreign
from study.workflows.results.fold_session import fold_session
from study.workflows.views.session_line import session_line

FROZEN = Path(__file__).parents[3] / "frozen" / "v0_1"
SEED, COUNT = (int(part) for part in os.environ.get("HAPTEQ_MUTATIONS", "20260101:240").split(":"))
MOST_MEMORY_BYTES = 2**30
NUMBERS = (b"1e999", b"-1e999", b"nan", b"NaN", b"-1", b"0", b"9" * 30, b"1e308", b"-0.0", b"1e-320", b"true", b'""')
VALUES = (None, True, -1, 0, 10**30, 1e308, -1e-320, "", "\ud800", "x" * 3000, [], {}, [[[]]], {"a": {"b": 1}})
LIVE = {
    "format": "hapteq-live", "version": 1, "utc": "2026-01-01T00:00:00+00:00", "activity": "answer",
    "since_utc": "2026-01-01T00:00:00+00:00", "fault": "", "offset_mm": 0.5, "handle_ready": True,
    "acceleration_mps2": None, "sensor_clipped": False, "missed_ticks": 0,
}  # fmt: skip
REQUEST = {
    "format": "hapteq-request",
    "version": 1,
    "request": "note",
    "who": "experimenter",
    "text": "a",
    "adverse": True,
}


def corpus(folder: Path) -> list[Path]:
    """One sound file of each kind: the frozen ones, and foreign ones made here."""
    folder.mkdir()
    for name in ("model.h5", "lever.h5", "forces.csv", "wanted.csv", "twin.toml", "corpus_recording.toml",
                 "corpus_study.toml", "lever_map.toml", "lever.csv"):  # fmt: skip
        shutil.copy(FROZEN / name, folder)
    session = FROZEN / "study" / "P01_001"
    others = ("found/diagnosis.json", "study/corpus.lock.json", "study/P03_001/withdrawn.json")
    trial = session / "recordings" / "run-00_trial-000_attempt-0.h5"
    for path in (*session.glob("*.*"), *(FROZEN / name for name in others), trial):
        shutil.copy(path, folder)
    u = np.random.default_rng(0).normal(size=(400, 2))
    arrays = {"t": np.arange(400) / 1e3, "force": u, "acceleration": u[::-1].copy(), "fs": 1000.0}
    np.savez_compressed(folder / "packed.npz", **arrays)
    np.savez(folder / "plain.npz", **arrays)
    np.save(folder / "single.npy", u)
    savemat(
        folder / "plain.mat", {"data": {"u": u, "deep": {"fs": 1e3}}, "note": "a", "cells": np.array([u, 1], object)}
    )
    savemat(folder / "packed.mat", arrays, do_compression=True)
    for name in ("foreign.h5", "matlab.mat"):
        with h5py.File(folder / name, "w") as file:
            for key, value in arrays.items():
                file[f"run/{key}"] = value
            file.create_dataset("run/packed", data=u, compression="gzip", chunks=(50, 2))
            file["note"] = "text"
    (folder / "live.json").write_text(json.dumps(LIVE))
    (folder / "note-1.json").write_text(json.dumps(REQUEST))
    return sorted(folder.iterdir())


def mutated(content: bytes, name: str, rng: np.random.Generator) -> bytes:
    """One to three changes of a random kind."""
    kinds = [flipped, cut, doubled, inserted, removed]
    if not name.endswith((".h5", ".npz", ".npy", ".mat")):
        kinds += [renumbered, renumbered, nested]
    if name.endswith((".json", ".jsonl")):
        kinds += [retyped, retyped, retyped]
    if name.endswith(".h5") or name == "matlab.mat":
        kinds += [restructured, restructured, restructured]
    for _ in range(int(rng.integers(1, 4))):
        content = kinds[int(rng.integers(len(kinds)))](content, rng)
    return content


def place(content: bytes, rng: np.random.Generator) -> int:
    """Somewhere, and half of the time near the beginning, where what matters stands."""
    return int(rng.integers(0, max(1, len(content) if rng.random() < 0.5 else min(len(content), 2000))))


def flipped(content, rng):
    changed = bytearray(content)
    for _ in range(int(rng.integers(1, 20))):
        if changed:
            changed[place(content, rng)] = int(rng.integers(256))
    return bytes(changed)


def cut(content, rng):
    return content[: place(content, rng)]


def doubled(content, rng):
    at, size = place(content, rng), int(rng.integers(1, 2000))
    return content[: at + size] + content[at:]


def inserted(content, rng):
    at = place(content, rng)
    return content[:at] + rng.bytes(int(rng.integers(1, 50))) + content[at:]


def removed(content, rng):
    at = place(content, rng)
    return content[:at] + content[at + int(rng.integers(1, 200)) :]


def renumbered(content, rng):
    numbers = list(re.finditer(rb"-?\d+(\.\d+)?(e-?\d+)?", content))
    if not numbers:
        return content
    found = numbers[int(rng.integers(len(numbers)))]
    return content[: found.start()] + NUMBERS[int(rng.integers(len(NUMBERS)))] + content[found.end() :]


def nested(content, rng):
    numbers = list(re.finditer(rb"(?<=[=:,])\s*\d+", content))
    depth = int(rng.choice([30, 300, 3000, 30000]))
    deep = [b"[" * depth + b"]" * depth, b'{"a":' * depth + b"1" + b"}" * depth, b"0x" + b"f" * depth, b"(" * depth]
    if not numbers:
        return content
    found = numbers[int(rng.integers(len(numbers)))]
    return content[: found.start()] + deep[int(rng.integers(len(deep)))] + content[found.end() :]


def retyped(content, rng):
    """One value of a document, or of one line of a log, becomes another of any type."""
    lines = content.split(b"\n")
    line = int(rng.integers(len(lines))) if content.count(b"\n{") > 1 else -1
    try:
        document = json.loads(content if line < 0 else lines[line])
    except (ValueError, RecursionError):
        return content
    holders = [(document, key) for key in document] if isinstance(document, dict) else []
    for holder, key in holders:
        inner = holder[key]
        if isinstance(inner, dict):
            holders += [(inner, name) for name in inner]
        elif isinstance(inner, list):
            holders += [(inner, number) for number in range(len(inner))]
    if not holders or len(holders) > 100_000:
        return content
    holder, key = holders[int(rng.integers(len(holders)))]
    holder[key] = VALUES[int(rng.integers(len(VALUES)))]
    try:
        text = json.dumps(document).encode()
    except (ValueError, RecursionError):
        return content
    return text if line < 0 else b"\n".join([*lines[:line], text, *lines[line + 1 :]])


def restructured(content, rng):
    """Another shape, type or value of a dataset or an attribute, by way of the library."""
    buffer = io.BytesIO(content)
    try:
        with h5py.File(buffer, "r+") as file:
            names: list[str] = []
            file.visit(names.append)
            datasets = [name for name in names if isinstance(file[name], h5py.Dataset)]
            name = datasets[int(rng.integers(len(datasets)))]
            owner = file if rng.random() < 0.5 else file[name]
            replaced(file, name, owner, rng)
    except Exception:  # noqa: BLE001 - damaged before: h5py raises what it likes
        return content
    return buffer.getvalue()


def replaced(file, name, owner, rng):
    keys = list(owner.attrs)
    odd = (
        np.nan,
        -1,
        1e308,
        "",
        "x" * 5000,
        np.zeros((30, 30)),
        ["a"] * 500,
        b"\xff",
        np.inf,
        10**18,
        True,
        h5py.Empty("f"),
    )
    match int(rng.integers(7)):
        case 0 if keys:
            owner.attrs[keys[int(rng.integers(len(keys)))]] = odd[int(rng.integers(len(odd)))]
        case 1 if keys:
            del owner.attrs[keys[int(rng.integers(len(keys)))]]
        case 2:
            kept = dict(file[name].attrs)
            del file[name]
            shape = [(), (0,), (0, 0), (5,), (3, 3, 3), (2**40, 2), (2**20, 3), (2**31, 1)][int(rng.integers(8))]
            kind = ["f8", "f4", "i8", "u1", "S4", "c16", "f2", h5py.string_dtype(), h5py.ref_dtype][
                int(rng.integers(9))
            ]
            chunks = True if shape and min(shape) and rng.random() < 0.5 else None
            file.create_dataset(name, shape, kind, chunks=chunks).attrs.update(kept)
        case 3:
            values = file[name][()]
            if getattr(values, "size", 0) and values.dtype.kind == "f":
                values.reshape(-1)[int(rng.integers(values.size))] = rng.choice([np.nan, np.inf, 1e308, -1e308, 1e-320])
                file[name][()] = values
        case 4:
            del file[name]
        case 5:
            file[f"{name}_2"] = h5py.ExternalLink("/etc/passwd", "/x")
        case 6:
            del file[name]
            file.create_dataset(name, (20,), "f8", external=[("/etc/passwd", 0, 160)])


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
            readable_events(path)
            session_line(SessionFolder(path.parent))
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


@pytest.fixture(scope="module")
def sound(tmp_path_factory):
    return corpus(tmp_path_factory.mktemp("corpus") / "files")


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


def commands(path: Path, beside: Path) -> list[tuple[str | Path, ...]]:
    """What a person may do with such a file. Fits that take long only get files that are refused."""
    out, data = path.with_name("out"), path.parent.parent
    known: dict[str, list[tuple[str | Path, ...]]] = {
        "model.h5": [("equalize", path, beside / "wanted.csv", "--out", out / "f.csv")],
        "wanted.csv": [("equalize", beside / "model.h5", path, "--out", out / "f.csv")],
        "lever_map.toml": [("import", beside / "lever.csv", "--map", path, "--out", out / "r.h5")],
        "lever.csv": [("import", path, "--map", beside / "lever_map.toml", "--out", out / "r.h5")],
        "events.jsonl": [("show", path.parent), ("sessions", "--data", data), ("analyze", data, "--out", out)],
        "diagnosis.json": [("show", path)],
        "corpus_study.toml": [("protocol", "show", path)],
        "corpus_recording.toml": [("protocol", "show", path)],
    }
    if path.name in known:
        return known[path.name]
    imported = ("import", path, "--out", out / "r.h5")
    if path.suffix == ".h5" and validate_file(path).problems:
        return [imported, ("identify", path, "--out", out / "m.h5"), ("diagnose", path, "--out", out)]
    return [imported] if path.suffix in (".npz", ".npy", ".mat", ".h5") else []


def commanded(sound, folder, seed, count):
    """How many commands ended with each exit code."""
    codes = dict.fromkeys((0, 1, 2), 0)
    for number in range(count):
        rng = np.random.default_rng([seed, number, 1])
        source = sound[number % len(sound)]
        path = folder / f"{number}" / "P01_001" / source.name
        path.parent.mkdir(parents=True)
        (path.parent / "out").mkdir()
        path.write_bytes(mutated(source.read_bytes(), source.name, rng))
        for words in commands(path, source.parent):
            done = CliRunner().invoke(app, [str(word) for word in words])
            error = done.exception
            if error is not None and not isinstance(error, StudyError | SystemExit):
                error.add_note(f"seed {seed}, case {number}, {' '.join(map(str, words))}")
                raise error
            codes[int(error.exit_code) if isinstance(error, StudyError) else done.exit_code] += 1
        shutil.rmtree(folder / f"{number}")
    return codes


@pytest.mark.timeout(300)
def test_commands_end_with_a_code_of_theirs_whatever_the_file(sound, tmp_path):
    codes = commanded(sound, tmp_path, SEED, len(sound))
    assert sum(codes.values()) >= len(sound) / 2
    assert codes[1] > 0


@pytest.mark.slow
@pytest.mark.timeout(3600)
def test_a_thousand_commands_end_with_a_code_of_theirs(sound, tmp_path):
    codes = commanded(sound, tmp_path, 4, 1000)
    assert all(codes.values())


@pytest.mark.slow
@pytest.mark.timeout(3600)
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_three_thousand_mutated_files_are_read_or_refused_by_name(sound, tmp_path, seed):
    assert sum(attacked(sound, tmp_path, seed, 3000)) == 3000
