"""`hapteq equalize` as a script would use it."""

import json

import numpy as np
import pytest

from equalizer.plant.identified_model import IdentifiedModel
from equalizer.signals.signal import Signal
from equalizer.tracking.feedforward.trajectory import Trajectory
from study.cli.main import main
from study.store.formats.identified_model_file import write_identified_model
from study.store.formats.trajectory_file import read_trajectory, write_trajectory


@pytest.fixture
def run(capsys):
    def call(*arguments: object) -> tuple[int, str, str]:
        capsys.readouterr()
        code = main(["equalize", *(str(a) for a in arguments)])
        said = capsys.readouterr()
        return int(code), said.out, said.err

    return call


@pytest.fixture
def files(plants, tmp_path):
    """A model, a table, and a name for the forces."""
    plant, channels = plants.omega_like(), (("fx", "fy", "fz"), ("ax", "ay", "az"))
    model = IdentifiedModel(plant.A, plant.B, plant.C, np.zeros((3, 3)), 1000.0, (5.0, 35.0), "N", "m/s^2", *channels)
    write_identified_model(tmp_path / "model.h5", model)
    samples = plants.multisine(6.0, 34.0, seconds=1.0) * np.sin(np.pi * np.arange(1000) / 1000)[:, None] ** 2
    wanted = Trajectory(Signal(samples, 1000.0, "acceleration", "m/s^2", ("ax", "ay", "az")))
    write_trajectory(tmp_path / "wanted.csv", wanted)
    return tmp_path / "model.h5", tmp_path / "wanted.csv", "--out", tmp_path / "forces.csv"


def test_the_path_and_what_to_know_go_to_stdout(run, files):
    code, out, err = run(*files)
    assert code == 0
    assert out.splitlines()[0] == str(files[-1])
    assert out.splitlines()[1].startswith("No quality is stored")
    assert out.splitlines()[2].startswith("As the model itself predicts: error 0.")
    assert err == ""
    assert len(read_trajectory(files[-1]).signal) == 1000


def test_or_one_document_for_a_program(run, files):
    code, out, _ = run(*files, "--json")
    assert code == 0
    assert json.loads(out)["forces"] == str(files[-1])
    assert json.loads(out)["predicted_error"] < 0.01


@pytest.mark.parametrize("missing", ["table", "model", "order"])
def test_models_come_first_and_a_table_behind_them(run, files, missing):
    model, table, *rest = files
    code, _, err = run(*{"table": [model], "model": [table], "order": [table, model]}[missing], *rest)
    assert code == 2
    assert err.startswith("Models or the table are missing")


@pytest.mark.parametrize("part", [["--repeat", 3], ["--device", "simulated"], ["--from", "old.csv"]])
def test_repeat_and_device_go_together(run, files, part):
    code, _, err = run(*files, *part)
    assert code == 2
    assert "--repeat and --device must be given together, and --from only with them." in err


def test_repeating_needs_a_model_that_says_its_spring(run, files):
    code, _, err = run(*files, "--repeat", 3, "--device", "simulated")
    assert code == 1
    assert "Nothing was played" in err
    assert not files[-1].exists()


def test_too_strong_forces_end_with_a_named_error(run, files):
    code, out, err = run(*files, "--cap", 0.1)
    assert (code, out) == (1, "")
    assert "The forces would be too strong" in err
    assert "above the cap of 0.1 N" in err
    assert run(*files, "--cap", 0.1, "--constrain")[0] == 0
