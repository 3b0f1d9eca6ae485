"""Command line that continues an unfinished session, for messages at the end of a sitting."""

DEFAULT_DEVICE = "simulated"
"""Device of `hapteq resume` without the option --device."""


def format_resume_command(session_path: str, device_name: str) -> str:
    """Format the command. session_path: of the session's folder; device_name: as `open_device` takes it."""
    option = "" if device_name == DEFAULT_DEVICE else f" --device {device_name}"
    return f"hapteq resume {session_path}{option}"
