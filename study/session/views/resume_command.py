"""Command line that resumes an unfinished session, for messages after a sitting or a failure of its process.

Called by `run_session`, `end_sitting` and `plan_sitting` of `study.workflows.session`, by `study.cli.watch` and
`study.tui.engine.client`; the form of a new session (`new_session_form`) uses `SIMULATED_DEVICE`.
"""

SIMULATED_DEVICE = "simulated"
"""Name of the simulated device, which `hapteq resume` opens without the option --device. Equal to
`study.devices.opening.SIMULATED`, which this package and the screens must not import, because they load no drivers."""


def find_device_option(logged_name: str, simulated: bool) -> str:
    """Find the name, as `open_device` takes it, of a session's device from its log: for a real one the vendor's name
    without its dot; the simulated device for any other, because a log does not name the file of a replay. Without it
    the command would open the simulated device, on which a session of a real one is refused."""
    return SIMULATED_DEVICE if simulated else logged_name.replace(".", "")


def format_resume_command(session_path: str, device_name: str) -> str:
    """Format the command `hapteq resume`. session_path: path of the session's folder, inserted without shell quotes;
    device_name: as `open_device` takes it."""
    option = "" if device_name == SIMULATED_DEVICE else f" --device {device_name}"
    return f"hapteq resume {session_path}{option}"
