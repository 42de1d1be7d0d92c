"""Plots of what a run measured, as SVG to stand in a page: intervals, values, response times.

matplotlib takes half a second to load: it is imported when there is something to draw.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from io import StringIO
from math import isfinite, log10
from typing import TYPE_CHECKING, Any, Final

from conformance.numbers import figure
from conformance.report.record import ResponseTimes
from conformance.report.results import Item

if TYPE_CHECKING:
    from matplotlib.axes import Axes

FEWEST_INTERVALS: Final = 3
FEWEST_TRANSFERS: Final = 100
MOST_ROWS: Final = 40
BEYOND: Final = 2.0
"""Where a row ends, in parts of its tolerance."""
STEPS: Final = 80
_BASE: Final = 0.3
"""Height of a bar that stands for one, in decades."""
_ONE_STEP: Final = 10 ** (1 / 20)
_WIDTH_IN: Final = 8.0
_MARGIN_IN: Final = 0.3
_LETTER_IN: Final = 0.073
"""At least as wide as a letter is on average."""
_LINE: Final = "#010101"
_DATA: Final = "#020202"
_LIMIT: Final = "#030303"
_COLORS: Final = {_LINE: "currentColor", _DATA: "var(--data)", _LIMIT: "var(--bad)"}
"""What stands for the colours of the page, light or dark."""


@dataclass(frozen=True, slots=True)
class Plot:
    """A plot and the same in words.

    Args:
        id: Of its element in the page.
        title: What it shows.
        words: How to read it.
        heads: Of the table with its figures.
        rows: Of that table.
        svg: The drawing.
    """

    id: str
    title: str
    words: str
    heads: Sequence[str]
    rows: Sequence[Sequence[str]]
    svg: str


@dataclass(frozen=True, slots=True)
class _Row:
    name: str
    unit: str
    values: Sequence[float]
    least: float
    nominal: float
    most: float
    failed: bool


def plots(items: Sequence[Item], response_times: ResponseTimes) -> list[Plot]:
    """Return the plots of a run, none where nothing was measured.

    Args:
        items: What was judged.
        response_times: How long the node took to answer.
    """
    rows = [(item, row) for item in items for row in _rows(item)]
    several = [(i, r) for i, r in rows if r.unit == "ms" and len(r.values) >= FEWEST_INTERVALS]
    beats = [r for i, r in several if i.service.startswith("heartbeat")]
    tpdos = [r for i, r in several if i.service.startswith("tpdo")]
    made = [
        _intervals("heartbeats", "Heartbeat intervals", beats),
        _intervals("tpdos", "TPDO intervals", tpdos),
        *(
            _values(unit, word, [r for _, r in rows if r.unit == unit])
            for unit, word in (("deg", "Angles"), ("V", "Voltages"))
        ),
        _response_times(response_times),
    ]
    return [plot for plot in made if plot is not None]


def _rows(item: Item) -> list[_Row]:
    """Return the measurements of an item that have values, a nominal one and limits on both sides."""
    found = []
    for it in item.measurements:
        least, nominal, most = (_number(it.get(key)) for key in ("least", "nominal", "most"))
        told = it.get("values")
        values = [_number(value) for value in told] if isinstance(told, list) else []
        known = [value for value in values if value is not None]
        if least is None or nominal is None or most is None or len(known) < len(values):
            continue
        if known and most > least:
            name = item.id.partition("/")[2]
            row = _Row(
                name, str(it.get("unit")), known, least, nominal, most, item.verdict == "fail"
            )
            found.append(row)
    return found


def _number(value: object) -> float | None:
    """Return a finite number of a record; None for all else."""
    return value if isinstance(value, int | float) and isfinite(value) else None


def _figures(rows: Sequence[_Row]) -> list[tuple[str, ...]]:
    return [
        (
            row.name,
            str(len(row.values)),
            f"{figure(row.least, 6)} {row.unit}",
            f"{figure(row.most, 6)} {row.unit}",
            f"{figure(min(row.values), 6)} {row.unit}",
            f"{figure(sum(row.values) / len(row.values), 6)} {row.unit}",
            f"{figure(max(row.values), 6)} {row.unit}",
        )
        for row in rows
    ]


_HEADS = ("item", "count", "not below", "not above", "least", "mean", "most")


def _intervals(name: str, title: str, rows: Sequence[_Row]) -> Plot | None:
    """Return a histogram per item, each on the scale of its own tolerance, so that one line limits all."""
    if not rows:
        return None
    ordered = sorted(rows, key=lambda row: not row.failed)[:MOST_ROWS]

    def draw(axes: Axes) -> None:
        for place, row in enumerate(reversed(ordered)):
            half = (row.most - row.least) / 2
            parts = [(value - row.nominal) / half for value in row.values]
            _histogram(axes, parts, place)
        axes.axvline(-1, color=_LIMIT, linewidth=1)
        axes.axvline(1, color=_LIMIT, linewidth=1)
        axes.set_xlim(-BEYOND * 1.02, BEYOND * 1.02)
        axes.set_ylim(-0.2, len(ordered))
        axes.set_yticks(
            [place + 0.3 for place in range(len(ordered))],
            [_label(row) for row in reversed(ordered)],
        )
        axes.set_xticks(
            [-BEYOND, -1, 0, 1, BEYOND], ["earlier", "least", "as it should be", "most", "later"]
        )

    left_out = len(rows) - len(ordered)
    words = (
        "A row is the histogram of one item's intervals, from the least that is allowed to the most; "
        "what is beyond the lines is outside its limits, and at the edge what is further away."
        + (f" {left_out} more items are in the table only." if left_out else "")
    )
    left_in = 0.3 + _LETTER_IN * max(len(_label(row)) for row in ordered)
    svg = _svg(draw, name, 0.9 + 0.27 * len(ordered), min(left_in, _WIDTH_IN / 2))
    return Plot(name, title, words, _HEADS, _figures(rows), svg)


def _label(row: _Row) -> str:
    return f"{row.name}: {figure(row.nominal, 6)} {row.unit} ± {figure((row.most - row.least) / 2, 6)} {row.unit}"


def _histogram(axes: Axes, parts: Sequence[float], place: int) -> None:
    """Draw the histogram of a row at its place, the highest step nearly as high as the row."""
    width = 2 * BEYOND / STEPS
    counts: dict[int, int] = {}
    for part in parts:
        inside = min(max(part, -BEYOND), BEYOND)
        step = round((inside + BEYOND) / width)
        counts[step] = counts.get(step, 0) + 1
    most = max(counts.values())
    axes.bar(
        [step * width - BEYOND for step in counts],
        [0.8 * count / most for count in counts.values()],
        width=width,
        bottom=place,
        color=_DATA,
    )
    axes.axhline(place, color=_LINE, linewidth=0.3)


def _values(unit: str, word: str, rows: Sequence[_Row]) -> Plot | None:
    """Return how far values are from what they should be, over what they should be."""
    if not rows:
        return None

    def draw(axes: Axes) -> None:
        nominal = [row.nominal for row in rows for _ in row.values]
        off = [value - row.nominal for row in rows for value in row.values]
        places = [row.nominal for row in rows]
        below, above = (
            [row.least - row.nominal for row in rows],
            [row.most - row.nominal for row in rows],
        )
        axes.vlines(places, below, above, color=_LIMIT, linewidth=1, alpha=0.4)
        axes.plot(places, below, "_", color=_LIMIT, markersize=9)
        axes.plot(places, above, "_", color=_LIMIT, markersize=9)
        axes.plot(nominal, off, "o", color=_DATA, markersize=4)
        axes.axhline(0, color=_LINE, linewidth=0.5)
        axes.set_xlabel(f"expected, {unit}")
        axes.set_ylabel(f"measured - expected, {unit}")

    words = (
        "A dot is a measured value: across, what it should be; up and down, how far it is from that. "
        "The bars are its limits."
    )
    name = f"values-{unit}"
    svg = _svg(draw, name, 3.2)
    return Plot(name, f"{word} against what was expected", words, _HEADS, _figures(rows), svg)


def _response_times(times: ResponseTimes) -> Plot | None:
    """Return the histogram of the SDO response times."""
    steps = times.histogram
    if sum(count for _, count in steps) < FEWEST_TRANSFERS:
        return None
    low = [edge / _ratio(steps) for edge, _ in steps]

    def draw(axes: Axes) -> None:
        for (edge, count), first in zip(steps, low, strict=True):
            if count:
                start, width = log10(first), log10(edge / first)
                axes.bar(start, log10(count) + _BASE, width=width, align="edge", color=_DATA)
        decades = range(len(str(max(count for _, count in steps))))
        axes.set_yticks(
            [power + _BASE for power in decades], [f"{10**power:,}" for power in decades]
        )
        ticks = [base * 10**power for power in range(-3, 6) for base in (1, 2, 5)]
        inside = [tick for tick in ticks if low[0] <= tick <= steps[-1][0]]
        axes.set_xticks([log10(tick) for tick in inside], [figure(tick, 6) for tick in inside])
        axes.set_xlabel("longest wait for a response in a transfer, ms")
        axes.set_ylabel("transfers")

    words = (
        f"{times.transfers} transfers were answered: median {times.median_ms} ms, 99 % within "
        f"{times.p99_ms} ms, at most {times.max_ms} ms ({times.max_object}). Both scales are "
        "logarithmic."
    )
    rows = [
        (f"{figure(first, 4)} to {figure(edge, 4)} ms", str(count))
        for first, (edge, count) in zip(low, steps, strict=True)
        if count
    ]
    name = "sdo-response-times"
    return Plot(name, "SDO response times", words, ("time", "transfers"), rows, _svg(draw, name, 3))


def _ratio(steps: Sequence[tuple[float, int]]) -> float:
    """Return how much longer a time is at the end of a step than at its beginning."""
    return steps[1][0] / steps[0][0] if len(steps) > 1 else _ONE_STEP


def _svg(draw: Callable[[Axes], None], name: str, height_in: float, left_in: float = 0.7) -> str:
    """Return a drawing as an SVG element in the colours and letters of the page."""
    import logging  # noqa: PLC0415 - with matplotlib, which says what no user asked

    logging.getLogger("matplotlib").setLevel(logging.ERROR)
    from matplotlib import rc_context  # noqa: PLC0415 - it takes half a second to load
    from matplotlib.figure import Figure  # noqa: PLC0415

    settings: dict[Any, Any] = {
        "svg.fonttype": "none",
        "svg.hashsalt": name,
        "svg.id": name,
        "font.size": 9,
        "axes.edgecolor": _LINE,
        "axes.labelcolor": _LINE,
        "xtick.color": _LINE,
        "ytick.color": _LINE,
        "text.color": _LINE,
        "axes.spines.top": False,
        "axes.spines.right": False,
        "axes.unicode_minus": False,
    }
    with rc_context(settings):
        figure = Figure(figsize=(_WIDTH_IN, height_in))
        figure.patch.set_visible(False)
        margins = {"left": left_in / _WIDTH_IN, "right": 1 - _MARGIN_IN / _WIDTH_IN}
        heights = {"bottom": 2 * _MARGIN_IN / height_in, "top": 1 - _MARGIN_IN / 2 / height_in}
        axes = figure.subplots(gridspec_kw=margins | heights)
        axes.patch.set_visible(False)
        draw(axes)
        drawn = StringIO()
        nothing = dict.fromkeys(("Date", "Creator", "Format", "Type"))
        figure.savefig(drawn, format="svg", metadata=nothing)
    return _for_page(drawn.getvalue(), name)


def _for_page(svg: str, name: str) -> str:
    """Return an SVG file as an element of a page: no id twice, the page's colours, no document type."""
    svg = svg[svg.index("<svg") :]
    svg = re.sub(r"\s*<metadata>.*?</metadata>", "", svg, flags=re.DOTALL)
    svg = re.sub(r' id="(?=\w)', f' id="{name}-', svg)
    svg = re.sub(r'(href="|url\()#', rf"\g<1>#{name}-", svg)
    svg = re.sub(r"font: ([\d.]+px) [^;\"]*", r"font: \1 sans-serif", svg)
    for placeholder, color in _COLORS.items():
        svg = svg.replace(placeholder, color)
    return svg.replace(
        "<svg ", f'<svg role="img" aria-labelledby="{name}-title {name}-words" ', 1
    ).strip()
