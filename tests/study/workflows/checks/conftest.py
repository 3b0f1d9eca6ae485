"""A device on the stub of the vendor's library that is as new but for what is given, and its recordings."""

import contextlib
import shutil
from dataclasses import replace

import pytest

from protocols.definition.recording_segments import MultisineSegment
from study.devices.clock import VirtualClock
from study.devices.device import DeviceInfo
from study.devices.opening import get_device_folder
from study.devices.safe import SafeDevice
from study.store.disk.provenance import compute_sha256
from study.store.formats.protocol_files import read_recording_protocol
from study.store.formats.recording_file import read_recording
from study.workflows.checks.daily_check import MotionCallbacks, check_on_device
from study.workflows.recording.record_device import RecordingPlan, make_recording_settings, record_on_device

AS_NEW = {"friction": 0.15, "damping": 1.0, "mode_hz": 60.0, "noise": 0.05}
QUIET = MotionCallbacks(lambda notice: None, lambda done: None)


def short():
    """The shipped protocol with fewer and shorter periods: a fifth of its time."""
    protocol = read_recording_protocol("daily_check").protocol
    segments = tuple(
        replace(segment, duration_s=1.0, periods=3)
        if isinstance(segment, MultisineSegment)
        else replace(segment, duration_s=4.0, settle_s=1.0)
        for segment in protocol.segments
    )
    return replace(protocol, segments=segments, rest_s=0.5)


@pytest.fixture
def device_like(stepped_stub):
    """A device as new, but for what is given; its accelerometer's noise from a seed."""

    @contextlib.contextmanager
    def made(seed: int, changed: dict[str, float]):
        state = AS_NEW | changed
        for name in ("friction", "damping", "mode_hz", "gain"):
            stepped_stub.set(name, state.get(name, 1.0))
        stepped_stub.set("noise", state["noise"])
        stepped_stub.seed = seed
        rig = stepped_stub.rig()
        plan = RecordingPlan(short(), "omega3", (0.0, 0.0, 0.0), 1, get_device_folder() / f"{seed}.h5")
        stepped_stub.move(0.0, 0.0, 0.0)
        with contextlib.closing(SafeDevice(rig, make_recording_settings(plan), VirtualClock())) as device:
            yield device, plan

    return made


@pytest.fixture(scope="session")
def kept(tmp_path_factory):
    """Recordings that were made once, for each test that asks for the same device on the same day."""
    return tmp_path_factory.mktemp("kept")


@pytest.fixture
def recorded(device_like, kept):
    def record(seed: int, **changed: float):
        out = get_device_folder() / f"{seed}.h5"
        once = kept / f"{'-'.join(map(str, (seed, *changed, *changed.values())))}.h5"
        if not once.exists():
            with device_like(seed, changed) as (device, plan):
                record_on_device(device, plan, lambda done: None, lambda notice: None)
            plan.out.rename(once)
        shutil.copyfile(once, out)
        return read_recording(out)

    return record


INFO = DeviceInfo("omega.3", False, 1000.0, 12.0, 0.28, "serial 4242, firmware 2.41, SDK 3.17.5.0")


@pytest.fixture
def two_days(recorded, device_like, vendor):
    """Accepted with a baseline, which is given back, and a function that checks that device once more."""
    recorded(1)
    baseline = get_device_folder() / "1.h5"
    vendor.accept("omega.3", baseline=(baseline.name, compute_sha256(baseline)))

    def again(seed: int, **changed: float):
        with device_like(seed, changed) as (device, plan):
            return check_on_device(device, plan, QUIET)

    return baseline, again
