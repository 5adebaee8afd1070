"""The same results, in the same order, whoever computes them."""

import math
import os
import pickle

import pytest

from covertool.errors import MissingExtraError, OptionError
from covertool.spread import LOCAL_CLUSTER, Ledger, spread, spread_in_order

PIECES = [4, 1, 9, 16, 2]
ROOTS = [2.0, 1.0, 3.0, 4.0, math.sqrt(2)]


def test_one_process_keeps_the_order_of_the_pieces():
    assert spread(math.sqrt, PIECES) == ROOTS


def test_processes_give_the_same_results_in_the_same_order():
    assert spread(math.sqrt, PIECES, workers=2) == ROOTS


@pytest.mark.slow
def test_a_dask_cluster_gives_the_same_results_in_the_same_order():
    pytest.importorskip("distributed")
    assert spread(math.sqrt, PIECES, workers=2, scheduler=LOCAL_CLUSTER) == ROOTS


def test_no_pieces_give_no_results():
    assert spread(math.sqrt, []) == []
    assert spread(math.sqrt, [], workers=2) == []


def test_a_fault_of_a_piece_comes_back_as_it_is():
    with pytest.raises(ValueError, match=r"domain error|nonnegative"):
        spread(math.sqrt, [1, -1, 4], workers=2)


def test_no_worker_is_refused():
    with pytest.raises(OptionError):
        spread(math.sqrt, PIECES, workers=0)


def test_a_scheduler_that_does_not_answer_is_told():
    pytest.importorskip("distributed")
    with pytest.raises(OptionError, match="scheduler"):
        spread(math.sqrt, PIECES, scheduler="no-such-protocol://nowhere")


def test_without_dask_the_mend_names_the_extra(monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "distributed", None)
    with pytest.raises(MissingExtraError, match=r"covertool\[scale\]"):
        spread(math.sqrt, PIECES, scheduler=LOCAL_CLUSTER)


def test_finished_pieces_are_not_computed_again(tmp_path):
    ledger = Ledger(tmp_path / "ledger", "roots")
    computed = []

    def root(piece):
        computed.append(piece)
        return math.sqrt(piece)

    assert spread(root, PIECES[:3], ledger=ledger) == ROOTS[:3]
    assert spread(root, PIECES, ledger=ledger) == ROOTS
    assert computed == PIECES


def test_another_job_finds_nothing_of_this_one(tmp_path):
    spread(math.sqrt, PIECES, ledger=Ledger(tmp_path, "roots"))
    assert Ledger(tmp_path, "logarithms").recall(4) == (False, None)


def test_a_damaged_ledger_file_counts_as_missing(tmp_path):
    ledger = Ledger(tmp_path, "roots")
    ledger.record(4, 2.0)
    (file,) = tmp_path.iterdir()
    file.write_bytes(file.read_bytes()[:-3])
    assert ledger.recall(4) == (False, None)
    assert spread(math.sqrt, [4], ledger=ledger) == [2.0]
    assert ledger.recall(4) == (True, 2.0)


def test_a_cleared_ledger_leaves_no_folder(tmp_path):
    ledger = Ledger(tmp_path / "ledger", "roots")
    spread(math.sqrt, PIECES, ledger=ledger)
    ledger.clear(PIECES)
    assert os.listdir(tmp_path) == []


def test_every_piece_is_told_once():
    told = []
    spread(math.sqrt, PIECES, on_done=told.append)
    assert sum(told) == len(PIECES)


def test_a_fault_of_covertool_survives_the_way_between_processes():
    error = OptionError("what", "where", "mend")
    assert str(pickle.loads(pickle.dumps(error))) == str(error)


def test_results_that_wait_in_a_ledger_come_one_after_the_other_in_order(tmp_path):
    ledger = Ledger(tmp_path / "ledger", "roots")
    results = spread_in_order(math.sqrt, [9, 4, 1], ledger=ledger)
    assert next(results) == 3
    assert len(list((tmp_path / "ledger").glob("*.piece"))) == 3
    ledger.clear([4])  # a lost one is computed anew
    assert list(results) == [2, 1]
