"""People who do not give their consent, or may not take part: outcomes of their own, and no place in the order."""

import json
import random
from collections.abc import Callable
from dataclasses import replace

import pytest

from protocols.definition.preparation import ConsentSettings
from protocols.document.dumping import dump_protocol
from protocols.procedure.schedule import make_williams_rows
from study.devices.clock import VirtualClock
from study.errors import StudyError
from study.participants.observer_catalogue import find_observer
from study.session.facts.events import FormFilled, PlaceTaken, SessionClosed, SessionInterrupted, SessionOpened
from study.session.views.archive_views import INELIGIBILITY_REASONS
from study.session.views.form_views import FormKind, FormReply
from study.session.views.participant_views import Unanswered
from study.session.watching.followed_session import apply_followed_event, begin_watching
from study.session.watching.make_watch_view import LiveInfo, make_watch_view
from study.store.sessions.event_log import read_log
from study.store.sessions.log_seal import find_seals
from study.tui.session_status import describe_session
from study.workflows.files.validate import validate_file
from study.workflows.results.collect_sessions import collect_sessions
from study.workflows.session.conduct_session import Participant, conduct_new, conduct_resumed
from study.workflows.session.end_sitting import end_sitting
from study.workflows.session.open_session import SessionPlan
from study.workflows.session.plan_sitting import find_unfinished_sessions
from study.workflows.session.simulated_display import SimulatedDisplay
from study.workflows.views.view_home import list_session_lines
from study.workflows.views.view_session import make_session_view

UTC = "2026-11-22T12:00:00+00:00"
LEAVE = Unanswered("the participant left", ends_sitting=True)
OUTCOMES = [(FormKind.CONSENT, "refused"), (FormKind.EXCLUSION, "excluded")]


class Visitor(SimulatedDisplay):
    """Fills in forms from a script and leaves at the first trial.

    "pass"; "slip": a wrong answer, mended when asked; "twice": a wrong answer, called a slip, and given again; "firm".
    """

    meanwhile: Callable[[], None] = staticmethod(lambda: None)
    """Called before the first form."""

    def __init__(self, script: dict[FormKind, str], clock: VirtualClock) -> None:
        super().__init__(find_observer("ideal", 1), 1, clock)
        self.script, self.forms, self.goodbyes = script, [], []

    def fill_in(self, form):
        if not self.forms:
            self.meanwhile()
        self.forms.append(form)
        way, asked = self.script.get(form.kind, "pass"), sum(seen.kind is form.kind for seen in self.forms)
        if "right" in [field.key for field in form.fields]:
            return FormReply({"right": "yes" if way == "firm" else "no"})
        well = "no" if form.kind is FormKind.EXCLUSION else "yes"
        if form.kind not in (FormKind.CONSENT, FormKind.EXCLUSION):
            return super().fill_in(form)
        answers = {field.key: well for field in form.fields}
        if way in ("firm", "twice") or (way == "slip" and asked == 1):
            answers[form.fields[-1].key] = "yes" if well == "no" else "no"
        return FormReply(answers)

    def ask(self, question, sign_of_life):
        return LEAVE

    def goodbye(self, notice):
        self.goodbyes.append(notice)


@pytest.fixture
def asking(small_protocol):
    consent = ConsentSettings("1", "", ("I agree.", "I may stop."), ("Do you have a wound?", "An implant?"))
    return replace(small_protocol, consent=consent)


@pytest.fixture
def visit(asking, tmp_path):
    """A sitting of one person; returns its end and its display."""

    def sit(subject: str = "P01", protocol=asking, meanwhile=None, **script: str):
        clock = VirtualClock()
        visitor = Visitor({FormKind(kind): way for kind, way in script.items()}, clock)
        visitor.meanwhile = meanwhile or visitor.meanwhile
        plan = SessionPlan(protocol, dump_protocol(protocol), False, subject, None, 11, tmp_path / "data")
        return conduct_new(plan, "simulated", Participant(visitor, visitor, clock)), visitor

    return sit


def of(end, kind):
    return [event for event in read_log(end.folder.log).events if isinstance(event, kind)]


