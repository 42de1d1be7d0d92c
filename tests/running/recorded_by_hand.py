"""Recordings that a test writes frame by frame, and what is judged of them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from recorded_session import SPECS

from conformance.judging.record import Judging
from conformance.judging.recording import read_recording
from conformance.spec.load import load_spec


def verdict_of(
    frames: Sequence[tuple[float, str]], item: str, folder: Path, device: str = "siko_ims360"
) -> str:
    """Return an item's verdict, or ``none`` where there is no such item.

    Args:
        frames: Each with its time in s, as candump writes them.
        item: Its id without the device's name.
        folder: Where the recording goes.
        device: Built-in name.
    """
    path = folder / "recording.log"
    lines = (f"({1000 + time_s:.6f}) can0 {frame}\n" for time_s, frame in frames)
    path.write_text("".join(lines), encoding="ascii")
    spec = load_spec(SPECS / f"{device}.yaml").resolve(None, None)
    results = Judging(read_recording(path), spec, spec.bitrate, 1.0).results()
    return next((it.verdict for it in results.items if it.id == f"{device}/{item}"), "none")
