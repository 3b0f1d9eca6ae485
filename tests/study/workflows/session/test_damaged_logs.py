"""Logs of closed sessions, damaged at random: every reader sees it, and none ends in anything but a named error.

`DAMAGE_SEED=7 pytest ...` draws others.
"""

import contextlib
import os
import random
import shutil
from pathlib import Path

import pytest

from study.errors import StudyError
from study.store.disk.file_errors import CannotWriteError
from study.store.disk.json_document import write_json
from study.store.disk.provenance import compute_sha256
from study.store.sessions.archive import SessionFolder
from study.store.sessions.event_log import LOG_NAME, read_log, remove_incomplete_line
from study.store.sessions.log_seal import SEAL_NAME
from study.workflows.files.validate import validate_file
from study.workflows.results.collect_sessions import collect_sessions
from study.workflows.results.fold_session import fold_session
from study.workflows.results.session_results import list_due_results, write_tables
from study.workflows.results.write_results import write_results
from study.workflows.session.end_sitting import write_missing_results
from study.workflows.session.participant_number import read_begun_participant
from study.workflows.views.session_line import make_session_line
from study.workflows.views.view_session import make_session_view
from study.workflows.views.watch_session import follow

FROZEN = Path(__file__).parents[3] / "frozen" / "v0_1" / "study" / "P01_001"
SEED = int(os.environ.get("DAMAGE_SEED", "20261122"))
NOW = "2026-11-22T15:00:00.000+00:00"


@pytest.fixture(scope="module")
def finished(tmp_path_factory, session_logs) -> Path:
    """A finished session of an earlier version, as this version would have written it."""
    session = Path(shutil.copytree(FROZEN, tmp_path_factory.mktemp("finished") / "P01_001"))
    session_logs.forged(session, list)
    write_tables(SessionFolder(session))
    return session


@pytest.fixture
def session(finished, tmp_path) -> Path:
    return Path(shutil.copytree(finished, tmp_path / "P01_001"))


def unseen_by(session: Path) -> list[str]:
    """Readers that take a damaged session for a whole one."""
    unseen = []
    with contextlib.suppress(StudyError):
        fold_session(SessionFolder(session))
        unseen.append("resume")
    with contextlib.suppress(StudyError):
        collect_sessions(session)
        unseen.append("analyze")
    if make_session_view(session).line.standing != "unreadable":
        unseen.append("show")
    if make_session_line(SessionFolder(session)).standing != "unreadable":
        unseen.append("sessions")
    if not validate_file(session).problems:
        unseen.append("validate")
    return unseen


def flips(session: Path, count: int) -> None:
    log, rng = session / "events.jsonl", random.Random(SEED)
    whole = log.read_bytes()
    for _ in range(count):
        place, bit = rng.randrange(len(whole)), rng.randrange(8)
        log.write_bytes(whole[:place] + bytes([whole[place] ^ 1 << bit]) + whole[place + 1 :])
        assert unseen_by(session) == [], f"bit {bit} of byte {place}"
    log.write_bytes(whole)


def test_a_whole_session_is_taken_for_one(session):
    assert len(unseen_by(session)) == 5
    assert "sealed to line" in validate_file(session).kind


def test_every_flipped_bit_is_seen_by_every_reader(session):
    flips(session, 40)


@pytest.mark.slow
def test_every_one_of_many_flipped_bits_is_seen(session):
    flips(session, 600)


def test_every_cut_tail_is_distinguished_from_an_interrupted_session(session):
    log = session / "events.jsonl"
    whole = log.read_bytes()
    lines = whole.splitlines(keepends=True)
    at_line_ends = [sum(map(len, lines[:count])) for count in range(1, len(lines), 6)]
    for length in (*at_line_ends, len(whole) - 1, len(whole) - 30):
        log.write_bytes(whole[:length])
        assert unseen_by(session) == [], length
    log.write_bytes(whole[: at_line_ends[-1]])
    with pytest.raises(StudyError, match="The end of this session's log is missing"):
        fold_session(SessionFolder(session))
    (session / SEAL_NAME).unlink()
    with pytest.raises(StudyError, match="session.json of P01_001 was made from a finished session"):
        fold_session(SessionFolder(session))


