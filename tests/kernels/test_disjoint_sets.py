"""Sets that join, beside connected components of scipy."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from simplifier.kernels.compiled.kernel import inner_kernel
from simplifier.kernels.disjoint_sets import root_of


@inner_kernel
def joined_by_machine(parents, pairs):
    for pair in range(len(pairs)):
        parents[root_of(parents, pairs[pair, 0])] = root_of(parents, pairs[pair, 1])
    for member in range(len(parents)):
        root_of(parents, member)


@given(st.data())
def test_members_have_the_same_root_where_pairs_connect_them(data):
    count = data.draw(st.integers(1, 30))
    members = st.integers(0, count - 1)
    pairs = np.array(data.draw(st.lists(st.tuples(members, members))), np.int64).reshape(-1, 2)
    parents = np.arange(count)
    joined_by_machine(parents, pairs)
    graph = coo_array((np.ones(len(pairs)), pairs.T), shape=(count, count))
    expected = connected_components(graph, directed=False)[1]
    roots = np.array([root_of(parents, member) for member in range(count)])
    same = roots[:, None] == roots
    assert np.array_equal(same, expected[:, None] == expected)
