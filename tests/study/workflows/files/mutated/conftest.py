"""Sound files, to be damaged."""

import pytest

from tests.study.workflows.files.mutated.corpus import corpus


@pytest.fixture(scope="session")
def sound(tmp_path_factory):
    return corpus(tmp_path_factory.mktemp("corpus") / "files")
