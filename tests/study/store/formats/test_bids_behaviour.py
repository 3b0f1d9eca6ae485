"""What a BIDS dataset says of the task is what the protocol's rule is."""

import json
from pathlib import Path

import pytest

from study.store.formats.bids_behaviour import write_bids

PUBLISHED = (Path(__file__).parents[4] / "protocols" / "direction_threshold.toml").read_text("utf-8")


@pytest.mark.parametrize(
    ("up", "down", "target"), [(1, 3, "79.37 %"), (1, 2, "70.71 %"), (1, 1, "50.00 %"), (2, 3, None)]
)
def test_the_target_of_the_staircase_is_that_of_its_rule(tmp_path, up, down, target):
    text = PUBLISHED.replace("up_after_wrong = 1 ", f"up_after_wrong = {up} ")
    text = text.replace("down_after_right = 3 ", f"down_after_right = {down} ")
    write_bids(tmp_path, "study", (), text, {})
    said = json.loads((tmp_path / "task-study_beh.json").read_text("utf-8"))["TaskDescription"]
    assert f"level at which {target} of the answers" in said if target else "%" not in said
