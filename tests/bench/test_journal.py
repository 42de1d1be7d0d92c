"""The journal of a run: on disk before anything is written, whole or not there."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from conformance.bench.given_back.journal import NAME, Found, Journal, load_journal
from conformance.errors import BenchError, SpecError

JOURNAL = Journal("/specs/x.yaml", "one", "/benches/y.yaml", 5, 125_000, "0042")
FOUND = Found(
    held={(0x1017, 0): b"\x64\x00", (0x2000, 3): "abort 0602 0000h"},
    stored={(0x1017, 0): b"\0\0"},
    nmt_state="Operational (05h)",
    had_no_errors=True,
    offsets={(0x6013, 0): -7},
)


def test_a_journal_comes_back_as_it_was(tmp_path: Path) -> None:
    JOURNAL.keep(tmp_path / NAME, FOUND)
    read = load_journal(tmp_path)
    assert (read.device, read.variant, read.bench) == ("/specs/x.yaml", "one", "/benches/y.yaml")
    assert (read.node_id, read.bitrate, read.serial) == (5, 125_000, "0042")
    assert read.found == FOUND
    assert not read.given_back
    JOURNAL.keep(tmp_path / NAME, Found({}), given_back=True)
    assert load_journal(tmp_path / NAME).given_back
    assert load_journal(tmp_path).found == Found({})


def test_it_is_on_the_disk_before_it_takes_its_name(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    done: list[str] = []
    sync, rename = os.fsync, Path.replace

    def synced(number: int) -> None:
        done.append("synced")
        sync(number)

    def renamed(path: Path, target: Path) -> Path:
        done.append(f"named {target.name}")
        return rename(path, target)

    monkeypatch.setattr(os, "fsync", synced)
    monkeypatch.setattr(Path, "replace", renamed)
    JOURNAL.keep(tmp_path / NAME, FOUND)
    assert done == ["synced", f"named {NAME}"]


def test_a_full_disk_keeps_the_journal_before(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    JOURNAL.keep(tmp_path / NAME, FOUND)

    def full(*_: Any) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(BenchError, match=r"cannot write .*journal.json: No space left"):
        JOURNAL.keep(tmp_path / NAME, Found({}))
    assert load_journal(tmp_path).found == FOUND


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (None, "expected the folder of a run or its journal.json"),
        ("{", "expected a journal, got"),
        ("[]", "expected a journal of format 1"),
        ("{}", "expected a journal of format 1, got something else"),
        ('{"format": 2}', "expected a journal of format 1, got something else"),
    ],
)
def test_a_wrong_file_is_told(tmp_path: Path, text: str | None, said: str) -> None:
    if text is not None:
        (tmp_path / NAME).write_text(text, encoding="ascii")
    with pytest.raises(SpecError, match=said):
        load_journal(tmp_path)


def test_the_channel_is_kept(tmp_path: Path) -> None:
    replace(JOURNAL, channel="can1").keep(tmp_path / NAME, FOUND)
    assert load_journal(tmp_path).channel == "can1"
