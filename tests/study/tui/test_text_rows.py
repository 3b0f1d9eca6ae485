from study.tui.text_rows import aligned


def test_numbers_stand_on_the_right_and_words_on_the_left():
    assert aligned((("run", "what", "x"), ("2", "test", "≥ 1.5 N"), ("10", "training", "–"))) == (
        "run  what            x",
        "  2  test      ≥ 1.5 N",
        " 10  training        –",
    )


def test_short_rows_are_filled_up_and_nothing_is_nothing():
    assert aligned((("a", "b"), ("c",))) == ("a  b", "c")
    assert aligned(()) == ()
