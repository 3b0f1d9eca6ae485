"""Hand-made facts of a session, for folds driven without any device."""

from types import ModuleType

import pytest

from tests import session_facts


@pytest.fixture(scope="session")
def facts() -> ModuleType:
    """The builders of `tests/session_facts.py`."""
    return session_facts
