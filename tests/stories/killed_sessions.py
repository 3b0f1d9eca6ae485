"""Run sessions, kill each with SIGKILL at random moments, resume it, and check what is on the disk.

A script of its own: `python killed_sessions.py FOLDER SESSIONS SEED PROTOCOL`. It forks its children from a warm
process without threads, so that a hundred sessions take minutes rather than hours. Prints one JSON line per session.
"""

import json
import os
import random
import signal
import sys
import time
from pathlib import Path

from protocols.loading import load_protocol
from study.devices.clock import VirtualClock
from study.store.archive import SessionFolder, session_folders
from study.store.event_log import read_log
from study.workflows.conduct_session import conduct_new, conduct_resumed
from study.workflows.fold_session import fold_session
from study.workflows.open_session import SessionPlan
from study.workflows.simulated_participant import simulated_participant

KILLS = 3


def plan(data: Path, subject: str, text: str, seed: int) -> SessionPlan:
    protocol = load_protocol(text, "killed sessions")
    return SessionPlan(protocol, text, False, subject, "scripted", seed, data)


def sit(data: Path, subject: str, text: str, seed: int) -> None:
    """Begin the subject's session, or go on with it."""
    participant = simulated_participant("scripted", seed, VirtualClock())
    folder = begun(data, subject)
    if folder is None:
        conduct_new(plan(data, subject, text, seed), "simulated", participant)
    else:
        conduct_resumed(folder, "simulated", participant)


def begun(data: Path, subject: str) -> SessionFolder | None:
    """The subject's session, once its log has a whole first line; before that there is nothing to lose."""
    folders = [f for f in session_folders(data) if f.subject == subject and f.log.exists()]
    return next((f for f in folders if b"\n" in f.log.read_bytes()), None)


def killed_after(seconds: float, data: Path, subject: str, text: str, seed: int) -> bool:
    """Whether the sitting was still going on when the signal came."""
    child = os.fork()
    if child == 0:
        sit(data, subject, text, seed)
        os._exit(0)
    time.sleep(seconds)
    os.kill(child, signal.SIGKILL)
    _, status = os.waitpid(child, 0)
    return os.WIFSIGNALED(status)


def decisions(folder: SessionFolder) -> list[list[object]]:
    state = fold_session(folder).state
    return [[t.run, t.trial, t.frequency_hz, t.level_n, t.correct] for t in state.trials if t.counts]


def answered(folder: SessionFolder) -> list[tuple[int, int, int, int]]:
    return [(e.run, e.trial, e.attempt, e.answer) for e in read_log(folder.log).events if e.event == "answer_given"]


def try_one(data: Path, number: int, text: str, seed: int, typical_s: float, expected: list[list[object]]) -> dict:
    rng, subject = random.Random(f"{seed} {number}"), f"K{number:03d}"
    kills = torn = 0
    prefixes_hold = answers_hold = True
    for _ in range(KILLS):
        kills += killed_after(rng.uniform(0.0, 0.7 * typical_s), data, subject, text, seed)
        folder = begun(data, subject)
        if folder is None or fold_session(folder).state.closed:
            continue
        before, said = folder.log.read_bytes(), answered(folder)
        whole = before[: before.rfind(b"\n") + 1]
        torn += whole != before
        child = os.fork()
        if child == 0:
            # A resumed sitting that is killed in its turn, at once or a little later.
            sit(data, subject, text, seed)
            os._exit(0)
        time.sleep(rng.uniform(0.0, 0.2 * typical_s))
        os.kill(child, signal.SIGKILL)
        os.waitpid(child, 0)
        prefixes_hold &= folder.log.read_bytes().startswith(whole)
        answers_hold &= answered(folder)[: len(said)] == said
    folder = begun(data, subject)
    if folder is None or not fold_session(folder).state.closed:
        sit(data, subject, text, seed)
    folder = begun(data, subject)
    return {
        "session": number,
        "kills": kills,
        "torn": torn,
        "finished": fold_session(folder).state.closed,
        "prefixes_hold": prefixes_hold,
        "answers_hold": answers_hold,
        "decisions_equal": decisions(folder) == expected,
    }


def main() -> None:
    data, sessions, seed = Path(sys.argv[1]), int(sys.argv[2]), int(sys.argv[3])
    text = Path(sys.argv[4]).read_text()
    sit(data, "WARM0", text, seed)  # compiles, so that the children need not
    started = time.monotonic()
    sit(data, "WHOLE0", text, seed)
    typical_s = time.monotonic() - started
    expected = decisions(begun(data, "WHOLE0"))
    for number in range(sessions):
        sys.stdout.write(json.dumps(try_one(data, number, text, seed, typical_s, expected)) + "\n")
        sys.stdout.flush()


if __name__ == "__main__":
    main()