def test_an_edited_value_is_named_by_its_line(session):
    log = session / "events.jsonl"
    lines = log.read_bytes().splitlines(keepends=True)
    number = next(n for n, line in enumerate(lines, start=1) if b'"displacement_mm":0.' in line)
    lines[number - 1] = lines[number - 1].replace(b'"displacement_mm":0.', b'"displacement_mm":1.')
    log.write_bytes(b"".join(lines))
    said = f"Line {number} of events.jsonl in P01_001 does not match its checksum."
    assert validate_file(session).problems == (said,)


def test_a_log_that_continues_under_this_version_covers_what_came_before(session, session_logs):
    session_logs.as_older(session)
    older = (session / "events.jsonl").read_bytes()
    chain, line = session_logs.append_checksum(read_log(session / "events.jsonl").chain, NOTE)
    (session / "events.jsonl").write_bytes(older + line)
    assert fold_session(SessionFolder(session)).log_contents.chain.first_checksum_line == chain.lines
    (session / "events.jsonl").write_bytes(older.replace(b'"displacement_mm":0.', b'"displacement_mm":1.', 1) + line)
    with pytest.raises(StudyError, match="or one of the lines before it was changed"):
        fold_session(SessionFolder(session))


NOTE = b'{"utc":"2026-11-22T15:00:00.000+00:00","who":"experimenter","text":"late","adverse":true,"event":"note_taken"}'


