import json
from pathlib import Path

import pytest

from equalizer.plant.effect_vocabulary import EFFECT_ENTRIES
from study.workflows.files.format_docs import SCHEMAS, generate_documents, write_documents

DOCS = Path(__file__).parents[4] / "docs"


@pytest.mark.parametrize("name", generate_documents())
def test_the_committed_page_is_what_the_code_says(name):
    """Where this fails: python -m study.workflows.files.format_docs docs"""
    assert (DOCS / name).read_text("utf-8") == generate_documents()[name]


def test_no_schema_of_old_is_left():
    assert {path.name for path in (DOCS / "schemas").iterdir()} == {schema.file for schema in SCHEMAS}


@pytest.mark.slow
def test_every_effect_is_on_the_page():
    assert all(f"`{effect.name}`" in generate_documents()["formats.md"] for effect in EFFECT_ENTRIES)


def test_a_document_schema_asks_for_format_and_version():
    schema = json.loads(generate_documents()["schemas/diagnosis.json"])
    assert schema["properties"]["format"] == {"const": "hapteq-diagnosis"}
    assert schema["required"][:2] == ["format", "version"]


def test_the_pages_can_be_written_again(tmp_path):
    write_documents(tmp_path)
    write_documents(tmp_path)
    assert (tmp_path / "formats.md").read_text("utf-8") == generate_documents()["formats.md"]
