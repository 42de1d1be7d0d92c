"""Other people's Python that does something on the bench, found by its entry point."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from importlib.metadata import entry_points
from typing import Any

from conformance.errors import BenchError, first_line


def made(group: str, name: str, methods: Sequence[str]) -> Any:
    """Call an entry point and return what it makes.

    Args:
        group: The group of the entry point.
        name: Its name.
        methods: What the object must have.

    Raises:
        BenchError: There is none, or it fails, or it makes something else.
    """
    found = entry_points(group=group, name=name)
    if not found:
        known = ", ".join(sorted({it.name for it in entry_points(group=group)})) or "none"
        raise BenchError(f"{group}: no entry point {name!r} is installed (there are: {known})")

    def make() -> Any:
        return next(iter(found)).load()()

    it = called(group, name, make)
    lacking = [method for method in methods if not callable(getattr(it, method, None))]
    if lacking:
        raise BenchError(f"{group}: {name!r} makes what has no {' and no '.join(lacking)}")
    return it


def called(group: str, name: str, call: Callable[..., Any], *arguments: object) -> Any:
    """Call other people's Python.

    Raises:
        BenchError: It failed, in whatever way.
    """
    try:
        return call(*arguments)
    except Exception as error:
        raise BenchError(f"{group}: {name!r} failed: {first_line(error)}") from error
