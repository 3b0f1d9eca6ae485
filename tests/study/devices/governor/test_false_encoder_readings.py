"""Millions of ticks with encoders that lie and ticks that come late, under a judge that shares nothing with the safety
layer; and the proof that this judge sees what must never happen: safety layers with one line changed."""

import math
import sys
from collections import Counter
from dataclasses import replace
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from study.devices.device import Fault
from study.devices.governor import cells, compiling, confine, feedback, govern, plausibility

TICKS_OF_HOLD = 2500
ENCODERS = {Fault.NOT_A_NUMBER, Fault.OUTSIDE, Fault.JUMPED, Fault.SHAKEN, Fault.STALE}


def fuzz(lying, ticks: int, first_seed: int) -> Counter:
    """Holds of all lies in turn until so many ticks are over. How often each fault ended a hold of each lie."""
    met, done, seed = Counter(), 0, first_seed
    kinds = (*lying.LIES, "faint noise")
    while done < ticks:
        lie = kinds[seed % len(kinds)]
        played = lying.play(lying.draw(np.random.default_rng(seed), lie, TICKS_OF_HOLD))
        assert played.found == [], f"seed {seed}"
        assert lie not in lying.PLAIN or played.fault not in ENCODERS, f"seed {seed}: {played.fault}"
        met[lie, played.fault] += 1
        done += played.ticks
        seed += 1
    return met


def test_false_readings_and_late_ticks_never_exceed_the_force_limits(lying):
    met = fuzz(lying, 200_000, first_seed=0)
    assert {fault for _, fault in met} >= ENCODERS | {Fault.NONE, Fault.STALLED}
    assert {lie for lie, _ in met} >= set(lying.LIES)


@pytest.mark.slow
def test_ten_million_ticks_of_false_readings_never_exceed_the_force_limits(lying):
    fuzz(lying, 10_000_000, first_seed=1_000_000)


MUTATIONS = {
    "the fade turns the force round": (
        govern, "force[i] = max(remaining_gain, 0.0) * state[LET_GO_FORCE + i]",
        "force[i] = -max(remaining_gain, 0.0) * state[LET_GO_FORCE + i]", "fade: its sign", 2,
    ),
    "the fade rises": (
        govern, "remaining_gain = 1.0 - (state[TICK] - state[LET_GO_START] + 1.0)",
        "remaining_gain = 1.0 + (state[TICK] - state[LET_GO_START] + 1.0)", "fade: no way down", 2,
    ),
    "the fade takes twice as long": (
        govern, "/ settings[LET_GO_TICKS]", "/ (2.0 * settings[LET_GO_TICKS])", "fade: longer", 2,
    ),
    "the release turns the force round": (
        govern, "remaining_gain = 1.0 - _compute_fade_gain(", "remaining_gain = _compute_fade_gain(", "", 0,
    ),
    "the stimulus' fade turns round": (
        govern, "    return remaining_gain * state[STIMULUS_GAIN], remaining_gain * state[SPRING_GAIN]",
        "    return -remaining_gain * state[STIMULUS_GAIN], remaining_gain * state[SPRING_GAIN]", "fade: its sign", 0,
    ),
    "the stimulus fades in twice too high": (
        govern, "return state[STIMULUS_GAIN], state[SPRING_GAIN]",
        "return 2.0 * state[STIMULUS_GAIN], state[SPRING_GAIN]", "", 0,
    ),
    "a fade with corners": (
        govern, "return 0.5 - 0.5 * math.cos(math.pi * ticks / fade_ticks)",
        "return 0.0 if ticks < 0.5 * fade_ticks else 1.0", "", 0,
    ),
    "nothing confined last": (
        govern, "        confine(force, settings[TOTAL_CAP])\n        for i", "        for i", "total", 6,
    ),
    "the stimulus is not confined": (
        govern, "confine(force, settings[STIMULUS_CAP])", "False", "", 5,
    ),
    "twice the slew": (
        govern, "settings[SLEW_STEP] * LIMIT_FACTOR", "(2.0 * settings[SLEW_STEP])", "slew", 7,
    ),
    "no watchdog": (
        govern, "tick - state[LAST_KEEP_ALIVE_TICK] > settings[WATCHDOG_TICKS]", "False",
        "late: a force after the watchdog", 2,
    ),
    "no longest hold": (
        govern, "tick >= state[LONGEST_HOLD]", "False", "late: a force after the longest hold", 4,
    ),
    "no ear for a release": (
        govern, "state[RELEASE_REQUEST] != 0.0 or", "", "", 0,
    ),
    "twice the spring": (
        feedback, "stiffness * (reading[0]", "2.0 * stiffness * (reading[0]", "", 1,
    ),
    "the spring pushes": (
        feedback, "force[0] -= reduced_gain * (total_factor * x)", "force[0] += reduced_gain * (total_factor * x)",
        "spring: pushes", 1,
    ),
    "three times the feedback's cap": (
        feedback, "cap, stiffness, damping = settings[FEEDBACK_CAP]",
        "cap, stiffness, damping = 3.0 * settings[FEEDBACK_CAP]", "", 7,
    ),
    "speed by one tick instead of those that went by": (
        feedback, "(elapsed_ticks * settings[TICK_S])", "settings[TICK_S]", "", 7,
    ),
    "no check of stale readings": (
        plausibility, "return STALE if _is_stale(state, settings, reading) or axis_stale else NO_FAULT",
        "return NO_FAULT", "lie", 13,
    ),
    "no check of jumps": (
        plausibility, "        return JUMPED", "        pass", "lie", 9,
    ),
    "no check of accelerations": (
        plausibility, "        return SHAKEN", "        pass", "lie", 11,
    ),
    "no bound of the workspace": (
        plausibility, "        return OUTSIDE", "        pass", "lie", 10,
    ),
}  # fmt: skip
"""File, text, its replacement, how the judge calls it (empty where it may call it this or that), and the number of the
hold that shows it: all others are played only if that fails to."""


