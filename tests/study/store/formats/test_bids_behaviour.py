"""What a BIDS dataset says of the task is what the protocol's rule is."""

import json
from pathlib import Path

import pytest

from protocols.document.hashing import hash_protocol
from protocols.document.loading import load_protocol
from study.cli.main import main
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


@pytest.mark.slow
def test_seeds_hash_and_device_are_exported(tmp_path, small_text):
    (tmp_path / "small.toml").write_text(small_text)
    data, out = tmp_path / "data", tmp_path / "bids"
    assert main(["study", "--protocol", str(tmp_path / "small.toml"), "--observer", "ideal", "--seed", "7",
                 "--subject", "P01", "--data", str(data)]) == 0  # fmt: skip
    assert main(["export", str(data), "--format", "bids", "--out", str(out)]) == 0
    facts = json.loads((out / "code" / "facts.json").read_text("utf-8"))
    exported = load_protocol((out / "code" / "protocol.toml").read_text("utf-8"), "protocol.toml")
    assert facts["protocol_hash"] == hash_protocol(exported)
    assert list(facts["seeds"].values()) == [7]
    (session,) = facts["seeds"]
    assert (data / session).is_dir()
    opened = json.loads((data / session / "events.jsonl").read_text("utf-8").splitlines()[0])
    assert facts["devices"] == [opened["device"]["name"]]
    assert "`code/facts.json`" in (out / "README.md").read_text("utf-8")


def test_no_target_of_the_staircase_is_stated_where_psi_chooses_the_levels(tmp_path):
    text = PUBLISHED.replace("[staircase.bayesian]\ntrials = 0 ", "[staircase.bayesian]\ntrials = 60 ")
    assert text != PUBLISHED
    write_bids(tmp_path, "study", (), text, {})
    assert "%" not in json.loads((tmp_path / "task-study_beh.json").read_text("utf-8"))["TaskDescription"]
