"""Languages by code and by file, in the file of a protocol, under a lock and in the log."""

import json
from pathlib import Path
from types import SimpleNamespace

import pytest

from protocols.document.hashing import hash_protocol
from protocols.wording.english import ENGLISH, LANGUAGES
from study.store.disk.file_errors import CannotReadError, UnusableFileError
from study.store.formats import participant_texts
from study.store.formats.participant_texts import make_language_template, read_language
from study.store.formats.protocol_files import (
    LockedProtocolChangedError,
    ProtocolRefusedError,
    lock_protocol,
    read_protocol,
    read_study_protocol,
)
from study.workflows.files.validate import validate_file


@pytest.fixture
def mine(tmp_path):
    """A copy of the shipped study with a table of texts."""

    def write(text: str):
        path = tmp_path / "mine.toml"
        shipped = read_protocol("direction_training").text
        path.write_text(f"{shipped}\n[text]\n{text}\n", encoding="utf-8")
        return str(path)

    return write


@pytest.fixture
def french(tmp_path):
    """Not French, but another language as far as a program can tell."""
    path = tmp_path / "fr.toml"
    table = {key: f"« {text} »" for key, text in ENGLISH.items()}
    path.write_text(
        "".join(f"{key} = {json.dumps(text, ensure_ascii=False)}\n" for key, text in table.items()), encoding="utf-8"
    )
    return path


@pytest.mark.parametrize("code", LANGUAGES)
def test_a_template_is_a_table_that_can_be_read_again(tmp_path, code):
    path = tmp_path / "copy.toml"
    path.write_text(make_language_template(code), encoding="utf-8")
    assert read_language(str(path))[1] == read_language(code)[1]


def test_a_text_for_no_that_is_the_languages_text_for_yes_is_refused(mine):
    """Beside the English text for yes it is no problem; a refusal would be logged as a consent."""
    with pytest.raises(ProtocolRefusedError, match=r"text\.words\.no is the text of yes"):
        read_study_protocol(mine('language = "de"\nwords = { no = "Ja" }'))


def test_a_protocol_in_german_has_german_texts_and_says_so_in_its_text(mine, tmp_path):
    found = read_study_protocol(mine('language = "de"'))
    assert found.protocol.text.words["rest_title"] == "Ruhepause"
    assert found.protocol.title == "Übungsdurchgang bei 5 Hz"
    again = tmp_path / "again.toml"
    again.write_text(found.text, encoding="utf-8")
    assert hash_protocol(read_study_protocol(str(again)).protocol) == hash_protocol(found.protocol)


def test_a_protocol_without_the_table_keeps_its_text_and_hash(mine):
    assert read_protocol("direction_training").text.startswith("# Practice alone")
    shipped = hash_protocol(read_protocol("direction_training").protocol)
    assert hash_protocol(read_protocol(mine("")).protocol) == shipped


def test_a_language_by_one_file_beside_the_protocol(mine, french):
    found = read_study_protocol(mine('language = "fr.toml"'))
    assert found.protocol.text.language == "fr"
    assert found.protocol.text.words["yes"] == "« yes »"


def test_a_missing_key_is_named_and_an_unknown_one_refused(mine, french):
    lines = french.read_text("utf-8").splitlines()
    kept = [line for line in lines if not line.startswith(("yes =", "rest_title ="))]
    french.write_text("\n".join([*kept, 'rest_titel = "x"']), encoding="utf-8")
    with pytest.raises(UnusableFileError) as refused:
        read_study_protocol(mine('language = "fr.toml"'))
    for part in ("yes is missing", "rest_title is missing", "rest_titel is no text of hapteq"):
        assert part in str(refused.value)


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ('language = "tlh"', 'text.language is "tlh"'),
        ('words = { rest_titel = "x" }', "text.words.rest_titel is no text of hapteq"),
        ('words = { heading = "x" }', "text.words.heading has no braces"),
        ("language = 3", "text.language is 3"),
        ("words = 3", "text.words is 3"),
    ],
)
def test_a_wrong_table_is_refused(mine, text, told):
    with pytest.raises(ProtocolRefusedError, match=told):
        read_study_protocol(mine(text))


def test_a_file_that_is_not_there(mine):
    with pytest.raises(CannotReadError):
        read_study_protocol(mine('language = "xx.toml"'))


def test_a_text_changed_under_a_lock_is_another_protocol(mine, french, tmp_path):
    path = mine('language = "fr.toml"')
    lock_protocol(read_protocol(path), tmp_path, "2024-05-01T09:00:00+00:00", "0.1")
    assert read_protocol(path).locked
    french.write_text(french.read_text("utf-8").replace("« Rest »", "« Break »"), encoding="utf-8")
    with pytest.raises(LockedProtocolChangedError):
        read_protocol(path)


def add_a_text(monkeypatch):
    """As a later version of hapteq may: a new text, and a better German one."""
    shipped = dict(participant_texts.tomllib.loads(make_language_template("de")))
    longer = {**ENGLISH, "new_text": "New."}
    monkeypatch.setattr(participant_texts, "ENGLISH", longer)
    monkeypatch.setattr("protocols.wording.translation.ENGLISH", longer)

    class Newer:
        loads = staticmethod(participant_texts.tomllib.loads)

    def loads(text):
        table = Newer.loads(text)
        return {**shipped, "new_text": "Neu.", "rest_title": "Erholung"} if table == shipped else table

    monkeypatch.setattr(participant_texts, "tomllib", SimpleNamespace(loads=loads))


@pytest.mark.parametrize("stated", ['language = "de"', 'language = "de"\n[text.words]\nrest_relax = "Bitte ruhen."'])
def test_a_lock_in_german_holds_when_a_later_version_changes_its_texts(mine, tmp_path, monkeypatch, stated):
    path = mine(stated)
    before = read_study_protocol(path)
    lock_protocol(before, tmp_path, "2026-11-22T10:00:00+00:00", "0.1.0")
    add_a_text(monkeypatch)
    assert read_study_protocol(path).protocol == before.protocol
    assert read_study_protocol(path).text == before.text
    mine(stated.replace('"de"', '"es"'))
    with pytest.raises(LockedProtocolChangedError):
        read_study_protocol(path)


@pytest.mark.usefixtures("validated_here")
@pytest.mark.parametrize("name", ["fr.toml", "en.toml"])
def test_a_lock_with_a_table_of_ones_own_holds_when_a_later_version_needs_another_text(
    mine, french, tmp_path, monkeypatch, name
):
    """Also one of one's own English."""
    french = french.rename(tmp_path / name)
    path = mine(f'language = "{name}"')
    before = read_study_protocol(path)
    lock_protocol(before, tmp_path, "2026-11-22T10:00:00+00:00", "0.1.0")
    filled = tmp_path / "filled.toml"
    filled.write_text(before.text, encoding="utf-8")
    add_a_text(monkeypatch)
    for source in (path, str(filled)):
        assert read_study_protocol(source).protocol == before.protocol
        assert validate_file(Path(source)).problems == ()
    french.write_text(french.read_text("utf-8").replace("« Practice", "« practice"), encoding="utf-8")
    with pytest.raises(LockedProtocolChangedError):
        read_study_protocol(path)
