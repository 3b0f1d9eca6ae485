"""Psi on simulated people, and rules compared on the same people: recovery, ends, guessers, and the command."""

import json
from dataclasses import asdict, replace

import numpy as np
import pytest
from typer.testing import CliRunner

from analysis.psychophysics.power.compare_rules import compare_rules, list_compared_rules, simulate_person
from analysis.psychophysics.power.simulated_study import Crowd
from analysis.psychophysics.thresholds import compute_thresholds
from protocols.definition.staircase_rule import BayesianPlacement
from protocols.document.dumping import dump_protocol
from protocols.procedure.psi import compute_posterior, estimate_threshold
from protocols.procedure.staircase import is_complete, is_finished, step, to_db
from study.cli.main import app
from study.cli.power import _print_comparison
from study.store.formats.protocol_files import read_study_protocol
from tests.analysis.conftest import GUESSER, PUBLISHED

CAP_DB = to_db(3.0)
RULE = replace(PUBLISHED, bayesian=BayesianPlacement(trials=40))


def test_a_run_ends_by_trials_or_once_its_threshold_is_known_so_well():
    early = replace(RULE, bayesian=BayesianPlacement(trials=200, spread_db=2.0))
    _, state, _ = simulate_person(Crowd((5.0,), (0.6,)), early, (3,))
    assert 10 < state.trials < 200 and state.spread_db <= 2.0
    with pytest.raises(ValueError, match="finished"):
        step(early, state, True)
    _, state, _ = simulate_person(Crowd((5.0,), (0.6,)), RULE, (3,))
    assert state.trials == 40
    limited = replace(RULE, trial_limit=20)
    _, state, _ = simulate_person(Crowd((5.0,), (0.6,)), limited, (3,))
    assert is_finished(limited, state) and not is_complete(limited, state)


def test_who_guesses_is_said_to_be_above_the_cap_and_who_is_sure_is_not():
    _, guessing, _ = simulate_person(Crowd((5.0,), (1e3,), person_sd_db=0.0, frequency_sd_db=0.0), RULE, (4,))
    assert estimate_threshold(compute_posterior(guessing.answered, CAP_DB), CAP_DB).above_cap > 0.5
    _, sure, _ = simulate_person(Crowd((5.0,), (0.3,), person_sd_db=0.0, frequency_sd_db=0.0), RULE, (4,))
    assert estimate_threshold(compute_posterior(sure.answered, CAP_DB), CAP_DB).above_cap < 0.01


@pytest.mark.slow
def test_thresholds_are_recovered_with_a_smaller_error_per_trial_than_by_the_staircase():
    crowd = Crowd((5.0,), (2.0,))
    rules = {name: rule for name, rule in list_compared_rules(PUBLISHED).items() if name in RULES}
    staircase, psi = compare_rules(crowd, rules, 40, 1)
    assert abs(psi.bias_db) < 0.9 and psi.sd_db < 2.5 and psi.runs == 40  # three standard errors of 0.3 dB
    assert staircase.error_per_trial_db > psi.error_per_trial_db > 0
    assert psi.highest_n <= 3.0


def test_a_spread_may_be_a_whole_number():
    assert simulate_person(Crowd((5.0,), (0.6,), frequency_sd_db=2), RULE, (3,)) == simulate_person(
        Crowd((5.0,), (0.6,), frequency_sd_db=2.0), RULE, (3,)
    )


RULES = ("staircase, new step after the reversal", "Psi, 60 trials")


@pytest.mark.slow
def test_the_same_seed_compares_the_same_people():
    rules = {"a": PUBLISHED, "b": PUBLISHED, "c": RULE}
    one, other, psi = compare_rules(Crowd((5.0,), (0.7,)), rules, 10, 3)
    assert replace(one, rule="") == replace(other, rule="")
    assert compare_rules(Crowd((5.0,), (0.7,)), {"c": RULE}, 10, 3) == (psi,)


@pytest.mark.parametrize("change", [{"initial_one_up_one_down": True}, {"trial_limit": 15}])
def test_what_a_protocol_sets_for_its_staircase_does_not_hold_for_psi(change):
    """The first was a traceback; the second stopped every run of Psi, and NaN is no JSON."""
    rules = list_compared_rules(replace(PUBLISHED, **change))
    staircase, psi = compare_rules(
        Crowd((5.0,), (0.7,)), {name: rules[name] for name in (RULES[0], "Psi, 30 trials")}, 2, 3
    )
    assert (psi.runs, psi.trials) == (2, 30.0) and psi.error_db > 0
    stopped = "trial_limit" in change
    assert staircase.runs == (0 if stopped else 2)
    assert (staircase.error_db is None) == (staircase.bias_db is None) == stopped
    assert json.loads(json.dumps(asdict(staircase), allow_nan=False))["runs"] == staircase.runs


def test_the_table_names_runs_without_an_end_and_keeps_its_columns(capsys):
    """There is no trial limit: far below the threshold, nine right answers in a row hardly occur."""
    _print_comparison(Crowd((5.0,), (9.0,)), replace(PUBLISHED, down_after_right=9), 1, 1, False)
    lines = capsys.readouterr().out.splitlines()
    assert len({len(line) for line in lines[1:6]}) == 1
    assert "or without an end in 2000 trials, have no threshold and no error: 1 (staircase, new step after" in lines[7]


def test_sessions_analyse_such_runs(simulate):
    def found(true_n, seed):
        (row,) = compute_thresholds(simulate(true_n, np.random.default_rng(seed), rule=RULE), RULE)
        return row

    below, guesser = found(0.6, 1), found(GUESSER, 2)
    assert below.complete and not below.censored and below.reversals == 0 and below.trials == 40
    assert below.threshold_n == pytest.approx(0.6, rel=0.5)
    assert below.threshold_mps2 == pytest.approx(4.0 * below.threshold_n)
    assert guesser.censored and guesser.threshold_n <= 3.0


@pytest.mark.slow
def test_the_command_prints_each_rule_and_simulates_whole_studies_by_psi(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    told = CliRunner().invoke(app, ["power", "--compare", "--studies", "10", "--json"])
    assert [row["rule"] for row in json.loads(told.stdout)][-1] == "Psi, 60 trials"
    assert not list(tmp_path.iterdir())
    text = dump_protocol(replace(protocol := read_study_protocol("direction_threshold").protocol, staircase=RULE))
    (tmp_path / "mine.toml").write_text(text.replace(f'name = "{protocol.name}"', 'name = "mine"'))
    whole = CliRunner().invoke(app, ["power", "--protocol", "mine.toml", "--studies", "10", "--subjects", "3"])
    assert whole.exit_code == 0, whole.output
    assert "Psi's posterior means, paired" in whole.stdout and "reversal" not in whole.stdout
    (point,) = json.loads((tmp_path / "power" / "power.json").read_text())["points"]
    assert point["trials_per_person"] == 5 * 40
