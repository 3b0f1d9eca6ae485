"""The command that continues a session names the device, unless the command takes it anyway."""

from study.devices.opening import SIMULATED
from study.session.views.resume_command import SIMULATED_DEVICE, format_resume_command


def test_a_real_device_is_named():
    assert format_resume_command("data/P01_001", "omega3") == "hapteq resume data/P01_001 --device omega3"


def test_the_default_device_is_left_out():
    assert format_resume_command("data/P01_001", SIMULATED) == "hapteq resume data/P01_001"
    assert SIMULATED_DEVICE == SIMULATED
