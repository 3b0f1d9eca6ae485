import pytest

from study.errors import WrongUseError
from study.tui.keys.answer_keys import DIGITS, AnswerKeys, parse_keys


def test_named_keys_answer_and_so_do_the_digits():
    keys = parse_keys("f, j")
    assert keys == AnswerKeys("f", "j")
    assert [keys.parse_answer(typed) for typed in ("f", "j", "1", "2", "F", "J")] == [1, 2, 1, 2, 1, 2]
    assert keys.describe_keys() == "f for 1, j for 2"


@pytest.mark.parametrize("typed", ["", "k", "11", "fj", "\x1b[A"])
def test_anything_else_is_no_answer(typed):
    assert parse_keys("f,j").parse_answer(typed) is None
    assert DIGITS.parse_answer(typed) is None


def test_the_digits_alone_may_be_named_too():
    assert parse_keys("1,2") == DIGITS
    assert DIGITS.describe_keys() == "1 or 2"


@pytest.mark.parametrize(
    ("text", "happened"),
    [
        ("f", "'f' names 1 of them."),
        ("f,j,k", "'f,j,k' names 3 of them."),
        ("f,f", "'f' cannot stand for both."),
        ("f,F", "'f' cannot stand for both."),
        ("f,", "'' is nothing."),
        ("left,j", "'left' is more than one character."),
        ("\x01,j", r"'\x01' is not printable."),
        ("2,j", "The digits 1 and 2 always stand for themselves."),
        ("f,1", "The digits 1 and 2 always stand for themselves."),
        *((f"f,{key}", f"'{key}' has another meaning in a trial.") for key in "pqrn?"),
    ],
)
def test_what_cannot_be_told_apart_is_refused(text, happened):
    with pytest.raises(WrongUseError) as caught:
        parse_keys(text)
    assert caught.value.title == "These answer keys cannot be used"
    assert caught.value.happened == happened
    assert "such as --keys f,j; not p q r n ?" in caught.value.do_now
