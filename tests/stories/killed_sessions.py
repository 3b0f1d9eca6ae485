"""Run sessions, kill each with SIGKILL at random moments, resume it, and check what is on the disk.

A script of its own: `python killed_sessions.py FOLDER SESSIONS SEED PROTOCOL [processes|sketched]`. Every sitting
goes through the command line, `hapteq study` and `hapteq resume`, results included. It forks its children from a warm
process without threads, so that a hundred sessions take minutes rather than hours; with `processes` each is a new
program, and with `sketched` each figure of a report is a line. Prints one JSON line per session.
"""

import json
import os
import random
import signal
import sys
import time
from pathlib import Path

from study.cli.main import main as hapteq
from study.store.sessions.archive import SessionFolder, list_session_folders
from study.store.sessions.event_log import read_log
from study.workflows.files.validate import validate_file
from study.workflows.results.fold_session import fold_session
from tests.sketches import list_replacements

KILLS = 3
RESULTS = Path(sys.argv[1]).with_name("results.jsonl")
PROCESSES = sys.argv[5:] == ["processes"]
if sys.argv[5:] == ["sketched"]:
    for replacement in list(list_replacements()):
        setattr(*replacement)


def words(data: Path, subject: str, protocol: str, seed: int) -> list[str]:
    """Begin the subject's session, or go on with it."""
    folder = begun(data, subject)
    if folder is not None:
        return ["resume", folder.name, "--data", str(data), "--json"]
    return ["study", "--protocol", protocol, "--observer", "scripted", "--subject", subject, "--seed", str(seed),
            "--data", str(data), "--json"]  # fmt: skip


def started(asked: list[str]) -> int:
    """The id of a new process that does what was asked, silently."""
    child = os.fork()
    if child:
        return child
    silence = os.open(os.devnull, os.O_WRONLY)
    os.dup2(silence, 1)
    os.dup2(silence, 2)
    if PROCESSES:
        os.execv(sys.executable, [sys.executable, "-m", "study", *asked])
    os._exit(hapteq(asked))


def exit_code(asked: list[str]) -> int:
    return os.waitstatus_to_exitcode(os.waitpid(started(asked), 0)[1])


def begun(data: Path, subject: str) -> SessionFolder | None:
    """The subject's session, once its log has a whole first line; before that there is nothing to lose."""
    folders = [f for f in list_session_folders(data) if f.subject == subject and f.log.exists()]
    return next((f for f in folders if b"\n" in f.log.read_bytes()), None)


def killed_after(seconds: float, asked: list[str]) -> bool:
    """Whether it was still going on when the signal came."""
    child = started(asked)
    time.sleep(seconds)
    os.kill(child, signal.SIGKILL)
    return os.WIFSIGNALED(os.waitpid(child, 0)[1])


def decisions(folder: SessionFolder) -> list[list[object]]:
    state = fold_session(folder).state
    return [[t.run, t.trial, t.frequency_hz, t.level_n, t.correct] for t in state.trials if t.is_valid]


def thresholds(folder: SessionFolder) -> list[str]:
    return [line.split(",")[:9] for line in (folder.path / "thresholds.csv").read_text().splitlines()]


def answered(folder: SessionFolder) -> list[tuple[int, int, int, int]]:
    return [(e.run, e.trial, e.attempt, e.answer) for e in read_log(folder.log).events if e.event == "answer_given"]


def try_one(data: Path, number: int, protocol: str, seed: int, typical_s: float, expected: SessionFolder) -> dict:
    rng, subject = random.Random(f"{seed} {number}"), f"K{number:03d}"
    kills = torn = late = 0
    prefixes_hold = answers_hold = True
    for _ in range(KILLS):
        before = begun(data, subject)
        whole = b"" if before is None else before.log.read_bytes()
        said = [] if before is None else answered(before)
        kills += killed_after(rng.uniform(0.0, typical_s), words(data, subject, protocol, seed))
        folder = begun(data, subject)
        if folder is None:
            continue
        after = folder.log.read_bytes()
        prefixes_hold &= after.startswith(whole[: whole.rfind(b"\n") + 1])
        answers_hold &= answered(folder)[: len(said)] == said
        torn += not after.endswith(b"\n")
        late += fold_session(folder).state.closed
    codes = [exit_code(words(data, subject, protocol, seed))]
    folder = begun(data, subject)
    if codes == [0]:
        codes.append(exit_code(words(data, subject, protocol, seed)))  # whole now: it says that it is finished
    return {
        "session": number,
        "kills": kills,
        "torn": torn,
        "killed_when_closed": late,
        "codes": codes,
        "finished": codes[-1] == 1 and fold_session(folder).state.closed,
        "prefixes_hold": prefixes_hold,
        "answers_hold": answers_hold,
        "decisions_equal": decisions(folder) == decisions(expected),
        "results_whole": validate_file(folder.path).problems == () and (folder.path / "analysis/report.html").is_file(),
        "results_equal": [row[2:] for row in thresholds(folder)] == [row[2:] for row in thresholds(expected)],
    }


def main() -> None:
    data, sessions, seed, protocol = Path(sys.argv[1]), int(sys.argv[2]), int(sys.argv[3]), sys.argv[4]
    hapteq(words(data, "WARM0", protocol, seed))  # compiles, so that the children need not
    begin_s = time.monotonic()
    assert exit_code(words(data, "WHOLE0", protocol, seed)) == 0
    typical_s = time.monotonic() - begin_s
    expected = begun(data, "WHOLE0")
    for number in range(sessions):
        line = json.dumps(try_one(data, number, protocol, seed, typical_s, expected))
        sys.stderr.write(f"{line}\n")
        RESULTS.write_text((RESULTS.read_text() if RESULTS.exists() else "") + line + "\n")


if __name__ == "__main__":
    main()
