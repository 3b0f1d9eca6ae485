"""One command in this process, and a data folder with a finished session."""

import shutil
from pathlib import Path

import pytest

from study.cli.main import main


@pytest.fixture
def run(capsys):
    """Runs one command in this process; returns exit code, stdout, stderr."""

    def call(*arguments: object) -> tuple[int, str, str]:
        capsys.readouterr()
        code = main([str(a) for a in arguments])
        said = capsys.readouterr()
        return int(code), said.out, said.err

    return call


@pytest.fixture(scope="session")
def finished(tmp_path_factory, small_text, sketching):
    """A data folder with one finished session of the small protocol; copied by each test that changes it."""
    folder = tmp_path_factory.mktemp("finished")
    (folder / "small.toml").write_text(small_text)
    data = folder / "data"
    with sketching():
        assert main(["study", "--protocol", str(folder / "small.toml"), "--observer", "ideal", "--seed", "3",
                     "--subject", "P01", "--data", str(data)]) == 0  # fmt: skip
    return data


@pytest.fixture
def data(finished, tmp_path) -> Path:
    return Path(shutil.copytree(finished, tmp_path / "data"))
