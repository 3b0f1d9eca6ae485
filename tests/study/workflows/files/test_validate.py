import re
from pathlib import Path

import h5py
import numpy as np
import pytest

from equalizer.plant.identified_model import IdentifiedModel
from equalizer.signals.recording import Recording
from equalizer.signals.signal import Signal
from protocols.document.loading import load_protocol
from protocols.trial import Trial
from study.errors import StudyError
from study.session.facts.events import SESSION_FORMAT
from study.store.disk.csv_rows import format_csv_table
from study.store.disk.json_document import write_json
from study.store.formats.daily_check_file import DailyCheck, write_daily_check
from study.store.formats.identified_model_file import write_identified_model
from study.store.formats.participant_texts import make_language_template
from study.store.formats.protocol_files import list_shipped_protocols, read_study_protocol
from study.store.formats.recording_file import write_recording
from study.store.formats.thresholds_file import write_thresholds
from study.store.sessions.event_log import LOG_NAME
from study.tui.themes import NEXT_THEME
from study.workflows.files.file_content import FileContent
from study.workflows.files.recognisers import RECOGNISERS
from study.workflows.files.validate import validate_file

SHIPPED = Path(__file__).parents[4] / "protocols"

MODEL = """[model]
name = "lever"
quantity = "angle"
mass = [[5.8e-4]]
damping = [[1e-3]]
stiffness = [[0]]
input = [[1]]
output = [[1]]
[[effect]]
kind = "coulomb_friction"
level = 0.1
"""


def sound(path):
    found = validate_file(path)
    assert (found.path, found.problems) == (path, ())
    return found.kind


def written(path, text):
    path.write_text(text)
    return path


def force(n=500):
    return Signal(np.zeros((n, 1)), 1000.0, "force", "N", ("fx",))


def test_a_recording_is_described(tmp_path):
    write_recording(tmp_path / "a.h5", Recording("bench", force(), force()))
    assert sound(tmp_path / "a.h5") == "recording, 0.5 s at 1000 Hz, 1 command, 1 response"


@pytest.mark.parametrize("number", range(11))
def test_the_shared_cases_are_sound(shared, number):
    recording, model = (shared / "cases" / f"open-{number:02d}.{ending}" for ending in ("h5", "toml"))
    assert sound(recording) == "recording, 105 s at 1000 Hz, 3 commands, 3 responses, 3 positions, 14 segments"
    assert sound(model) == (
        f"mechanical model 'bench open-{number:02d}', 6 coordinates, 3 inputs, 3 outputs (acceleration), no effects"
    )


@pytest.mark.parametrize(("pole", "said"), [(0.9, "stable"), (1.01, "unstable (spectral radius 1.01)")])
def test_an_identified_model_is_described_with_its_stability(tmp_path, pole, said):
    one = np.ones((1, 1))
    model = IdentifiedModel(pole * one, one, one, 0 * one, 1000.0, (5.0, 35.0), "N", "m/s^2", ("fx",), ("ax",))
    write_identified_model(tmp_path / "m.h5", model)
    assert sound(tmp_path / "m.h5") == (
        f"identified model of order 1, 5 to 35 Hz at 1000 Hz, 1 input, 1 output, {said}, quality not stored"
    )


def test_a_mechanical_model_is_described_with_its_effects(tmp_path):
    assert sound(written(tmp_path / "m.toml", MODEL)) == (
        "mechanical model 'lever', 1 coordinate, 1 input, 1 output (angle), coulomb_friction"
    )


@pytest.mark.parametrize("name", list_shipped_protocols())
def test_the_shipped_protocols_are_sound(name):
    assert f"protocol '{name}'" in sound(SHIPPED / f"{name}.toml")


@pytest.mark.parametrize("language", ["de", "es", "mine.toml"])
def test_a_protocol_in_a_language_is_sound_as_its_file_is_read(tmp_path, small_text, language):
    """Its texts are filled in from the table, as where a session begins."""
    written(tmp_path / "mine.toml", make_language_template("de"))
    asked = f'{small_text}\n[text]\nlanguage = "{language}"\n'
    assert sound(written(tmp_path / "study.toml", asked)).startswith("study protocol 'small': ")
    lost = validate_file(written(tmp_path / "lost.toml", asked.replace(language, "nowhere.toml")))
    assert "nowhere.toml" in " ".join(lost.problems)


def test_each_document_that_hapteq_writes_is_known(tmp_path):
    study = Path(__file__).parents[4] / "study"
    stated = {
        name for path in study.rglob("*.py") for name in re.findall(r'"(hapteq-[a-z-]+)"', path.read_text("utf-8"))
    }
    in_hdf5 = {"hapteq-recording", "hapteq-model", "hapteq-calibration"}
    documents = stated - in_hdf5 - {"hapteq-", *NEXT_THEME, SESSION_FORMAT}
    unknown = []
    for name in sorted(documents):
        found = validate_file(written(tmp_path / "a.json", f'{{"format": "{name}", "version": 1}}'))
        unknown += [name for problem in found.problems if "is not known here" in problem]
    assert len(documents) > 12
    assert unknown == []


