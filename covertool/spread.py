"""Spreads pieces of work over this process, worker processes, or a dask cluster.

The results come back in the order of the pieces, whoever computed them, so that a sum over them is
the same for any number of workers. A ledger keeps every finished piece on disk: a run that was
interrupted takes it up again and computes only what is missing.
"""

from __future__ import annotations

import hashlib
import importlib
import logging
import multiprocessing
import os
import pickle
import signal
import tempfile
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from multiprocessing import resource_tracker
from pathlib import Path
from typing import Any, TypeVar

from covertool.errors import ComputationError, FileError, MissingExtraError, OptionError

Piece = TypeVar("Piece")
Result = TypeVar("Result")

LOCAL_CLUSTER = "local"
"""The scheduler that stands for a dask cluster started here, for this run only."""

MAX_DEATHS = 3
"""Deaths of workers in a row, with no piece finished between, after which a run gives up."""


class Ledger:
    """Finished pieces of one job in a folder, one file each, written atomically.

    Parameters
    ----------
    folder : Path
        Where the files lie; made when it is missing. Use one that others cannot write to: the
        files are pickles.
    job : str
        Everything that decides the results (inputs with their hashes, options). Another job finds
        none of this job's pieces, and the other way round.
    """

    def __init__(self, folder: Path, job: str) -> None:
        self.folder = folder
        self.job = job
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise FileError(
                f"the ledger's folder cannot be made ({error.strerror})",
                str(folder),
                "name a folder that can be written",
            ) from error

    def _path(self, piece: object) -> Path:
        key = hashlib.sha256(f"{self.job}\n{piece!r}".encode()).hexdigest()
        return self.folder / f"{key}.piece"

    def recall(self, piece: object) -> tuple[bool, Any]:
        """Return whether a piece is finished, and its result; a damaged file counts as missing."""
        try:
            digest, body = self._path(piece).read_bytes().split(b"\n", 1)
        except (FileNotFoundError, ValueError):
            return False, None
        if hashlib.sha256(body).hexdigest().encode() != digest:
            return False, None
        return True, pickle.loads(body)

    def record(self, piece: object, result: object) -> None:
        """Keep the result of a finished piece: the whole file or none."""
        body = pickle.dumps(result)
        handle, name = tempfile.mkstemp(dir=self.folder, suffix=".part")
        with os.fdopen(handle, "wb") as file:
            file.write(hashlib.sha256(body).hexdigest().encode() + b"\n" + body)
        os.replace(name, self._path(piece))

    def clear(self, pieces: Sequence[object]) -> None:
        """Forget the given pieces of this job, and the folder when it is empty then."""
        for piece in pieces:
            self._path(piece).unlink(missing_ok=True)
        if not any(self.folder.iterdir()):
            self.folder.rmdir()


def spread(
    function: Callable[[Piece], Result],
    pieces: Sequence[Piece],
    *,
    workers: int = 1,
    scheduler: str | None = None,
    ledger: Ledger | None = None,
    on_done: Callable[[int], object] | None = None,
) -> list[Result]:
    """Return ``[function(piece) for piece in pieces]``, computed by one or many.

    See `spread_in_order` for results that are too large to be held all at once.

    Parameters
    ----------
    function : callable
        Takes a piece; with workers it must be picklable (a module's function, a partial of one,
        or an instance of a module's class that can be called).
    pieces : sequence
        Small plain values such as tile numbers; their ``repr`` is their key in the ledger.
    workers : int
        Processes; 1 computes in this process.
    scheduler : str, optional
        Address of a dask scheduler, or ``"local"`` for a cluster started here.
    ledger : Ledger, optional
        Pieces found in it are not computed again; new ones are added as they finish.
    on_done : callable, optional
        Called with the number of pieces finished since the last call.

    Raises
    ------
    OptionError
        When ``workers`` is less than 1, or the scheduler does not answer.
    MissingExtraError
        When a scheduler is named and dask is not installed.
    ComputationError
        When workers die again and again without finishing anything.

    Examples
    --------
    >>> spread(abs, [-1, 2, -3])
    [1, 2, 3]
    """
    return list(
        spread_in_order(
            function,
            pieces,
            workers=workers,
            scheduler=scheduler,
            ledger=ledger,
            on_done=on_done,
        )
    )


def spread_in_order(
    function: Callable[[Piece], Result],
    pieces: Sequence[Piece],
    *,
    workers: int = 1,
    scheduler: str | None = None,
    ledger: Ledger | None = None,
    on_done: Callable[[int], object] | None = None,
) -> Iterator[Result]:
    """Yield the results that `spread` returns, once all are computed.

    With a ledger they wait on disk, and only one at a time is in memory. Parameters and errors are
    those of `spread`.

    Examples
    --------
    >>> list(spread_in_order(abs, [-1, 2, -3]))
    [1, 2, 3]
    """
    if workers < 1:
        raise OptionError(
            "there must be at least one worker", f"workers={workers}", "use 1 or more"
        )
    kept: dict[int, Result] = {}
    known = [ledger is not None and ledger.recall(piece)[0] for piece in pieces]
    todo = [i for i, found in enumerate(known) if not found]
    if on_done is not None and any(known):
        on_done(sum(known))
    for i, result in _compute(function, pieces, todo, workers, scheduler):
        if ledger is None:
            kept[i] = result
        else:
            ledger.record(pieces[i], result)
        if on_done is not None:
            on_done(1)
    for i, piece in enumerate(pieces):
        if ledger is None:
            yield kept.pop(i)
        else:
            found, result = ledger.recall(piece)
            yield result if found else function(piece)


