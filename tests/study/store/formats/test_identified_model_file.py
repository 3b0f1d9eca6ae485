from dataclasses import replace

import h5py
import numpy as np
import pytest

from equalizer.plant.identified_model import IdentifiedModel
from equalizer.plant.model_quality import ModelQuality
from study.store.disk.file_errors import AlreadyExistsError, UnusableFileError
from study.store.formats.identified_model_file import LAYOUT, read_identified_model, write_identified_model

MATRICES = ("A", "B", "C", "D", "covariance", "samples")
REST = ("sample_rate_hz", "band_hz", "input_unit", "output_unit", "input_channels", "output_channels", "delay_samples")


@pytest.fixture
def model():
    rng = np.random.default_rng(3)
    return IdentifiedModel(
        A=rng.normal(size=(4, 4)) / 4,
        B=rng.normal(size=(4, 2)),
        C=rng.normal(size=(3, 4)),
        D=np.zeros((3, 2)),
        sample_rate_hz=1000.0,
        band_hz=(5.0, 35.0),
        input_unit="N",
        output_unit=("m/s^2", "m/s^2", "rad/s^2"),
        input_channels=("fx", "fy"),
        output_channels=("ax", "ay", "rz"),
        delay_samples=1.0,
        place_m=(0.0, 0.01, -0.02),
        covariance=np.eye(42),
        samples=rng.normal(size=(5, 42)),
        provenance={"seeds": {"start": 3}},
        quality=ModelQuality(0.2, 0.1, 0.01, 0.2, 0.05, 10.0, ("The order 4 may be too low.",)),
    )


@pytest.fixture
def written(tmp_path, model):
    write_identified_model(tmp_path / "m.h5", model)
    return tmp_path / "m.h5"


def test_a_written_model_is_read_back_to_the_last_digit(written, model):
    read = read_identified_model(written)
    assert all(np.array_equal(getattr(read, name), getattr(model, name)) for name in MATRICES)
    for name in (*REST, "place_m", "provenance", "quality"):
        assert getattr(read, name) == getattr(model, name)


def test_everything_in_the_file_is_in_its_documented_layout_and_the_other_way_round(written):
    with h5py.File(written) as file:
        assert {*file, *file.attrs} == {entry.name for entry in LAYOUT}


def test_a_model_without_place_or_uncertainty_is_read(tmp_path, model):
    path = tmp_path / "bare.h5"
    write_identified_model(
        path, replace(model, place_m=None, covariance=None, samples=None, provenance={}, quality=None)
    )
    read = read_identified_model(path)
    assert (read.place_m, read.covariance, read.samples, read.quality) == (None, None, None, None)


def test_a_model_that_was_not_tested_keeps_what_is_known_of_it(tmp_path, model):
    quality = ModelQuality(expected_error=0.03, misfit_error=0.03)
    write_identified_model(tmp_path / "untested.h5", replace(model, quality=quality))
    assert read_identified_model(tmp_path / "untested.h5").quality == quality


def test_figures_of_quality_that_cannot_be_are_named(written):
    with h5py.File(written, "r+") as file:
        file.attrs["held_out_error"] = -0.1
    with pytest.raises(UnusableFileError, match=r"held_out_error is -0\.1; it must be a number that is not negative"):
        read_identified_model(written)


def test_nothing_existing_is_overwritten_unless_asked_for(written, model):
    with pytest.raises(AlreadyExistsError):
        write_identified_model(written, model)
    write_identified_model(written, replace(model, delay_samples=2.0), overwrite=True)
    assert read_identified_model(written).delay_samples == 2.0


@pytest.mark.parametrize(
    ("name", "value", "problem"),
    [
        ("format", "hapteq-recording", "its format is 'hapteq-recording', not 'hapteq-model'"),
        ("version", 7, "its version is 7; this program reads version 1"),
        ("sample_rate_hz", None, "the attribute 'sample_rate_hz' is missing"),
        ("band_hz", 5.0, "the attribute 'band_hz' is 5.0; it must be 2 numbers"),
        ("band_hz", (35.0, 5.0), "band_hz is 35 to 5; it must rise within 0 and half the sample rate"),
        ("input_unit", None, "the attribute 'input_unit' is missing"),
        ("input_unit", "mN", "input_unit is 'mN'; a model is in SI units, here N"),
        ("output_channels", ["ax"], "output_channels names 1 channels, but the matrices have 3"),
        ("place_m", (0.0, 0.0), "the attribute 'place_m' is [0.0, 0.0]; it must be 3 numbers"),
        ("provenance", "{", "the attribute 'provenance' is not JSON"),
        ("provenance", "[]", "the attribute 'provenance' is []; it must be a JSON object"),
        ("A", None, "the dataset 'A' is missing"),
        ("B", np.ones((3, 2)), "B has shape (3, 2), but order 4"),
    ],
)
def test_every_fault_of_a_file_is_named(written, name, value, problem):
    with h5py.File(written, "r+") as file:
        owner = file if name in ("A", "B") else file.attrs
        del owner[name]
        if value is not None:
            owner[name] = value
    with pytest.raises(UnusableFileError) as refused:
        read_identified_model(written)
    assert any(found.startswith(problem) for found in refused.value.problems), refused.value.problems
