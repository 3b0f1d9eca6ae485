"""Times of a log as a person reads them: the zone is passed in, and nothing that a log holds makes it raise."""

from datetime import UTC, datetime, timedelta, timezone

import pytest

from study.local_clock import convert_to_machine_zone, format_local_now
from study.session.views.local_time import format_time_in_zone, format_times_in_zone, split_time_in_zone, to_utc


def india(time: datetime) -> datetime:
    return time.astimezone(timezone(timedelta(hours=5, minutes=30)))


@pytest.mark.parametrize(
    ("utc", "zone", "expected"),
    [
        ("2026-11-22T13:05:59.999+00:00", to_utc, "2026-11-22 13:05 +00:00"),
        ("2026-11-22T13:05:59.999+00:00", india, "2026-11-22 18:35 +05:30"),
        ("2026-11-22T20:05:00+00:00", india, "2026-11-23 01:35 +05:30"),
        ("2026-11-22T13:05:00Z", india, "2026-11-22 18:35 +05:30"),
        ("2026-11-22T13:05:00+02:00", to_utc, "2026-11-22 11:05 +00:00"),
        ("2026-11-22T13:05:00", india, "2026-11-22 18:35 +05:30"),
    ],
)
def test_a_time_is_that_of_the_place_with_its_offset(utc, zone, expected):
    assert format_time_in_zone(utc, zone) == expected


@pytest.mark.parametrize("text", ["", "T10;01", "yesterday", "9999-12-31T23:59:59+00:00", "0001-01-01T00:00:00+14:00"])
@pytest.mark.parametrize("zone", [convert_to_machine_zone, india])
def test_what_cannot_be_converted_stays_as_it_is_or_is_converted(text, zone, summer_and_winter):
    assert format_time_in_zone(text, zone)[:4] in (text[:4], "1000")


def test_a_zone_that_breaks_down_leaves_the_time_as_it_is():
    def broken(time: datetime) -> datetime:
        raise OSError("no zone")

    assert format_time_in_zone("2026-11-22T13:05:00+00:00", broken) == "2026-11-22T13:05:00+00:00"


@pytest.mark.parametrize(
    ("utc", "expected"),
    [
        ("2026-11-22T13:05:10+00:00", ("2026-11-22", "14:05:10", "+01:00")),
        ("2026-07-22T13:05:10+00:00", ("2026-07-22", "15:05:10", "+02:00")),
    ],
)
def test_the_machine_knows_summer_time(utc, expected, summer_and_winter):
    assert split_time_in_zone(utc, convert_to_machine_zone) == expected


def test_now_is_local(summer_and_winter):
    said = datetime.strptime(format_local_now(), "%Y-%m-%d %H:%M %z")
    assert said.utcoffset() in (timedelta(hours=1), timedelta(hours=2))
    assert abs(said - datetime.now(UTC)) < timedelta(days=1)


def test_an_offset_that_times_share_stands_in_the_header_alone():
    def summer_from_april(time):
        return time.astimezone(timezone(timedelta(hours=2 if time.month > 3 else 1)))

    utcs = ("2026-05-04T09:30:12+00:00", "2026-02-04T09:30:12+00:00", "2026-05-05T09:30:12+00:00", "no time")
    assert format_times_in_zone(utcs, summer_from_april) == (
        "+02:00",
        ("2026-05-04 11:30", "2026-02-04 10:30 +01:00", "2026-05-05 11:30", "no time"),
    )
    assert format_times_in_zone((), summer_from_april) == ("", ())
