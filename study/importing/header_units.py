"""Names and units in one text, as headers of tables have them: `fx [N]`, `time (s)`."""

import re

_NAMED = re.compile(r"(?P<name>.*?)\s*[\[(](?P<unit>[^\[\]()]+)[\])]\s*")


def unit_in(header: str) -> tuple[str, str]:
    """Name and unit; the unit is empty where the header says none."""
    match = _NAMED.fullmatch(header)
    return (match["name"].strip(), match["unit"].strip()) if match and match["name"].strip() else (header, "")