def compiled_in_python(changed: ModuleType | None = None, old: str = "", new: str = ""):
    """The tick as plain Python, from the very sources, one line of one of them changed: nothing is kept, nothing is
    compiled."""
    parts = (compiling, confine, feedback, plausibility, govern)
    kept = {module.__name__: module for module in parts}
    try:
        for module in parts:
            text = Path(module.__file__).read_text(encoding="utf-8")
            if module is changed:
                assert text.count(old) >= 1, f"{old!r} is not in {module.__file__}"
                text = text.replace(old, new)
            plain = "def njit(*arguments, **options):\n    return lambda function: function\n"
            text = text.replace("from numba import njit, types\n", f"from numba import types\n{plain}")
            text = text.replace("from numba import njit\n", plain)
            copy = sys.modules[module.__name__] = ModuleType(module.__name__)
            copy.__file__ = module.__file__
            exec(compile(text, module.__file__, "exec"), copy.__dict__)
        return sys.modules[govern.__name__].tick
    finally:
        sys.modules.update(kept)


def scenarios(lying, ticks: int = 900):
    """Short holds in which each line of the safety layer matters once."""
    judge = sys.modules["force_judge"]

    def hold(lie, amplitude=2.5, spring=True, damping=0.0, **changes):
        seed = np.random.default_rng(4)
        drawn = lying.draw(seed, lie, ticks)
        samples = 50
        wave = np.sin(2 * np.pi * np.arange(samples) / samples)[:, None] * [0.0, 0.6, 0.8] * amplitude
        stimulus = replace(
            drawn.stimulus, loop=lying.rigs.force(wave), fade_in_s=0.1, fade_out_s=0.1, fade_shape="raised_cosine"
        )
        limits = replace(drawn.settings.limits, release_s=0.05)
        settings = replace(
            drawn.settings, limits=limits, spring_frequency_hz=3.5 if spring else 0.0, spring_damping_n_s_per_m=damping
        )
        plain = {
            "late": np.zeros(ticks), "release_at": judge.NEVER, "silent_from": judge.NEVER, "told_by": judge.NEVER,
            "hand": np.array([0.09, 4.0, 120.0, 0.003, 0.004, -0.002]), "offsets_m": np.zeros((ticks, 3)),
            "matrix": np.eye(3), "lies_from": ticks, "frozen": False, "delay": 0,
        }  # fmt: skip
        return replace(drawn, **(plain | {"stimulus": stimulus, "settings": settings} | changes))

    after = np.arange(ticks)[:, None] >= 400
    clock = np.arange(ticks)
    shaken = 0.0007 * (-1.0) ** clock[:, None] * after * [0.6, 0.8, 0.0]
    late = ((clock > 300) & (clock % 92 != 0)).astype(float)
    garbage = np.array([[400, cells.FORCE, 60.0], [500, cells.LET_GO_FORCE, 1e4], [500, cells.PHASE, cells.LETTING_GO]])
    short = hold("none").settings
    yield hold("none", spring=False, release_at=431)
    yield hold("none", release_at=431)
    yield hold("none", spring=False, silent_from=113)
    yield hold("none", silent_from=113)
    yield hold("none", settings=replace(short, limits=replace(short.limits, longest_hold_s=0.433)))
    yield hold("none", amplitude=4.0)
    yield hold("none", garbage=garbage)
    yield hold("none", late=late, damping=20.0, spring=True)
    yield hold("none", settings=replace(short, limits=replace(short.limits, slew_n_per_s=80.0)), amplitude=3.0)
    yield hold("jump", offsets_m=after * [0.004, 0.0, 0.0], told_by=400 + 52)
    yield hold("drift", offsets_m=after * 0.0005 * (clock[:, None] - 400) * [1.0, 0.0, 0.0], told_by=400 + 350)
    yield hold("oscillation", offsets_m=shaken, told_by=400 + 200)
    yield hold("nan", offsets_m=np.where(after, np.nan, np.zeros((ticks, 3))), told_by=400 + 51)
    yield hold("freeze", lies_from=300, frozen=True, told_by=300 + 400)


def test_the_tick_in_plain_python_writes_the_same_forces_to_the_last_bit(lying):
    plain = compiled_in_python()
    for number, hold in enumerate(scenarios(lying)):
        expected, given = lying.play(hold), lying.play(hold, plain)
        assert expected.found == [], number
        assert given.fault is expected.fault
        assert np.array_equal(given.forces_n, expected.forces_n), number


