"""Needs by stage: no size makes one smaller, and what is too much is refused with a way out."""

from __future__ import annotations

import re
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from simplifier.errors import MemoryLimitError, OptionError
from simplifier.memory.limit import check_need, default_limit, machine_memory
from simplifier.memory.need import BASE_BYTES, GIB, MIB, MemoryNeed, MeshSize
from simplifier.memory.runs import Judging, drawing, judging, loading, seeing, showing, simplifying
from simplifier.options.stages import make_options

SIZES = st.builds(MeshSize, st.integers(3, 10**8), st.integers(1, 10**8))
SHAPES = st.tuples(*[st.integers(1, 1024)] * 3)


def whole(size, shape, options, how):
    """The need of a run from a mesh in memory to its pictures."""
    need = simplifying(size, shape, 1.0, options).joined(judging(size, shape, options, how))
    return need.joined(drawing(size, shape, options)).joined(showing(size))


CHOSEN = st.fixed_dictionaries(
    {
        "budget": st.integers(1, 100_000),
        "preset": st.sampled_from(["draft", "balanced", "best"]),
        "conservative": st.booleans(),
        "smallest_hole": st.floats(0.0, 20.0),
        "moves": st.sampled_from([0, 100]),
    }
)


@given(SIZES, SHAPES, CHOSEN, st.integers(1, 65_536), st.integers(8, 4096), st.data())
def test_no_stage_needs_less_for_more(size, shape, chosen, views, image, data):
    options, how = make_options(1e9, **chosen), Judging(views, image)
    before = whole(size, shape, options, how)
    more = st.integers(0, 1000)
    # A longer mesh has its room, and what is wholly inside, in fewer voxels to a cell.
    longer = not chosen["conservative"] and data.draw(st.booleans())
    larger = whole(
        MeshSize(size.vertices + data.draw(more), size.triangles + data.draw(more)),
        tuple(length + data.draw(more) * longer for length in shape),
        make_options(1e9, **{**chosen, "budget": min(chosen["budget"] + data.draw(more), 100_000)}),
        Judging(
            views + data.draw(more),
            image + data.draw(more),
            1 + data.draw(st.integers(0, 3)),
        ),
    )
    for name, need in before.stages.items():
        assert larger.stages[name] >= need or (longer and name == "refine")
    assert before.peak > BASE_BYTES + size.held


@given(st.integers(0, 10**8), st.integers(0, 10**8), st.integers(0, 10**10), st.integers(0, 10**6))
def test_loading_needs_no_less_for_more(vertices, triangles, decoding, more):
    need = loading(vertices, triangles, decoding).peak
    for larger in (
        loading(vertices + more, triangles, decoding),
        loading(vertices, triangles + more, decoding),
        loading(vertices, triangles, decoding + more),
    ):
        assert larger.peak >= need


def test_a_hole_a_shrink_and_levels_cost_what_they_hold():
    size, shape = MeshSize(1000, 2000), (256, 256, 256)
    plain = make_options(1.0)
    plain = replace(plain, solid=replace(plain.solid, fill="flood"))  # as the solids inside are
    for solid in (
        replace(plain.solid, smallest_hole=4.0),
        replace(plain.solid, shrink=2.0, conservative=True),
        replace(plain.solid, glue=True),
    ):
        other = simplifying(size, shape, 1.0, replace(plain, solid=solid))
        assert other.stages["fill"] >= simplifying(size, shape, 1.0, plain).stages["fill"]


def test_pictures_are_held_while_the_next_is_made():
    size, shape, options = MeshSize(1_000_000, 2_000_000), (64, 64, 64), make_options(1.0)
    alone = simplifying(size, shape, 1.0, options, Judging())
    assert alone == simplifying(size, shape, 1.0, options)
    among = simplifying(size, shape, 1.0, options, Judging(views=256, image=256, again=True))
    kept = 24 * size.vertices + 256 * (256 * 4 + 514 * 9) * 8  # words of 64 pixels
    assert among == alone.beside(kept)
    most = simplifying(size, shape, 1.0, options, Judging(views=4096, image=4096, again=True))
    assert most == alone.beside(24 * size.vertices + 2 * 16 * MIB)


def test_the_solid_is_held_while_an_occluder_is_judged_and_drawn():
    size, shape, options = MeshSize(1000, 2000), (256, 256, 256), make_options(1.0)
    solid = 2 * 256**3  # touched and filled
    alone = seeing(size, Judging())
    assert (
        judging(size, shape, options, Judging()).stages["accuracy"]
        >= alone.peak - BASE_BYTES + solid
    )
    assert drawing(size, shape, options).stages["pictures"] > 100 * MIB + solid


def test_the_largest_stage_is_the_peak_and_joining_keeps_the_larger():
    one = MemoryNeed({"load": 10 * MIB, "refine": 30 * MIB})
    both = one.joined(MemoryNeed({"load": 20 * MIB, "report": 5 * MIB}))
    assert both.stages == {"load": 20 * MIB, "refine": 30 * MIB, "report": 5 * MIB}
    assert (both.largest, both.peak) == ("refine", BASE_BYTES + 30 * MIB)
    assert both.beside(MIB).peak == both.peak + MIB


def need_at(resolution):
    return MemoryNeed({"fill": 10 * resolution**3})


@given(st.integers(2, 1024), st.floats(0.18, 20.0))
def test_what_is_refused_names_the_finest_resolution_that_fits(resolution, limit):
    if need_at(resolution).gib <= limit:
        check_need(need_at(resolution), limit, resolution=resolution, at=need_at)
        return
    with pytest.raises(MemoryLimitError) as told:
        check_need(need_at(resolution), limit, resolution=resolution, at=need_at)
    finest = told.value.resolution
    assert need_at(finest + 1).gib > limit
    assert finest == 0 or need_at(finest).gib <= limit
    (least,) = re.findall(r"a memory limit of at least ([0-9.]+)$", told.value.remedy)
    check_need(need_at(resolution), float(least))


def test_the_message_tells_need_stage_limit_and_what_to_do():
    need = MemoryNeed({"load": GIB, "refine": 12 * GIB})
    with pytest.raises(MemoryLimitError) as told:
        check_need(need, 8.0, where="city.glb")
    assert str(told.value) == (
        "city.glb: about 12.1 GiB of memory would be needed, most of it to refine, and the limit is"
        " 8 GiB; thin the mesh, or set a memory limit of at least 12.17"
    )


def test_half_of_the_machine_is_the_limit_where_none_is_set():
    assert default_limit() == machine_memory() / GIB / 2.0
    with pytest.raises(MemoryLimitError, match=f"the limit is {default_limit():.3g} GiB"):
        check_need(MemoryNeed({"fill": machine_memory()}), None)
    check_need(MemoryNeed({"fill": 0}), None)


@pytest.mark.parametrize("limit", [0.0, -1.0, float("nan"), float("inf"), "8", True])
def test_what_is_no_limit_is_a_wrong_option(limit):
    with pytest.raises(OptionError, match=r"^memory limit: "):
        check_need(MemoryNeed({"fill": 0}), limit)
