"""Command line that resumes an unfinished session, for messages after a sitting or a failure of its process.

Called by `run_session` and `end_sitting` of `study.workflows.session`, and by `study.tui.engine.client`; the form of a
new session (`new_session_form`) uses `SIMULATED_DEVICE`.
"""

SIMULATED_DEVICE = "simulated"
"""Name of the simulated device, which `hapteq resume` opens without the option --device. Equal to
`study.devices.opening.SIMULATED`, which this package and the screens must not import, because they load no drivers."""


def format_resume_command(session_path: str, device_name: str) -> str:
    """Format the command `hapteq resume`. session_path: path of the session's folder, inserted without shell quotes;
    device_name: as `open_device` takes it."""
    option = "" if device_name == SIMULATED_DEVICE else f" --device {device_name}"
    return f"hapteq resume {session_path}{option}"
