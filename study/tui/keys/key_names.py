"""Key names as printed on a keyboard: F5 and Esc, in the footer and in every text."""

import re


def key_name(shown: str) -> str:
    """The key's name as printed on a keyboard. shown: Textual's name, such as f5, shift+f4, esc, ^p."""
    parts = shown.split("+") if len(shown) > 1 else [shown]
    return "+".join(part.capitalize() if re.fullmatch(r"f\d+|[a-z]{2,}", part) else part for part in parts)
