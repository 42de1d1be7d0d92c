"""The terminal: plain words, tables, errors in one sentence."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from rich.console import Console
from rich.markup import escape
from rich.table import Table


class Terminal:
    """Standard output and standard error."""

    def __init__(self) -> None:
        self.out = Console(highlight=False, soft_wrap=True)
        self._err = Console(stderr=True, highlight=False, soft_wrap=True)

    def say(self, text: str = "", style: str | None = None) -> None:
        """Print a line as it is; text from a device is never taken for markup."""
        self.out.print(escape(text), style=style)

    def error(self, text: str) -> None:
        """Print an error to standard error."""
        self._err.print(f"[bold red]error:[/] {escape(text)}")

    def table(self, heads: Sequence[str], rows: Iterable[Sequence[str]]) -> None:
        """Print a table; its columns are as wide as their content when the output is no terminal."""
        table = Table(box=None, pad_edge=False, header_style="bold")
        for head in heads:
            table.add_column(head, overflow="fold")
        for row in rows:
            table.add_row(*(escape(cell) for cell in row))
        if self.out.is_terminal:
            self.out.print(table)
        else:
            self.out.print(table, width=500, no_wrap=True, crop=False)


console = Terminal()
