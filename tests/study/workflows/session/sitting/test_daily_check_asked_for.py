"""A sitting at a device that says it is real: without a daily check it is warned of, or refused where that is asked."""

from dataclasses import replace

import pytest

from protocols.definition.preparation import SetupSettings
from study.devices.opening import open_device
from study.errors import DeviceError
from study.session.facts.events import DeviceChecked, TrialPresented
from study.workflows.session import conduct_session
from study.workflows.session.conduct_session import conduct_new
from tests.study.workflows.session.sitting.person import of


@pytest.fixture
def real_device(monkeypatch, tmp_path):
    """The simulated one, taken for real; this computer knows of no daily check."""
    monkeypatch.setenv("HAPTEQ_DEVICE_FILE", str(tmp_path / "none.toml"))

    def opened(*asked):
        device = open_device(*asked)
        device._info = replace(device.info, simulated=False)
        return device

    monkeypatch.setattr(conduct_session, "open_device", opened)


@pytest.mark.slow
def test_a_device_that_was_not_checked_today_is_warned_of_and_that_is_logged(plan, small_protocol, seat, real_device):
    end = conduct_new(plan(small_protocol), "simulated", seat)
    (checked,) = of(end, DeviceChecked)
    assert "Daily check: none yet (warning)" in checked.findings
    assert of(end, TrialPresented)


def test_a_protocol_may_refuse_a_device_that_was_not_checked_today(plan, small_protocol, seat, person, real_device):
    strict = replace(small_protocol, setup=SetupSettings(daily_check_needed=True))
    with pytest.raises(DeviceError, match="requires a passed daily check.*none yet.*hapteq resume"):
        conduct_new(plan(strict), "simulated", seat)
    assert not person.questions and "welcome" not in person.calls


def test_a_simulated_device_needs_no_daily_check(plan, small_protocol, seat):
    strict = replace(small_protocol, setup=SetupSettings(daily_check_needed=True))
    end = conduct_new(plan(strict), "simulated", seat)
    assert not end.end_reason and not any("Daily" in line for line in of(end, DeviceChecked)[0].findings)
