"""What a reader of a record has to know before its verdict is relied on, in sentences."""

from __future__ import annotations

from collections.abc import Iterator

from conformance.report.record import Record


def cautions(record: Record) -> Iterator[str]:
    """Return the sentences; text from the record is in them as it is, however long."""
    run, summary = record.run, record.summary
    if is_simulated(record):
        yield "A simulated device was judged, no real one."
    faults = run.get("faults")
    if isinstance(faults, list) and faults:
        yield f"It was given defects on purpose: {', '.join(map(str, faults))}."
    if run.get("simulate_spec"):
        yield f"It was built from another spec: {run['simulate_spec']}."
    if run.get("select"):
        yield f"Only a part of the items was judged, those selected by “{run['select']}”."
    if summary.aborted:
        yield f"The run ended early: {summary.aborted}"
    elif not summary.complete:
        yield "The run did not come to its end: items are missing."
    yield from (text for text in (summary.left_changed, summary.illegal) if text)
    not_judged = run.get("not_judged")
    if isinstance(not_judged, list) and not_judged:
        words = ", ".join(str(name).replace("_", " ") for name in not_judged)
        yield f"The manual documents services that these checks do not judge: {words}."


def is_simulated(record: Record) -> bool:
    """Tell whether no real device was judged."""
    return record.run.get("interface") == "canopen_simulator"
