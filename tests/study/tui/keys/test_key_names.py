"""Keys in the footer are written as on the keyboard."""

import pytest

from study.tui.keys.key_names import format_key_name


@pytest.mark.parametrize(
    ("shown", "printed"),
    [("f5", "F5"), ("shift+f4", "Shift+F4"), ("esc", "Esc"), ("space", "Space"), ("^p", "^p"), ("r", "r"), ("+", "+")],
)
def test_a_key_is_named_as_on_the_keyboard(shown, printed):
    assert format_key_name(shown) == printed
