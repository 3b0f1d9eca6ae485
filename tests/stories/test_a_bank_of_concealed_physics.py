"""The slow proof of the diagnosis: a bank of concealed-physics cases, drawn from typed seeds, two at a time.

`make prove-diagnosis` (CASES=60). Each case's line is kept in pytest's cache, by the code that found it: interrupted,
it goes on; changed, it begins anew.
"""

import hashlib
import json
import os
import subprocess
import sys
import time
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
CASES = int(os.environ.get("CASES", "60"))
PROCESSES = 2
AT_LEAST = {
    "named right": 0.80,
    "in the returned set": 0.85,
    "right where one name is returned": 0.85,
    "place": 0.88,
    "axis": 0.90,
    "nothing missing, no name": 0.90,
    "outside the catalogue, not explained": 0.80,
    "without the true effect, not explained": 0.75,
    "pairs, both": 0.40,
    "pairs, at least one": 0.80,
}
"""Of so few cases; what was measured of many stands in the documentation."""
AT_MOST = {
    "mean size of the set": 1.6,
    "main parameter's error, median": 0.03,
    "held-out error after / noise, median": 1.15,
}


@pytest.mark.slow
@pytest.mark.timeout(0)
def test_a_bank_of_concealed_physics_is_named(module_at, pytestconfig, capsys):
    bank = module_at(Path(__file__).with_name("diagnosis_bank.py"))
    kept = Path(pytestconfig.cache.mkdir("diagnosis-bank"))
    files = [kept / f"{digest_of_code()}-{process}.jsonl" for process in range(PROCESSES)]
    with capsys.disabled():
        lines = finished(bank, files)
        shares, medians = bank.shares(lines), bank.medians(lines)
        written("")
        for name, share in shares.items():
            written(f"{name:42s} {share.text}")
        for name, value in medians.items():
            written(f"{name:42s} {value:.3g}")
    short = [name for name, bar in AT_LEAST.items() if shares[name].value < bar]
    long = [name for name, bar in AT_MOST.items() if medians[name] > bar]
    assert not short and not long


def finished(bank, files):
    """All lines, in order; printed as they come."""
    have = read(files)
    left = [number for number in range(CASES) if number not in have]
    written(f"\n{CASES} cases, {len(left)} of them still to be diagnosed\n{bank.HEAD}")
    for number in sorted(have):
        written(bank.row(have[number]))
    program = str(Path(__file__).with_name("diagnosis_bank.py"))
    workers = [
        subprocess.Popen(
            [sys.executable, program, str(file), *map(str, left[process::PROCESSES])],
            cwd=ROOT,
            env={**os.environ, "PYTHONPATH": str(ROOT), "OPENBLAS_NUM_THREADS": "1"},
        )
        for process, file in enumerate(files)
    ]
    try:
        watched(bank, files, workers, have)
    finally:
        for worker in workers:
            worker.terminate()
            worker.wait()
    assert all(worker.returncode == 0 for worker in workers), "a worker broke down; what it said is above"
    return [have[number] for number in sorted(have)]


def watched(bank, files, workers, have):
    """Until all workers have ended; adds to `have`."""
    running = True
    while running:
        running = any(worker.poll() is None for worker in workers)
        for number, line in read(files).items():
            if number not in have:
                have[number] = line
                written(f"{bank.row(line)}   {len(have)} of {CASES}")
        time.sleep(1.0 if running else 0.0)


def read(files):
    """Lines by number; one that was cut off is made again."""
    have = {}
    for file in files:
        for text in file.read_text(encoding="utf-8").splitlines() if file.exists() else ():
            try:
                line = json.loads(text)
            except ValueError:
                continue
            if line["number"] < CASES:
                have[line["number"]] = line
    return have


def digest_of_code():
    """Of all that a line hangs on."""
    digest = hashlib.sha256()
    folders = ("analysis/diagnosis", "equalizer", "study/challenge", "tests/stories/diagnosis_bank.py")
    for folder in folders:
        for file in sorted((ROOT / folder).rglob("*.py")) or [ROOT / folder]:
            digest.update(file.read_bytes())
    return digest.hexdigest()[:12]


def written(text):
    sys.stdout.write(text + "\n")
    sys.stdout.flush()


def test_draws_do_not_hang_on_how_many_there_are(module_at):
    bank = module_at(Path(__file__).with_name("diagnosis_bank.py"))
    drawn = [bank.draw(number) for number in range(60)]
    assert drawn == [bank.draw(number) for number in range(60)]
    singles = [one.effects[0] for one in drawn if one.kind in ("single", "without")]
    assert len(set(singles)) == len(singles)
    assert all(len(one.strength) == len(one.effects) for one in drawn)


def test_shares_are_of_what_is_detectable(module_at):
    bank = module_at(Path(__file__).with_name("diagnosis_bank.py"))
    line = {
        "number": 0, "kind": "single", "effects": ["force_gain"], "named": ["force_gain"],
        "set": [["force_gain", "added_mass"]], "verdict": "explained", "place_right": [True], "axis_right": [True],
        "main_error": [0.01], "detectable": True, "errors": [3.0, 2.0, 1.1, 1.0], "seconds": 4.0, "probability": [0.9],
    }  # fmt: skip
    missed = line | {"named": [], "set": [], "verdict": "unexplained", "main_error": [None]}
    shares = bank.shares([line, missed, missed | {"detectable": False}])
    assert (shares["named right"].hits, shares["named right"].of) == (1, 2)
    assert shares["right where one name is returned"].of == 0
    assert bank.medians([line, missed])["mean size of the set"] == 2.0
    assert "force_gain|added_mass" in bank.row(line) and "1.0 %" in bank.row(line)
