from dataclasses import dataclass

from study.session.views.printable import make_printable, replace_unprintable


@dataclass(frozen=True)
class Inner:
    text: str
    number: float | None = None


@dataclass(frozen=True)
class Outer:
    inner: tuple[Inner, ...]
    rows: tuple[tuple[str, ...], ...] = ()


def test_control_characters_become_blanks_and_line_ends_stay():
    assert replace_unprintable("a\x1b[2Jb\r\x07\x9b c\nd") == "a [2Jb    c\nd"


def test_ordinary_text_of_any_script_stays():
    assert replace_unprintable("Müller 長 ≥ 3 m/s²") == "Müller 長 ≥ 3 m/s²"


def test_all_text_of_a_view_is_cleaned_wherever_it_is():
    view = Outer((Inner("\x1b", 1.5), Inner("fine", None)), (("\x00a", "b"),))
    assert make_printable(view) == Outer((Inner(" ", 1.5), Inner("fine", None)), ((" a", "b"),))
