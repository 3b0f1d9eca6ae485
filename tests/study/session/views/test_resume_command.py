"""The command that continues a session names the device, unless the command takes it anyway."""

import shlex

from study.devices.force_dimension.device_models import MODELS
from study.devices.opening import SIMULATED
from study.session.views.resume_command import SIMULATED_DEVICE, find_device_option, format_resume_command


def test_a_real_device_is_named():
    assert format_resume_command("data/P01_001", "omega3") == "hapteq resume data/P01_001 --device omega3"


def test_the_default_device_is_left_out():
    assert format_resume_command("data/P01_001", SIMULATED) == "hapteq resume data/P01_001"
    assert SIMULATED_DEVICE == SIMULATED


def test_a_folder_with_a_blank_is_one_word_for_the_shell():
    command = format_resume_command("my data/P01_001", "replay:my run.h5")
    assert shlex.split(command) == ["hapteq", "resume", "my data/P01_001", "--device", "replay:my run.h5"]


def test_each_real_device_of_a_log_is_opened_by_its_own_name():
    assert [find_device_option(model.name, simulated=False) for model in MODELS.values()] == list(MODELS)
    assert find_device_option("simulated omega.3", simulated=True) == SIMULATED
