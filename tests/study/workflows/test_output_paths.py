"""A name is free, and there is a folder for what will have it."""

import pytest

from study.errors import StudyError
from study.workflows.output_paths import require_new_outputs


def refusal(*paths) -> StudyError:
    with pytest.raises(StudyError) as refused:
        require_new_outputs(*paths, title="Nothing was baked", kind="cakes", saved="The oven is off.")
    return refused.value


def test_a_free_name_in_a_folder_is_fine(tmp_path):
    require_new_outputs(tmp_path / "new.h5", tmp_path / "new.json", title="Nothing was baked", kind="cakes")


def test_what_is_there_is_never_overwritten_be_it_the_result_or_what_goes_beside_it(tmp_path):
    (tmp_path / "there").write_text("mine")
    for paths in [(tmp_path / "there",), (tmp_path / "new.h5", tmp_path / "there")]:
        said = refusal(*paths)
        assert said.happened == f"{tmp_path / 'there'} exists already, and cakes are never overwritten."
        assert (said.title, said.saved) == ("Nothing was baked", "The oven is off.")


def test_a_folder_that_is_not_there_is_not_made(tmp_path):
    said = refusal(tmp_path / "no" / "new.h5")
    assert f"There is no folder {tmp_path / 'no'} to write new.h5 into." in said.happened
    assert "Make the folder first" in said.do_now


def test_a_link_to_nowhere_is_a_name_that_is_taken(tmp_path):
    (tmp_path / "link.h5").symlink_to(tmp_path / "nowhere.h5")
    assert "exists already" in refusal(tmp_path / "link.h5").happened
