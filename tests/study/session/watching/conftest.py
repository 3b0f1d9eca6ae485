"""Sessions to be followed."""

import pytest

from protocols.document.loading import load_protocol
from tests.watched_story import Story


@pytest.fixture
def story(small_protocol, small_text) -> Story:
    return Story(small_protocol, small_text)


@pytest.fixture
def with_parts(small_text):
    """The small protocol and some parts more."""

    def story(*parts: str) -> Story:
        text = "\n".join((small_text, *parts))
        return Story(load_protocol(text, "small.toml"), text)

    return story