@pytest.mark.parametrize(("form", "outcome"), OUTCOMES)
def test_a_firm_answer_is_asked_once_more_and_is_final(visit, tmp_path, form, outcome):
    end, visitor = visit(**{form.value: "firm"})
    check = visitor.forms[-1]
    assert (check.kind, check.title) == (form, "Please check your answer")
    assert "Is that right?" in check.fields[0].label
    assert [event.outcome for event in of(end, SessionClosed)] == [outcome]
    assert of(end, SessionInterrupted) == of(end, PlaceTaken) == []
    (filled,) = [event for event in of(end, FormFilled) if event.form == form.value]
    assert (filled.passed, filled.answers) == (False, {})
    assert visitor.goodbyes[0].outcome == outcome


@pytest.mark.parametrize("form", [FormKind.CONSENT, FormKind.EXCLUSION])
def test_the_check_quotes_what_was_answered_and_nothing_else(visit, form):
    _, visitor = visit(**{form.value: "firm"})
    asked, check = visitor.forms[-2:]
    assert f"“{asked.fields[-1].label}”" in check.introduction
    assert asked.fields[0].label not in check.introduction


@pytest.mark.parametrize("form", [FormKind.CONSENT, FormKind.EXCLUSION])
def test_a_slip_of_the_finger_is_no_refusal_and_is_kept_nowhere(visit, form):
    end, visitor = visit(**{form.value: "slip"})
    assert sum(seen.kind is form for seen in visitor.forms) == 3
    assert all(event.passed for event in of(end, FormFilled))
    assert len(of(end, PlaceTaken)) == 1
    assert visitor.goodbyes[0].outcome == ""


@pytest.mark.parametrize(("form", "outcome"), OUTCOMES)
def test_a_refusal_is_asked_again_once_and_then_holds(visit, form, outcome):
    end, visitor = visit(**{form.value: "twice"})
    assert sum(seen.kind is form for seen in visitor.forms) == 3
    assert end.state.sitting.ineligibility == outcome


@pytest.mark.parametrize(("form", "outcome"), OUTCOMES)
def test_every_list_and_page_tells_the_outcome_and_nothing_suggests_to_resume(visit, tmp_path, form, outcome):
    end, _ = visit(**{form.value: "firm"})
    data, folder = tmp_path / "data", end.folder
    with pytest.raises(StudyError, match="does not take part") as ended:
        end_sitting(end, UTC)
    with pytest.raises(StudyError, match="does not take part") as resumed:
        clock = VirtualClock()
        visitor = Visitor({}, clock)
        conduct_resumed(folder, "simulated", Participant(visitor, visitor, clock))
    assert visitor.forms == []
    summary = json.loads((folder.path / "session.json").read_text())
    assert (summary["outcome"], summary["closed"], summary["participant_number"]) == (outcome, True, None)
    (line,) = list_session_lines(data)
    assert line.standing == outcome
    view = make_session_view(folder.path)
    validation = validate_file(folder.path)
    assert validation.problems == ()
    assert outcome in validation.kind
    assert find_unfinished_sessions(data, "P01", "small") == ()
    texts = (str(ended.value), str(resumed.value), describe_session(line), *view.events, str(view.facts))
    assert not any("resume" in text.casefold() or "unfinished" in text for text in texts)
    assert any(INELIGIBILITY_REASONS[outcome] in text for text in texts)
    assert "without a place" in str(view.facts)


@pytest.mark.parametrize(("form", "outcome"), OUTCOMES)
def test_a_watcher_sees_the_outcome_without_an_alarm(visit, form, outcome):
    end, _ = visit(**{form.value: "firm"})
    opened, *rest = read_log(end.folder.log).events
    watched = begin_watching(opened, end.state.protocol)
    for event in rest:
        watched = apply_followed_event(watched, event)
    view = make_watch_view(watched, LiveInfo(has_writer=False), UTC)
    assert (view.standing, view.alarms) == (outcome, ())
    assert INELIGIBILITY_REASONS[outcome] in view.reason


@pytest.mark.slow
def test_an_analysis_leaves_them_out_by_name(visit, tmp_path, sitter):
    visit("P01", consent="firm")
    visit("P02", exclusion="firm")
    with pytest.raises(StudyError, match="P01_001 does not take part: consent was not given"):
        collect_sessions(tmp_path / "data")
    sitter.whole("ideal1")
    assert [note for note in collect_sessions(tmp_path / "data").exclusions if "P0" in note] == [
        "P01_001 does not take part: consent was not given.",
        "P02_001 does not take part: a question of the exclusion list was answered with yes.",
    ]


