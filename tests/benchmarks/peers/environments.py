"""A virtual environment for each peer, made when first needed and kept beside the checkout's own."""

import subprocess
import sys
from pathlib import Path

from peer_table import Peer

FOLDER = Path(__file__).resolve().parents[3] / ".venv-peers"
PATIENCE_S = 600.0


class NotInstalledError(Exception):
    """The text is the last line of what pip, or venv, had to say."""


def python_of(peer: Peer) -> Path:
    """The interpreter that has the peer. Raises NotInstalledError."""
    environment = FOLDER / peer.name
    python, mark = environment / "bin" / "python", environment / ".installed"
    wanted = "\n".join(peer.requirements)
    if mark.is_file() and mark.read_text() == wanted:
        return python
    _ran([sys.executable, "-m", "venv", "--clear", str(environment)])
    _ran([str(python), "-m", "pip", "install", "--quiet", "--disable-pip-version-check", *peer.requirements])
    mark.write_text(wanted)
    return python


def _ran(command: list[str]) -> None:
    try:
        done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=PATIENCE_S)
    except subprocess.TimeoutExpired:
        raise NotInstalledError(f"took longer than {PATIENCE_S:.0f} s") from None
    if done.returncode:
        raise NotInstalledError(last_line(done.stderr) or last_line(done.stdout) or f"exit code {done.returncode}")


def last_line(text: str) -> str:
    """The last that tells something; pip may warn after it has failed."""
    lines = [line.strip() for line in text.splitlines() if line.strip()]
    errors = [line for line in lines if line.startswith("ERROR")]
    return (errors or lines or [""])[-1]
