from dataclasses import replace

import numpy as np
import pytest

from analysis.diagnosis.balance.judge_laws import judge_laws, judge_structure
from analysis.diagnosis.balance.judged_law import NO_COLUMN
from analysis.diagnosis.balance.motion import compute_motions
from analysis.diagnosis.balance.structures import Structure, search_structures
from analysis.diagnosis.confirm.laws_for_simulation import judge_special_cases
from analysis.diagnosis.data.observed_parts import observe_parts
from analysis.diagnosis.document import Diagnosis, Errors, Estimate, Fit, Mismatch, NamedEffect
from analysis.diagnosis.errors.hypothesis import Claim
from analysis.diagnosis.result.candidates import add_balances_with_fitted_model, collect_balance_errors
from analysis.diagnosis.result.curves.state_maps import WITH_CANDIDATES, compute_state_maps
from analysis.diagnosis.search.time_budget import grant_time
from analysis.figures.diagnosis.state_maps import make_state_map_pictures
from equalizer.effects.catalogue import EFFECTS
from equalizer.signals.recording import Recording
from equalizer.signals.signal import Signal

RATE_HZ, MASS, DAMPING, LEVEL = 200.0, 2.0, 5.0, 3.0
PLACE = Mismatch("x", "force", (1.0, 2.0), 1.0, None, 0.8, 1e-9)
ERRORS = Errors(0.5, 0.36, 0.36, 0.02)
NOTHING = Diagnosis("unexplained", (PLACE,), (), {}, (), Fit(ERRORS, ERRORS), "predicted force", None)


def record_friction(level):
    """A mass with damping and dry friction, moved along three sines; the force is what that takes."""
    seconds = np.arange(8000) / RATE_HZ
    lines = [(0.05, 2 * np.pi * 0.31), (0.02, 2 * np.pi * 0.83), (0.008, 2 * np.pi * 1.7)]
    x = sum(size * np.sin(w * seconds) for size, w in lines)
    v = sum(size * w * np.cos(w * seconds) for size, w in lines)
    a = sum(-size * w**2 * np.sin(w * seconds) for size, w in lines)
    noise = np.random.default_rng(3).normal(0, [1e-6, 0.01], (len(x), 2))
    force = MASS * a + DAMPING * v + level * np.tanh(v / 1e-3)
    return Recording(
        "slide",
        Signal((force + noise[:, 1])[:, None], RATE_HZ, "force", "N", ("force",)),
        Signal((x + noise[:, 0])[:, None], RATE_HZ, "position", "m", ("x",)),
    )


def find_state_maps(level, without=frozenset()):
    recording = record_friction(level)
    motions = compute_motions(observe_parts((recording,), 1))
    balance = judge_laws(search_structures(motions, 0, False, without, grant_time))
    return balance, compute_state_maps(NOTHING, (balance,), (), recording), recording


@pytest.fixture(scope="module")
def friction_maps():
    return find_state_maps(LEVEL)


def find_view(maps, along):
    return next(view for view in maps.views if view.abscissa_name == along)


@pytest.mark.slow
def test_friction_shows_as_a_missing_force_that_turns_with_the_velocity(friction_maps):
    (maps,) = friction_maps[1]
    view = find_view(maps, "velocity")
    slow = np.abs(view.bin_abscissa) < 0.05
    assert view.mean[slow & (view.bin_abscissa < -0.005)].mean() > 0.3 * LEVEL
    assert view.mean[slow & (view.bin_abscissa > 0.005)].mean() < -0.3 * LEVEL
    assert np.sqrt(np.mean(view.mean_residual**2)) < 0.2 * np.sqrt(np.mean(view.mean**2))
    assert (maps.axis, maps.unit, view.unit, maps.completed) == ("force", "N", "m/s", WITH_CANDIDATES)


@pytest.mark.slow
def test_without_friction_nothing_stands_out():
    (maps,) = find_state_maps(0.0)[1]
    assert maps.share < 0.05
    assert np.abs(find_view(maps, "velocity").mean).max() < 0.1 * LEVEL


def test_a_loop_follows_the_measured_force_with_the_completed_law(friction_maps):
    (maps,) = friction_maps[1]
    loop = maps.loops[0]
    far, near = (np.sqrt(np.mean((each - loop.measured) ** 2)) for each in (loop.model_force, loop.completed_force))
    assert near < 0.4 * far
    assert np.ptp(loop.abscissa) > 0.09


@pytest.mark.slow
def test_what_nothing_completes_has_no_second_course():
    catalogue = frozenset({"coulomb_friction"})
    balance, _, recording = find_state_maps(LEVEL, catalogue)
    bare = replace(balance, laws=(), further_laws=())
    (maps,) = compute_state_maps(NOTHING, (bare,), (), recording)
    assert maps.completed == ""
    assert all(not len(view.mean_residual) for view in maps.views)
    assert not len(maps.loops[0].completed_force)
    assert "Blue" not in make_state_map_pictures((maps,))[0].caption


def test_how_far_names_reach_is_measured_on_held_out_blocks(friction_maps):
    balance, _, recording = friction_maps
    (reached,) = collect_balance_errors(NOTHING, (balance,), recording.command.channels)
    assert reached.named_error == pytest.approx(reached.linear_error)
    assert reached.share == pytest.approx(0.0, abs=1e-6)
    assert reached.all_laws_error < 0.3 * reached.linear_error


