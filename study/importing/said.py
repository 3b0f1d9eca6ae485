"""Sentences about an import, each told once: what holds for all parts is not repeated for each."""

from collections.abc import Sequence

_NAMED = 3


class Said:
    def __init__(self) -> None:
        self._parts: dict[str, list[str]] = {}

    def add(self, part: str, sentence: str) -> None:
        parts = self._parts.setdefault(sentence, [])
        if part not in parts:  # channels of one name, in several roles
            parts.append(part)

    def sentences(self, every_part: Sequence[str]) -> tuple[str, ...]:
        """every_part: labels of all parts, to tell what holds for all of them."""
        return tuple(
            sentence if len(parts) == len(every_part) else f"{_shortened(parts)}: {sentence}"
            for sentence, parts in self._parts.items()
        )


def _shortened(parts: Sequence[str]) -> str:
    shown = ", ".join(parts[:_NAMED])
    return shown + (f" and {len(parts) - _NAMED} more" if len(parts) > _NAMED else "")
