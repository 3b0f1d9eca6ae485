"""Device settings that follow from a study protocol: force limits, centring spring, recorded part of each trial."""

from protocols.definition.study_protocol import StudyProtocol
from study.devices.device import DeviceSettings
from study.session.stimulus.limits import make_study_limits


def make_device_settings(protocol: StudyProtocol, hand_on_handle: bool = True) -> DeviceSettings:
    """Make the settings with which a device is opened. hand_on_handle: whether a hand holds the handle; a simulated
    device then has a simulated hand."""
    return DeviceSettings(
        limits=make_study_limits(protocol),
        spring_frequency_hz=protocol.spring.natural_frequency_hz,
        spring_damping_n_s_per_m=protocol.spring.damping_n_s_per_m,
        keep_s=protocol.measurement.keep_s,
        hand_on_handle=hand_on_handle,
    )
