"""The same scripted session in three languages: other words on the screen, the same log and the same thresholds."""

import json
from dataclasses import replace

import pytest

from protocols.definition.participant_text import Question
from protocols.document.dumping import dump_protocol
from protocols.document.loading import load_protocol
from study.devices.clock import VirtualClock
from study.session.views.form_views import FormKind, FormReply
from study.store.formats.participant_texts import load_in_language
from study.store.formats.protocol_files import read_study_protocol
from study.store.sessions.event_log import LOG_NAME
from study.workflows.results.collect_sessions import collect_sessions
from study.workflows.results.export_study import export_study
from study.workflows.session.conduct_session import Participant, conduct_new
from study.workflows.session.end_sitting import end_sitting
from study.workflows.session.open_session import SessionPlan
from study.workflows.session.withdraw_participant import plan_withdrawal, withdraw
from tests.study.workflows.session.sitting.person import Person

BEFORE = (
    Question("age", "How old are you?", number=(18.0, 99.0), unit="years"),
    Question("handedness", "Which hand do you write with?", ("right", "left", "either")),
    Question("tired", "How tired are you?", scale=(1, 7), ends=("not at all", "very")),
    Question("remarks", "How did you tell the two directions apart?"),
    Question("skipped", "How old are you?", number=(0.0, 9.0)),
)
SAID = {"age": "34,5", "remarks": "Brmm, by its rhythm", "skipped": ""}
CHOSEN = {"tired": 5, "hearing": 4, "hand_hidden": 1, "handedness": 1, "grip_changed": 2}
"""Index of the choice; of other choices the first, but no where yes would end the sitting."""


class Scripted(Person):
    """Chooses by place, as a hand on the number keys does, in any language."""

    def fill_in(self, form):
        self.calls.append(form.kind)
        last = form.kind is FormKind.EXCLUSION
        return FormReply({field.key: self._answer(field, last) for field in form.fields})

    def _answer(self, field, last):
        if field.choices:
            return field.choices[-1 if last else CHOSEN.get(field.key, 0)]
        return SAID.get(field.key, "")


@pytest.fixture(scope="module")
def sat(tmp_path_factory, small_protocol):
    """Sessions of the same protocol in each language: their ends, displays and data folders."""
    asked = Question("grip_changed", "Did your grip change during the study?", ("no", "a little", "a lot"))
    shipped = read_study_protocol("direction_threshold").protocol.consent
    english = replace(
        small_protocol,
        before=BEFORE,
        debrief=(asked, Question("strategy", "How did you tell the two directions apart?")),
        consent=replace(
            small_protocol.consent,
            version="1",
            statements=shipped.statements,
            exclusions=shipped.exclusions,
        ),
        setup=replace(small_protocol.setup, ask=True),
    )
    found = {}
    for code in ("en", "de", "es"):
        text = dump_protocol(english).replace('language = "en"', f'language = "{code}"')
        protocol, resolved = load_in_language(text, "mine.toml", None)
        clock = VirtualClock()
        person = Scripted(clock)
        data = tmp_path_factory.mktemp(code) / "data"
        plan = SessionPlan(protocol, resolved, False, "P01", None, 11, data)
        end = conduct_new(plan, "simulated", Participant(display=person, hand=person, clock=clock))
        found[code] = end, person, data
    return found


def facts(end):
    """The log without what may differ: the clock, the protocol's own text, and checksums of these."""
    lines = [json.loads(line) for line in (end.folder.path / LOG_NAME).read_text("utf-8").splitlines()]
    for line in lines:
        for key in ("protocol_text", "protocol_hash", "utc", "chain", "sha256", "findings"):
            line.pop(key, None)
    return lines


@pytest.mark.slow
def test_the_log_is_the_same_in_every_language(sat):
    english = facts(sat["en"][0])
    assert len(english) > 30
    for code in ("de", "es"):
        differing = {
            (mine["event"], key)
            for mine, theirs in zip(facts(sat[code][0]), english, strict=True)
            for key in mine.keys() | theirs.keys()
            if mine.get(key) != theirs.get(key)
        }
        assert differing == set()


def test_answers_are_kept_in_codes(sat):
    kept = {line["form"]: line["answers"] for line in facts(sat["es"][0]) if line["event"] == "form_filled"}
    assert kept["questionnaire"] == {"age": "34.5", "handedness": "left", "tired": "6", "remarks": SAID["remarks"]}
    assert kept["setup"] == {"hearing": "nothing", "hand_hidden": "no", "arm_supported": "yes", "grip": "pen grip",
                             "hand": "right"}  # fmt: skip
    assert kept["debrief"] == {"grip_changed": "a lot"}
    assert set(kept["consent"].values()) == {"yes"}


