"""Which models are offered for a study."""

import numpy as np

from equalizer.plant.identified_model import IdentifiedModel
from study.store.formats.identified_model_file import write_identified_model
from study.workflows.views.view_home import list_model_files, make_home_view

MODEL = IdentifiedModel(
    np.zeros((1, 1)), np.eye(1), np.eye(1), np.zeros((1, 1)), 1000.0, (5.0, 50.0), "N", "m/s^2", ("fx",), ("ax",)
)


def test_models_in_the_data_folder_and_beside_it_are_found_and_nothing_else(tmp_path):
    data = tmp_path / "data"
    data.mkdir()
    write_identified_model(tmp_path / "beside.h5", MODEL)
    write_identified_model(data / "within.h5", MODEL)
    (data / "torn.h5").write_bytes(b"no HDF5")
    (data / "model.txt").write_text("")
    found = list_model_files(data)
    assert set(found) == {str(tmp_path / "beside.h5"), str(data / "within.h5")}
    assert make_home_view(data).models == found
    assert {make_home_view(data).describe_quality(model) for model in found} == {"quality not stored"}


def test_a_folder_that_is_not_there_has_none(tmp_path):
    assert list_model_files(tmp_path / "none" / "data") == ()


def test_a_protocol_of_accelerations_says_so(tmp_path):
    equalized = {line.name: line.equalized for line in make_home_view(tmp_path).protocols}
    assert equalized["equalized_threshold"] and not equalized["direction_threshold"]