def test_nothing_but_the_outcome_is_in_the_folder(visit):
    end, _ = visit(consent="firm")
    kinds = [type(event) for event in read_log(end.folder.log).events]
    assert kinds == [SessionOpened, FormFilled, SessionClosed]
    assert list(end.folder.recordings.iterdir()) == []


def test_a_program_that_died_before_the_last_line_is_finished_by_resume(visit):
    end, _ = visit(consent="firm")
    for seal in find_seals(end.folder.path).values():  # written after the last line
        seal.unlink(missing_ok=True)
    lines = end.folder.log.read_bytes().splitlines(keepends=True)
    end.folder.log.write_bytes(b"".join(lines[:-1]))
    clock = VirtualClock()
    visitor = Visitor({}, clock)
    with pytest.raises(StudyError, match="does not take part"):
        conduct_resumed(end.folder, "simulated", Participant(visitor, visitor, clock))
    assert [event.outcome for event in of(end, SessionClosed)] == ["refused"]
    assert json.loads((end.folder.path / "session.json").read_text())["outcome"] == "refused"


def test_a_person_who_comes_again_begins_a_new_session_and_takes_a_place_then(visit):
    visit("P01", exclusion="firm")
    assert visit("P02")[0].state.opened.participant_number == 0
    again, _ = visit("P01")
    assert (again.folder.name, again.state.opened.participant_number) == ("P01_002", 1)
    assert visit("P02")[0].state.opened.participant_number == 0


def test_a_session_of_the_first_rules_keeps_the_number_of_its_opening_line(visit, monkeypatch):
    monkeypatch.setattr("study.workflows.session.open_session.LATEST_RULES", 1)
    old, _ = visit("P01", consent="firm")
    monkeypatch.undo()
    assert of(old, PlaceTaken) == of(old, SessionClosed) == []
    assert visit("P02")[0].state.opened.participant_number == 1


def check_the_rows(visit, asking, seed: int, passes: int):
    """Visitors in random order, refusing at random, until every row is due so many times."""
    order = replace(asking.schedule, order="williams", labels="swapped_for_half")
    frequencies = replace(asking.stimulus, frequencies_hz=(15.0, 25.0))
    protocol = replace(asking, schedule=order, stimulus=frequencies)
    luck, taken, visitors = random.Random(seed), [], 0
    rows = len(make_williams_rows(2))
    while len(taken) < passes * rows:
        visitors += 1
        way = luck.choice([{"consent": "firm"}, {"exclusion": "firm"}, {}, {"consent": "slip"}, {"exclusion": "twice"}])
        end, _ = visit(f"P{visitors:02d}", protocol, **way)
        if not end.state.sitting.ineligibility:
            taken.append(end.state.opened.participant_number)
        elif luck.random() < 0.5:  # comes again another day, and takes part
            taken.append(visit(f"P{visitors:02d}", protocol)[0].state.opened.participant_number)
    assert taken == list(range(len(taken)))
    per_row = [sum(number % rows == row for number in taken) for row in range(rows)]
    assert per_row == [passes] * rows, f"seed {seed}"


@pytest.mark.parametrize("seed", [3, 14])
def test_every_row_of_the_williams_square_is_filled_equally_with_any_refusals(visit, asking, seed):
    check_the_rows(visit, asking, seed, passes=3)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(20))
def test_every_row_is_filled_equally_over_many_studies(visit, asking, seed):
    check_the_rows(visit, asking, seed, passes=20)


def test_sessions_that_are_open_at_the_same_time_take_their_places_one_after_the_other(visit):
    """P02 sits down, refuses and goes while P01 reads the forms; P03 is faster than P01."""
    faster = []

    def meanwhile():
        visit("P02", consent="firm")
        faster.append(visit("P03")[0].state.opened.participant_number)

    end, _ = visit("P01", meanwhile=meanwhile)
    assert (faster, end.state.opened.participant_number) == ([0], 1)
