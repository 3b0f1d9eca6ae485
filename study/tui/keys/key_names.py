"""Names of keys as printed on a keyboard, such as F5 and Esc."""

import re


def format_key_name(textual_name: str) -> str:
    """Format the name of a key or key combination, such as Shift+F4. textual_name: Textual's name, such as f5,
    shift+f4, esc or ^p. Function keys and words of two or more lower-case letters are capitalised; other parts are
    unchanged."""
    parts = textual_name.split("+") if len(textual_name) > 1 else [textual_name]
    return "+".join(part.capitalize() if re.fullmatch(r"f\d+|[a-z]{2,}", part) else part for part in parts)
