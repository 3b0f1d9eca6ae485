"""A session's facts as markers: all of them, in order, with their own times, and nothing about the person."""

import contextlib
import json
import re
import sys
import threading
import time
from types import SimpleNamespace

import pytest

from study.cli.main import main
from study.errors import StudyError
from study.regular_file import open_regular
from study.workflows.views import stream_session as module
from study.workflows.views.lsl_outlets import MarkerOutlet, make_source_id
from study.workflows.views.stream_session import MAX_EVENT_AGE_S, SideTasks, measure_offset_s, stream_session

OFFSET_S = 1000.25


class Clock:
    """The session's; it goes on when the follower sleeps, and a writer writes then."""

    def __init__(self, log, lines: list[bytes]) -> None:
        self.now, self.log, self.lines = 50.0, log, lines
        self.waited = 0

    def now_s(self) -> float:
        return self.now

    def sleep(self, seconds: float) -> None:
        self.now += seconds
        self.waited = 0 if self.lines else self.waited + 1
        assert self.waited < 100, "it waits for a session that is over"
        if self.lines:
            with self.log.open("ab") as file:
                file.write(self.lines.pop(0))


class Kept:
    def __init__(self, clock: Clock) -> None:
        self.clock, self.pushed = clock, []

    def clock_s(self) -> float:
        return self.clock.now + OFFSET_S

    def push(self, marker: str, at_s: float) -> None:
        self.pushed.append((json.loads(marker), at_s))


def line(event: str, **more: object) -> bytes:
    return json.dumps({"utc": "2026-01-01T00:00:00+00:00", "event": event, **more, "chain": "0"}).encode() + b"\n"


PRESENTED = {"run": 0, "trial": 3, "attempt": 0, "frequency_hz": 35.0, "level_n": 1.2, "direction": 2}


def streamed(tmp_path, lines: list[bytes], before: bytes = b"") -> tuple[list, int]:
    log = tmp_path / "events.jsonl"
    log.write_bytes(before)
    clock = Clock(log, lines)
    outlet = Kept(clock)
    said: list[str] = []
    sent = stream_session(log, outlet, said.append, clock.now_s, clock.sleep)
    assert said == [json.dumps(each, separators=(",", ":")) for each, _ in outlet.pushed if each["event"] != "clock"]
    return outlet.pushed, sent


def test_each_fact_becomes_a_marker_with_the_time_at_which_it_became_a_fact(tmp_path):
    lines = [line("trial_presented", **PRESENTED, monotonic_s=49.9), line("session_closed", monotonic_s=50.01)]
    pushed, sent = streamed(tmp_path, lines)
    assert sent == 2
    (clock, _), (presented, at_s), (closed, _) = pushed
    assert clock == {"event": "clock", "lsl_minus_monotonic_s": pytest.approx(OFFSET_S)}
    assert presented == {"event": "trial_presented", **PRESENTED}
    assert at_s == pytest.approx(49.9 + OFFSET_S)
    assert closed["event"] == "session_closed"


def test_what_was_there_before_is_not_sent_and_a_torn_line_waits_for_its_end(tmp_path):
    whole = line("answer_given", answer=1, monotonic_s=50.0)
    lines = [whole[:20], whole[20:], line("session_closed", monotonic_s=50.0)]
    pushed, sent = streamed(tmp_path, lines, before=line("session_opened", subject="P01"))
    assert sent == 2
    assert [marker["event"] for marker, _ in pushed] == ["clock", "answer_given", "session_closed"]


def test_nothing_about_the_person_is_reported(tmp_path):
    private = {"subject": "P01", "text": "feels dizzy", "answers": ["left-handed"], "protocol_text": "secret"}
    lines = [line("note_taken", **private, monotonic_s=50.0), line("session_closed", **private, monotonic_s=50.0)]
    pushed, _ = streamed(tmp_path, lines)
    said = json.dumps(pushed)
    assert not any(word in said for word in ("P01", "dizzy", "left-handed", "secret"))


