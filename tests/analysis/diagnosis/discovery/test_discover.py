"""Laws are found in simulated recordings, and none where nothing is missing. Compiles."""

from dataclasses import replace

import numpy as np
import pytest

from analysis.diagnosis.diagnose import diagnose
from analysis.diagnosis.diagnosis_settings import DiagnosisSettings
from analysis.diagnosis.discovery.add_laws import LawSearch
from analysis.diagnosis.discovery.beam import search_best_sums
from analysis.diagnosis.discovery.convert_sum import convert_sum_to_law, list_fitted_laws
from analysis.diagnosis.discovery.discover import discover_laws
from analysis.diagnosis.discovery.fit_sum import Sum
from analysis.diagnosis.discovery.grammar import Term
from analysis.diagnosis.discovery.matched_filter import build_views
from analysis.diagnosis.discovery.screen_terms import build_normal_equations
from analysis.diagnosis.discovery.snap_exponents import simplify_powers
from analysis.diagnosis.discovery.validation import NO_OTHER_EXCITATION
from analysis.diagnosis.discovery.view_terms import list_view_terms
from analysis.diagnosis.errors.hypothesis import NO_EFFECTS
from analysis.diagnosis.errors.output_error import evaluate_fit
from analysis.diagnosis.limits import SHUFFLED_RATIO
from analysis.diagnosis.result.wording import write_summary_lines
from analysis.diagnosis.search.verdict import SearchResult, judge
from analysis.diagnosis.search_by_simulation import has_discovered_law
from equalizer.effects.catalogue import CATALOGUE
from equalizer.laws.evaluate import evaluate
from tests.diagnosed import device
from tests.lawful import PLAN, arena_of, law, recorded
from tests.slow_instances import slow_rows

DRAG = law("-p0*abs(vx)**1.5*sign(vx)", 3.0)


def ignore_progress(said, share):
    pass


def always():
    return True


def search_for_laws(recording):
    context, known = arena_of(recording)
    found = discover_laws(context, known, ignore_progress, always)
    return None if found is None else list_fitted_laws(found.explanation.after.fitted.hypothesis)


@pytest.mark.parametrize("seed", [1])
@pytest.mark.parametrize(
    ("true", "shape"),
    [
        (DRAG, "p0*abs(vx)**1.5*sign(vx)"),
        pytest.param(law("-p0*x**3", 1e5), "p0*x**3", marks=pytest.mark.slow),
        pytest.param(law("p0*fx*sin(2*pi*x/p1)", 0.2, 0.013), "p0*fx*sin(2*pi*x/p1 + p2)", marks=pytest.mark.slow),
        # The fitted stretches travel 26.5 mm, at most 14 mm to one side: just one pitch.
        pytest.param(law("p0*fx*sin(2*pi*x/p1)", 0.3, 0.026), "p0*fx*sin(2*pi*x/p1 + p2)", marks=pytest.mark.slow),
        *slow_rows((law("p0*lag(x, p1)", 40.0, 0.05), "p0*lag(x, p1)")),
        (law("p0", 0.1), "p0"),
        *slow_rows(
            (law("-p0*x*ax", 5.0), "p0*x*ax"),
            (law("-p0*(x*ax + vx**2/2)", 5.0), "p0*(x*ax + vx**2/2)"),
            (law("-p0*(x**2*ax + x*vx**2)", 200.0), "p0*(x**2*ax + x*vx**2)"),
        ),
        (law("-p0*maximum(abs(fx) - p1, 0)*sign(fx)", 0.6, 1.7), "fx + p0*maximum(abs(fx) - p1, 0)*sign(fx)"),
    ],
)
def test_a_law_is_found_with_its_numbers(true, shape, seed):
    laws = search_for_laws(recorded((true,), seed))
    assert laws is not None
    assert laws[0].expression == shape
    sign = -1.0 if true.expression.startswith("-") else 1.0
    assert laws[0].numbers[0] == pytest.approx(sign * true.numbers[0], rel=0.05)
    assert laws[0].numbers[1 : len(true.numbers)] == pytest.approx(true.numbers[1:], rel=0.05)


@pytest.mark.slow
def test_an_attraction_is_found_where_the_axis_was(seed=5):
    """Its place and exponent are hardly known apart; its force is, within 5 %."""
    recording = recorded((law("p0*(1/abs(p1 - x)**2 - 1/p1**2)", 5e-4, 0.07),), seed)
    laws = search_for_laws(recording)
    assert laws is not None
    x = recording.position.samples[:, 0]
    true = 5e-4 * ((0.07 - x) ** -2 - 0.07**-2)
    found = evaluate(laws[0], {"x": x}, recording.position.sample_rate_hz)
    base = np.column_stack([x, np.ones_like(x)])  # of the spring's own
    apart = true - found - base @ np.linalg.lstsq(base, true - found, rcond=None)[0]
    assert laws[0].variables == ("x",)
    assert np.linalg.norm(apart) < 0.05 * np.linalg.norm(true - base @ np.linalg.lstsq(base, true, rcond=None)[0])