@pytest.mark.parametrize("name", MUTATIONS)
def test_a_safety_layer_with_one_line_changed_is_caught(lying, name):
    module, old, new, called, shown_by = MUTATIONS[name]
    weak = compiled_in_python(module, old, new)
    found, holds = [], list(scenarios(lying))
    for hold in (*holds[shown_by:], *holds[:shown_by]):
        found = lying.play(hold, weak).found
        if any(called in violation for violation in found):
            return
    raise AssertionError(f"not caught as {called!r}; the last hold said {found}")


def late_hold(lying, damping: float, late: np.ndarray, speed_m_per_s: float):
    """A handle that is pulled along at a steady speed, no spring, no stimulus."""
    ticks = len(late)
    hold = lying.draw(np.random.default_rng(0), "drift", ticks)
    steady = np.arange(ticks)[:, None] * speed_m_per_s / 1000 * np.array([1.0, 0.0, 0.0]) - [0.09, 0.0, 0.0]
    return replace(
        hold, lie="drift", stimulus=lying.rigs.sine(0.0), hand=np.zeros(6), offsets_m=steady, matrix=np.zeros((3, 3)),
        lies_from=0, frozen=False, late=late, told_by=10**9, release_at=10**9, silent_from=10**9,
        settings=replace(hold.settings, spring_frequency_hz=0.0, spring_damping_n_s_per_m=damping),
    )  # fmt: skip


def test_ninety_late_ticks_do_not_multiply_the_damping(lying):
    """0.3 m/s at 2 N s/m are 0.6 N, however many ticks had no sign of life."""
    late = np.zeros(500)
    late[300:390] = 1.0
    played = lying.play(late_hold(lying, 2.0, late, 0.3))
    assert played.fault is Fault.NONE
    pull = -played.forces_n[:, 0]
    assert pull.max() == pytest.approx(0.6, rel=1e-6)
    assert pull[390:].min() == pytest.approx(0.6, rel=1e-6)


@pytest.mark.parametrize("seed", range(10))
def test_no_pattern_of_late_ticks_gets_the_damper_past_its_speed_or_its_cap(lying, seed):
    rng = np.random.default_rng(seed)
    late = (rng.random(500) < rng.uniform(0, 0.95)).astype(float)
    late[::50] = 0.0
    for damping, most in ((2.0, 0.6), (20.0, 1.5)):
        pull = -lying.play(late_hold(lying, damping, late, 0.3)).forces_n[:, 0]
        assert 0.99 * most < pull.max() <= most * (1 + 1e-9)


def test_time_stamps_of_a_loop_are_what_the_speed_is_made_from(rigs):
    """A loop whose readings are 1.9 and 0.1 ms apart, and one whose clock stands still or goes back."""
    governor = govern_at_rest(rigs, damping=2.0)
    stamps = np.cumsum(np.tile([1.9e-3, 0.1e-3], 300)) + 5.0
    pulls = [pull_at(governor, 0.2 * (stamp - 5.0) - 0.06, stamp) for stamp in stamps]
    assert max(pulls) == pytest.approx(0.4, rel=1e-6)
    for stamp in (5.0, math.nan, -1.0, 5.0, 0.0):
        assert 0.0 <= pull_at(governor, 0.06, stamp) <= 0.5
    assert governor.fault is Fault.NONE


def govern_at_rest(rigs, damping: float):
    from study.devices.governor.governor import Governor

    governor = Governor(rigs.INFO, replace(rigs.SETTINGS, spring_frequency_hz=0.0, spring_damping_n_s_per_m=damping))
    governor.begin_hold(rigs.sine(0.0, fade_s=0.0))
    return governor


def pull_at(governor, x_m: float, stamp_s: float) -> float:
    from study.devices.rig import READING_SIZE

    reading = np.zeros(READING_SIZE)
    reading[0] = x_m
    governor.restart_watchdog()
    governor.state[cells.READING_TIME_S] = stamp_s
    govern.tick(governor.state, governor.settings, governor.loop, governor.buffer, reading, governor.force)
    return -float(governor.force[0])


def test_the_kept_code_of_the_tick_is_outdated_when_any_file_of_the_safety_layer_changes(tmp_path):
    folder = Path(govern.__file__).parent
    rig = folder.parent / "rig.py"
    expected = compiling.compute_fingerprint(folder, rig)
    for entry in (govern.tick, govern.record_missed_ticks):
        assert expected in [cell.cell_contents for cell in entry.py_func.__closure__]
    for name in ("cells", "compiling", "confine", "feedback", "govern", "plausibility", "rig"):
        for source in folder.glob("*.py"):
            (tmp_path / source.name).write_bytes(source.read_bytes())
        beyond = tmp_path / "beyond.txt"
        beyond.write_bytes(rig.read_bytes())
        with (beyond if name == "rig" else tmp_path / f"{name}.py").open("a") as file:
            file.write("# changed")
        assert compiling.compute_fingerprint(tmp_path, beyond) != expected
