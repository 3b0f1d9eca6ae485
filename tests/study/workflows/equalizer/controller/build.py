"""A model, and its exported sources compiled as strictly as a user may."""

import os
import subprocess
from pathlib import Path

import numpy as np

from equalizer.plant.identified_model import IdentifiedModel
from study.store.formats.identified_model_file import write_identified_model

STRICT = ("-O2", "-Wall", "-Wextra", "-Wpedantic", "-Werror")
STAND_INS = Path(__file__).parent / "stand_ins"
CHANNELS = ("fx", "fy", "fz"), ("ax", "ay", "az")


def write_model(path: Path, band_hz=(5.0, 35.0), order=8, size=3) -> Path:
    draw = np.random.default_rng(7).standard_normal
    A, B, C = draw((order, order)), draw((order, size)), draw((size, order))
    if order:
        A *= 0.97 / np.abs(np.linalg.eigvals(A)).max()
    names = [tuple(channels[:size]) for channels in CHANNELS]
    model = IdentifiedModel(A, B, C, draw((size, size)), 1000.0, band_hz, "N", "m/s^2", *names)
    write_identified_model(path, model)
    return path


def build(vendor, folder: Path, source: str, *options: str) -> Path:
    """A program of a C source in a folder. Fails on a warning."""
    out = folder / "built"
    command = [*vendor.compiler(), "-std=c11", *STRICT, *options, "-o", str(out), str(folder / source), "-lm"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=240, check=False)
    assert done.returncode == 0, done.stderr
    return out


def compiled_cpp(vendor, source: Path, *folders: Path, options: tuple[str, ...] = ("-c",)) -> tuple[Path, str]:
    """What was made of a C++ source, and what the compiler said: nothing where all is well."""
    out = source.with_suffix(".out")
    where = [f"-I{folder}" for folder in (*folders, STAND_INS)]
    command = [*vendor.cpp_compiler(), "-std=c++17", *STRICT, *where, *options, "-o", str(out), str(source)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=240, check=False)
    assert (done.returncode == 0) == (done.stderr == ""), done.stderr
    return out, done.stderr


def run(program: Path, *words: str, **variables: float) -> subprocess.CompletedProcess[str]:
    """With variables of the environment."""
    environment = {**os.environ, **{name: str(value) for name, value in variables.items()}}
    command = [str(program), *words]
    return subprocess.run(command, capture_output=True, text=True, timeout=60, check=False, env=environment)
