"""Entries of Textual's command palette: the current actions, each with its key and, where there is one, the equivalent
command line.

Users find an action by its name, and learn the shell command that does the same.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from typing import Any

from textual.app import App, SystemCommand
from textual.screen import Screen

EQUIVALENT_COMMAND_LINES = {
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
"""Equivalent of an action outside the screen, by the name of the action in its key binding: a shell command, or the key
of line mode."""

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


def generate_commands(app: App[Any], screen: Screen[Any]) -> Iterator[SystemCommand]:
    """Generate the entries of the palette, each action once: enabled ones that the footer shows or `TITLES` names."""
    listed_actions = set()
    for active_binding in screen.active_bindings.values():
        binding = active_binding.binding
        action = binding.action.removeprefix("app.").removeprefix("screen.")
        title = TITLES.get(action, binding.tooltip or binding.description)
        is_hidden = not binding.show and action not in TITLES
        if is_hidden or not title or not active_binding.enabled or action in listed_actions:
            continue
        listed_actions.add(action)
        key = app.get_key_display(binding)
        command_line = EQUIVALENT_COMMAND_LINES.get(action)
        run_action = partial(app.run_action, binding.action, active_binding.node)
        yield SystemCommand(
            title, f"Key: {key}.{f' In a terminal: {command_line}' if command_line else ''}", run_action
        )