def test_what_is_shown_is_not_the_same(sat):
    protocols = [load_protocol(facts_text(sat[code][0]), "a log") for code in ("en", "de", "es")]
    assert len({protocol.consent.statements for protocol in protocols}) == 3
    assert len({protocol.debrief[0].choices for protocol in protocols}) == 3
    assert sat["de"][1].calls == sat["en"][1].calls


def facts_text(end):
    return json.loads((end.folder.path / LOG_NAME).read_text("utf-8").splitlines()[0])["protocol_text"]


@pytest.mark.slow
def test_thresholds_are_the_same_in_every_language(sat):
    tables = {code: end_sitting(end, "2024-05-01T09:00:00+00:00").thresholds for code, (end, _, _) in sat.items()}
    assert tables["en"]
    assert tables["de"] == tables["en"] == tables["es"]


def exported(sat, tmp_path, form, free_text=False):
    data = sat["de"][2]
    out = tmp_path / f"{form}-{free_text}"
    export_study(collect_sessions(data), data, out, form, free_text)
    return out


@pytest.mark.parametrize("form", ["csv", "psych-ds", "bids", "mat"])
def test_free_text_is_exported_only_when_it_is_asked_for(sat, tmp_path, form):
    def holds(out):
        return any(b"Brmm" in path.read_bytes() for path in out.rglob("*") if path.is_file())

    if form == "mat":
        from scipy.io import loadmat

        plain, whole = (loadmat(exported(sat, tmp_path, form, free) / "trials.mat") for free in (False, True))
        assert "before_remarks" not in plain["answers"].dtype.names
        assert "Brmm" in str(whole["answers"]["before_remarks"][0, 0])
        assert plain["answers"]["before_age"][0, 0][0, 0][0] == "34.5"
        return
    assert not holds(exported(sat, tmp_path, form))
    assert holds(exported(sat, tmp_path, form, free_text=True))


def test_answers_are_a_table_with_a_dictionary(sat, tmp_path):
    out = exported(sat, tmp_path, "csv")
    header, row = (out / "answers.csv").read_text("utf-8").splitlines()
    assert header == "subject,session,before_age,before_handedness,before_tired,before_skipped,debrief_grip_changed"
    assert row == f"P01,{sat['de'][0].folder.name},34.5,left,6,,a lot"
    dictionary = (out / "dictionary.csv").read_text("utf-8")
    assert "before_age,Wie alt sind Sie?,years" in dictionary
    assert "right: rechts; left: links; either: mit beiden" in dictionary
    assert "1: gar nicht; 7: sehr" in dictionary


def test_psych_ds_describes_every_answer_and_is_read_back(sat, tmp_path):
    out = exported(sat, tmp_path, "psych-ds")
    described = {
        each["name"] for each in json.loads((out / "dataset_description.json").read_text())["variableMeasured"]
    }
    header = (out / "data" / "description-answers_data.csv").read_text("utf-8").splitlines()[0].split(",")
    assert set(header) <= described
    from study.workflows.results.export_study import collect_exported

    assert collect_exported(out).trials == collect_sessions(sat["de"][2]).trials


def test_bids_has_them_as_phenotype_and_what_it_knows_of_participants(sat, tmp_path):
    out = exported(sat, tmp_path, "bids")
    assert (out / "participants.tsv").read_text("utf-8").splitlines() == [
        "participant_id\tcode\tage\thandedness",
        "sub-P01\tP01\t34.5\tleft",
    ]
    header, row = (line.split("\t") for line in (out / "phenotype" / "before.tsv").read_text("utf-8").splitlines())
    assert header == ["participant_id", "session_id", "age", "handedness", "tired", "skipped"]
    assert row[0] == "sub-P01"
    assert row[2:] == ["34.5", "left", "6", "n/a"]
    described = json.loads((out / "phenotype" / "before.json").read_text("utf-8"))
    assert described["age"]["Units"] == "years"
    assert described["handedness"]["Levels"]["left"] == "links"


def test_erasing_a_participant_takes_every_answer_and_names_the_exports(sat, tmp_path):
    end, _, data = sat["es"]
    out = data / "exported"
    export_study(collect_sessions(data), data, out, "csv", free_text=True)
    plan = plan_withdrawal(end.folder)
    told = " ".join((*plan.doubtful, (data / "written_elsewhere.txt").read_text("utf-8")))
    assert str(out) in told
    withdraw(data, plan, "2024-05-01T09:00:00+00:00")
    left = [path for path in data.rglob("*") if path.is_file() and not path.is_relative_to(out)]
    assert left
    for path in left:
        assert not any(word in path.read_bytes() for word in (b"Brmm", b"34.5", b"a lot")), path
