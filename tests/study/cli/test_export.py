"""Exported trials: as other tools read them, and read back with the same results."""

import csv
import json
import re
import shutil
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path

import pytest
from scipy.io import loadmat

from protocols.definition.participant_text import Question
from protocols.trial import Trial
from study.cli.main import main
from study.store.disk.csv_rows import list_columns
from study.store.disk.file_errors import UnusableFileError
from study.store.formats.answer_table import AnswerColumn, AnswerTable
from study.store.formats.trial_columns import TRIAL_COLUMNS
from study.store.formats.trials_file import read_trials
from study.store.formats.trials_mat import write_trials_mat
from study.workflows.results.collect_sessions import collect_sessions
from study.workflows.results.export_study import collect_exported, export_study
from tests.slow_instances import slow

FLOAT = re.compile(r"\d+\.\d+")
PSYCH_DS_FILE = re.compile(r"[a-z]+-[A-Za-z0-9]+(_[a-z]+-[A-Za-z0-9]+)*_data\.csv")


@pytest.fixture(scope="module")
def data(tmp_path_factory, small_text, sketching) -> Path:
    """Two sessions of the small protocol."""
    folder = tmp_path_factory.mktemp("export")
    (folder / "small.toml").write_text(small_text)
    with sketching():
        for number in (1, 2):
            asked = ["study", "--protocol", str(folder / "small.toml"), "--observer", "ideal", "--seed", str(number)]
            assert main([*asked, "--subject", f"P0{number}", "--data", str(folder / "data")]) == 0
    return folder / "data"


@pytest.fixture(scope="module")
def export_as(data, tmp_path_factory) -> Callable[[str], Path]:
    """Folder of the exported data; made once for each form."""

    @cache
    def export(form: str) -> Path:
        out = tmp_path_factory.mktemp("exported") / form
        assert main(["export", str(data), "--out", str(out), "--format", form]) == 0
        return out

    return export


@pytest.fixture
def exported(export_as, tmp_path) -> Callable[[str], Path]:
    """A copy of it, to be changed."""
    return lambda form: Path(shutil.copytree(export_as(form), tmp_path / "ds"))


def logged(data: Path) -> list[Trial]:
    return [trial for path in sorted(data.glob("*/trials.csv")) for trial in read_trials(path)]


def test_every_column_is_described():
    assert set(TRIAL_COLUMNS) == set(list_columns(Trial))


@pytest.mark.slow
def test_a_psych_ds_dataset_names_all_its_columns(data, tmp_path):
    assert main(["export", str(data), "--out", str(tmp_path / "ds")]) == 0
    description = json.loads((tmp_path / "ds" / "dataset_description.json").read_text("utf-8"))
    assert (description["@context"], description["@type"]) == ("https://schema.org/", "Dataset")
    files = sorted((tmp_path / "ds" / "data").iterdir())
    assert len(files) == 2 and all(PSYCH_DS_FILE.fullmatch(path.name) for path in files)
    named = {each["name"] for each in description["variableMeasured"]}
    for path in files:
        with path.open(newline="") as table:
            assert set(next(csv.reader(table))) == named
    assert description["hapteq"]["seeds"] == {"P01_001": 1, "P02_001": 2}


@pytest.mark.usefixtures("sketched")
@pytest.mark.parametrize("form", [pytest.param("psych-ds", marks=pytest.mark.slow), "csv"])
def test_what_was_exported_is_analysed_with_the_same_results(data, tmp_path, capsys, form):
    assert main(["export", str(data), "--out", str(tmp_path / "ds"), "--format", form]) == 0
    said = []
    for source, out in ((data, tmp_path / "a"), (tmp_path / "ds", tmp_path / "b")):
        capsys.readouterr()
        assert main(["analyze", str(source), "--out", str(out)]) == 0
        said.append(capsys.readouterr().out)
    assert said[0] == said[1]
    first, second = (json.loads((tmp_path / name / "anova.json").read_text("utf-8")) for name in "ab")
    for document in (first, second):
        del document["provenance"]
    assert first == second
    assert (tmp_path / "a" / "thresholds.csv").read_bytes() == (tmp_path / "b" / "thresholds.csv").read_bytes()


