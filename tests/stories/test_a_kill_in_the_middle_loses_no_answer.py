"""Real SIGKILLs at random moments."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.real_time

SCRIPT = Path(__file__).with_name("killed_sessions.py")


def run(folder: Path, sessions: int, seed: int, text: str, *how: str) -> list[dict]:
    protocol = folder / "small.toml"
    protocol.write_text(text)
    done = subprocess.run(
        [sys.executable, str(SCRIPT), str(folder / "data"), str(sessions), str(seed), str(protocol), *how],
        capture_output=True,
        text=True,
        check=False,
        env={**os.environ, "PYTHONPATH": str(SCRIPT.parents[2])},
    )
    assert done.returncode == 0, done.stderr[-3000:]
    return [json.loads(line) for line in (folder / "results.jsonl").read_text().splitlines()]


def check(results: list[dict], sessions: int) -> None:
    assert len(results) == sessions
    # 1: nothing was left to do, the last kill came too late.
    assert [r["codes"] for r in results if r["codes"] not in ([0, 1], [1])] == []
    for fact in ("finished", "prefixes_hold", "answers_hold", "decisions_equal", "results_whole", "results_equal"):
        assert [r["session"] for r in results if not r[fact]] == [], fact


def test_a_few_killed_sessions_finish_with_the_same_results(tmp_path, brief_text):
    results = run(tmp_path, 2, 5, brief_text, "sketched")
    check(results, 2)
    assert sum(r["kills"] for r in results) >= 3


@pytest.mark.slow
@pytest.mark.timeout(6000)
def test_three_hundred_kills_end_with_the_same_results(tmp_path, small_text):
    results = run(tmp_path, 110, seed=2026, text=small_text)
    check(results, 110)
    assert sum(r["kills"] for r in results) >= 300
    sys.stderr.write(f"{sum(r['kills'] for r in results)} kills, {sum(r['torn'] for r in results)} torn lines\n")


@pytest.mark.slow
@pytest.mark.timeout(3000)
def test_killed_programs_of_their_own_end_with_the_same_results(tmp_path, small_text):
    check(run(tmp_path, 10, 7, small_text, "processes"), 10)
