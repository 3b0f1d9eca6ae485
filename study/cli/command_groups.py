"""Grouped command list of `--help`, with each line whole."""

from typing import Any

from typer.core import TyperGroup


class CommandGroups(TyperGroup):
    """Groups by each command's `rich_help_panel`, so that plain help and typer with rich show the same groups."""

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        groups: dict[str, list[tuple[str, str]]] = {}
        for name, command in self.commands.items():
            words = command.get_short_help_str(limit=200)
            groups.setdefault(getattr(command, "rich_help_panel", None) or "Commands", []).append((name, words))
        for title, rows in groups.items():
            with formatter.section(title):
                formatter.write_dl(rows)
