import json

import pytest

from study.store.disk.file_errors import AlreadyExistsError, UnusableFileError
from study.store.disk.json_document import read_json, write_json
from study.store.disk.provenance import gather_provenance


@pytest.fixture
def path(tmp_path):
    return tmp_path / "anova.json"


def test_a_document_says_its_format_and_version_first(path):
    write_json(path, "hapteq-anova", 1, {"f": 3.2})
    assert list(json.loads(path.read_text()).items()) == [("format", "hapteq-anova"), ("version", 1), ("f", 3.2)]
    assert read_json(path, "hapteq-anova", 1) == {"f": 3.2}


def test_a_document_keeps_its_provenance(path):
    write_json(path, "hapteq-anova", 1, {}, gather_provenance(protocol_hash="abc"))
    assert read_json(path, "hapteq-anova", 1)["provenance"]["protocol_hash"] == "abc"


def test_nothing_existing_is_overwritten_unless_asked_for(path):
    write_json(path, "hapteq-anova", 1, {"f": 1})
    with pytest.raises(AlreadyExistsError):
        write_json(path, "hapteq-anova", 1, {"f": 2})
    write_json(path, "hapteq-anova", 1, {"f": 2}, overwrite=True)
    assert read_json(path, "hapteq-anova", 1) == {"f": 2}


def test_a_value_that_json_does_not_have_is_refused_before_anything_is_written(path):
    with pytest.raises(ValueError, match=r"anova\.json would hold a value that JSON does not have"):
        write_json(path, "hapteq-anova", 1, {"f": float("nan")})
    assert not path.exists()


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("{", "this is not JSON: Expecting property name"),
        ("[" * 100_000, "this is not JSON: "),
        ('{"f": NaN}', "this is not JSON: JSON has no NaN; write null"),
        ("[1]", "it holds a list; a hapteq document is an object with format and version"),
        ("{}", "its format is missing, not 'hapteq-anova'"),
        ('{"format": "other", "version": 1}', "its format is 'other', not 'hapteq-anova'"),
        ('{"format": "hapteq-anova"}', "its version is missing; this program reads version 1"),
        ('{"format": "hapteq-anova", "version": 2}', "its version is 2; this program reads version 1"),
        ('{"format": "hapteq-anova", "version": true}', "its version is True; this program reads version 1"),
    ],
)
def test_every_fault_of_a_document_is_named(path, text, problem):
    path.write_text(text)
    with pytest.raises(UnusableFileError) as refused:
        read_json(path, "hapteq-anova", 1)
    assert refused.value.problems[0].startswith(problem)
