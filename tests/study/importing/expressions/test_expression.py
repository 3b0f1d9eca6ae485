from contextlib import suppress

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from study.importing.expressions.budget import Budget
from study.importing.expressions.expression import evaluate, find_names, quote_name
from study.importing.expressions.functions import FUNCTIONS
from study.importing.expressions.namespace import Namespace
from study.importing.map_format.map_errors import ImportProblemError
from tests.slow_instances import slow_rows

U = np.array([1.0, 2.0, 4.0, 8.0])


class Millisecond:
    def times_s(self, count):
        return np.arange(count) / 1000


def lookup(name):
    values = {"u": U, "table": np.arange(6.0).reshape(2, 3), "Force [N]": 10 * U, "gain": np.float64(3.0)}
    if name not in values:
        raise ImportProblemError(f"no {name}")
    return values[name]


def value(text):
    return evaluate(text, lookup, Millisecond(), Budget())


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("u", U),
        ("-u * gain + 1", -3 * U + 1),
        ("u ** 2 / 2 - u % 3", U**2 / 2 - U % 3),
        ("u - mean(u[:2])", U - 1.5),
        ("u[::-1]", U[::-1]),
        ("table[1]", [3, 4, 5]),
        ("table[:, -1]", [2, 5]),
        ("flatten(transpose(table))", [0, 3, 1, 4, 2, 5]),
        ("array('Force [N]') / 10", U),
        ("sin(pi / 2) + abs(-1)", 2.0),
        ("diff(u)", [0, 1, 2, 4]),
        ("cumsum(u)", [1, 3, 7, 15]),
        ("derivative(u) / 1000", [1, 1.5, 3, 4]),
        ("integral(u) * 1000", [0, 1.5, 4.5, 10.5]),
        ("u >= 2", [0, 1, 1, 1]),
        ("u[onset(u, 4)]", 8.0),
        ("repeat(u[:2], 2)", [1, 2, 1, 2]),
        ("clip(u, 2, 5)", [2, 2, 4, 5]),
        ("max(u) - min(u) + length(u) + sum(u) + median(u)", 7 + 4 + 15 + 3),
    ],
)
def test_arithmetic_over_arrays(text, expected):
    np.testing.assert_allclose(value(text), expected)


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("", "the expression is empty"),
        ("u +", "'u +' is not an expression"),
        ("x" * 3000, "3000 characters"),
        ("__import__('os').system('true')", "this is not understood: __import__('os').system('true')"),
        ("u.__class__", "this is not understood: u.__class__"),
        ("(lambda: 1)()", "this is not understood"),
        ("[x for x in u]", "this is not understood"),
        ("u if u else u", "this is not understood"),
        ("1 < u < 2", "this is not understood"),
        ("u and u", "this is not understood"),
        ("f'{u}'", "this is not understood"),
        ("True", "this is not understood: True"),
        ("9" * 400, "this is not understood"),
        ("'u'", "is a text, not numbers"),
        ("u + 'u'", "the text 'u' is found where numbers are needed"),
        ("meen(u)", "there is no function 'meen'; did you mean 'mean'"),
        ("mean(u, u)", "mean(x) was given 2 values"),
        ("mean(u, axis=0)", "this is not understood"),
        ("u + table", "shapes (4,) and (2, 3) cannot be combined"),
        ("u[7]", "the index is outside the shape (4,)"),
        ("u[0.5]", "an index is not a whole number"),
        ("u[u]", "an index is not a whole number"),
        ("array(u)", "takes one name in quotes"),
        ("repeat(u, 1000000000)", "more than 20000000 numbers"),
        ("onset(u * 0, 1)", "nothing leaves the mean of the first ten samples by more than 1"),
        ("diff(table)", "it needs an array of one dimension, not of shape (2, 3)"),
        ("-" * 300 + "u", "nested too deeply"),
        ("nothing", "no nothing"),
    ],
)
def test_other_expressions_are_refused_by_name(text, sentence):
    with pytest.raises(ImportProblemError) as refused:
        value(text)
    assert sentence in str(refused.value)


@settings(max_examples=200, deadline=None)
@given(st.text(alphabet="u0129.+-*/%()[]:,<>= '\"_xtabelmnsigrpf", max_size=24))
def test_no_text_does_anything_but_give_numbers_or_be_refused(text):
    with suppress(ImportProblemError):
        assert np.asarray(value(text)).dtype.kind in "fib"


def test_huge_powers_take_no_time():
    assert np.isinf(value("9 ** 9 ** 9 ** 9"))


