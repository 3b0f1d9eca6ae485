"""`hapteq protocol show`: every field with value, default and reason."""

from dataclasses import replace
from importlib.resources import files

import pytest

from protocols.document.explain import explain_protocol
from protocols.document.loading import load_protocol

NAMES = tuple(sorted(path.name.removesuffix(".toml") for path in files("protocols").iterdir() if ".toml" in path.name))


def fields_of(name: str):
    return explain_protocol(load_protocol(files("protocols").joinpath(f"{name}.toml").read_text("utf-8"), name))


@pytest.mark.parametrize("name", NAMES)
def test_every_field_is_described_and_every_default_has_its_reason(name):
    for field in fields_of(name):
        assert len(field.description) > 10, field
        if field.default is not None:
            assert "default" in field.description.lower(), field


@pytest.mark.parametrize("name", NAMES)
def test_every_key_is_listed_once(name):
    keys = [field.key for field in fields_of(name)]
    assert len(set(keys)) == len(keys)


def test_a_field_shows_value_default_and_what_is_allowed(threshold):
    faster = replace(threshold, stimulus=replace(threshold.stimulus, fade_in_s=0.3))
    field = {field.key: field for field in explain_protocol(faster)}["stimulus.fade_in_s"]
    assert (field.value, field.default) == (0.3, 0.5)
    assert field.allowed == "a number above 0 up to 5, in seconds"
    assert "no onset reveals the direction" in field.description


def test_entries_of_lists_count_from_one():
    values = {field.key: field.value for field in fields_of("direction_threshold")}
    assert (values["staircase.steps[1].step_db"], values["staircase.steps[2].step_db"]) == (4.0, 1.0)
    assert {field.key: field.value for field in fields_of("sweep")}["segments[3].along"] == "z"


def test_what_every_protocol_must_state_has_no_default():
    defaults = {field.key: field.default for field in fields_of("direction_threshold")}
    assert defaults["staircase.start_n"] is None
    assert defaults["training.frequencies_hz"] == []
