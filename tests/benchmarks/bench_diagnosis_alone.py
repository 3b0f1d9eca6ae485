"""The diagnosis of a recording without a model, by this checkout and by another in one run: `--against PATH`, or none.

Invented devices with dry friction: one axis of 20 000 samples, and three. Each checkout runs in a process of its own
with one thread; what it imports and compiles at first is stated apart. Times are of the processor: others may use the
machine.
"""

import argparse
import json
import os
import subprocess
import sys
import time
from pathlib import Path

import numpy as np

HERE = Path(__file__).resolve().parents[2]
RATE_HZ, SAMPLES, TIMES = 500.0, 20_000, 3
MASS_KG, DAMPING, STIFFNESS, FRICTION_N, NOISE_M = 0.3, 2.0, 100.0, 0.8, 3e-6
STEPS = 20
"""Of the integration, per sample."""
AIM_S = 4.0
"""Of one axis. An aim, and no bar: machines differ."""
MOST = 1.15
"""Times the other checkout's time that ours may take at most."""


def moved(force):
    """(n,): position of a body on a spring that rubs, implicit in its friction; force: newtons, held."""
    step, v, q, found = 1 / (RATE_HZ * STEPS), 0.0, 0.0, np.empty(len(force))
    for k, held in enumerate(force.tolist()):
        found[k] = q
        for _ in range(STEPS):
            free = v + step / MASS_KG * (held - DAMPING * v - STIFFNESS * q)
            v = np.sign(free) * max(abs(free) - step * FRICTION_N / MASS_KG, 0.0)
            q += step * v
    return found


def device(axes: int):
    from equalizer.signals.recording import Recording
    from equalizer.signals.signal import Signal

    random = np.random.default_rng(1)
    spectrum = np.zeros((SAMPLES // 2 + 1, axes), complex)
    spectrum[10:600] = np.exp(2j * np.pi * random.random((590, axes)))
    force = np.fft.irfft(spectrum, SAMPLES, axis=0)
    force *= 3.0 / force.std(axis=0)
    position = np.column_stack([moved(column) for column in force.T])
    position += NOISE_M * random.standard_normal(position.shape)
    names = tuple("xyz"[:axes])
    return Recording(
        "invented",
        Signal(force, RATE_HZ, "force", "N", tuple(f"f{name}" for name in names)),
        Signal(position, RATE_HZ, "position", "m", names),
    )


def measured(axes: int) -> dict:
    """In the checkout whose packages are on the path, through the workflow that a user's command runs."""
    import tempfile

    began = time.process_time()
    from study.store.formats.recording_file import write_recording
    from study.workflows.diagnosis.diagnose_recordings import DiagnosePlan, diagnose_recordings

    imports = time.process_time() - began
    taken, recording = [], device(axes)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "rec.h5"
        write_recording(path, recording)
        for number in range(TIMES):
            began = time.process_time()
            done = diagnose_recordings(DiagnosePlan((path,), Path(folder) / f"out{number}"), lambda what, share: None)
            taken.append(time.process_time() - began)
    named = [effect.effect for effect in done.findings.diagnosis.effects]
    return {"imports": imports, "first": taken[0], "later": min(taken[1:]), "named": named}


def by_checkout(root: Path, axes: int) -> dict:
    threads = {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1", "PYTHONPATH": str(root)}
    command = [sys.executable, str(Path(__file__).resolve()), "--measure", str(axes)]
    done = subprocess.run(command, cwd=root, env={**os.environ, **threads}, capture_output=True, text=True, check=False)
    if done.returncode:
        raise SystemExit(f"{root}: {done.stderr[-2000:]}")
    return json.loads(done.stdout.splitlines()[-1])


def report(what: str, found: dict) -> None:
    sys.stdout.write(
        f"{what}: {found['later']:.2f} CPU s with page and figures, named {', '.join(found['named']) or 'nothing'}; "
        f"the first time {found['first']:.2f} s, after {found['imports']:.2f} s of imports\n"
    )
    sys.stdout.flush()


def main() -> int:
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--against", type=Path, help="another checkout of hapteq")
    options.add_argument("--measure", type=int, help=argparse.SUPPRESS)
    asked = options.parse_args()
    if asked.measure:
        sys.stdout.write(json.dumps(measured(asked.measure)) + "\n")
        return 0
    good = True
    for axes in (1, 3):
        what = f"{axes} {'axis' if axes == 1 else 'axes'}, {SAMPLES} samples"
        ours = by_checkout(HERE, axes)
        report(f"{what}, ours (aim on one axis {AIM_S:g} s)", ours)
        if asked.against is not None:
            theirs = by_checkout(asked.against.resolve(), axes)
            report(f"{what}, {asked.against}", theirs)
            ratio = ours["later"] / theirs["later"]
            sys.stdout.write(f"ours / theirs: {ratio:.2f} (at most {MOST:g} wanted)\n")
            good &= ratio <= MOST
        good &= "coulomb_friction" in ours["named"]
    return int(not good)


if __name__ == "__main__":
    sys.exit(main())