def test_the_names_that_an_expression_needs_are_known():
    assert find_names("gain * (u - mean(array('Force [N]'))) + pi * clock_s") == {"gain", "u", "Force [N]"}


def test_every_function_says_how_it_is_used():
    assert all(function.usage.startswith(f"{name}(") and function.meaning for name, function in FUNCTIONS.items())


LONG = np.arange(100_000.0)


def of_definitions(text, definitions):
    return Namespace({"u": LONG, "empty": LONG[:0]}, definitions, "a.npz", Budget()).compute_value(text, Millisecond())


def chained(count, text):
    """a1 in terms of u, a2 in terms of a1, and so on."""
    return {f"a{k}": text.replace("?", f"a{k - 1}" if k > 1 else "u") for k in range(1, count + 1)}


@pytest.mark.timeout(60)
@pytest.mark.parametrize(
    ("text", "definitions", "sentence"),
    [
        ("a40", chained(40, "? + ?"), "takes too long"),
        ("a3000", chained(3000, "? + 1"), "nested too deeply"),
        ("a3000", chained(3000, "?"), "nested too deeply"),
        ("u[0/0]", {}, "an index is not a whole number"),
        ("u[1/0]", {}, "an index is not a whole number"),
        ("u[1e30]", {}, "the index is outside the shape (100000,)"),
        ("u[::0]", {}, "a step of 0 is not allowed"),
        ("repeat(u, empty)", {}, "repeat(x, times) fails"),
        ("repeat(empty, 1/0)", {}, "repeat(x, times) fails"),
        ("repeat(u, 0/0)", {}, "repeat(x, times) fails"),
        ("'u' * 3", {}, "the text 'u' is found where numbers are needed"),
        ("not " * 499 + "u", {}, "this is not understood: not not"),
        ("(" * 900 + "u" + ")" * 900, {}, "is not an expression"),
        ("u" + "[0:9]" * 300, {}, "nested too deeply"),
        ("u" + "+u" * 300, {}, "nested too deeply"),
        ("a1", {"a1": "a2", "a2": "a1 + u"}, "the definition of 'a1' refers to itself"),
        *slow_rows(
            ("a40", {**chained(40, "? + ?"), "a1": "1 + 1"}, "takes too long"),
            ("a40", {**chained(40, "max(?) * ?"), "a1": "1 + 1"}, "takes too long"),
            ("a40", chained(40, "repeat(?, 2)"), "would give more than 20000000 numbers"),
        ),
    ],
)
def test_what_costs_too_much_ends_with_a_named_error(text, definitions, sentence):
    with pytest.raises(ImportProblemError) as refused:
        of_definitions(text, definitions)
    assert sentence in str(refused.value)


@pytest.mark.timeout(60)
def test_an_outer_product_is_refused_before_it_is_made():
    space = Namespace({"c": np.zeros((40000, 1)), "r": np.zeros((1, 40000))}, {}, "a.npz", Budget())
    for text in ("c * r", "c < r", "clip(c, r, 1)", "c + r + r"):
        with pytest.raises(ImportProblemError, match="would give more than 20000000 numbers"):
            space.compute_value(text, Millisecond())


def test_arrays_that_wait_for_another_count_too():
    """Ten of these are held while the innermost is computed."""
    text = "(-u + " * 10 + "u" + ")" * 10
    small = Budget()
    np.testing.assert_array_equal(
        Namespace({"u": LONG}, {}, "a.npz", small).compute_value(text, Millisecond()), -9.0 * LONG
    )
    long = np.zeros(3_000_000)
    with pytest.raises(ImportProblemError, match="would give more than 20000000 numbers"):
        Namespace({"u": long}, {}, "a.npz", Budget()).compute_value(text, Millisecond())


def test_a_larger_file_may_cost_more():
    budget = Budget()
    budget.add_allowance(3_000_000)
    text = "(-u + " * 10 + "u" + ")" * 10
    Namespace({"u": np.zeros(3_000_000)}, {}, "a.npz", budget).compute_value(text, Millisecond())


@pytest.mark.parametrize("name", ["motor's state", "a\\b", 'say "no"', "in", "pi", "fx [N]", "force"])
def test_the_expression_for_an_array_names_it(name):
    assert find_names(quote_name(name)) == {name}
    space = Namespace({name: LONG}, {}, "a.npz", Budget())
    np.testing.assert_array_equal(space.compute_value(f"{quote_name(name)}[:2]", Millisecond()), LONG[:2])