@pytest.mark.parametrize("seed", [3, 4])
def test_nothing_is_found_where_nothing_is_missing(seed):
    assert search_for_laws(recorded((), seed)) is None


@pytest.mark.slow
def test_ten_times_the_noise_leaves_the_law(seed=6):
    laws = search_for_laws(recorded((DRAG,), seed, noise=10.0))
    assert laws is not None
    assert "vx" in laws[0].variables


def search_any_law(recording):
    context, known = arena_of(recording)
    return LawSearch(ignore_progress, always).add_laws(SearchResult(context, known, judge(known)))


@pytest.mark.slow
def test_a_proved_law_explains(seed=7):
    seen = search_any_law(recorded((DRAG,), seed))
    assert seen.judgement.verdict == "explained"
    assert [claim.effect.name for claim in seen.found.after.fitted.hypothesis.claims] == ["discovered_law"]
    assert has_discovered_law(seen)
    assert "stronger commands and another kind of command" in seen.remarks[0]
    assert "Beyond vx = ±" in seen.remarks[0]


@pytest.mark.slow
def test_without_a_test_of_another_kind_a_law_is_a_candidate(seed=8):
    plan = (*PLAN[:3], ("multisine", 1.5, "test"))
    seen = search_any_law(recorded((DRAG,), seed, plan=plan))
    assert not seen.judgement.named
    law = list_fitted_laws(seen.unconfirmed[0].hypothesis)[0]
    assert law is not None
    assert "abs(vx)**1.5" in law.expression
    assert NO_OTHER_EXCITATION in seen.unconfirmed[0].why_not
    assert seen.unconfirmed[0].gain > 0.9


def test_a_shuffled_force_holds_no_law(seed=9):
    context, known = arena_of(recorded((DRAG,), seed))
    fitted = known.retuned.fitted
    view = build_views(
        context.measure, context.tuning, evaluate_fit(context.measure, context.tuning, fitted.deviations, NO_EFFECTS)
    )[0]
    found = search_best_sums(build_normal_equations(view), list_view_terms(view), always)
    best = found.sums[0]
    assert best.cross_validated_error / best.base_error < SHUFFLED_RATIO * (1 - found.chance_share)
    assert any("vx" not in each.variables for each in found.sums)  # the grammar without it was asked


def test_terms_begin_at_the_same_numbers_in_either_order_of_the_recordings(seed=9):
    context, known = arena_of(recorded((DRAG,), seed))
    fitted = evaluate_fit(context.measure, context.tuning, known.retuned.fitted.deviations, NO_EFFECTS)
    view = build_views(context.measure, context.tuning, fitted)[0]
    (record,) = view.records
    louder = {name: 2.0 * column for name, column in record.columns.items()}
    records = record, replace(record, columns=louder, missing_force=2.0 * record.missing_force)
    terms, reversed_terms = (list_view_terms(replace(view, records=order)) for order in (records, records[::-1]))
    assert terms == reversed_terms == list_view_terms(replace(view, records=records[1:]))


def test_axes_are_called_as_the_recording_does():
    """Its only axis is y: the grammar calls it x."""
    recording = recorded((), 3)
    named = replace(recording, command=replace(recording.command, channels=("fy",)))
    drag = Sum(0, (Term("abs(vx)*x*fx"),), (-2.0,), 1.0, 9.0, 0.0, ())
    law = convert_sum_to_law(drag, named)
    assert (law.axis, law.variables) == ("y", ("fy", "vy", "y"))


@pytest.mark.parametrize(
    ("written", "read"),
    [
        ("p0*abs(vx)**3*sign(vx)", "p0*vx**3"),
        ("p0*abs(x)**2*sign(x)", "p0*x*abs(x)"),
        ("p0*abs(x)**2*vx", "p0*x**2*vx"),
        ("p0*abs(vx)**1.5*sign(vx)", "p0*abs(vx)**1.5*sign(vx)"),
        ("p0*abs(x)**1*vx", "p0*abs(x)*vx"),
        ("p0*maximum(x - p1, 0)**1", "p0*maximum(x - p1, 0)"),
        ("p0*(1/abs(p1 - x)**1 - 1/p1**1)", "p0*(1/abs(p1 - x) - 1/p1)"),
        ("p0*x**15", "p0*x**15"),
    ],
)
def test_formulas_are_written_as_a_reader_would(written, read):
    assert simplify_powers(written) == read


@pytest.mark.slow
def test_a_diagnosis_says_the_law(seed=10):
    """The catalogue's own law is struck out: its formula is found."""
    recording = recorded((law("-p0*vx*abs(vx)", 5.0),), seed)
    without = tuple(effect.name for effect in CATALOGUE if effect.name not in ("amplifier_lag", "sensor_lag"))
    found = diagnose([recording], device(1), DiagnosisSettings(without=without, discovery=True), map, ignore_progress)
    law_found = found.diagnosis.effects[0].law
    assert found.diagnosis.verdict == "explained"
    assert law_found is not None
    assert law_found.variables == ("vx",)
    assert found.diagnosis.effects[0].parameters["p0"].value == pytest.approx(-5.0, rel=0.02)
    assert f"F = {law_found.expression} N" in " ".join(write_summary_lines(found))
