"""Rows that are sent between ranks, and the directory of items by their global numbers."""

import numpy as np
from mpm_core.rows import exchange_rows, find_items, request_rows


def test_rows_arrive_by_rank_in_their_order(comm):
    to = np.arange(7 * comm.size) % comm.size  # each rank gets seven rows of each rank
    rows = np.column_stack([np.full(len(to), comm.rank), np.arange(len(to))])
    came, senders = exchange_rows(comm, to, rows)
    assert senders.tolist() == np.repeat(np.arange(comm.size), 7).tolist() == came[:, 0].tolist()
    assert came[:, 1].tolist() == [comm.rank + comm.size * k for k in range(7)] * comm.size


def test_items_are_found_on_the_lowest_rank_that_has_them(comm):
    """Rank r has the numbers 10 r to 10 r + 14, so that neighbours share five; numbers may be large, or be no item's."""
    large = 3_000_000_000
    own = large + 10 * comm.rank + np.arange(15)
    wanted = np.array([large - 1, *range(large, large + 10 * comm.size + 6), -1])
    ranks, rows = find_items(comm, own, 100 + np.arange(15), wanted)
    assert ranks[[0, -1]].tolist() == rows[[0, -1]].tolist() == [-1, -1] and ranks[-2] == -1
    for number, rank, row in list(zip(wanted, ranks, rows))[1:-2]:
        lowest = max(0, (number - large - 5) // 10)
        assert (rank, row) == (lowest, 100 + number - large - 10 * lowest)


def test_replies_come_in_the_order_of_the_requests(comm):
    ranks = np.arange(9)[::-1] % comm.size
    replies = request_rows(comm, ranks, np.arange(9)[:, None], lambda asked: asked + 1000 * comm.rank)
    assert replies[:, 0].tolist() == [k + 1000 * rank for k, rank in enumerate(ranks)]
