"""Blocks' products against plain least squares on all samples."""

from dataclasses import replace

import numpy as np
import pytest

from analysis.diagnosis.balance import structures
from analysis.diagnosis.balance.blocks import solve_ridge
from analysis.diagnosis.balance.change_laws import copy_columns, keep_laws, overwrite_law, try_law
from analysis.diagnosis.balance.given_model_base import GivenModelBase
from analysis.diagnosis.balance.laws.law import Law, name_weights
from analysis.diagnosis.balance.motion import compute_motions
from analysis.diagnosis.balance.regression import MOST_RIDGE_FOLDS, build_regression, fit_all_laws, make_law_columns
from analysis.diagnosis.balance.structures import Structure, improves_significantly, search_structures
from analysis.diagnosis.data.observed_parts import observe_parts
from analysis.diagnosis.limits import BALANCE_FOLDS

RATE_HZ, COUNT = 500.0, 6000
SCALE = Law("scale", 0, (1.0,), lambda m, n: np.tanh(m.velocity[:, :1] / n[0]), name_weights("level"))
CUBE = Law("cube", 0, (), lambda m, _: m.position[:, :1] ** 3, name_weights("k3"))
PAIR = Law(
    "pair", 0, (), lambda m, _: np.hstack([np.sin(9 * m.position), np.cos(9 * m.position)]), name_weights("a", "b")
)


@pytest.fixture
def regression(record_samples):
    """Of a force that the laws make in part, with noise; two records."""
    records = []
    for seed in (1, 2):
        random = np.random.default_rng(seed)
        t = np.arange(COUNT) / RATE_HZ
        q = sum(a * np.sin(2 * np.pi * f * t + random.uniform(0, 6)) for f, a in ((0.7, 0.5), (2.3, 0.2), (5.1, 0.05)))
        force = 0.4 * np.gradient(np.gradient(q)) * RATE_HZ**2 + 3.0 * np.gradient(q) * RATE_HZ + 40 * q + 30 * q**3
        force += 5 * np.tanh(np.gradient(q) * RATE_HZ) + random.standard_normal(COUNT)
        records.append(record_samples(force[:, None], q[:, None], RATE_HZ))
    motions = compute_motions(observe_parts(records, 1))
    return build_regression(motions, 0, (SCALE, CUBE, PAIR), turns_freely=False)


def stack_blocks(regression, columns, blocks):
    rows = [regression.columns[b.motion_index][b.rows][:, columns] for b in blocks]
    return np.vstack(rows), np.concatenate([regression.force[b.motion_index][b.rows] for b in blocks])


def solve_blocks(regression, columns, blocks):
    x, y = stack_blocks(regression, columns, blocks)
    size = np.linalg.norm(x, axis=0)
    return np.linalg.lstsq(x / size, y, rcond=None)[0] / size


def residual_energy(regression, columns, weights, block):
    x, y = stack_blocks(regression, columns, [block])
    return float(np.sum((y - x @ weights) ** 2))


def test_weights_are_those_of_least_squares(regression):
    columns = regression.select_columns((0, 1))
    assert regression.fit_weights(columns) == pytest.approx(solve_blocks(regression, columns, regression.fit), rel=1e-4)
    assert regression.fit_weights(columns)[-1] == pytest.approx(30, rel=0.2)


def test_a_folds_error_is_that_of_numbers_fitted_to_all_others(regression):
    columns = regression.select_columns((1,))
    found = regression.cross_validate(columns)
    for number, block in enumerate(regression.fit):
        others = [other for other in regression.fit if other is not block]
        assert found[number] == pytest.approx(
            residual_energy(regression, columns, solve_blocks(regression, columns, others), block)
        )
    own = [
        residual_energy(regression, columns, solve_blocks(regression, columns, regression.fit), block)
        for block in regression.fit
    ]
    assert found.sum() > sum(own)
    sums = [regression.select_columns(laws) for laws in ((1,), (2,), (0, 1), (0,))] * 7  # of three lengths
    for selection, errors in zip(sums, regression.cross_validate_each(sums), strict=True):
        assert errors.tolist() == regression.cross_validate(selection).tolist()


def test_held_out_errors_are_of_samples_that_nothing_was_fitted_to(regression):
    columns = regression.select_columns((0, 2))
    truth = [
        residual_energy(regression, columns, solve_blocks(regression, columns, regression.fit), b)
        for b in regression.test
    ]
    assert regression.compute_test_errors(columns) == pytest.approx(truth, rel=1e-4)
    rows = {(b.motion_index, k) for b in regression.fit for k in b.rows.tolist()}
    assert not rows & {(b.motion_index, k) for b in regression.test for k in b.rows.tolist()}
    assert len(regression.fit) >= BALANCE_FOLDS


