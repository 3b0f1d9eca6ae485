"""What the language of laws holds, what it refuses and in which words, and that a law is written as it is read."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from equalizer.laws.evaluate import evaluate
from equalizer.laws.law import Law, parse_law
from equalizer.laws.parse import LawError, parse_formula
from equalizer.laws.tree import Apply, FreeParameter, Node, Number, Variable, format_formula


def test_numbers_with_a_point_are_free_and_whole_ones_are_form():
    law = parse_law("-4.1*abs(vy)**1.5*sign(vy) + 2*vy**3", "force", "y")
    assert law.expression == "-p0*abs(vy)**p1*sign(vy) + 2*vy**3"
    assert law.numbers == (4.1, 1.5)
    assert law.variables == ("vy",)
    assert law.text == "-4.1*abs(vy)**1.5*sign(vy) + 2*vy**3"


def test_the_text_has_five_digits_and_the_exact_text_all():
    law = parse_law("0.123456789*x", "force", "x")
    assert law.text == "0.12346*x"
    assert parse_law(law.exact_text, "force", "x") == law


def test_exponents_are_free_or_part_of_the_form():
    law = parse_law("-4.1*abs(vy)**1.5*sign(vy) - 0.1*y**2 + 3.0**(2*t)", "force", "y")
    assert law.exponents == (1.5, 2.0)


def test_other_numbers_keep_their_sign_where_they_stand():
    law = Law("p0*x - p1*vx**2 + x**p2 + p3**2", (-1.0, -2.0, -0.5, -3.0), (), "force", "x")
    assert law.text == "-1.0*x + 2.0*vx**2 + x**-0.5 + (-3.0)**2"
    columns = {"x": np.array([2.0]), "vx": np.array([0.5])}
    expected = -2.0 + 2.0 * 0.25 + 2.0**-0.5 + 9.0
    assert evaluate(law, columns, 1000.0) == pytest.approx([expected])
    assert evaluate(parse_law(law.text, "force", "x"), columns, 1000.0) == pytest.approx([expected])


LEAVES = st.one_of(
    st.sampled_from(["x", "vy", "fz"]).map(Variable),
    st.integers(0, 9).map(lambda value: Number(float(value))),
    st.integers(0, 2).map(FreeParameter),
)
SMOOTH = ("sin", "cos", "tanh", "atan", "abs", "neg", "exp", "sign", "sqrt", "log", "tan")


def _grown(parts: st.SearchStrategy[Node]) -> st.SearchStrategy[Node]:
    one = st.builds(lambda name, part: Apply(name, (part,)), st.sampled_from(SMOOTH), parts)
    names = ["+", "-", "*", "/", "**", "minimum", "maximum"]
    two = st.builds(lambda name, left, right: Apply(name, (left, right)), st.sampled_from(names), parts, parts)
    return one | two


TREES = st.recursive(LEAVES, _grown, max_leaves=12)
NUMBERS = st.lists(st.floats(-9.0, 9.0).filter(lambda value: abs(value) > 1e-3), min_size=3, max_size=3)
COLUMNS = {"x": np.linspace(-2, 2, 17), "vy": np.cos(np.arange(17.0)), "fz": np.linspace(3, 0.1, 17) ** 2}
NUMPY = {
    "+": np.add, "-": np.subtract, "*": np.multiply, "/": np.divide, "**": np.power, "neg": np.negative,
    "minimum": np.minimum, "maximum": np.maximum, "abs": np.abs, "sign": np.sign, "atan": np.arctan,
    "sin": np.sin, "cos": np.cos, "tan": np.tan, "exp": np.exp, "log": np.log, "sqrt": np.sqrt, "tanh": np.tanh,
}  # fmt: skip


def by_numpy(tree: Node, numbers: list[float]) -> np.ndarray:
    match tree:
        case Number(value):
            return np.full(17, value)
        case FreeParameter(place):
            return np.full(17, numbers[place])
        case Variable(name):
            return COLUMNS[name]
    return NUMPY[tree.name](*(by_numpy(part, numbers) for part in tree.arguments))


def law_with(tree: Node, numbers: list[float]) -> Law:
    """With every number used, for any tree."""
    for place in range(3):
        tree = Apply("+", (tree, Apply("*", (Number(0.0), FreeParameter(place)))))
    return Law(format_formula(tree), tuple(numbers), (), "force", "x")


@pytest.mark.slow
@given(TREES, NUMBERS)
@settings(max_examples=150, deadline=None)
def test_random_formulas_give_what_numpy_gives(tree: Node, numbers: list[float]):
    with np.errstate(all="ignore"):
        expected = by_numpy(tree, numbers)
        found = evaluate(law_with(tree, numbers), COLUMNS, 1000.0)
    close = np.isclose(found, expected, rtol=1e-9, atol=1e-12)
    same = close | (np.isnan(found) & np.isnan(expected)) | (found == expected)
    assert same.all() or not np.isfinite(expected).all() or np.abs(expected).max() > 1e12


@given(TREES, NUMBERS)
@settings(max_examples=150, deadline=None)
def test_a_formula_is_read_as_it_was_written(tree: Node, numbers: list[float]):
    again, _ = parse_formula(format_formula(tree), template=True)
    assert format_formula(again) == format_formula(tree)
    with np.errstate(all="ignore"):
        expected, found = by_numpy(tree, numbers), by_numpy(again, numbers)
    assert np.array_equal(found, expected, equal_nan=True)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "the law is empty"),
        ("vy.real", "'vy.real' at character 1 is not part of the language of laws; allowed are numbers, signals"),
        ("x + sinn(x)", "'sinn(x)' at character 5: there is no function 'sinn' (did you mean 'sin'?)"),
        ("__import__('os')", "there is no function '__import__'"),
        ("sin(x, y)", "sin takes 1 argument, not 2"),
        ("lag(x, tau_s=0.1)", "'lag(x, tau_s=0.1)' at character 1 is not part of the language"),
        ("2*lag(x, vy)", "'vy' at character 10: the second argument of lag must be a constant"),
        ("x if y else z", "is not part of the language"),
        ("p0*x", "'p0' at character 1 stands for a free number; write the number itself"),
        ("x*", "cannot be read"),
        ("2.0*sin", "'sin' at character 5 is a function; it takes its arguments in parentheses"),
        ("1e999*x", "'1e999' at character 1 is larger than any number"),
        ("é*foo(x)", "'foo(x)' at character 3"),
        ("x" + " + x" * 150, "the law has more than 200 parts"),
        ("x" * 2001, "the law has 2001 characters; up to 2000 are read"),
        ("(" * 500 + "x" + ")" * 500, "cannot be read"),
    ],
)
def test_what_is_not_in_the_language_is_refused_by_name_and_place(text: str, said: str):
    with pytest.raises(LawError) as error:
        parse_law(text, "force", "y")
    assert said in str(error.value)


def test_a_law_of_other_numbers_than_it_names_is_refused():
    with pytest.raises(LawError, match="names the free numbers p0, p2, but 2 are given"):
        Law("p0*x + p2", (1.0, 2.0), (), "force", "x")
    with pytest.raises(LawError, match="acts on force, command, response; not on 'motion'"):
        parse_law("x", "motion", "x")


def test_a_signal_that_is_not_there_is_named():
    with pytest.raises(LawError, match="needs the signal 'vz'; there are x"):
        evaluate(parse_law("2.0*vz*x", "force", "x"), {"x": np.zeros(3)}, 1000.0)


def test_the_time_counts_from_the_first_sample():
    assert evaluate(parse_law("2.0*t", "force", "x"), {"x": np.zeros(3)}, 10.0) == pytest.approx([0.0, 0.2, 0.4])
