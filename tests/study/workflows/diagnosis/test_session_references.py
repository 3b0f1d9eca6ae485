"""A session with references is diagnosed by them, and says what its probes saw."""

from dataclasses import replace

import pytest

from protocols.definition.probes import ProbeSettings
from protocols.document.dumping import dump_protocol
from study.workflows.diagnosis.diagnosis_input import read_input
from study.workflows.diagnosis.session_references import find_references


@pytest.fixture
def folder(sitter):
    kept = replace(sitter.protocol.measurement, keep_s=1.0)
    probes = ProbeSettings(levels_n=(0.4,), interval_s=20.0, reference_s=8.0)
    sitter.protocol = replace(sitter.protocol, probes=probes, measurement=kept)
    sitter.text = dump_protocol(sitter.protocol)
    return sitter.whole().folder


@pytest.mark.slow
def test_the_reference_is_read_in_the_place_of_the_trials(folder):
    found = read_input([folder.path], seed=1)
    (recording,) = found.recordings
    assert [segment.role for segment in recording.segments] == ["fit", "test", "fit", "test"]
    assert recording.position is not None
    assert folder.log in found.parents
    assert any("the reference without a hand was diagnosed" in remark for remark in found.remarks)
    assert any("no change was detected" in remark for remark in found.remarks)


@pytest.mark.slow
def test_a_reference_that_was_changed_since_is_left_out_and_the_trials_are_read(folder):
    references = find_references(folder.path)
    assert references is not None
    for path in references.paths:
        path.write_bytes(path.read_bytes() + b"x")
    assert find_references(folder.path) is None
    found = read_input([folder.path], seed=1)
    assert all(segment.kind == "sine" for recording in found.recordings for segment in recording.segments)
    assert not any("trials were left out" in remark for remark in found.remarks)


def test_a_session_without_probes_has_no_references(finished):
    assert find_references(finished.folder.path) is None
