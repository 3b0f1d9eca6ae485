"""Commands that are given damaged files end with an exit code of theirs."""

import shutil
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from study.cli.main import app
from study.errors import StudyError
from study.workflows.files.validate import validate_file
from tests.study.workflows.files.mutated.mutations import SEED, mutated


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
def test_commands_end_with_a_code_of_theirs_for_each_damaged_file(sound, tmp_path):
    codes = commanded(sound, tmp_path, SEED, len(sound))
    assert sum(codes.values()) >= len(sound) / 2
    assert codes[1] > 0


@pytest.mark.slow
@pytest.mark.timeout(3600)
def test_a_thousand_commands_end_with_a_code_of_theirs(sound, tmp_path):
    codes = commanded(sound, tmp_path, 4, 1000)
    assert all(codes.values())
