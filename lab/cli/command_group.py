"""A group of commands: its help is read from their rows, and only the command that was typed is loaded."""

from collections.abc import Callable
from typing import Any

from typer.core import TyperCommand, TyperGroup


class UnloadedCommand(TyperCommand):
    """A command of which no more is known than its name, the first line of its help, and what loads the rest of it."""

    def __init__(self, name: str, help_text: str, load: Callable[[], Any]) -> None:
        super().__init__(name, help=help_text)
        self.load = load


class CommandGroup(TyperGroup):
    """Commands, loaded when they are typed; its help is drawn as typer draws one, without rich's Markdown."""

    def resolve_command(self, ctx: Any, args: list[str]) -> tuple[str | None, Any, list[str]]:
        """The name, the command and the words that follow."""
        name, command, rest = super().resolve_command(ctx, args)
        return name, command.load() if isinstance(command, UnloadedCommand) else command, rest

    def format_help(self, ctx: Any, formatter: Any) -> None:
        """Prints the help of the group."""
        from rich.console import Console
        from rich.padding import Padding
        from rich.panel import Panel
        from rich.table import Table
        from rich.text import Text

        options = [record for param in self.get_params(ctx) if (record := param.get_help_record(ctx))]
        commands = [(name, command.help or "") for name, command in self.commands.items()]
        console = Console(highlight=False)
        usage = self.get_usage(ctx).split(" ", 1)
        console.print(Padding(Text.assemble((usage[0], "yellow"), f" {usage[1]}"), 1), style="bold")
        console.print(Padding(Text(self.help or ""), (0, 1, 1, 1)))
        for title, rows in (("Options", options), ("Commands", commands)):
            table = Table(show_header=False, box=None, expand=True, pad_edge=False)
            table.add_column(style="bold cyan", no_wrap=True)
            table.add_column(ratio=1)
            for name, meaning in rows:
                table.add_row(name, Text(meaning))
            console.print(Panel(table, title=title, title_align="left", border_style="dim"))
