from study.tui.text_rows import align_rows, wrap_hanging


def test_numbers_stand_on_the_right_and_words_on_the_left():
    assert align_rows((("run", "what", "x"), ("2", "test", "≥ 1.5 N"), ("10", "training", "–"))) == (
        "run  what            x",
        "  2  test      ≥ 1.5 N",
        " 10  training        –",
    )


def test_short_rows_are_filled_up_and_nothing_is_nothing():
    assert align_rows((("a", "b"), ("c",))) == ("a  b", "c")
    assert align_rows(()) == ()


def test_the_widest_column_of_words_wraps_and_numbers_never_do():
    rows = (("what", "n", "remark"), ("short", "12345678901234", "a remark of many words that does not fit"))
    assert align_rows(rows, 45) == (
        "what                n  remark",
        "short  12345678901234  a remark of many words",
        "                       that does not fit",
    )
    assert max(map(len, align_rows(rows, 20))) > 20  # the terminal wraps what cannot be narrowed


def test_a_long_line_continues_under_its_text():
    assert wrap_hanging("Sensor     one two three", 11, 18) == ("Sensor     one two", "           three")
    assert wrap_hanging("Sensor     one two three", 11, None) == ("Sensor     one two three",)