def test_a_table_of_texts_is_checked_as_a_protocol_that_names_it_would(tmp_path):
    text = make_language_template("de")
    assert sound(written(tmp_path / "fr.toml", text)).startswith("table of texts for participants, ")
    found = validate_file(written(tmp_path / "gap.toml", text.replace("\nyes = ", "\nyess = ")))
    assert found.kind == "table of texts"
    assert [problem.split(" ")[0] for problem in found.problems] == ["yess", "yes"]


def test_a_table_is_known_by_its_header_under_any_name(tmp_path):
    assert sound(written(tmp_path / "a.txt", "time_s,fx,fy,fz\n0,1,2,3\n0.001,1,2,3\n")) == (
        "forces, 0.002 s at 1000 Hz (N)"
    )
    assert sound(written(tmp_path / "b.csv", format_csv_table([], Trial))) == "table of 0 trials"
    write_thresholds(tmp_path / "c.csv", [])
    assert sound(tmp_path / "c.csv") == "table of 0 thresholds"


def test_an_import_map_is_described(tmp_path):
    channel = '[[channel]]\nrole = "{}"\nname = "x"\nvalue = "x"\nunit = "N"\n'
    text = 'title = "t"\ndevice = "rig"\n[[clock]]\nrate_hz = 100\n' + channel.format("command")
    (tmp_path / "m.toml").write_text(text + channel.format("response"))
    assert sound(tmp_path / "m.toml") == "import map for rig: 2 channels, 1 clock"


@pytest.mark.parametrize(
    ("passed", "changes", "outcome"),
    [
        (True, ({"changed": False},), "passed"),
        (False, ({"changed": False}, {"changed": True}), "something changed"),
        (False, ({"changed": False},), "measured too inaccurately to detect a change"),
        (False, (), "it broke off"),
    ],
)
def test_a_daily_check_is_described_by_its_outcome(tmp_path, passed, changes, outcome):
    check = DailyCheck("omega.3", "serial 1", "2026-05-04T09:30:00+00:00", passed, (), changes, "", "", "0" * 64)
    write_daily_check(tmp_path / "c.json", check)
    assert sound(tmp_path / "c.json") == f"daily check of omega.3 at {check.utc}: {outcome}"


def test_a_diagnosis_is_described(tmp_path):
    errors = {"before": 0.1, "retuned": 0.1, "after": 0.1, "noise": None}
    payload = {
        "verdict": "parameters", "mismatch": [], "effects": [], "retuned": {}, "remainder": [],
        "fit": {"fit": errors, "test": errors}, "error": "free simulation", "next_experiment": None,
    }  # fmt: skip
    write_json(tmp_path / "d.json", "hapteq-diagnosis", 1, payload)
    assert sound(tmp_path / "d.json") == "diagnosis, parameters: no effects"


@pytest.mark.parametrize(
    ("name", "text", "kind", "problem"),
    [
        (
            "m.toml",
            MODEL.replace("mass", "maas"),
            "mechanical model",
            "Unknown key 'model.maas' (did you mean 'mass'?)",
        ),
        ("m.toml", "[model", "TOML file", "This is not TOML: "),
        ("m.toml", "[tool]\na = 1\n", "TOML file", "Its keys (tool) are neither those of a mechanical model"),
        ("p.toml", 'name = "p"\nkind = "stady"\n', "protocol", 'kind is "stady". Allowed: "study" or "recording".'),
        ("t.csv", "time_s,ax,ay\n", "table of accelerations or forces", "Line 1 reads 'time_s,ax,ay'; allowed is"),
        ("t.csv", "a,b\n1,2\n", "table", "Its header, 'a,b', is not known; known are recordings"),
        (
            "trials.csv",
            "subject,session,runn\n",
            "table of trials",
            "Column 3 of the header is 'runn'; it must be 'run'",
        ),
        ("th.csv", "subject,frequency_hz\n", "table of thresholds", "Column 3 of the header is missing; it must be"),
        ("d.json", "{", "JSON document", "This is not JSON: "),
        ("d.json", "[]", "JSON document", "It states no format; every hapteq document states its format and version."),
        ("d.json", '{"format": "x"}', "JSON document", "Its format, 'x', is not known here."),
        ("d.json", '{"format": "hapteq-diagnosis"}', "hapteq-diagnosis", "Its version is missing; this program reads"),
        ("d.json", '{"format": "hapteq-diagnosis", "version": 1}', "diagnosis", "verdict: this is missing."),
        ("t.csv", "time_s\rax\n", "table", "Its header, '', is not known"),
        ("t.csv", "time_s,ax,ay,az\n0\r,1,2,3\n", "table of accelerations or forces", "This is not CSV: new-line"),
        ("trials.csv", "subject,session,run\n1\r,2,3\n", "table of trials", "This is not CSV: new-line"),
        ("notes.md", "# Notes\n", "unknown file", "The kind of this file is not known; known are recordings"),
        ("empty.csv", "\n", "empty file", "It holds nothing; known are"),
        ("a.h5", "garbage", "HDF5 file", "It does not begin as HDF5 files do."),
    ],
)
def test_what_is_wrong_is_reported_in_words(tmp_path, name, text, kind, problem):
    found = validate_file(written(tmp_path / name, text))
    assert found.kind == kind
    assert any(said.startswith(problem) for said in found.problems), found.problems
    assert all(said.endswith(".") for said in found.problems)


