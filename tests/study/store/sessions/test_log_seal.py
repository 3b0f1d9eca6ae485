"""The seal of a closed log: what is wrong in its file."""

import pytest

from study.session.facts.log_chain import CHECKSUM_DIGITS
from study.store.disk.file_errors import UnusableFileError
from study.store.disk.json_document import write_json
from study.store.sessions.log_seal import SEAL_FORMAT, SEAL_NAME, SEAL_VERSION, read_seal


def test_all_that_is_wrong_in_a_seal_is_told_at_once(tmp_path):
    fields = {"session": "P01_001", "lines": "12", "bytes": -1, "head": "0" * CHECKSUM_DIGITS, "sha256": "0" * 64}
    write_json(tmp_path / SEAL_NAME, SEAL_FORMAT, SEAL_VERSION, fields)
    with pytest.raises(UnusableFileError) as refusal:
        read_seal(tmp_path / SEAL_NAME)
    assert [problem.partition(":")[0] for problem in refusal.value.problems] == ["lines", "bytes"]
