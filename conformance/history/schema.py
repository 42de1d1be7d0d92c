"""The tables of the history and their version.

Texts from devices and people are kept as `conformance.report.printable` shows them, for no database
takes every character. Times are texts in ISO 8601, UTC.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final

from sqlalchemy import (
    Boolean,
    Column,
    Connection,
    ForeignKey,
    Index,
    Integer,
    MetaData,
    String,
    Table,
    UniqueConstraint,
    insert,
    inspect,
    select,
    text,
    update,
)

from conformance.errors import SpecError

VERSION: Final = 3
STEPS: Final[Mapping[int, Sequence[str]]] = {
    1: (),
    2: (
        "alter table runs add column label varchar not null default ''",
        "alter table runs add column told varchar not null default ''",
        "create index runs_by_label on runs (label)",
        "create index runs_by_told on runs (told)",
    ),
}
"""Version to the statements that make the next one of it, in the SQL of both databases.

Tables that are new need none.
"""

metadata = MetaData()

versions = Table("schema_version", metadata, Column("version", Integer, nullable=False))

units = Table(
    "units",
    metadata,
    Column("id", Integer, primary_key=True),
    Column("device", String, nullable=False),
    Column("serial", String, nullable=False),
    UniqueConstraint("device", "serial"),
    Index("units_by_serial", "serial"),
)

lots = Table(
    "lots",
    metadata,
    Column("id", Integer, primary_key=True),
    Column("name", String, nullable=False, unique=True),
    Column("part", String, nullable=False),
    Column("order_number", String, nullable=False),
    Column("size", Integer, nullable=False),
    Column("plan", String, nullable=False),
    Column("verdict", String, nullable=False),
    Column("decided", String, nullable=False),
)

places = Table(
    "places",
    metadata,
    Column("lot_id", ForeignKey("lots.id"), primary_key=True),
    Column("place", Integer, primary_key=True),
    Column("unit_id", ForeignKey("units.id"), nullable=False),
    Index("places_by_unit", "unit_id"),
)

runs = Table(
    "runs",
    metadata,
    Column("id", Integer, primary_key=True),
    Column("sha256", String(64), nullable=False, unique=True),
    Column("unit_id", ForeignKey("units.id")),
    Column("device", String, nullable=False),
    Column("variant", String, nullable=False),
    Column("started", String, nullable=False),
    Column("verdict", String, nullable=False),
    Column("complete", Boolean, nullable=False),
    Column("selected", String, nullable=False),
    Column("items", Integer, nullable=False),
    Column("deviations", Integer, nullable=False),
    Column("suite", String, nullable=False),
    Column("spec_sha256", String, nullable=False),
    Column("firmware", String, nullable=False),
    Column("bench", String, nullable=False),
    Column("simulated", Boolean, nullable=False),
    Column("path", String, nullable=False),
    Column("label", String, nullable=False, server_default=""),
    Column("told", String, nullable=False, server_default=""),
    Index("runs_by_unit", "unit_id", "started"),
    Index("runs_by_device", "device", "verdict", "started"),
    Index("runs_by_label", "label"),
    Index("runs_by_told", "told"),
)

deviations = Table(
    "deviations",
    metadata,
    Column("run_id", ForeignKey("runs.id"), primary_key=True),
    Column("item", String, primary_key=True),
    Column("quantity", String, nullable=False),
    Column("expected", String, nullable=False),
    Column("actual", String, nullable=False),
    Column("unit", String, nullable=False),
    Index("deviations_by_item", "item"),
)

concluded = Table(
    "concluded",
    metadata,
    Column("id", Integer, primary_key=True),
    Column("series", String, nullable=False),
    Column("lot", String, nullable=False),
    Column("content", String, nullable=False),
    UniqueConstraint("series", "lot"),
)


def bring_up_to_date(connection: Connection, name: str) -> None:
    """Make the tables, or those of an older version into this one's.

    Args:
        connection: In a transaction that no other station's can overtake.
        name: Of the database, for messages.

    Raises:
        SpecError: A newer version of the suite made them.
    """
    if not inspect(connection).has_table(versions.name):
        metadata.create_all(connection)
        connection.execute(insert(versions).values(version=VERSION))
        return
    found = connection.execute(select(versions.c.version)).scalar_one()
    if found > VERSION:
        raise SpecError(
            f"{name}: expected a history of version {VERSION} or older, got version {found}: "
            "a newer canopen-conformance made it"
        )
    for version in range(found, VERSION):
        for statement in STEPS[version]:
            connection.execute(text(statement))
    if found < VERSION:
        metadata.create_all(connection)
        connection.execute(update(versions).values(version=VERSION))
