from dataclasses import replace

import numpy as np
import pytest

from analysis.look.clock import check_clock

N = 5000


def record_with_stamps(make_recording, time_s):
    return make_recording(np.ones(N), np.ones(N), time_s=time_s)


def check_levels(found):
    return {check.level for check in found}


def find_check(found, word):
    (check,) = (check for check in found if word in check.finding)
    return check


def test_even_stamps_are_fine(make_recording):
    assert check_levels(check_clock(record_with_stamps(make_recording, np.arange(N) / 1000.0), [(0, N)])) == {"fine"}


def test_jitter_is_measured(make_recording):
    off = 1e-4 * np.random.default_rng(1).uniform(-1, 1, N)
    found = find_check(
        check_clock(record_with_stamps(make_recording, np.arange(N) / 1000.0 + off), [(0, N)]), "from even spacing"
    )
    assert found.level == "notice"
    assert float(found.finding.split("deviate by ")[1].split(" us")[0]) == pytest.approx(1e2 / np.sqrt(3), rel=0.05)


@pytest.mark.parametrize(("ppm", "level"), [(20, "fine"), (800, "notice"), (20_000, "wrong"), (-800, "notice")])
def test_drift_is_measured(make_recording, ppm, level):
    found = find_check(
        check_clock(record_with_stamps(make_recording, np.arange(N) * (1 + ppm * 1e-6) / 1000.0), [(0, N)]), "ppm"
    )
    assert found.level == level
    assert float(found.finding.split(" is ")[1].split(" ppm")[0]) == pytest.approx(abs(ppm), rel=1e-3)
    assert ("slower" if ppm > 0 else "faster") in found.finding


def test_gaps_are_counted_and_do_not_count_as_jitter_or_drift(make_recording):
    time_s = np.arange(N) / 1000.0
    time_s[2000:] += 0.05
    time_s[3000:] += 0.002
    found = check_clock(record_with_stamps(make_recording, time_s), [(0, N)])
    gap = find_check(found, "gaps")
    assert gap.level == "wrong"
    assert "2 gaps between time stamps, the first after 1.999 s; the longest is 51 ms in place of 1 ms" in gap.finding
    assert check_levels(check for check in found if check is not gap) == {"fine"}


def test_a_pause_between_parts_is_no_gap(make_recording):
    time_s = np.arange(N) / 1000.0
    time_s[2500:] += 60.0
    assert check_levels(check_clock(record_with_stamps(make_recording, time_s), [(0, 2500), (2500, N)])) == {"fine"}


def test_unknown_time_is_reported(make_recording):
    numbered = replace(make_recording(np.ones(N), np.ones(N)), meta={"time": "unknown"})
    assert check_levels(check_clock(numbered, [(0, N)])) == {"notice"}


def test_what_an_import_evened_out_is_reported(make_recording):
    notes = ["a: resampled from uneven stamps (about 952 Hz) to 952 Hz, linear."]
    found = check_clock(make_recording(np.ones(N), np.ones(N), meta={"import": {"notes": notes}}), [(0, N)])
    assert [check.level for check in found] == ["notice"]
    assert notes[0] in found[0].finding