def test_a_law_in_anothers_place_gives_what_a_new_regression_would(regression):
    wider = replace(SCALE, numbers=(0.2,))
    before = regression.cross_validate(regression.select_columns((0,)))
    changed = overwrite_law(copy_columns(regression), 0, wider)
    tried = try_law(regression, 0, wider)
    anew = build_regression(regression.motions, 0, (wider, CUBE, PAIR), turns_freely=False)
    for laws in ((0,), (0, 1, 2)):
        columns = anew.select_columns(laws)
        assert changed.cross_validate(columns) == pytest.approx(anew.cross_validate(columns))
        assert changed.compute_test_errors(columns) == pytest.approx(anew.compute_test_errors(columns))
        assert changed.fit_weights(columns) == pytest.approx(anew.fit_weights(columns))
        assert tried.cross_validate(columns).tolist() == changed.cross_validate(columns).tolist()
        assert np.vstack(changed.compute_residuals(columns)) == pytest.approx(
            np.vstack(anew.compute_residuals(columns))
        )
    assert regression.cross_validate(regression.select_columns((0,))).tolist() == before.tolist()
    assert changed.cross_validate(changed.select_columns((0,))).sum() != pytest.approx(
        regression.cross_validate(anew.select_columns((0,))).sum()
    )
    assert overwrite_law(copy_columns(regression), 0, PAIR) is None
    assert try_law(regression, 0, replace(SCALE, make_columns=lambda m, n: 0 * m.velocity[:, :1])) is None


def test_some_laws_alone_leave_what_they_leave_among_the_others(regression):
    alone = keep_laws(regression, (2, 0))
    assert [law.effect for law in alone.laws] == ["pair", "scale"]
    assert alone.cross_validate(alone.select_columns((0, 1))) == pytest.approx(
        regression.cross_validate(regression.select_columns((2, 0)))
    )
    assert alone.compute_test_errors(alone.select_columns((1,))) == pytest.approx(
        regression.compute_test_errors(regression.select_columns((0,)))
    )


def test_all_laws_together_leave_no_more_than_the_truth_and_noise_alone_stays(regression):
    everything = range(regression.columns[0].shape[1])
    crossed, tested = fit_all_laws(regression, everything)
    truth = regression.cross_validate(regression.select_columns((0, 1))).sum()
    assert crossed == pytest.approx(truth, rel=0.05)
    assert crossed < 0.7 * regression.cross_validate(regression.select_columns(())).sum()
    assert tested.shape == (len(regression.test),)


def test_hundreds_of_short_parts_are_merged_to_a_few_folds(regression, monkeypatch):
    everything, fold_counts = range(regression.columns[0].shape[1]), []

    def count_folds(products, ridge, is_base):
        fold_counts.append(len(np.atleast_2d(products[1])))
        return solve_ridge(products, ridge, is_base)

    monkeypatch.setattr("analysis.diagnosis.balance.regression.solve_ridge", count_folds)
    error, tested = fit_all_laws(regression, everything)
    repeated_error, repeated_tested = fit_all_laws(replace(regression, fit=regression.fit * 20), everything)
    assert max(fold_counts) <= MOST_RIDGE_FOLDS < 20 * len(regression.fit)
    assert repeated_error == pytest.approx(20 * error, rel=0.05)
    assert repeated_tested == pytest.approx(tested, rel=1e-3)


def test_columns_of_parts_of_one_length_are_those_of_each_part(regression):
    motions = [*regression.motions, replace(regression.motions[0], force=2 * regression.motions[0].force)]
    for columns, motion in zip(make_law_columns(motions, PAIR), motions, strict=True):
        np.testing.assert_array_equal(columns, motion.decimate(PAIR.make_columns(motion, ())))


def test_without_time_left_only_the_base_is_fitted(regression):
    search = search_structures(regression.motions, 0, False, frozenset(), lambda: False)
    assert not search.complete and search.regression.laws == () and search.best.laws == ()


@pytest.mark.parametrize("is_left", [True, False])
def test_a_given_model_that_no_law_improves_ends_the_search_which_is_complete_only_with_time(
    regression, monkeypatch, is_left
):
    monkeypatch.setattr(structures, "build_regression_with_model", lambda *given: regression)
    monkeypatch.setattr(structures, "can_laws_explain", lambda *given: False)
    base = GivenModelBase(**dict.fromkeys(GivenModelBase.__dataclass_fields__))
    search = search_structures(regression.motions, 0, False, frozenset(), lambda: is_left, base)
    assert search.complete is is_left and search.best.laws == ()


