import pytest

from study.session.views.participant_codes import explain_invalid_code, is_code, suggest_code


@pytest.mark.parametrize("code", ["P01", "1", "a1", "A" * 15 + "1"])
def test_letters_and_digits_with_a_digit_are_a_code(code):
    assert is_code(code)
    assert explain_invalid_code(code) == ""


@pytest.mark.parametrize("text", ["Ada", "P 01", "p.01", "ada@lab1", "A" * 16 + "1", "P01\n", "Ünal1", "１"])
def test_what_could_be_a_name_is_no_code_and_says_what_is(text):
    assert not is_code(text)
    assert "1 to 16 letters and digits, at least one digit, such as P01" in explain_invalid_code(text)


@pytest.mark.parametrize("text", ["", "   "])
def test_nothing_typed_asks_for_a_code(text):
    assert explain_invalid_code(text).startswith("A code is needed")


@pytest.mark.parametrize(
    ("taken", "proposed"),
    [
        ((), "P01"),
        (("P03", "P01"), "P04"),
        (("S009", "P77"), "S010"),
        (("99",), "100"),
        (("a1b", "K7"), "K8"),
        (("A" * 14 + "99",), "P01"),
    ],
)
def test_the_next_code_follows_the_manner_of_the_latest(taken, proposed):
    assert suggest_code(taken) == proposed


def test_the_next_code_was_never_taken():
    taken = ("P02", "P10", "P09")
    assert suggest_code(taken) not in taken
