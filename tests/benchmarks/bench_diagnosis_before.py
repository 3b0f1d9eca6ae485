"""`hapteq diagnose` of this checkout and of earlier commits on the same files, in one run; prints ratios.

The whole command, with page and figures: imports count, what is compiled at the first run is left out. Times are of the
processor, children included: others may use the machine. `--against CHECKOUT` takes another commit's directory, as
`git worktree add` makes one; else the commits are taken from this repository.
"""

import argparse
import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from equalizer.signals.recording import Recording
from equalizer.signals.signal import Signal
from study.evaluation.challenge.draw_case import draw_case
from study.store.formats.mechanical_model_file import write_mechanical_model
from study.store.formats.recording_file import write_recording

HERE = Path(__file__).resolve().parents[2]
BEFORE = ("06f1c62", "571f516")
"""Of November 2026: before the search was made faster, and half-way."""
SEED = 61
CONCEALED = ((), ("sensor_lag",), ("hardening_stiffness",), ("coulomb_friction",))
"""On three axes, 9 channels, 105 s at 1 kHz, with a model."""
RATE_HZ, SAMPLES = 500.0, 20_000
MASS_KG, DAMPING, STIFFNESS, FRICTION_N, NOISE_M = 0.3, 2.0, 100.0, 0.8, 3e-6
"""Of one axis without a model,"""
STEPS = 20
"""integrated in so many per sample."""
AIMS_S = {"one axis": 4.0}
"""Aims, and no bars: machines differ."""
THREE_AXES_S = 10.0
MOST = 1.1
"""Times the earlier commit's time that ours may take at most, at the median."""


@dataclass(frozen=True)
class Taken:
    cpu_s: float
    wall_s: float
    said: str


def report(line: str) -> None:
    sys.stdout.write(line + "\n")
    sys.stdout.flush()


def rubbing_axis() -> Recording:
    """A body on a spring that rubs, implicit in its friction."""
    random = np.random.default_rng(1)
    spectrum = np.zeros(SAMPLES // 2 + 1, complex)
    spectrum[10:600] = np.exp(2j * np.pi * random.random(590))
    force = np.fft.irfft(spectrum, SAMPLES)
    force *= 3.0 / force.std()
    step, v, q, position = 1 / (RATE_HZ * STEPS), 0.0, 0.0, np.empty(SAMPLES)
    for k, held in enumerate(force.tolist()):
        position[k] = q
        for _ in range(STEPS):
            free = v + step / MASS_KG * (held - DAMPING * v - STIFFNESS * q)
            v = np.sign(free) * max(abs(free) - step * FRICTION_N / MASS_KG, 0.0)
            q += step * v
    position += NOISE_M * random.standard_normal(SAMPLES)
    return Recording(
        "invented",
        Signal(force[:, None], RATE_HZ, "force", "N", ("fx",)),
        Signal(position[:, None], RATE_HZ, "position", "m", ("x",)),
    )


def written(folder: Path) -> dict[str, list[str]]:
    """Each case's files, as the command takes them."""
    write_recording(folder / "one.h5", rubbing_axis())
    cases = {"one axis": [str(folder / "one.h5")]}
    for number, effects in enumerate(CONCEALED):
        case = draw_case(SEED + number, effects, strength=0.6 if effects else None)
        recording, model = folder / f"{number}.h5", folder / f"{number}.toml"
        write_recording(recording, case.recording)
        write_mechanical_model(model, case.model)
        cases[f"three axes, {' '.join(effects) or 'nothing'}"] = [str(recording), "--model", str(model)]
    return cases


def diagnosed(checkout: Path, files: list[str], out: Path) -> Taken:
    said = {**os.environ, "OPENBLAS_NUM_THREADS": "1", "PYTHONPATH": str(checkout)}
    said.pop("PYTHONDONTWRITEBYTECODE", None)
    command = [sys.executable, "-m", "study", "diagnose", *files, "--out", str(out)]
    before, began = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    done = subprocess.run(command, cwd=checkout, env=said, capture_output=True, text=True, check=False)
    wall_s, after = time.perf_counter() - began, resource.getrusage(resource.RUSAGE_CHILDREN)
    if done.returncode:
        raise SystemExit(f"{checkout}: {done.stderr[-2000:]}")
    cpu_s = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    found = json.loads((out / "diagnosis.json").read_text(encoding="utf-8"))
    return Taken(cpu_s, wall_s, f"{found['verdict']} {' '.join(each['effect'] for each in found['effects'])}".strip())


def compared(ours: Path, earlier: dict[str, Path], folder: Path) -> dict[str, float]:
    """Our time over theirs, at the median; by commit."""
    ratios: dict[str, list[float]] = {commit: [] for commit in earlier}
    for number, (name, files) in enumerate(written(folder).items()):
        taken = {}
        for side, checkout in {"ours": ours, **earlier}.items():
            if name in ("one axis", "three axes, nothing", "three axes, coulomb_friction"):
                diagnosed(checkout, files, folder / f"{side}{number}-first")
            each = taken[side] = diagnosed(checkout, files, folder / f"{side}{number}")
            aim = AIMS_S.get(name, THREE_AXES_S)
            report(f"{name}, {side}: {each.cpu_s:.1f} CPU s, {each.wall_s:.1f} s (aim {aim:g} s): {each.said}")
        for commit, its in ratios.items():
            its.append(taken["ours"].cpu_s / taken[commit].cpu_s)
            report(f"{name}: {its[-1]:.2f} times as long as {commit}")
    return {commit: float(np.median(its)) for commit, its in ratios.items()}


def archived(folder: Path) -> dict[str, Path]:
    """Earlier commits' sources; without those that are not in this repository."""
    found = {}
    for commit in BEFORE:
        kept = subprocess.run(["git", "archive", commit], cwd=HERE, capture_output=True, check=False)
        if kept.returncode:
            report(f"Commit {commit} is not here to compare with; give a checkout with --against.")
            continue
        found[commit] = folder / commit
        found[commit].mkdir()
        subprocess.run(["tar", "-x", "-C", str(found[commit])], input=kept.stdout, check=True)
    return found


def main() -> int:
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--against", type=Path, help="another checkout of hapteq")
    asked = options.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        given = asked.against
        earlier = archived(Path(folder)) if given is None else {given.name: given.resolve()}
        ratios = compared(HERE, earlier, Path(folder)) if earlier else {}
    for commit, ratio in ratios.items():
        report(f"ours / {commit}, median: {ratio:.2f} (at most {MOST:g} wanted)")
    return int(any(ratio > MOST for ratio in ratios.values()))


if __name__ == "__main__":
    sys.exit(main())