@pytest.mark.parametrize("monotonic_s", [None, 50.0 - MAX_EVENT_AGE_S - 1, 60.0, 0.3])
def test_a_fact_of_another_clock_is_stamped_when_it_is_sent_and_reports_it(tmp_path, monotonic_s):
    pushed, _ = streamed(tmp_path, [line("trial_presented", monotonic_s=monotonic_s), line("session_closed")])
    marker, at_s = pushed[1]
    assert marker["stamped"] == "when it was sent"
    assert 50.0 <= at_s - OFFSET_S < 50.1


def test_the_offset_is_measured_again_and_again(tmp_path):
    lines = [b""] * round(2.5 * module.OFFSET_INTERVAL_S / module.POLL_INTERVAL_S)
    pushed, _ = streamed(tmp_path, [*lines, line("session_closed", monotonic_s=50.0)])
    assert [marker["event"] for marker, _ in pushed].count("clock") == 3


def test_the_offset_is_noted_at_first_and_when_it_has_changed(tmp_path):
    noted: list[float] = []
    log = tmp_path / "events.jsonl"
    log.write_bytes(b"")
    lines = [b""] * round(3.5 * module.OFFSET_INTERVAL_S / module.POLL_INTERVAL_S)
    clock = Clock(log, [*lines, line("session_closed", monotonic_s=50.0)])
    outlet = Kept(clock)
    drift = 0.6 * module.REPORTED_CHANGE_S / module.OFFSET_INTERVAL_S
    outlet.clock_s = lambda: clock.now + OFFSET_S + drift * (clock.now - 50.0)
    stream_session(log, outlet, print, clock.now_s, clock.sleep, SideTasks(noted.append, lambda offset_s: 0))
    assert len(noted) == 2 and noted[1] - noted[0] == pytest.approx(2 * 0.6 * module.REPORTED_CHANGE_S, rel=0.1)


def test_lost_ticks_are_a_marker(tmp_path):
    lost = [0, 7, 0]
    log = tmp_path / "events.jsonl"
    log.write_bytes(b"")
    clock = Clock(log, [b"", b"", line("session_closed", monotonic_s=50.0)])
    outlet = Kept(clock)
    beside = SideTasks(lambda offset_s: None, lambda offset_s: lost.pop(0) if lost else 0)
    stream_session(log, outlet, lambda marker: None, clock.now_s, clock.sleep, beside)
    assert {"event": "signals_lost", "ticks": 7} in [marker for marker, _ in outlet.pushed]


def test_an_interrupted_reading_of_the_clocks_does_not_count():
    times = iter([0.0, 0.5, 1.0, 1.001, *(2.0 + 0.2 * k for k in range(100))])

    class Theirs:
        def clock_s(self) -> float:
            return 100.0

    assert measure_offset_s(Theirs(), lambda: next(times)) == pytest.approx(100.0 - 1.0005)


@pytest.mark.parametrize("after", [b"", line("note_taken", text="he said session_closed")])
def test_of_a_session_that_is_over_nothing_is_sent_and_it_ends(tmp_path, after):
    before = line("answer_given", answer=1) + line("session_closed", outcome="completed") + after
    assert streamed(tmp_path, [], before) == ([], 0)


def test_a_note_that_names_the_end_is_not_the_end(tmp_path):
    before = line("note_taken", text="was this session_closed?")
    assert streamed(tmp_path, [line("session_closed", monotonic_s=50.0)], before)[1] == 1


def test_each_look_reads_only_new_bytes(tmp_path, monkeypatch):
    """At 50 looks a second: room for the largest log that there may be is not taken each time."""
    asked: list[int] = []

    def noted(path):
        with open_regular(path) as file:
            yield SimpleNamespace(
                fileno=file.fileno, seek=file.seek, read=lambda size: asked.append(size) or file.read(size)
            )

    monkeypatch.setattr(module, "open_regular", contextlib.contextmanager(noted))
    before, last = line("answer_given", answer=1), line("session_closed", monotonic_s=50.0)
    streamed(tmp_path, [b"", last], before)
    assert asked == [len(before), 0, 0, len(last)]


def test_a_log_that_became_shorter_is_reported(tmp_path):
    log = tmp_path / "events.jsonl"
    log.write_bytes(line("answer_given", answer=1))
    clock = Clock(log, [b""])
    clock.sleep = lambda seconds: log.write_bytes(b"")
    with pytest.raises(StudyError, match="became shorter"):
        stream_session(log, Kept(clock), print, clock.now_s, clock.sleep)


