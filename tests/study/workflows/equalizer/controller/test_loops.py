"""The example loop and the loops of docs/controller.md: they never leave a force on, and replay nothing after a stall.

Both run on a clock that goes on by what they sleep, and a device that writes down what it is sent.
"""

import re
import signal
from pathlib import Path

import numpy as np
import pytest

from equalizer.tracking.lqr.changing_direction import play
from equalizer.tracking.realtime.realtime_controller import RealtimeSettings
from study.workflows.equalizer.controller.export_controller import ControllerPlan, export_controller
from tests.slow_instances import slow
from tests.study.workflows.equalizer.controller.build import build, compiled_cpp, run, write_model

DOCS = Path(__file__).parents[5] / "docs"

FAKE_CLOCK = """
#define _POSIX_C_SOURCE 200809L
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>
static long long fake_ns = 100000000000LL;
static int fake_gettime(clockid_t which, struct timespec *now)
{
    (void)which;
    now->tv_sec = (time_t)(fake_ns / 1000000000LL);
    now->tv_nsec = (long)(fake_ns % 1000000000LL);
    return 0;
}
static int fake_sleep(const struct timespec *nap, struct timespec *left)
{
    (void)left;
    fake_ns += 1 + (long long)nap->tv_sec * 1000000000LL + nap->tv_nsec;
    return 0;
}
#define clock_gettime fake_gettime
#define nanosleep fake_sleep
"""

FAKE_DEVICE = """
static int device_open(void) { return 1; }
static int device_send(const double force[HAPTEQ_INPUTS])
{
    static int sends = 0;
    printf("sent %.17g %.17g %.17g\\n", force[0], force[1], force[2]);
    if (++sends == 10) {
        fake_ns += (long long)(1e6 * atof(getenv("STALL_MS")));
        if (atoi(getenv("SIGNAL")))
            raise(atoi(getenv("SIGNAL")));
        return !atoi(getenv("GONE"));
    }
    return 1;
}
static void device_release(void) { puts("released"); }

"""
AFTER = 10
"""So many forces were sent when it happens: that of row 9 is the last."""


def forces_of(said: str) -> np.ndarray:
    return np.array([line.split()[1:] for line in said.splitlines() if line.startswith("sent")], dtype=float)


@pytest.fixture(scope="module")
def example(vendor, exported, tmp_path_factory):
    """example(stall_ms, signal, gone): what the example loop says where this comes over it at the tenth force."""
    folder = tmp_path_factory.mktemp("example")
    source = (exported.plan.out / "example_loop.c").read_text()
    mine = re.compile(r"(?<=/\* ---- your device ---- \*/\n).*?(?=/\* ---- the loop)", re.DOTALL)
    source, found = mine.subn(lambda _: FAKE_DEVICE, source)
    assert found == 1
    (folder / "clock.h").write_text(FAKE_CLOCK)
    (folder / "loop.c").write_text(source)
    program = build(vendor, folder, "loop.c", f"-I{exported.plan.out}", "-include", str(folder / "clock.h"))
    return lambda stall_ms=0.0, signal=0, gone=0: run(program, "0.06", STALL_MS=stall_ms, SIGNAL=int(signal), GONE=gone)


@pytest.fixture(scope="module")
def rows(exported):
    """(ticks, 3): the forces of the transient, towards the normal of the example."""
    normal = np.array([0.0, 0.6, 0.8])
    across = np.array([1.0, 0.0, 0.0])
    rotation = np.column_stack((across, np.cross(normal, across), normal))
    return play(exported.controller.transient, np.tile(rotation, (len(exported.controller.transient), 1, 1))).forces


@pytest.mark.slow
def test_the_example_compiles_as_it_is_and_ends_by_itself(vendor, exported):
    done = run(build(vendor, exported.plan.out, "example_loop.c"), "0.05")
    assert re.search(r"^\d+ ticks, \d+ missed, largest force on an axis .*limited 0 times$", done.stdout, re.MULTILINE)


def test_undisturbed_it_sends_each_row_once_and_then_zero(example, rows):
    done = example()
    assert done.returncode == 0
    sent = forces_of(done.stdout)
    np.testing.assert_allclose(sent[:-1], rows[:60], atol=1e-12)
    assert not sent[-1].any() and "60 ticks, 0 missed" in done.stdout and "\nreleased\n" in done.stdout


def test_ticks_that_were_missed_are_not_sent_one_after_the_other(example, rows):
    """14.5 ms late: the forces that were due meanwhile are gone, the waveform is where the time is."""
    done = example(stall_ms=15.5)
    assert done.returncode == 0
    sent = forces_of(done.stdout)
    np.testing.assert_allclose(sent[:-1], np.delete(rows[:60], np.arange(AFTER, AFTER + 14), axis=0), atol=1e-12)
    assert not sent[-1].any() and "60 ticks, 14 missed" in done.stdout


def test_a_loop_that_stood_still_sets_zero_and_ends(example, rows):
    done = example(stall_ms=21.5)
    assert done.returncode == 1
    sent = forces_of(done.stdout)
    np.testing.assert_allclose(sent[:-1], rows[:AFTER], atol=1e-12)
    assert len(sent) == AFTER + 1 and not sent[-1].any()
    assert "\nreleased\n" in done.stdout and "stood still" in done.stdout


