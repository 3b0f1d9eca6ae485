"""The band of an equalizer from a study's direction limit."""

import json

import pytest

from study.cli.main import main
from study.store.disk.file_errors import UnusableFileError
from study.workflows.equalizer.direction_limit import read_study_band

LIMIT = {"frequency_hz": 34.7, "lower_hz": 31.6, "upper_hz": None, "words": ""}


@pytest.fixture
def written(tmp_path):
    def write(limit=LIMIT, **changes):
        document = {"format": "hapteq-anova", "version": 1, "population": "people", "primary": {"limit": limit}}
        path = tmp_path / "anova.json"
        path.write_text(json.dumps({**document, **changes}))
        return path

    return write


def test_the_band_ends_at_the_limit_and_says_how_sure_that_is(written):
    found = read_study_band(written(), 5.0)
    assert found.band_hz == (5.0, 34.7)
    assert "34.7 Hz (interval: 31.6 Hz to above what was played)" in found.origin
    assert "simulated" not in found.origin
    assert "simulated" in read_study_band(written(population="simulated"), 5.0).origin


@pytest.mark.parametrize(
    ("changes", "lowest_hz", "said"),
    [
        ({"limit": {**LIMIT, "frequency_hz": None}}, 5.0, "no direction limit"),
        ({"primary": None}, 5.0, "no direction limit"),
        ({"format": "other"}, 5.0, "format"),
        ({}, 40.0, "not above"),
    ],
)
def test_a_study_without_a_usable_limit_is_refused(written, changes, lowest_hz, said):
    with pytest.raises(UnusableFileError, match=said):
        read_study_band(written(**changes), lowest_hz)


def test_identify_takes_its_band_from_there(written, tmp_path, monkeypatch, capsys):
    plans = []

    def only_look(plan, _):
        plans.append(plan)
        raise KeyboardInterrupt

    monkeypatch.setattr("study.workflows.equalizer.identify_model.identify_model", only_look)
    main(["identify", "a.h5", "--out", str(tmp_path / "m.h5"), "--band", "4", "50", "--limit-from", str(written())])
    assert [plan.band_hz for plan in plans] == [(4.0, 34.7)]
    assert "ends at the direction limit" in capsys.readouterr().err