@pytest.mark.usefixtures("sketched")
@pytest.mark.parametrize("form", [*slow("psych-ds"), "csv"])
def test_what_was_left_out_before_an_export_is_counted_after_it_without_a_name(data, tmp_path, capsys, form):
    mine = tmp_path / "data"
    shutil.copytree(data, mine)
    assert main(["study", "--protocol", str(data.parent / "small.toml"), "--observer", "ideal", "--seed", "3",
                 "--subject", "P77", "--data", str(mine)]) == 0  # fmt: skip
    assert main(["withdraw", "P77_001", "--data", str(mine), "--yes"]) == 0
    assert main(["export", str(mine), "--out", str(tmp_path / "ds"), "--format", form]) == 0
    assert not any("P77" in path.read_text("utf-8") for path in (tmp_path / "ds").rglob("*.*") if path.is_file())
    capsys.readouterr()
    for source, out in ((mine, tmp_path / "a"), (tmp_path / "ds", tmp_path / "b")):
        assert main(["analyze", str(source), "--out", str(out)]) == 0
    assert "Note: Before the export, 1 of 1 was left out." in capsys.readouterr().err
    first, second = (json.loads((tmp_path / name / "anova.json").read_text("utf-8")) for name in "ab")
    assert first["declared_result"]["left_out_count"] == 1
    assert first["declared_result"] == second["declared_result"]


@pytest.mark.parametrize("count", ['"many"', "-1", "1e9", "10001"])
def test_a_count_that_is_none_is_not_believed(exported, tmp_path, count):
    facts = exported("csv") / "facts.json"
    written = facts.read_text("utf-8")
    changed = written.replace('"left_out_count": 0', f'"left_out_count": {count}')
    assert changed != written
    facts.write_text(changed, "utf-8")
    assert collect_exported(tmp_path / "ds").exclusions == ()


@pytest.mark.parametrize("form", ["psych-ds", "csv"])
def test_a_declaration_that_was_changed_after_the_export_is_refused(exported, tmp_path, capsys, form):
    """The facts beside it say whether it was locked before the data."""
    (protocol,) = exported(form).rglob("protocol.toml")
    text = protocol.read_text("utf-8")
    protocol.write_text(f"# A comment changes nothing.\n{text}", "utf-8")
    assert collect_exported(tmp_path / "ds").lock_statement
    declared = re.sub(r"\[analysis\]\n(.+\n)*", "", text)
    protocol.write_text(declared + '\n[analysis]\nprimary = "hierarchical"\n', "utf-8")
    capsys.readouterr()
    assert main(["analyze", str(tmp_path / "ds"), "--out", str(tmp_path / "out")]) == 1
    assert "It was changed since the export: its hash is not that of" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("key", "value"),
    [("seeds", []), ("seeds", None), ("seeds", {"P01_001": "one"}), ("seeds", {"P01_001": None}),
     ("devices", None), ("devices", 5), ("devices", "omega"), ("observers", [None])],
)  # fmt: skip
def test_facts_of_another_kind_are_refused_in_words(exported, tmp_path, key, value):
    facts = exported("csv") / "facts.json"
    facts.write_text(json.dumps({**json.loads(facts.read_text("utf-8")), key: value}), "utf-8")
    with pytest.raises(UnusableFileError, match=rf"Its {key} are no "):
        collect_exported(tmp_path / "ds")


def test_an_export_states_its_format_and_one_of_a_newer_version_is_refused(data, tmp_path):
    """As docs/formats.md says of every JSON document; earlier exports state none, and are read."""
    export_study(collect_sessions(data), data, tmp_path / "ds", "csv")
    path = tmp_path / "ds" / "facts.json"
    facts = json.loads(path.read_text("utf-8"))
    assert (facts.pop("format"), facts.pop("version")) == ("hapteq-export", 1)
    path.write_text(json.dumps({**facts, "version": 2}), "utf-8")
    with pytest.raises(UnusableFileError, match="Its version is 2; this program reads version 1"):
        collect_exported(tmp_path / "ds")
    path.write_text(json.dumps(facts), "utf-8")
    assert collect_exported(tmp_path / "ds").trials


