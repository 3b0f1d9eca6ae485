"""The command palette: all actions of the present screen, each with its key and its command-line equivalent.

Thus an action can be found by its name, and a user learns how to do the same without the screen.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from typing import Any

from textual.app import App, SystemCommand
from textual.screen import Screen

EQUIVALENT_LAWS = {
    "begin": "hapteq study --subject CODE",
    "resume": "hapteq resume SESSION",
    "decide('resume')": "hapteq resume SESSION",
    "analyze": "hapteq analyze SESSION",
    "diagnose": "hapteq diagnose REC.h5 --model MODEL.toml --out DIR",
    "sensor": "hapteq doctor --calibrate-sensor PORT --keep",
    "withdraw": "hapteq withdraw SESSION",
    "watch": "hapteq watch SESSION",
    "past": "hapteq sessions",
    "decide('home')": "hapteq sessions",
    "app.start_screen": "hapteq sessions",
    "browse": "hapteq show PATH",
    "stop": "hapteq watch SESSION --stop",
    "let_go": "hapteq watch SESSION --stop",
    "pause": "hapteq watch SESSION --pause",
    "reply('pause')": "hapteq watch SESSION --pause",
    "note(False)": "hapteq note SESSION TEXT",
    "note(True)": "hapteq note --adverse SESSION TEXT",
    "quit": "Ctrl-C in line mode",
}
"""Command-line equivalent of an action, by the name of the action in its binding."""

TITLES = {
    "let_go": "Take the force off and leave",
    "note(False)": "Take a note",
    "note(True)": "Note an adverse event",
    "suspend_process": "Suspend",
    "watch": "Watch this session",
    "pause": "Pause",
    "next_theme": "Light, dark or high contrast",
    "heard(1)": "",
    "heard(2)": "",
    "command_palette": "",
}
"""Titles of actions whose descriptions in the footer are too short, or that the footer does not show. An empty title
hides the action."""


def commands(app: App[Any], screen: Screen[Any]) -> Iterator[SystemCommand]:
    """The enabled actions of this screen and of the application, each once, as entries of the palette."""
    listed = set()
    for active in screen.active_bindings.values():
        binding = active.binding
        action = binding.action.removeprefix("app.").removeprefix("screen.")
        title = TITLES.get(action, binding.tooltip or binding.description)
        hidden = not binding.show and action not in TITLES
        if hidden or not title or not active.enabled or action in listed:
            continue
        listed.add(action)
        key = app.get_key_display(binding)
        twin = EQUIVALENT_LAWS.get(action)
        run = partial(app.run_action, binding.action, active.node)
        yield SystemCommand(title, f"Key: {key}.{f' In a terminal: {twin}' if twin else ''}", run)
