"""A map from a table's header, or from the names of a file's arrays of one length, where they name quantities and
units: `time [s], force [N], displacement_mm`."""

import re

from study.importing.arrays.arrays import Arrays
from study.importing.map_format.import_map import ChannelMap, ClockMap, ImportMap
from study.importing.map_format.signal_words import named, roles_of

_TIME = re.compile(r"(t|time|zeit|temps)(_?(s|ms|us))?", re.IGNORECASE)


def header_map(arrays: Arrays) -> ImportMap | None:
    """None where the header does not say what every column is, or does not tell commands from responses."""
    if len({array.shape for array in arrays.by_name.values()}) != 1 or next(iter(arrays.by_name.values())).ndim != 1:
        return None
    columns = [named(header) for header in arrays.by_name]
    times = [column for column in columns if column.unit and _TIME.fullmatch(column.name) and column.quantity == "time"]
    rest = [column for column in columns if column not in times]
    if not all(column.sure and column.quantity for column in rest):
        return None
    roles = roles_of(rest)
    if len(times) != 1 or roles is None or len({column.name for column in rest}) < len(rest):
        return None
    clock = ClockMap(time=times[0].header, time_unit=times[0].unit)
    channels = tuple(
        ChannelMap(
            role=role,
            name=column.name,
            value=column.header,
            unit=column.unit,
            quantity="" if column.unit else column.quantity,
        )
        for column, role in zip(rest, roles, strict=True)
    )
    return ImportMap(channel=channels, device="unknown", title=arrays.path.stem, clock=(clock,))