def test_every_fact_of_an_export_is_described(data, tmp_path):
    export_study(collect_sessions(data), data, tmp_path / "ds", "csv")
    facts = json.loads((tmp_path / "ds" / "facts.json").read_text("utf-8"))
    page = (Path(__file__).parents[3] / "docs" / "statistics.md").read_text("utf-8")
    table = page.partition("| fact | what it holds |")[2].partition("\n\n")[0]
    named = [row.split("|")[1] for row in table.splitlines() if row.startswith("| `")]
    described = {name for cell in named for name in re.findall(r"`(\w+)`", cell)}
    assert described == facts.keys() - {"study"}


def test_the_quality_of_models_comes_back_from_an_export(data, tmp_path):
    collected = replace(collect_sessions(data), model_qualities=(("P01_001 and P02_001", "It predicts 90 %."),))
    export_study(collected, data, tmp_path / "ds", "psych-ds")
    assert collect_exported(tmp_path / "ds").model_qualities == collected.model_qualities


def test_one_table_has_every_trial_and_a_dictionary_of_its_columns(data, tmp_path):
    assert main(["export", str(data), "--out", str(tmp_path / "csv"), "--format", "csv"]) == 0
    assert read_trials(tmp_path / "csv" / "trials.csv") == tuple(logged(data))
    with (tmp_path / "csv" / "dictionary.csv").open(newline="", encoding="utf-8") as table:
        described = {row["column"]: row for row in csv.DictReader(table)}
    assert list(described) == list(list_columns(Trial))
    assert described["level_n"]["unit"] == "N"
    assert {name: row["description"] for name, row in described.items()} == {
        name: words for name, (words, _) in TRIAL_COLUMNS.items()
    }
    assert json.loads((tmp_path / "csv" / "facts.json").read_text("utf-8"))["seeds"] == {"P01_001": 1, "P02_001": 2}


@pytest.mark.parametrize(
    ("name", "text"), [("facts.json", "[]"), ("facts.json", "{"), ("trials.csv", "a,b\n1,2\n"), ("protocol.toml", "x")]
)
def test_a_damaged_table_is_refused_by_name(exported, tmp_path, capsys, name, text):
    folder = exported("csv")
    (folder / name).write_text(text)
    capsys.readouterr()
    assert main(["analyze", str(folder), "--out", str(tmp_path / "out")]) == 1
    assert name in capsys.readouterr().err


def test_a_matlab_file_holds_every_trial(data, tmp_path):
    assert main(["export", str(data), "--out", str(tmp_path / "mat"), "--format", "mat"]) == 0
    found = loadmat(tmp_path / "mat" / "trials.mat", simplify_cells=True)
    trials = logged(data)
    assert found["trials"]["level_n"].tolist() == [trial.level_n for trial in trials]
    assert list(found["trials"]["session"]) == [trial.session for trial in trials]
    assert set(found["trials"]) == set(list_columns(Trial))
    assert found["units"]["level_n"] == "N"


def test_answers_to_questions_of_long_keys_stay_apart(tmp_path):
    keys = ("hours_of_sleep_in_the_night_before", "hours_of_sleep_in_a_usual_night_of_theirs")
    questions = tuple(AnswerColumn("before", Question(key[:40], "How long?", number=(0.0, 24.0))) for key in keys)
    write_trials_mat(tmp_path, "s", (), "", {}, AnswerTable(questions, (("P01", "P01_001", ("5", "8")),)))
    found = loadmat(tmp_path / "trials.mat", simplify_cells=True)["answers"]
    assert [found[f"before_{key[:40]}"] for key in keys] == ["5", "8"]