@pytest.mark.parametrize("name", [SEAL_NAME, "trials.csv", "thresholds.csv", "session.json"])
def test_what_a_kill_left_out_is_finished_and_said(session, name):
    folder = SessionFolder(session)
    before = (session / name).read_bytes()
    for torn in (None, before[: len(before) // 2]):
        (session / name).unlink()
        if torn is not None and name != SEAL_NAME:
            (session / name).write_bytes(torn)
        assert list_due_results(folder, fold_session(folder)) == (name,)
        (said,) = collect_sessions(session).result_file_notes
        assert name in said
        assert list_due_results(folder, fold_session(folder)) == ()
    if name != "session.json":
        assert (session / name).read_bytes() == before


@pytest.mark.usefixtures("sketched")
def test_a_finished_session_is_finished_by_resume_and_then_said_to_be(session):
    folder = SessionFolder(session)
    (session / SEAL_NAME).unlink()
    written = write_missing_results(folder, fold_session(folder))
    assert "written now, because missing or out of date: seal.json, analysis/report.html" in written.warnings[0]
    with pytest.raises(StudyError, match="This session is finished"):
        write_missing_results(folder, fold_session(folder))


@pytest.mark.slow
def test_a_report_from_before_the_end_is_written_again_by_resume(session):
    folder = SessionFolder(session)
    statistics, sha256 = session / "analysis" / "anova.json", compute_sha256(folder.log)
    statistics.parent.mkdir(exist_ok=True)
    (statistics.parent / "report.html").write_text("of the log as it was in the middle")
    write_json(statistics, "hapteq-anova", 1, {"provenance": {"parents": [{"file": LOG_NAME, "sha256": "0" * 64}]}})
    assert "analysis/report.html" in write_missing_results(folder, fold_session(folder)).warnings[0]
    assert sha256 in statistics.read_text()


def test_figures_that_are_a_link_are_not_written_through(session, tmp_path):
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    (session / "analysis").mkdir(exist_ok=True)
    shutil.rmtree(session / "analysis" / "figures", ignore_errors=True)
    (session / "analysis" / "figures").symlink_to(elsewhere)
    with pytest.raises(CannotWriteError, match="link"):
        write_results(SessionFolder(session))
    assert list(elsewhere.iterdir()) == []


def test_a_changed_table_and_a_changed_summary_are_named(session):
    for name, old, new in (("thresholds.csv", "P01", "P02"), ("session.json", '"answers": 1', '"answers": 2')):
        path = session / name
        text = path.read_text()
        path.write_text(text.replace(old, new, 1))
        assert path.read_text() != text
        assert any(problem.startswith(name) for problem in validate_file(session).problems), name
        path.write_text(text)


def mutated(rng: random.Random, text: bytes) -> bytes:
    lines = text.splitlines(keepends=True)
    place = rng.randrange(len(text))
    first, second = rng.randrange(len(lines)), rng.randrange(len(lines))
    match rng.randrange(8):
        case 0:
            return text[:place] + bytes([rng.randrange(256)]) + text[place + 1 :]
        case 1:
            return text[:place]
        case 2:
            lines[first], lines[second] = lines[second], lines[first]
        case 3:
            del lines[first]
        case 4:
            lines.insert(first, lines[second])
        case 5:
            parts = lines[first].split(b":")
            hostile = (b"1e999", b"9" * 5000, b"-1", b"[" * 3000, b"null", b'""', b"NaN", b'"\\ud800"', b"1e300", b"{}")
            which = rng.randrange(1, len(parts))
            end = parts[which][parts[which].find(b",") :] if b"," in parts[which] else b"}\n"
            lines[first] = b":".join((*parts[:which], rng.choice(hostile) + end, *parts[which + 1 :]))
        case 6:
            return text.decode().encode(rng.choice(("utf-16", "utf-32", "utf-8-sig")))
        case _:
            lines[first] = rng.randbytes(rng.randrange(200)) + b"\n"
    return b"".join(lines)


def read_by_all(session: Path) -> None:
    folder = SessionFolder(session)
    make_session_line(folder)
    make_session_view(session)
    validate_file(session)
    read_begun_participant(folder)
    for read in (lambda: collect_sessions(session), lambda: follow(session).look(NOW), lambda: fold_session(folder)):
        with contextlib.suppress(StudyError):
            read()


def fuzz(session: Path, session_logs, count: int) -> None:
    """With checksums, without, and with checksums computed again."""
    rng, log = random.Random(SEED), session / "events.jsonl"
    chained = log.read_bytes()
    older = b"".join(event + b"\n" for event in session_logs.events_of(log))
    for name in (SEAL_NAME, "session.json"):
        (session / name).unlink()
    for number in range(count):
        log.write_bytes(mutated(rng, chained if number % 4 == 0 else older))
        read_by_all(session)


@pytest.mark.slow
def test_no_reader_fails_on_a_mutated_log(session, session_logs):
    fuzz(session, session_logs, 80)


@pytest.mark.slow
def test_no_reader_fails_on_many_mutated_logs(session, session_logs):
    fuzz(session, session_logs, 3000)


def test_a_bad_time_leaves_one_session_out_of_an_analysis_and_not_all(session, session_logs):
    other = session.parent / "P02_001"
    shutil.copytree(session, other)
    for path in other.glob("seal*.json"):
        path.unlink()
    session_logs.forged(other, lambda events: [e.replace(b"P01", b"P02") for e in events])
    session_logs.as_older(session, lambda text: text.replace(b"T13:4", b"T13;4", 5))
    collected = collect_sessions(session.parent)
    assert [folder.name for folder in collected.sessions] == ["P02_001"]
    assert any(said.startswith("P01_001 cannot be used. Line 1 of events.jsonl") for said in collected.exclusions)
    assert make_session_line(SessionFolder(session)).standing == "unreadable"


def test_a_session_that_ended_before_its_first_trial_is_named_in_an_analysis(session, session_logs):
    other = session.parent / "P02_001"
    shutil.copytree(session, other)
    session_logs.unsealed(other)
    session_logs.forged(other, lambda events: [events[0].replace(b"P01", b"P02")])
    assert collect_sessions(session.parent).exclusions == ("P02_001 has no trial.",)


def test_a_torn_note_after_the_end_is_mended_and_the_seal_still_holds(session):
    log = session / "events.jsonl"
    log.write_bytes(log.read_bytes() + b'{"utc":"2026')
    remove_incomplete_line(log, read_log(log))
    assert len(unseen_by(session)) == 5


@pytest.mark.parametrize("kept", ["recordings", SEAL_NAME, "session.json", "lines"])
def test_a_log_whose_beginning_is_lost_is_never_said_to_hold_nothing(session, session_logs, kept):
    log, events = session / "events.jsonl", session_logs.events_of(session / "events.jsonl")
    for path in session.iterdir():
        if path.name not in (kept, log.name):
            shutil.rmtree(path) if path.is_dir() else path.unlink()
    log.write_bytes(b"\n".join((*events[1:4], b"")) if kept == "lines" else b"")
    with pytest.raises(StudyError, match="The beginning of this session's log is missing") as told:
        fold_session(SessionFolder(session))
    assert told.value.do_now == "Keep the folder as it is, and restore events.jsonl from a copy."
