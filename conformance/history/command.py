"""The command line's `history`: what is known of a unit, a lot, or all of them."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final

import typer

from conformance.errors import SpecError
from conformance.history.where import EXPECTED, VARIABLE

if TYPE_CHECKING:
    from conformance.history.acting import Entering

ADD: Final = "add"

DatabaseOption = Annotated[
    str,
    typer.Option(metavar="URL", help=f"{EXPECTED}; ${VARIABLE} or a file of your own if absent."),
]


def history(
    words: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="[SERIAL | add RUN...]", help="A unit's serial number, or runs to enter."
        ),
    ] = None,
    lot: Annotated[str, typer.Option(help="The units of this lot.")] = "",
    export: Annotated[
        Path | None, typer.Option(metavar="FILE.csv", help="Write the runs asked for as CSV.")
    ] = None,
    database: DatabaseOption = "",
) -> None:
    """Tell what is known of a unit, of a lot, or of all; or enter runs that are finished."""
    from conformance.history import acting  # noqa: PLC0415 - the database takes long to load

    asked = words or []
    if asked[:1] == [ADD]:
        if lot or export:
            raise SpecError("history add: expected runs alone, got --lot or --export as well")
        acting.add([Path(it) for it in asked[1:]], database)
        return
    if len(asked) > 1 or (asked and lot):
        raise SpecError("history: expected one serial number, or --lot, or add RUN..., got more")
    acting.show(database, asked[0] if asked else "", lot, export)


def prepared(url: str, *, create: bool = True) -> Entering:
    """See that runs can be entered, before one begins; return what enters them.

    Args:
        url: Of the database.
        create: Make what does not exist yet.

    Raises:
        SpecError: The database is none of this suite.
        BenchError: It cannot be opened.
    """
    from conformance.history.acting import Entering  # noqa: PLC0415 - the database takes long to load

    return Entering(url, create=create)
