"""Every field of every event is its type when it is read."""

import json
from dataclasses import fields
from pathlib import Path

import pytest

from study.session.facts.events import encode_event, parse_event

FROZEN = Path(__file__).parents[3] / "frozen" / "v0_1" / "study" / "P01_001" / "events.jsonl"
LINES = FROZEN.read_bytes().splitlines(keepends=True)
BY_KIND = {json.loads(line)["event"]: json.loads(line) for line in LINES}

BAD = {
    "utc": ("2026-01-01T10;01:00+00:00", "2026-01-01T10:01:00", "2026-13-01T10:01:00Z", "0001-01-01T00:00:00Z", "", 0),
    "run": (-1, 10**9, 10**500, 0.5, "0", True, None),
    "trial": (-1, "1"),
    "attempt": (-1, 1.5),
    "seed": (-1, 2**256),
    "participant_number": (-1,),
    "protocol_hash": ("ab", "z" * 64),
    "sha256": ("0" * 63, "A" * 64),
    "recording": ("../x.h5", "/etc/passwd", "recordings/../x.h5", "recordings/a/b.h5", "recordings/a\u0000.h5"),
    "frequency_hz": (0, -5, 1e300),
    "level_n": (-0.1, 1e300),
    "level_db": (1e300,),
    "angle_deg": (1e300, None),
    "response_time_s": (-0.1, 1e300),
    "rested_s": (-1,),
    "vibrated_s": (-1,),
    "missed_ticks": (-1, 0.5),
    "late_ticks": (-1, 0.5),
    "latest_s": (-1,),
    "delivered_mps2": (1e300,),
    "off_axis_mps2": (1e300,),
    "displacement_mm": (-1e300,),
    "offset_mm": (-1,),
    "wanted_mps2": (-1,),
    "direction": (3,),
    "answer": (0,),
    "polarity": (0,),
    "passed": (1, "yes"),
}


def with_value(kind: str, field: str, value: object) -> bytes:
    return json.dumps({**BY_KIND[kind], field: value}).encode()


CASES = [
    (kind, field, value)
    for kind, event in BY_KIND.items()
    for field in event
    for value in BAD.get(field, ())
]  # fmt: skip


@pytest.mark.parametrize(("kind", "field", "value"), CASES, ids=lambda part: str(part)[:20])
def test_a_field_outside_its_type_is_refused(kind, field, value):
    with pytest.raises(ValueError, match=field):
        parse_event(with_value(kind, field, value))


def test_every_line_of_an_earlier_version_is_read_and_written_as_it_was():
    for line in LINES:
        assert encode_event(parse_event(line)) == line


@pytest.mark.parametrize("kind", BY_KIND)
def test_a_field_that_no_event_has_is_refused(kind):
    with pytest.raises(ValueError, match="more"):
        parse_event(with_value(kind, "more", 1))


@pytest.mark.parametrize("hostile", ["[" * 5000, "9" * 5000, '"\\ud800"', "NaN", "-Infinity", "1e999", "{}"])
@pytest.mark.parametrize("kind", BY_KIND)
def test_hostile_values_are_refused_in_every_field(kind, hostile):
    event = parse_event(json.dumps(BY_KIND[kind]).encode())
    for field in fields(event):
        if (field.name, hostile) in (("answers", "{}"), ("versions", "{}")):
            continue
        line = json.dumps({**BY_KIND[kind], field.name: "HERE"}).replace('"HERE"', hostile)
        with pytest.raises(ValueError):
            parse_event(line.encode())
