"""Command line that resumes an unfinished session, for messages."""

import shlex

SIMULATED_DEVICE = "simulated"
"""Name of the simulated device, which `hapteq resume` opens without the option --device. Equal to
`study.devices.opening.SIMULATED`, which is not imported, because this package loads no drivers."""


def find_device_option(logged_name: str, simulated: bool) -> str:
    """Find the name, as `open_device` takes it, of the device that a session's log names: for a real one the vendor's
    name without dots; otherwise the simulated device, because a log does not name the file of a replay."""
    return SIMULATED_DEVICE if simulated else logged_name.replace(".", "")


def format_logged_resume_command(session_path: str, logged_name: str, simulated: bool) -> str:
    """Format the command `hapteq resume` on the device that the session's log names. session_path: path of the
    session's folder."""
    return format_resume_command(session_path, find_device_option(logged_name, simulated))


def format_resume_command(session_path: str, device_name: str) -> str:
    """Format the command `hapteq resume`. session_path: path of the session's folder; device_name: as `open_device`
    takes it. Both are quoted for a POSIX shell where needed."""
    option = () if device_name == SIMULATED_DEVICE else ("--device", device_name)
    return shlex.join(("hapteq", "resume", session_path, *option))
