"""`hapteq diagnose` of this checkout and of an earlier commit on the same files, in one run; prints ratios.

The whole command, with page and figures: imports count, what is compiled at the first run is left out. Times are of the
processor, children included: others may use the machine. `--against CHECKOUT` takes another commit's directory, as
`git worktree add` makes one; else the commit is taken from this repository.
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

HERE, BEFORE = Path(__file__).resolve().parents[2], "06f1c62"
"""Of November 2026, before the search was made faster."""
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


def compared(ours: Path, theirs: Path, folder: Path) -> float:
    """Our time over theirs, at the median."""
    ratios = []
    for number, (name, files) in enumerate(written(folder).items()):
        taken = []
        for side, checkout in (("ours", ours), ("theirs", theirs)):
            if name in ("one axis", "three axes, nothing", "three axes, coulomb_friction"):
                diagnosed(checkout, files, folder / f"{side}{number}-first")
            taken.append(diagnosed(checkout, files, folder / f"{side}{number}"))
        ratios.append(taken[0].cpu_s / taken[1].cpu_s)
        aim = AIMS_S.get(name, THREE_AXES_S)
        for side, each in zip(("ours", "before"), taken, strict=True):
            report(f"{name}, {side}: {each.cpu_s:.1f} CPU s, {each.wall_s:.1f} s (aim {aim:g} s): {each.said}")
        report(f"{name}: {ratios[-1]:.2f} times as long as before")
    return float(np.median(ratios))


def main() -> int:
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--against", type=Path, help="another checkout of hapteq")
    asked = options.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        theirs = asked.against
        if theirs is None:
            theirs = Path(folder) / BEFORE
            theirs.mkdir()
            kept = subprocess.run(["git", "archive", BEFORE], cwd=HERE, capture_output=True, check=False)
            if kept.returncode:
                report(f"Commit {BEFORE} is not here to compare with; give a checkout with --against.")
                return 0
            subprocess.run(["tar", "-x", "-C", str(theirs)], input=kept.stdout, check=True)
        ratio = compared(HERE, theirs.resolve(), Path(folder))
    report(f"ours / before, median: {ratio:.2f} (at most {MOST:g} wanted)")
    return int(ratio > MOST)


if __name__ == "__main__":
    sys.exit(main())