def test_an_axis_has_no_mass_and_no_damping_below_zero(regression):
    turned = replace(
        regression, force=tuple(-f for f in regression.force),
        fit=tuple(replace(b, cross=-b.cross) for b in regression.fit),
    )  # fmt: skip
    columns = turned.select_columns(())
    assert solve_blocks(turned, columns, turned.fit)[1] < 0
    assert (turned.fit_weights(columns)[:2] >= 0).all()


def test_columns_that_are_nothing_in_all_blocks_but_one_give_finite_errors(regression):
    """The rest of the sum is then the rounding of a difference."""
    last = Law(
        "late", 0, (), lambda m, _: (np.arange(len(m.force))[:, None] > 4300) * 1e6 * m.position, name_weights("k")
    )
    late = build_regression(regression.motions[:1], 0, (last,), turns_freely=False)
    found = late.cross_validate(late.select_columns((0,)))
    assert np.isfinite(found).all()
    assert found.sum() < 3 * late.cross_validate(late.select_columns(())).sum()


def test_laws_are_worth_it_where_the_folds_agree():
    plain = np.array([0.6, 0.05, 0.04, 0.1, 0.03, 0.02, 0.08, 0.08])
    swing = Structure((0,), plain / 20)
    luck = Structure((0,), plain * np.array([0.5, 1.1, 1.2, 1.1, 1.05, 1.3, 1.1, 1.2]))
    assert improves_significantly(Structure((), plain), swing)
    assert not improves_significantly(Structure((), plain), luck)
    assert not improves_significantly(Structure((), plain), Structure((0,), 0.99 * plain))


def test_a_gain_where_a_stop_is_met_counts_though_the_other_folds_gain_nothing():
    rng = np.random.default_rng(4)
    plain = rng.uniform(0.9, 1.1, 15)
    plain[[2, 7, 12]] = 40.0
    met, once = plain * rng.uniform(0.9, 1.1, 15), plain * rng.uniform(0.9, 1.1, 15)
    met[[2, 7, 12]] = 5.0
    once[2] = 5.0
    assert improves_significantly(Structure((), plain), Structure((0,), met))
    assert not improves_significantly(Structure((), plain), Structure((0,), once))


def record_driven_axis(record_samples, axis, coupling, offset, noise):
    """Of two bodies of 0.25 kg on springs, of which only one is driven, as accelerometers see them; a body that the
    spring between them does not move reads exactly `offset`."""
    random, omega = np.random.default_rng(axis), 2 * np.pi * np.arange(3.1, 60, 4)
    stiffness = 900 * np.eye(2) + coupling * (1 - np.eye(2))
    force = np.zeros((len(omega), 2), dtype=complex)
    force[:, axis] = np.exp(1j * random.uniform(0, 6, len(omega)))
    impedance = stiffness + ((1.2j * omega - 0.25 * omega**2)[:, None, None]) * np.eye(2)
    acceleration = -(omega[:, None] ** 2) * np.linalg.solve(impedance, force[..., None])[..., 0]
    turns = np.exp(1j * np.outer(np.arange(COUNT) / RATE_HZ, omega))
    read = (turns @ acceleration).real
    read = read + noise * read.std(axis=0) * random.standard_normal(read.shape) + offset
    return record_samples((turns @ force).real, read, RATE_HZ, "acceleration")


@pytest.mark.parametrize(
    ("coupling", "offset", "noise"), [(0.0, 0.0, 0.01), (0.0, 9.81, 0.01), (150.0, 0.0, 0.01), (150.0, 0.0, 0.0)]
)
def test_axes_that_are_driven_in_turn_are_coupled_by_their_spring_only(record_samples, coupling, offset, noise):
    records = [record_driven_axis(record_samples, axis, coupling, offset, noise) for axis in (0, 1)]
    motions = compute_motions(observe_parts(records, 2))
    for axis in (0, 1):
        regression = build_regression(motions, axis, (), turns_freely=False)
        weights = regression.fit_weights(regression.select_columns(()))[:6].reshape(3, 2)
        mass, damping, stiffness = weights[:, [axis, 1 - axis]]
        assert mass == pytest.approx([0.25, 0.0], abs=0.01)
        assert damping == pytest.approx([1.2, 0.0], abs=0.05)
        assert stiffness == pytest.approx([900.0, coupling], abs=40.0)