@pytest.mark.parametrize("preferred", ["coulomb_friction", "presliding_hysteresis"])
def test_what_a_simulation_prefers_to_a_law_of_the_balance_has_its_errors_and_its_share(friction_maps, preferred):
    """The balance chose presliding friction; the simulation preferred its special case, or kept it."""
    balance, _, recording = friction_maps
    search = balance.search
    effects = [law.effect for law in search.regression.laws]
    refined = (effects.index("presliding_hysteresis"),)
    errors = search.regression.cross_validate(search.regression.select_columns(refined))
    bent = judge_structure(search, Structure(refined, errors))
    (kept,) = judge_special_cases((bent,), [Claim(EFFECTS[preferred], "one", (0,))])
    assert (kept is bent) == (preferred == "presliding_hysteresis")

    effect = NamedEffect(preferred, "mechanism", "force", 0.1, 0.1, {"level": Estimate(LEVEL, "N")})
    named = replace(NOTHING, verdict="partly_explained", effects=(effect,), remainder=(PLACE,))
    (reached,) = collect_balance_errors(named, (kept,), recording.command.channels)
    assert reached.has_named_law
    assert reached.named_error < 0.5 * reached.linear_error
    (told,) = add_balances_with_fitted_model(named, (kept,), recording.command.channels).effects
    assert told.share > 0.5
    assert [law.law.effect for law in judge_special_cases((bent,), [])[0].laws] == ["presliding_hysteresis"]


def test_what_else_was_judged_is_kept_where_a_special_case_takes_the_place_of_a_law(friction_maps):
    """Reasons not to name other laws, laws of the command, and the error of the linear balance before them."""
    search = friction_maps[0].search
    effects = [law.effect for law in search.regression.laws]
    pair = (effects.index("presliding_hysteresis"), effects.index("hardening_stiffness"))
    errors = search.regression.cross_validate(search.regression.select_columns(pair))
    bent = judge_structure(search, Structure(pair, errors))
    told = {law.law.effect: law for law in bent.laws}
    doubted = replace(told["hardening_stiffness"], objection="in doubt")
    of_command = replace(told["hardening_stiffness"], law_index=NO_COLUMN, gain=0.3, objection="small")
    given = replace(
        bent,
        laws=(replace(told["presliding_hysteresis"], objection=""), doubted),
        further_laws=(of_command,),
        linear_error=0.77,
    )
    claims = [Claim(EFFECTS["coulomb_friction"], "one", (0,))]
    (kept,) = judge_special_cases((given,), claims)
    assert {law.law.effect: law.objection for law in kept.laws} == {
        "coulomb_friction": "", "hardening_stiffness": "in doubt",
    }  # fmt: skip
    assert [law for law in kept.further_laws if not law.has_column] == [of_command]
    assert kept.linear_error == 0.77
    # A law that is not named is not simulated, so that nothing was preferred to it.
    unnamed = given.withdraw_names("in doubt")
    assert judge_special_cases((unnamed,), claims)[0] is unnamed


def test_states_and_loops_are_drawn_with_plain_units(friction_maps):
    states, loops = make_state_map_pictures(friction_maps[1])
    labels = [axes.get_xlabel() for axes in states.figure.axes]
    assert labels == ["Position (mm)", "Velocity (mm/s)", "Command (N)", "Time (s)"]
    assert "Against velocity: mean missing force from −" in states.alternative.replace("-", "−")
    assert [axes.get_xlabel() for axes in loops.figure.axes] == ["Position (mm)", "Velocity (mm/s)"]
    assert make_state_map_pictures(()) == ()


def test_what_stands_in_a_class_is_no_candidate_beside_it(friction_maps):
    balance, _, recording = friction_maps
    (weighed, *_) = balance.laws
    level = {name: Estimate(value, "N") for name, value in weighed.values.items()}
    effect = NamedEffect(weighed.law.effect, "mechanism", "force", 0.9, 0.9, level)
    named = replace(NOTHING, verdict="partly_explained", effects=(effect,), remainder=(PLACE,))
    alike = replace(
        balance,
        laws=(replace(weighed, equivalents=("stribeck_friction",)),),
        further_laws=(weighed, _make_rival(weighed)),
    )
    found = add_balances_with_fitted_model(named, (alike,), recording.command.channels)
    assert found.effects[0].class_ == ()  # it only refines the named law, and is no candidate either
    assert found.candidates == ()
    apart = replace(balance, laws=(replace(weighed, equivalents=()),), further_laws=(_make_rival(weighed),))
    assert [
        candidate.effect
        for candidate in add_balances_with_fitted_model(named, (apart,), recording.command.channels).candidates
    ] == ["stribeck_friction"]


def test_a_law_that_leaves_a_remainder_explains_less_than_all(friction_maps):
    """It takes all that all laws together take; these leave half of the linear model's error."""
    balance, _, recording = friction_maps
    (weighed, *_) = balance.laws
    level = {name: Estimate(value, "N") for name, value in weighed.values.items()}
    effect = NamedEffect(weighed.law.effect, "mechanism", "force", 0.9, 0.9, level)
    named = replace(NOTHING, verdict="partly_explained", effects=(effect,), remainder=(PLACE,))
    half = replace(balance, laws=(replace(weighed, share=1.0),), linear_error=0.2, error=0.1, all_laws_error=0.1)
    assert add_balances_with_fitted_model(named, (half,), recording.command.channels).effects[0].share == pytest.approx(
        0.75
    )
    whole = replace(half, all_laws_error=0.0)
    assert add_balances_with_fitted_model(named, (whole,), recording.command.channels).effects[
        0
    ].share == pytest.approx(1.0)


def _make_rival(weighed):
    return replace(weighed, law=replace(weighed.law, effect="stribeck_friction"), objection="too little")