BROKEN = [b"not json\n", b"3\n", b'["session_closed"]\n', b"null\n", b"[" * 100_000 + b"\n", b"\xff\xfe\n", None]


@pytest.mark.parametrize("broken", BROKEN, ids=["text", "number", "list", "null", "deep", "bytes", "no file"])
def test_a_log_that_cannot_be_followed_is_reported(tmp_path, broken):
    if broken is None:
        clock = Clock(tmp_path / "gone.jsonl", [])
        with pytest.raises(StudyError, match="cannot be followed"):
            stream_session(clock.log, Kept(clock), print, clock.now_s, clock.sleep)
    else:
        with pytest.raises(StudyError, match="cannot be followed"):
            streamed(tmp_path, [broken])


def test_without_the_library_it_is_said_what_to_install(monkeypatch, tmp_path, small_text, capsys):
    monkeypatch.setitem(sys.modules, "pylsl", None)
    with pytest.raises(StudyError, match=r"pip install '\.\[lsl\]'"):
        MarkerOutlet(tmp_path / "events.jsonl")


def test_the_source_is_a_digest_of_this_session_alone(tmp_path, monkeypatch):
    made: list[tuple] = []
    fake = SimpleNamespace(
        IRREGULAR_RATE=0.0,
        local_clock=time.monotonic,
        StreamInfo=lambda *of: made.append(of),
        StreamOutlet=lambda of: of,
    )
    monkeypatch.setitem(sys.modules, "pylsl", fake)
    for name, seed in (("P01_001", 1), ("P02_001", 2), ("moved", 1)):
        log = tmp_path / name / "events.jsonl"
        log.parent.mkdir()
        log.write_bytes(line("session_opened", subject="P01", seed=seed))
        MarkerOutlet(log)
        with log.open("ab") as file:
            file.write(line("answer_given", answer=1))
        MarkerOutlet(log)
    first, again, other, _, moved, _ = (of[-1] for of in made)
    assert first == again == moved != other
    assert all(re.fullmatch(r"hapteq [0-9a-f]{16}", of[-1]) for of in made)
    with pytest.raises(StudyError, match="cannot be followed"):
        MarkerOutlet(tmp_path / "gone.jsonl")


@pytest.mark.real_time
def test_markers_arrive_at_another_end_with_their_times(tmp_path):
    """A real outlet and a real inlet, over the loopback."""
    try:
        import pylsl
    except (ImportError, RuntimeError) as problem:  # its wheel for some systems is without the library
        pytest.skip(f"no loopback of markers was tested: {problem}")
    log = tmp_path / "events.jsonl"
    log.write_bytes(line("session_opened", loopback=time.time_ns()))
    outlet = MarkerOutlet(log)
    following = threading.Thread(target=stream_session, args=(log, outlet, lambda marker: None))
    following.start()
    try:
        found = pylsl.resolve_byprop("source_id", make_source_id(log), timeout=20)
        inlet = pylsl.StreamInlet(found[0])
        inlet.open_stream(timeout=20)
        written = []
        for trial in range(20):
            written.append(time.monotonic())
            with log.open("ab") as file:
                file.write(line("trial_presented", trial=trial, monotonic_s=written[-1]))
        got = []
        while len(got) < 20:
            sample, at_s = inlet.pull_sample(timeout=20)
            assert sample is not None, f"{len(got)} of 20 markers came"
            marker = json.loads(sample[0])
            if marker["event"] != "clock":
                got.append((marker["trial"], at_s))
    finally:
        with log.open("ab") as file:
            file.write(line("session_closed", monotonic_s=time.monotonic()))
        following.join(20)
    assert [trial for trial, _ in got] == list(range(20))
    offset_s = pylsl.local_clock() - time.monotonic()
    assert all(abs(at_s - offset_s - at) < 0.1 for (_, at_s), at in zip(got, written, strict=True))


def test_the_command_streams_a_session_that_exists_only(tmp_path, capsys):
    assert main(["stream", "P01_001", "--data", str(tmp_path)]) == 2
    assert "There is no such session" in capsys.readouterr().err