@pytest.mark.parametrize("number", [signal.SIGTERM, *slow(signal.SIGINT, signal.SIGHUP)])
def test_a_signal_ends_the_example_with_zero_force(example, rows, number):
    done = example(signal=number)
    assert done.returncode == 0
    sent = forces_of(done.stdout)
    assert rows[AFTER - 1].any() and len(sent) == AFTER + 1 and not sent[-1].any()
    assert "\nreleased\n" in done.stdout


def test_a_device_that_is_gone_is_sent_zero_all_the_same(example):
    sent = forces_of(example(gone=1).stdout)
    assert len(sent) == AFTER + 1 and not sent[-1].any()


def snippet(mentioned: str) -> str:
    codes = re.findall(r"```cpp\n(.*?)```", (DOCS / "controller.md").read_text("utf-8"), re.DOTALL)
    (code,) = [code for code in codes if mentioned in code]
    return code


@pytest.mark.slow
@pytest.mark.parametrize("mentioned", ["chai3d.h", "rclcpp/rclcpp.hpp"])
def test_the_snippets_of_the_page_compile(vendor, exported, tmp_path, mentioned):
    source = tmp_path / "snippet.cpp"
    source.write_text(snippet(mentioned))
    assert compiled_cpp(vendor, source, exported.plan.out)[1] == ""


FAKE_CHAI3D_CLOCK = """
#include <chrono>
struct fake_clock {
    using duration = std::chrono::nanoseconds;
    using rep = duration::rep;
    using period = duration::period;
    using time_point = std::chrono::time_point<fake_clock>;
    static inline duration elapsed{};
    static time_point now() { return time_point(elapsed); }
    static void sleep_until(time_point due) { elapsed = due > now() ? due.time_since_epoch() : elapsed; }
};
"""
FAKE_CHAI3D = """
#include <cstdio>
#include <cstdlib>
static std::atomic<bool> running{true};
struct Fake : chai3d::cGenericHapticDevice {
    int sends = 0;
    bool getPosition(chai3d::cVector3d &position) override
    {
        position = chai3d::cVector3d(0.0, 0.0, std::atof(std::getenv("Z_M")));
        return true;
    }
    bool setForce(const chai3d::cVector3d &force) override
    {
        std::printf("sent %.17g %.17g %.17g\\n", force.x(), force.y(), force.z());
        if (++sends == 10)
            fake_clock::elapsed += std::chrono::microseconds(std::atoi(std::getenv("STALL_US")));
        running = sends < 40;
        return true;
    }
};
int main() { haptics(std::make_shared<Fake>(), running); }
"""


@pytest.fixture(scope="module")
def chai3d(vendor, exported, tmp_path_factory):
    """chai3d(z_m, stall_ms): the forces (n, 3) that the snippet sends while the handle stays at z."""
    code = snippet("chai3d.h")
    for real, fake in (
        ("std::chrono::steady_clock", "fake_clock"),
        ("std::this_thread::sleep_until", "fake_clock::sleep_until"),
    ):
        assert code.count(real) == 1
        code = code.replace(real, fake)
    source = tmp_path_factory.mktemp("chai3d") / "snippet.cpp"
    source.write_text(FAKE_CHAI3D_CLOCK + code + FAKE_CHAI3D)
    program, said = compiled_cpp(vendor, source, exported.plan.out, options=())
    assert said == ""

    def looped(z_m: float, stall_ms: float = 0.0) -> np.ndarray:
        return forces_of(run(program, Z_M=z_m, STALL_US=round(1000 * stall_ms)).stdout)

    return looped


@pytest.mark.slow
def test_tap_and_floor_together_are_shortened_to_the_cap_and_keep_their_direction(chai3d):
    shallow, deep = chai3d(-0.001), chai3d(-0.05)
    assert not shallow[-1].any() and not deep[-1].any()
    tap = shallow[:-1] - [0.0, 0.0, 0.4]
    wanted = tap + [0.0, 0.0, 20.0]
    wanted *= 5.0 / np.linalg.norm(wanted, axis=1, keepdims=True)
    assert np.abs(tap).max() > 0.01
    np.testing.assert_allclose(deep[:-1], wanted, atol=1e-9)


def test_a_position_beyond_all_numbers_is_no_force(chai3d):
    assert not chai3d(-1e300).any()


def test_in_chai3d_missed_ticks_are_not_sent_and_a_stall_ends_in_zero(chai3d):
    undisturbed, missed, stalled = chai3d(-0.001), chai3d(-0.001, stall_ms=15.5), chai3d(-0.001, stall_ms=21.5)
    np.testing.assert_array_equal(missed[:AFTER], undisturbed[:AFTER])
    np.testing.assert_array_equal(missed[AFTER : AFTER + 10], undisturbed[AFTER + 14 : AFTER + 24])
    assert undisturbed[AFTER:].any() and len(stalled) == AFTER + 1 and not stalled[-1].any()


@pytest.mark.parametrize(("cap_n", "compiles"), [(5.0, True), (5.5, False)])
def test_a_controller_beyond_the_cap_of_all_forces_does_not_compile_in(vendor, tmp_path, cap_n, compiles):
    model, out = write_model(tmp_path / "model.h5"), tmp_path / "out"
    export_controller(ControllerPlan(model, out, settings=RealtimeSettings(cap_n=cap_n)))
    source = tmp_path / "snippet.cpp"
    source.write_text(snippet("chai3d.h"))
    _, said = compiled_cpp(vendor, source, out)
    assert ("more than all forces together" in said) == (not compiles) and (said == "") == compiles
