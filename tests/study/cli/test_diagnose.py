"""`hapteq diagnose` as a script would use it, with the engine itself."""

import json
from pathlib import Path

import pytest

from equalizer.plant.effect_vocabulary import EFFECTS_BY_NAME
from study.cli.main import main
from study.store.formats.mechanical_model_file import write_mechanical_model
from study.store.formats.recording_file import write_recording

SUSPECTED = ("coulomb_friction", "viscous_damping")


@pytest.fixture(scope="module")
def files(module_at, tmp_path_factory):
    made = module_at(Path(__file__).parents[2] / "diagnosed.py")
    folder = tmp_path_factory.mktemp("files")
    write_recording(folder / "rec.h5", made.recorded(1))
    write_mechanical_model(folder / "model.toml", made.device(1))
    return folder


@pytest.fixture
def run(capsys):
    def call(*arguments: object) -> tuple[int, str, str]:
        capsys.readouterr()
        code = main(["diagnose", *(str(a) for a in arguments)])
        said = capsys.readouterr()
        return int(code), said.out, said.err

    return call


def given(files, out, *more):
    """Few effects are suspected: that is quick."""
    left_out = [word for name in EFFECTS_BY_NAME if name not in SUSPECTED for word in ("--without", name)]
    return (files / "rec.h5", "--model", files / "model.toml", "--out", out, *left_out, *more)


def test_friction_is_named_on_stdout_and_the_folder_is_written(run, files, tmp_path):
    code, out, err = run(*given(files, tmp_path / "out"))
    assert (code, err) == (0, "")
    assert out.startswith("Missing in the model: dry friction on the x drive.")
    assert f"Report: {tmp_path / 'out' / 'report.html'}" in out
    assert (tmp_path / "out" / "improved.toml").is_file()


@pytest.mark.slow
@pytest.mark.usefixtures("sketched")
def test_or_the_document_for_a_program(run, files, tmp_path):
    code, out, err = run(*given(files, tmp_path / "out", "--json"))
    document = json.loads(out)
    assert (code, err) == (0, "")
    assert [effect["effect"] for effect in document["effects"]] == ["coulomb_friction"]
    written = json.loads((tmp_path / "out" / "diagnosis.json").read_text())
    assert {key: value for key, value in written.items() if key != "provenance"} == document


def test_an_unknown_effect_is_wrong_use_and_suggests_one(run, files, tmp_path):
    code, out, err = run(files / "rec.h5", "--out", tmp_path / "out", "--without", "coulom_friction")
    assert (code, out) == (2, "")
    assert "There is no effect 'coulom_friction'" in err
    assert "did you mean 'coulomb_friction'?" in err


def test_a_folder_that_is_taken_is_an_error_that_says_so(run, files):
    code, _, err = run(files / "rec.h5", "--out", files)
    assert code == 1
    assert "holds files already" in err


def test_a_recording_that_is_not_there_is_an_error_that_says_so(run, tmp_path):
    code, _, err = run(tmp_path / "none.h5", "--out", tmp_path / "out")
    assert code == 1
    assert "none.h5 cannot be read" in err
    assert list(tmp_path.iterdir()) == []
