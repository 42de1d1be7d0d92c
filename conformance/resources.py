"""The data folders, in a checkout or in an installed wheel."""

from __future__ import annotations

from pathlib import Path

from conformance.errors import SpecError

_PACKAGE = Path(__file__).resolve().parent


def data(folder: str) -> Path:
    """Return a data folder: ``device_specs``, ``fixtures/benches``, ``fixtures/faults``, …."""
    installed = _PACKAGE / "_data" / folder
    return installed if installed.is_dir() else _PACKAGE.parent / folder


def is_file(name: str) -> bool:
    """Tell whether a text is the path of a file, however long it is."""
    try:
        return Path(name).is_file()
    except OSError:
        return False


def find(folder: str, name: str, option: str) -> Path:
    r"""Return a YAML file by built-in name or by path.

    Args:
        folder: Data folder that holds the built-in ones.
        name: A built-in name, or a path (with ``/``, ``\`` or the ending ``.yaml``).
        option: The argument to name in the error.

    Raises:
        SpecError: There is no such file.
    """
    path = Path(name)
    if path.suffix in (".yaml", ".yml") or len(path.parts) > 1:
        if is_file(name):
            return path
        raise SpecError(f"{option}: expected a readable file, got {name!r}")
    built_in = data(folder) / f"{name}.yaml"
    if is_file(str(built_in)):
        return built_in
    known = ", ".join(names(folder)) or "none"
    raise SpecError(f"{option}: expected a path or one of {known}, got {name!r}")


def names(folder: str) -> list[str]:
    """Return the built-in names of a data folder."""
    return sorted(
        path.stem
        for path in data(folder).glob("*.yaml")
        if not path.stem.endswith((".statements", ".equivalents"))
    )
