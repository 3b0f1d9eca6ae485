import pytest

from analysis.wording import conjoin, format_count, format_f_text, format_number, format_p, format_p_text


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