def test_bids_has_a_table_per_session_and_says_what_is_missing(data, tmp_path):
    assert main(["export", str(data), "--out", str(tmp_path / "bids"), "--format", "bids"]) == 0
    tables = sorted((tmp_path / "bids").glob("sub-*/ses-*/beh/*_beh.tsv"))
    assert [path.name.split("_")[0] for path in tables] == ["sub-P01", "sub-P02"]
    made = json.loads((tmp_path / "bids" / "dataset_description.json").read_text("utf-8"))
    assert made["GeneratedBy"][0]["Version"]
    rows = [line.split("\t") for path in tables for line in path.read_text("utf-8").splitlines()[1:]]
    assert len(rows) == len(logged(data)) and all("" not in row for row in rows)
    (sidecar,) = (tmp_path / "bids").glob("task-*_beh.json")
    described = json.loads(sidecar.read_text("utf-8"))
    assert set(tables[0].read_text("utf-8").splitlines()[0].split("\t")) <= set(described)


@pytest.mark.parametrize("form", ["psych-ds", "bids", "mat"])
def test_a_folder_that_holds_something_is_left_alone(data, tmp_path, form, capsys):
    (tmp_path / "kept.txt").write_text("mine")
    assert main(["export", str(data), "--out", str(tmp_path), "--format", form]) != 0
    assert "holds files already" in capsys.readouterr().err
    assert [path.name for path in tmp_path.iterdir()] == ["kept.txt"]


@pytest.mark.parametrize("spoil", ["{", '{"name": 1}', "[]"])
def test_a_damaged_description_is_named(exported, tmp_path, spoil, capsys):
    (exported("psych-ds") / "dataset_description.json").write_text(spoil)
    assert main(["analyze", str(tmp_path / "ds")]) != 0
    assert "dataset_description.json" in capsys.readouterr().err


def test_a_table_with_a_wrong_row_is_named(data, tmp_path, capsys):
    assert main(["export", str(data), "--out", str(tmp_path / "ds")]) == 0
    path = next((tmp_path / "ds" / "data").iterdir())
    header, first, *rest = path.read_text("utf-8").splitlines()
    fields = first.split(",")
    fields[header.split(",").index("level_n")] = "-1.0"
    path.write_text("\n".join([header, ",".join(fields), *rest]) + "\n")
    assert main(["analyze", str(tmp_path / "ds")]) != 0
    assert path.name in capsys.readouterr().err


@pytest.mark.parametrize("form", ["psych-ds", "csv"])
@pytest.mark.parametrize(
    ("spoil", "said"),
    [
        (lambda lines: [*lines[:2], lines[1], *lines[2:]], "is there 2 times"),
        (lambda lines: [lines[0], FLOAT.sub("inf", lines[1], 1)], "is not finite"),
        (lambda lines: [lines[0], FLOAT.sub("nan", lines[1], 1)], "is not finite"),
        (lambda lines: lines[:1], "There is nothing to analyse"),
    ],
)
def test_rows_twice_numbers_that_are_none_and_no_rows_are_refused(exported, tmp_path, capsys, form, spoil, said):
    """In any phase: what is no run of a staircase is not replayed, and would not contradict the protocol."""
    for path in exported(form).rglob("*.csv"):
        lines = path.read_text("utf-8").splitlines()
        if "level_n" in lines[0].split(",") and "session" in lines[0].split(","):
            path.write_text("\n".join(spoil(lines)) + "\n", "utf-8")
    capsys.readouterr()
    assert main(["analyze", str(tmp_path / "ds"), "--out", str(tmp_path / "out")]) == 1
    assert said in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("form", ["bids", "mat"])
def test_a_form_that_is_not_read_back_is_refused_with_those_that_are(data, tmp_path, capsys, form):
    assert main(["export", str(data), "--out", str(tmp_path / "ds"), "--format", form]) == 0
    assert main(["analyze", str(tmp_path / "ds"), "--out", str(tmp_path / "out")]) == 2
    assert "its export as psych-ds or csv (bids and mat" in " ".join(capsys.readouterr().err.split())