def test_a_torn_recording_is_reported(tmp_path):
    write_recording(tmp_path / "a.h5", Recording("bench", force(), force()))
    (tmp_path / "a.h5").write_bytes((tmp_path / "a.h5").read_bytes()[:900])
    (problem,) = validate_file(tmp_path / "a.h5").problems
    assert problem.startswith("It is not HDF5 that can be read, or it is cut off")


def test_hdf5_of_others_is_reported(tmp_path):
    with h5py.File(tmp_path / "a.h5", "w") as file:
        assert validate_file(tmp_path / "a.h5").problems[0].startswith("It ")
        file.attrs["format"] = "nwb"
    assert validate_file(tmp_path / "a.h5").problems == (
        "It calls itself 'nwb'; known formats are hapteq-recording, hapteq-model and hapteq-calibration.",
    )


def test_what_is_not_there_or_no_file_is_reported(tmp_path):
    assert validate_file(tmp_path / "none").problems == (f"There is no file {tmp_path / 'none'}.",)
    assert validate_file(tmp_path).problems == ("This folder is not a session: it holds no events.jsonl.",)


def test_a_name_that_no_file_can_have_is_reported():
    assert "File name too long" in validate_file(Path("a" * 1000)).problems[0]


@pytest.mark.parametrize("seed", range(20))
def test_garbage_never_raises(tmp_path, seed):
    rng = np.random.default_rng(seed)
    for ending in ("h5", "toml", "csv", "json", "txt"):
        path = tmp_path / f"a.{ending}"
        path.write_bytes(rng.bytes(300) if seed % 2 else bytes(rng.integers(32, 127, 300).tolist()))
        assert validate_file(path).problems


def test_a_new_format_joins_by_one_function(tmp_path):
    def recognise_notes(content: FileContent) -> str | None:
        return "notes" if (content.text or "").startswith("# Notes") else None

    path = written(tmp_path / "notes.md", "# Notes\n")
    assert validate_file(path, (*RECOGNISERS, recognise_notes)).kind == "notes"


def test_a_log_is_not_checked_under_another_name_by_the_log_of_its_folder(tmp_path):
    copy = written(tmp_path / "copy.jsonl", f'{{"format": "{SESSION_FORMAT}"}}\n')
    found = validate_file(copy)
    assert found.problems == (f"a log is only checked under its name {LOG_NAME} in the folder of its session.",)


UNFIT_FOR_NEW_SESSIONS = {
    "detection": ("longest_trial_s = 1.5\n", "[detection]\nfrequencies_hz = [25.0]\n", "detection.interval_s is 1.5 s"),
    "demo": ("longest_trial_s = 2.0\n", "[demo]\nlevel_n = 1.0\n", "demo.seconds is 2 s"),
    "probes": ("longest_trial_s = 1.35\n", "[probes]\nlevels_n = [0.2]\n", "a probe (probes.levels_n) is 1.35 s"),
    "fade-in": ("longest_trial_s = 0.1\n", "", "stimulus.fade_in_s is 0.1 s"),
    "short fade": ("", "", "stimulus.fade_out_s is 0.0005 s, no more than half a tick"),
}


@pytest.mark.parametrize("case", UNFIT_FOR_NEW_SESSIONS)
def test_a_protocol_that_no_session_can_finish_is_a_problem_of_its_file_and_not_of_old_logs(tmp_path, small_text, case):
    safety, table, said = UNFIT_FOR_NEW_SESSIONS[case]
    text = small_text.replace("[safety]\n", f"[safety]\n{safety}").replace("keep_s = 0.2", "keep_s = 1.0") + table
    text = text.replace("fade_out_s = 0.05", "fade_out_s = 0.0005") if case == "short fade" else text
    file = written(tmp_path / "study.toml", text)
    assert said in " ".join(validate_file(file).problems)
    with pytest.raises(StudyError, match="is not a usable protocol"):
        read_study_protocol(str(file))
    assert load_protocol(text, "the log").kind == "study"


def test_a_recording_protocol_whose_fade_is_no_tick_is_a_problem_of_its_file(tmp_path):
    text = (SHIPPED / "sweep.toml").read_text("utf-8").replace("fade_s = 0.1 ", "fade_s = 0.0001 ")
    assert "fade_s is 0.0001 s, no more than half a tick" in " ".join(
        validate_file(written(tmp_path / "sweep.toml", text)).problems
    )
