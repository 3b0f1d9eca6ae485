"""The figures that identification is to reach, on plants whose truth is known, over seeds of the sensor's noise.

One seed of the main case is in `test_identify.py`, with each run of the tests.

Run in a process of its own with one thread: what is counted is processor time of one core.
"""

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).parents[3]

SCRIPT = """
import importlib.util, json, sys, time
import numpy as np
from equalizer.identification.state_space.identify import identify
from equalizer.identification.state_space.settings import IdentificationSettings

def load(name, path):
    spec = importlib.util.spec_from_file_location(name, path)
    module = sys.modules[name] = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module

job = json.loads(sys.argv[1])
plants = load("plants", "tests/plants.py")
measuring = load("measured_lines", "tests/equalizer/identification/measured_lines.py")
plant = plants.omega_like(**job["plant"])
settings = IdentificationSettings(band_hz=tuple(job["band"]), order=job["order"])
for seed in job["seeds"]:
    response = measuring.swept(plants, plant, seed, *job["sweep"])
    start = time.process_time()
    found = identify(response, settings)
    spent = time.process_time() - start
    errors = [measuring.errors_of(found.model, plant, np.linspace(*part, 3001)) for part in job["parts"]]
    print(json.dumps({
        "held_out": measuring.held_out_error(plants, found.model, plant), "rms": [rms for rms, _ in errors],
        "worst_line": [worst for _, worst in errors], "radius": found.model.spectral_radius, "seconds": spent,
    }), flush=True)
"""


def run(band=(5, 35), order=26, sweep=(4.5, 37), parts=((5, 35),), seeds=(1, 2, 3, 4, 5), **plant):
    """Per figure, one row per seed."""
    job = {"band": band, "order": order, "sweep": sweep, "parts": parts, "seeds": seeds, "plant": plant}
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
        environment[name] = "1"
    done = subprocess.run(
        [sys.executable, "-c", SCRIPT, json.dumps(job)], cwd=ROOT, env=environment, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    rows = [json.loads(line) for line in done.stdout.splitlines()]
    figures = {name: np.array([row[name] for row in rows]) for name in rows[0]}
    assert (figures["radius"] < 1).all()
    for name, values in figures.items():
        # Seen with `pytest -s`.
        sys.stdout.write(f"{name}: median {np.median(values, axis=0)}, worst {values.max(axis=0)}\n")
    return figures


@pytest.mark.slow
def test_sweeps_of_the_band_order_26():
    figures = run(seeds=tuple(range(1, 11)))
    assert figures["held_out"].max() <= 0.002
    assert figures["worst_line"].max() <= 0.01


@pytest.mark.slow
def test_sweeps_from_1_to_500_hz_order_26():
    assert run(sweep=(1, 500))["held_out"].max() <= 0.004


@pytest.mark.slow
def test_a_wide_band_order_40():
    figures = run(band=(5, 450), order=40, sweep=(1, 500), parts=((5, 35), (35, 450)))
    assert figures["rms"].max() <= 0.0025


@pytest.mark.slow
@pytest.mark.parametrize("order", [20, 26])
@pytest.mark.parametrize(
    "plant", [{"hand": True}, {"shift": 0.1, "turn_deg": 5.0}, {"shift": 0.2, "turn_deg": 10.0, "bend": 1.0}]
)
def test_in_the_hand_and_at_the_edge(order, plant):
    figures = run(order=order, **plant)
    assert figures["held_out"].max() <= 0.002
    assert figures["worst_line"].max() <= 0.01


@pytest.mark.slow
@pytest.mark.parametrize("order", [20, 26])
def test_the_band_of_the_study(order):
    figures = run(band=(5, 50), order=order, sweep=(4.5, 53), parts=((5, 50),))
    assert figures["held_out"].max() <= 0.002
    assert figures["worst_line"].max() <= 0.01
