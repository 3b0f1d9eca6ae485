"""A question that is asked."""

import pytest

from study.tui.screens.trial import TrialScreen
from tests.study.tui.screens.trial.questions import QUESTION


@pytest.fixture
def asked(on_stage):
    """Presses keys while one question is asked; returns the replies, and the words on the screen at the end."""

    def ask(*keys, question=QUESTION, screen=None):
        screen = screen if screen is not None else TrialScreen()
        seen = []

        async def story(stage):
            screen.arm(question)
            await stage.press(*keys)
            seen.append(stage.words)

        return on_stage(screen, story), seen[0]

    return ask
