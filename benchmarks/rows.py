"""What every benchmark returns: one figure beside one peer, with its spread and its demand."""

from __future__ import annotations

import argparse
import multiprocessing
import statistics
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Row:
    """One measurement.

    ``values`` are of one unit; ``x`` marks a ratio of two works that took turns in one process.
    ``higher`` tells which way is better, ``limit`` what is demanded.
    """

    work: str
    beside: str
    values: tuple[float, ...]
    unit: str = "x"
    higher: bool = True
    limit: float | None = None

    @property
    def median(self) -> float:
        return statistics.median(self.values)

    @property
    def met(self) -> bool | None:
        if self.limit is None:
            return None
        return self.median >= self.limit if self.higher else self.median <= self.limit

    def to_json(self, *, quick: bool = False) -> dict[str, Any]:
        """Return the row as a table holds it; demands are made of the full sizes only."""
        limit, met = (None, None) if quick else (self.limit, self.met)
        return {
            "work": self.work,
            "beside": self.beside,
            "median": self.median,
            "least": min(self.values),
            "most": max(self.values),
            "turns": len(self.values),
            "unit": self.unit,
            "better": "higher" if self.higher else "lower",
            "demand": limit,
            "met": met,
        }


def seconds(work: Callable[[], object], clock: Callable[[], float] = time.perf_counter) -> float:
    """Return how long a work takes by a clock."""
    started = clock()
    work()
    return clock() - started


def side_by_side(
    work: str,
    beside: str,
    ours: Callable[[], object],
    peer: Callable[[], object],
    turns: int,
    *,
    at_least: float | None = None,
    at_most: float | None = None,
    clock: Callable[[], float] = time.perf_counter,
    repeats: int = 1,
) -> Row:
    """Return peer over ours, which take turns; with ``at_most`` ours over peer.

    Each turn of ours is the least of so many repeats: what is short must not be measured by one
    interruption.
    """
    taken = [
        (seconds(peer, clock), min(seconds(ours, clock) for _ in range(repeats)))
        for _ in range(turns)
    ]
    if at_most is not None:
        ratios = tuple(fast / slow for slow, fast in taken)
        return Row(work, beside, ratios, higher=False, limit=at_most)
    return Row(work, beside, tuple(slow / fast for slow, fast in taken), limit=at_least)


def seconds_alone(work: Callable[[], object], at_most_s: float) -> tuple[float, bool]:
    """Return how long a work takes in a process of its own, and whether it came to its end.

    A work that is not done in time is stopped: the seconds are then a lower bound.
    """
    context = multiprocessing.get_context("spawn")
    receive, send = context.Pipe(duplex=False)
    worker = context.Process(target=_timed, args=(work, send))
    worker.start()
    send.close()
    if receive.poll(at_most_s):
        taken = float(receive.recv())
        worker.join()
        return taken, True
    worker.kill()
    worker.join()
    return at_most_s, False


def _timed(work: Callable[[], object], answer: Any) -> None:
    answer.send(seconds(work))


HEADING = (
    "| work | beside | median | least to most | demand | met |\n"
    "| --- | --- | ---: | ---: | ---: | --- |"
)


def line(row: dict[str, Any]) -> str:
    """Return one line of the Markdown table."""
    sign = ">=" if row["better"] == "higher" else "<="
    demand = "" if row["demand"] is None else f"{sign} {row['demand']:g}"
    met = {None: "", True: "yes", False: "**no**"}[row["met"]]
    spread = f"{row['least']:.3g} to {row['most']:.3g}" if row["turns"] > 1 else "one turn"
    return (
        f"| {row['work']} | {row['beside']} | {row['median']:.3g} {row['unit']} "
        f"| {spread} | {demand} | {met} |"
    )


def main(rows: Callable[[bool], Iterable[Row]], about: str | None) -> None:
    """Print the table of one module: what ``python -m benchmarks.NAME [--quick]`` does."""
    parser = argparse.ArgumentParser(description=about)
    parser.add_argument("--quick", action="store_true", help="small sizes, well under a minute")
    quick = parser.parse_args().quick
    print(HEADING)
    for row in rows(quick):
        print(line(row.to_json(quick=quick)), flush=True)
