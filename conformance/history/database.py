"""Opens the database of the history: SQLite in a file, or a site's PostgreSQL server."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final

from platformdirs import user_data_path
from sqlalchemy import Connection, Engine, Integer, create_engine, event, literal_column, text
from sqlalchemy.dialects import postgresql, sqlite
from sqlalchemy.engine import URL, make_url
from sqlalchemy.exc import ArgumentError, NoSuchModuleError, SQLAlchemyError
from sqlalchemy.schema import Table
from sqlalchemy.sql.dml import ReturningInsert

from conformance.errors import BenchError, SpecError, first_line
from conformance.history.schema import bring_up_to_date
from conformance.history.where import EXPECTED, VARIABLE

WAIT_S: Final = 30
"""How long a station waits for another one's transaction."""

_LOCK: Final = 0x43414E6F
"""PostgreSQL's advisory lock while the tables are made."""

_WRITES: Final = {"writes": True}


class Database:
    """A database whose tables are those of this version.

    Args:
        asked: Its URL; empty for that of the environment, else the user's own file.
        create: Make what does not exist yet.

    Raises:
        SpecError: There is no such database, or it is none of this suite.
        BenchError: It cannot be opened.
    """

    def __init__(self, asked: str = "", *, create: bool) -> None:
        url = _url(asked)
        self.name = url.render_as_string(hide_password=True)
        self._sqlite = url.get_backend_name() == "sqlite"
        if self._sqlite:
            _find_file(url, self.name, create=create)
        try:
            self._engine = _engine(url)
        except ImportError as error:
            raise SpecError(
                f"{self.name}: expected psycopg for PostgreSQL, got none: "
                "pip install 'canopen-conformance[postgresql]'"
            ) from error
        try:
            with self.writing() as connection:
                if not self._sqlite:
                    lock = text("select pg_advisory_xact_lock(:n)")
                    connection.execute(lock, {"n": _LOCK})
                bring_up_to_date(connection, self.name)
        except BaseException:
            self.close()
            raise

    def close(self) -> None:
        """Close every connection."""
        self._engine.dispose()

    @contextmanager
    def writing(self) -> Iterator[Connection]:
        """Return a connection in a transaction that ends with the block: all of it is kept, or nothing.

        Raises:
            BenchError: The database fails.
        """
        with self._translated(), self._engine.connect() as plain:
            connection = plain.execution_options(**_WRITES)
            with connection.begin():
                yield connection

    @contextmanager
    def reading(self) -> Iterator[Connection]:
        """Return a connection that sees one state of the database.

        Raises:
            BenchError: The database fails.
        """
        with self._translated(), self._engine.connect() as plain:
            yield plain

    def insert_missing(
        self,
        connection: Connection,
        table: Table,
        values: Mapping[str, str | int | None],
        *keys: str,
    ) -> bool:
        """Insert a row unless one with the same keys is there; tell whether it was inserted."""
        insert = sqlite.insert if self._sqlite else postgresql.insert
        new: ReturningInsert[tuple[int]] = (
            insert(table)
            .values(values)
            .on_conflict_do_nothing(index_elements=keys)
            .returning(literal_column("1", Integer))
        )
        return connection.execute(new).first() is not None

    @contextmanager
    def _translated(self) -> Iterator[None]:
        try:
            yield
        except SQLAlchemyError as error:
            cause = getattr(error, "orig", None) or error
            raise BenchError(f"the history {self.name} failed: {first_line(cause)}") from error


def _url(asked: str) -> URL:
    """Return the URL of the database that is meant.

    Raises:
        SpecError: It is none, or of another database.
    """
    option = "--database" if asked else VARIABLE
    asked = asked or os.environ.get(VARIABLE, "")
    if not asked:
        own = user_data_path("canopen-conformance", appauthor=False) / "history.sqlite"
        return URL.create("sqlite", database=str(own))
    try:
        url = make_url(asked)
        backend = url.get_backend_name()
    except (ArgumentError, NoSuchModuleError, ValueError) as error:
        raise SpecError(f"{option}: expected {EXPECTED}, got what is no URL") from error
    if backend == "sqlite" and url.database not in (None, "", ":memory:"):
        return URL.create("sqlite", database=url.database)
    if backend == "postgresql":
        return url.set(drivername="postgresql+psycopg")
    shown = url.render_as_string(hide_password=True)
    raise SpecError(f"{option}: expected {EXPECTED}, got {shown!r}")


def _find_file(url: URL, name: str, *, create: bool) -> None:
    """Make the folder of a database, or see that the file is there.

    Raises:
        SpecError: It is not.
        BenchError: The folder cannot be made.
    """
    path = Path(str(url.database))
    if create:
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise BenchError(f"cannot make {path.parent}: {error.strerror}") from error
    elif not path.is_file():
        raise SpecError(f"{name}: expected a history, got no file: `history add RUN` makes it")


def _engine(url: URL) -> Engine:
    if url.get_backend_name() != "sqlite":
        return create_engine(url, connect_args={"connect_timeout": WAIT_S})
    engine = create_engine(url, connect_args={"timeout": WAIT_S})
    event.listen(engine, "connect", _set_up_sqlite)
    event.listen(engine, "begin", _begin_sqlite)
    return engine


def _set_up_sqlite(connection: Any, _record: object) -> None:
    connection.isolation_level = None  # transactions begin where `_begin_sqlite` says so
    connection.execute("pragma foreign_keys = on")
    if connection.execute("pragma journal_mode").fetchone() != ("wal",):
        connection.execute("pragma journal_mode = wal")


def _begin_sqlite(connection: Connection) -> None:
    """Take the write lock at once where it will be needed, for it cannot always be taken later."""
    writes = connection.get_execution_options().get("writes", False)
    connection.exec_driver_sql("begin immediate" if writes else "begin")
