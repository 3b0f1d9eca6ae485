import pytest

from analysis.wording import (
    choose_decimals,
    conjoin,
    format_count,
    format_f_text,
    format_newtons,
    format_number,
    format_p,
    format_p_text,
    mark_cut,
)


def test_what_is_not_there_is_a_dash():
    assert (format_number(None), format_count(None), format_p(None)) == ("–", "–", "–")


def test_a_tiny_p_is_a_bound_and_not_zero():
    assert format_p(3e-12) == "< 0.0001"
    assert format_p_text(3e-12) == "p < 0.0001"
    assert format_p_text(0.04321) == "p = 0.0432"


def test_f_has_both_its_degrees_of_freedom():
    assert format_f_text(4, 45, 2.579) == "F(4, 45) = 2.58"


@pytest.mark.parametrize(
    ("things", "text"), [([], ""), (["a"], "a"), (["a", "b"], "a and b"), (["a", "b", "c"], "a, b and c")]
)
def test_lists_read_like_sentences(things, text):
    assert conjoin(things) == text


def test_a_long_list_says_how_much_it_leaves_out():
    assert conjoin([str(i) for i in range(20)]).endswith("10, 11 and 8 more")


@pytest.mark.parametrize(
    ("newton", "text"),
    [(None, "–"), (0.0, "0.00"), (1e-17, "0.00"), (0.1, "0.10"), (0.7, "0.70"), (2.345, "2.35"), (123.4, "123.40"),
     (0.0342, "0.034"), (0.0996, "0.100"), (0.0041, "0.0041"), (-0.0041, "−0.0041"), (float("nan"), "nan")],
)  # fmt: skip
def test_a_small_force_keeps_two_significant_digits_and_others_have_two_decimals(newton, text):
    """A threshold of 4 mN was printed as 0.00 N."""
    assert format_newtons(newton) == text
    assert mark_cut(newton, True) == (f"{text} cut" if newton is not None else text)


def test_values_that_are_read_together_have_the_decimals_of_the_largest():
    assert (choose_decimals(0.7, -0.0004), choose_decimals(0.0043, -0.0004), choose_decimals(None)) == (2, 4, 2)
    assert (choose_decimals(0.5, least=3), choose_decimals(0.00031, least=3, significant=1)) == (3, 4)
