"""`hapteq power` for people that the analysis does not assume."""

import json

import pytest

from analysis.psychophysics.power.power_curve import PowerPoint, Share
from analysis.psychophysics.power.simulated_study import Crowd
from study.cli.main import main
from study.cli.power import _format_table
from study.workflows.planning.simulate_power import PROGRESS_NAME, PowerPlan
from tests.analysis.conftest import PUBLISHED

ASKED = ("power", "--subjects", "3", "--studies", "10", "--workers", "1", "--effect-db", "0", "--seed", "4")


def plan_of(out, *more):
    assert main([*ASKED, "--out", str(out), *more]) == 0
    return json.loads((out / PROGRESS_NAME).read_text().splitlines()[0])["plan"]["crowd"]


@pytest.mark.slow
def test_a_plan_without_habits_says_nothing_of_them_so_that_older_folders_go_on(tmp_path):
    crowd = plan_of(tmp_path / "plain")
    assert set(crowd) == {
        "frequencies_hz", "medians_n", "person_sd_db", "frequency_sd_db", "slope", "slope_log_sd", "lapse",
        "criterion_sd", "family",
    }  # fmt: skip
    assert (crowd["lapse"], crowd["family"]) == (0.02, "weibull")


@pytest.mark.slow
def test_curve_lapses_and_habits_reach_the_simulated_people(tmp_path):
    crowd = plan_of(tmp_path / "other", "--people", "repeating", "--curve", "logistic", "--lapse", "0.05")
    assert (crowd["unsure"], crowd["repeats"], crowd["family"], crowd["lapse"]) == (0.5, 3, "logistic", 0.05)


@pytest.mark.parametrize(("option", "name"), [("--people", "robots"), ("--curve", "cauchy")])
def test_unknown_people_are_refused_with_those_there_are(tmp_path, capsys, option, name):
    assert main([*ASKED, "--out", str(tmp_path / "no"), option, name]) == 2
    said = capsys.readouterr().err
    assert f"{option} is {name}." in said
    assert ("attentive, some-guess" in said) or ("weibull, logistic, gauss" in said)
    assert not (tmp_path / "no").exists()


@pytest.mark.slow
def test_people_feel_what_a_device_delivered_in_sessions(tmp_path, small_text, capsys):
    (tmp_path / "small.toml").write_text(small_text)
    small = ("--protocol", str(tmp_path / "small.toml"))
    data = str(tmp_path / "data")
    assert main(["study", *small, "--observer", "ideal", "--seed", "1", "--subject", "P01", "--data", data]) == 0
    crowd = plan_of(tmp_path / "felt", *small, "--delivered", data)
    tables = crowd["delivery"]["tables"]
    assert len(tables) == len(crowd["frequencies_hz"])
    rows = [row for pair in tables for table in pair for row in table]
    assert max(along for _, along, _, _ in rows) > 0.5  # of the simulated omega.3, over its usual strength
    assert all(0.0 < along < 2.5 and across < along for level_db, along, across, _ in rows if level_db > -6.0)
    assert plan_of(tmp_path / "felt", *small, "--delivered", data) == crowd
    assert main([*ASKED, *small, "--out", str(tmp_path / "felt")]) == 1  # another plan
    assert main([*ASKED, "--out", str(tmp_path / "no"), "--delivered", data]) == 2
    assert "no measured trials of both directions at" in capsys.readouterr().err


@pytest.mark.slow
def test_a_protocol_that_roves_its_levels_is_simulated_so_and_it_is_said(tmp_path, small_text, capsys):
    roved = small_text.replace("fade_in_s = 0.1", "fade_in_s = 0.1\nrove_db = 6.0").replace(
        "cap_n = 3.0\nup", "cap_n = 2.12\nup"
    )
    (tmp_path / "roved.toml").write_text(roved)
    mine = ("--protocol", str(tmp_path / "roved.toml"))
    assert plan_of(tmp_path / "roved", *mine)["rove_db"] == 6.0
    assert "Levels roved by 6 dB, as the protocol says." in capsys.readouterr().out
    assert main(["power", "--compare", "--studies", "10", *mine, "--people", "repeating"]) == 0
    said = capsys.readouterr().out
    assert "Roved by 6 dB" in said and "people are attentive" in said


@pytest.mark.parametrize(("medians_n", "is_told"), [((0.7, 5.0), False), ((20.0, 28.0), True)])
def test_where_both_medians_are_above_the_cap_it_is_told_what_counts_as_not_covered(medians_n, is_told):
    """Coverage was about 0 without a word, where a report gives no interval at all."""
    share = Share(0.0, 0.0, 0.1)
    points = [PowerPoint(5, 10, 300.0, share, share, share, share, 0.0, 0.0)]
    lines = _format_table(points, PowerPlan(Crowd((5.0, 45.0), medians_n), PUBLISHED, (5,), 10, 1))
    assert any("this counts as not found and not covered" in line for line in lines) == is_told