def _compute(
    function: Callable[[Piece], Result],
    pieces: Sequence[Piece],
    todo: list[int],
    workers: int,
    scheduler: str | None,
) -> Iterator[tuple[int, Result]]:
    """Yield (index, result) of the pieces to do, in the order in which they finish."""
    if scheduler is not None:
        return _on_dask(function, pieces, todo, workers, scheduler)
    if workers == 1 or len(todo) < 2:
        return ((i, function(pieces[i])) for i in todo)
    return _on_processes(function, pieces, todo, workers)


def _on_processes(
    function: Callable[[Piece], Result], pieces: Sequence[Piece], todo: list[int], workers: int
) -> Iterator[tuple[int, Result]]:
    """Yield from a pool of spawned processes; a pool that lost a worker is built again."""
    left, deaths = set(todo), 0
    while left:
        others = set(multiprocessing.active_children())
        pool = ProcessPoolExecutor(
            min(workers, len(left)),
            mp_context=multiprocessing.get_context("spawn"),
            initializer=_leave_with_parent,
        )
        try:
            with _children_deaf_to_interrupts():
                futures = {pool.submit(function, pieces[i]): i for i in sorted(left)}
            for future in as_completed(list(futures)):
                i = futures.pop(future)  # so that its result can go when it has been taken
                yield i, future.result()
                left.discard(i)
                deaths = 0
        except BrokenProcessPool:
            deaths += 1
            if deaths == MAX_DEATHS:
                raise _dying(pieces, left) from None
        except KeyboardInterrupt:
            for worker in set(multiprocessing.active_children()) - others:
                worker.terminate()
            raise
        finally:
            pool.shutdown(wait=True, cancel_futures=True)


@contextmanager
def _children_deaf_to_interrupts() -> Iterator[None]:
    """Let processes that start in this block not hear Ctrl-C, which a terminal sends to them too.

    This process alone meets it, and ends them. What comes in this block is heard after it.
    """
    if not hasattr(signal, "pthread_sigmask"):  # as on Windows
        yield
        return
    resource_tracker.ensure_running()  # which lets SIGINT through again when it starts
    before = signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGINT])
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _leave_with_parent() -> None:
    """End this worker when its parent dies: a killed parent cannot tell its workers to stop."""
    parent = multiprocessing.parent_process()
    if parent is None:
        return

    def watch() -> None:
        parent.join()
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


def _on_dask(
    function: Callable[[Piece], Result],
    pieces: Sequence[Piece],
    todo: list[int],
    workers: int,
    scheduler: str,
) -> Iterator[tuple[int, Result]]:
    """Yield from dask workers; dask itself gives the pieces of a dead worker to another."""
    try:
        distributed: Any = importlib.import_module("distributed")
    except ImportError:
        raise MissingExtraError(
            "dask.distributed is not installed", "--scheduler", "pip install 'covertool[scale]'"
        ) from None
    with _client(distributed, workers, scheduler) as client:
        futures = client.map(function, [pieces[i] for i in todo], pure=False)
        index = {future.key: i for future, i in zip(futures, todo, strict=True)}
        try:
            for future in distributed.as_completed(futures):
                yield index[future.key], future.result()
                future.release()
        except distributed.KilledWorker:
            raise _dying(pieces, set(todo)) from None


def _client(distributed: Any, workers: int, scheduler: str) -> Any:
    """Return a client of the scheduler at an address, or of a cluster started here."""
    if scheduler == LOCAL_CLUSTER:
        with _children_deaf_to_interrupts():
            return distributed.Client(
                n_workers=workers,
                threads_per_worker=1,
                processes=True,
                dashboard_address=None,
                silence_logs=logging.CRITICAL,
            )
    try:
        return distributed.Client(scheduler, timeout=10)
    except (OSError, ValueError) as error:
        raise OptionError(
            f"no dask scheduler answers there ({error})",
            f"--scheduler {scheduler}",
            f"start one with `dask scheduler`, or use --scheduler {LOCAL_CLUSTER}",
        ) from None


def _dying(pieces: Sequence[object], left: set[int]) -> ComputationError:
    named = ", ".join(repr(pieces[i]) for i in sorted(left)[:5])
    return ComputationError(
        f"workers die again and again ({len(left)} pieces left)",
        f"piece {named}",
        "use fewer workers or smaller tiles: the usual cause is lack of memory",
    )
