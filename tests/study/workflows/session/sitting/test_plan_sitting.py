"""The note of a plan about an unfinished session states a command that continues it."""

import pytest

from protocols.document.loading import load_protocol
from study.session.facts.events import DeviceFacts
from study.store.sessions.archive import create_session_folder
from study.store.sessions.event_log import EventLog
from study.workflows.session.plan_sitting import plan_sitting
from tests.session_facts import opened

PROTOCOL = (
    'name = "small"\nkind = "study"\ntitle = "A small study"\n[stimulus]\nfrequencies_hz = [25.0]\n'
    "[staircase]\nstart_n = 1.0\ncap_n = 3.0\nup_after_wrong = 1\ndown_after_right = 3\n"
    "steps = [{ step_db = 4.0, reversals = 3 }]\nreversals = 3\naveraged_reversals = 2\n[directions]\n"
    "[safety]\nstimulus_cap_n = 3.0\ntotal_cap_n = 4.5\n"
)


@pytest.mark.parametrize(
    ("device", "option"),
    [(DeviceFacts("omega.7", False, 1000.0), " --device omega7"), (DeviceFacts("simulated omega.3", True, 1000.0), "")],
)
def test_the_command_names_the_real_device_on_which_the_session_was_begun(tmp_path, device, option):
    path = tmp_path / "small.toml"
    path.write_text(PROTOCOL)
    folder = create_session_folder(tmp_path / "data", "P01")
    log = EventLog.create(folder.log)
    log.append(opened(load_protocol(PROTOCOL, "small.toml"), PROTOCOL, session=folder.name, device=device))
    log.close()
    (note,) = plan_sitting(str(path), "P01", None, 3, tmp_path / "data").notes
    assert note == f"P01_001 is not finished; hapteq resume {folder.path}{option} continues it."
