"""Power is that of the contrast which the protocol declares."""

import json
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import pytest

from analysis.psychophysics.anova import compute_one_way_anova
from analysis.psychophysics.comparisons import compare_group_means
from analysis.psychophysics.hierarchy.primary import compute_primary_analysis
from analysis.psychophysics.power.power_curve import compute_true_difference_db, judge_study
from analysis.psychophysics.power.simulated_study import Crowd, simulate_study
from protocols.definition.staircase_rule import StaircaseRule, StepPhase
from study.cli.main import main
from study.errors import StudyError
from study.workflows.planning.simulate_power import PROGRESS_NAME, RESULT_NAME, PowerPlan, simulate_power

RULE = StaircaseRule(1.0, 3.0, 1, 3, (StepPhase(4.0, 3), StepPhase(1.0, 10)), 13, 10)
CROWD = Crowd((5.0, 35.0, 45.0), (0.7, 1.4, 1.4))
PUBLISHED = (Path(__file__).parents[4] / "protocols" / "direction_threshold.toml").read_text("utf-8")


def test_the_true_difference_is_that_of_the_pair():
    assert compute_true_difference_db(CROWD) == pytest.approx(6.0206, abs=1e-4)
    assert compute_true_difference_db(CROWD, (45.0, 35.0)) == 0.0
    assert compute_true_difference_db(CROWD, (5.0, 35.0)) == pytest.approx(-6.0206, abs=1e-4)


def test_every_analysis_judges_the_declared_pair():
    study = simulate_study(CROWD, RULE, 8, (5, 0))
    means = study.threshold_db.mean(axis=0)
    by_pair = {pair: judge_study(CROWD, RULE, 8, (5, 0), pair) for pair in ((), (45.0, 35.0), (35.0, 45.0))}
    assert by_pair[()].primary_found and not by_pair[45.0, 35.0].primary_found
    assert by_pair[45.0, 35.0].means_error_db == pytest.approx(means[2] - means[1])
    assert by_pair[35.0, 45.0].means_error_db == pytest.approx(means[1] - means[2])
    assert by_pair[35.0, 45.0].primary_error_db == pytest.approx(-by_pair[45.0, 35.0].primary_error_db)
    groups = {f"{f:g} Hz": list(n) for f, n in zip(CROWD.frequencies_hz, study.threshold_n.T, strict=True)}
    tukey = {(pair.first, pair.second): pair.p for pair in compare_group_means(compute_one_way_anova(groups)).pairs}
    assert by_pair[45.0, 35.0].published_found == (tukey["35 Hz", "45 Hz"] < 0.05)
    assert by_pair[()].published_found == (tukey["5 Hz", "45 Hz"] < 0.05)


def test_a_difference_that_the_report_does_not_give_is_not_found():
    """Of two medians far above the cap; such studies without a difference counted as having found one."""
    crowd = Crowd((5.0, 45.0), (15.0, 15.0))
    found = compute_primary_analysis(simulate_study(crowd, RULE, 6, (1,)).answers, RULE.cap_n, declared_hz=(45.0, 5.0))
    assert found.far_above_hz == (5.0, 45.0) and found.declared_contrast is None
    verdict = judge_study(crowd, RULE, 6, (1,))
    assert not verdict.primary_found and not verdict.primary_covers


@pytest.mark.slow
def test_a_folder_goes_on_with_its_own_pair_alone(tmp_path):
    plan = PowerPlan(Crowd((5.0, 45.0), (0.7, 1.4)), RULE, (3,), 10, 3)

    def run(plan):
        with ThreadPoolExecutor(1) as pool:
            return simulate_power(plan, tmp_path, pool, lambda done: None)

    begun = run(plan)
    assert "contrast_hz" not in (tmp_path / PROGRESS_NAME).read_text("utf-8")
    assert run(replace(plan, contrast_hz=(45.0, 5.0))) == begun
    with pytest.raises(StudyError, match="another power simulation"):
        run(replace(plan, contrast_hz=(5.0, 45.0)))
    (tmp_path / PROGRESS_NAME).write_text("[1]\n", "utf-8")
    with pytest.raises(StudyError, match="another power simulation"):
        run(plan)


@pytest.mark.slow
def test_the_command_takes_the_contrast_of_the_protocol(tmp_path, capsys):
    text = PUBLISHED.replace("contrast_hz = []", "contrast_hz = [15.0, 25.0]")
    assert text != PUBLISHED
    (tmp_path / "mine.toml").write_text(text, "utf-8")
    out = tmp_path / "power"
    assert main(["power", "--subjects", "3", "--studies", "10", "--workers", "1", "--effect-db", "6", "--protocol",
                 str(tmp_path / "mine.toml"), "--out", str(out)]) == 0  # fmt: skip
    assert "Compared: 15 Hz minus 25 Hz, the declared contrast." in capsys.readouterr().out
    written = json.loads((out / RESULT_NAME).read_text("utf-8"))
    medians = dict(zip(*(written["plan"]["crowd"][key] for key in ("frequencies_hz", "medians_n")), strict=True))
    assert {f for f, n in medians.items() if n != 0.7} == {15.0}
    assert written["judged_hz"] == [15.0, 25.0]
