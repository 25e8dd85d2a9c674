"""What is mutated, and the tests that have to find it: those near it, not all there are."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Target:
    """A file of the project.

    ``tests``      files or single tests, as pytest is asked for them.
    ``functions``  or constants, classes: those that make the promise; all where none is named.
    ``compiled``   whether kernels are compiled.  Those of a target must not be: machine code does
                   not change with its source.
    """

    file: str
    tests: tuple[str, ...]
    functions: tuple[str, ...] = ()
    compiled: bool = True


_BOXES = ("tests/culling/test_depth_buffer.py",)
_FRUSTUM = tuple(
    f"tests/culling/test_depth_buffer.py::{name}"
    for name in (
        "test_outside_of_the_frustum", "test_values_that_are_not_numbers_are_visible",
        "test_a_box_around_the_camera_is_visible_behind_whatever",
    )
)  # fmt: skip
_INNER = tuple(
    f"tests/kernels/test_depth_buffer_inner.py::{name}"
    for name in (
        "test_a_triangle_is_drawn_where_it_holds_the_whole_pixel_at_its_farthest",
        "test_a_pair_is_drawn_only_where_it_leaves_no_gap",
        "test_nothing_is_lost_on_an_edge_of_two_triangles", "test_a_fold_is_not_a_union",
        "test_a_triangle_seen_from_its_edge_draws_nothing",
        "test_a_pixel_is_inside_by_more_than_rounding",
        "test_ground_through_the_camera_plane_is_drawn",
        "test_an_error_pushes_away_by_at_least_itself_clipped_or_not",
    )
)  # fmt: skip
_STORE = (
    "tests/service/storage/test_job_store.py",
    "tests/service/storage/test_job_store_fences.py",
    "tests/service/storage/test_job_store_clock.py",
    "tests/service/storage/test_asset_store.py",
)

TARGETS = (
    # Margins: what is called hidden cannot be seen.
    Target(
        "simplifier/culling/depth_buffer.py",
        ("tests/culling/test_depth_buffer_margins.py", *_BOXES,
         "tests/kernels/test_depth_buffer_inner.py::test_nothing_is_lost_on_an_edge_of_two_triangles"),
        functions=(
            "DepthBuffer.__init__", "DepthBuffer.clear", "DepthBuffer.draw",
            "DepthBuffer.draw_mesh", "DepthBuffer.test", "DepthBuffer._look", "DepthBuffer._draw",
            "_check_mesh", "screen_view",
        ),
    ),
    Target(
        "simplifier/kernels/box_verdict.py",
        ("tests/kernels/test_box_verdict.py", *_FRUSTUM,
         "tests/culling/test_depth_buffer_margins.py", "tests/kernels/test_box_verdict_outline.py"),
        compiled=False,
    ),
    Target("simplifier/kernels/frustum.py", ("tests/kernels/test_frustum.py",), compiled=False),
    Target(
        "simplifier/kernels/depth_buffer.py",
        ("tests/kernels/test_depth_buffer_errors.py",
         "tests/kernels/test_depth_buffer_planes.py", "tests/kernels/test_depth_buffer_pairs.py",
         "tests/kernels/test_depth_buffer.py", "tests/culling/test_depth_buffer_margins.py",
         *_INNER),
        compiled=False,
    ),
    # Sets of visible objects: what is left out of them cannot be seen.
    Target(
        "simplifier/kernels/height_field.py", ("tests/kernels/test_height_field.py",),
        compiled=False,
    ),
    # Containment: an occluder keeps to the solid.
    Target(
        "simplifier/kernels/voxelize.py",
        ("tests/kernels/test_voxelize_containment.py",),
        compiled=False,
    ),
    Target(
        "simplifier/kernels/soup_views.py",
        ("tests/kernels/test_voxelize_containment.py",),
        functions=("all_contained", "corner"),
        compiled=False,
    ),
    Target(
        "simplifier/voxel/core.py",
        ("tests/voxel/test_core.py", "tests/voxel/test_core_openings.py",
         "tests/voxel/test_core_rounding.py"),
    ),
    Target("simplifier/voxel/morphology.py", ("tests/voxel/test_morphology.py",)),
    Target(
        "simplifier/kernels/morphology.py",
        ("tests/kernels/test_morphology.py",),
        ("squared_distances", "_dilate_rows"),
        compiled=False,
    ),
    Target(
        "simplifier/refinement/annealing.py",
        ("tests/refinement/test_annealing.py", "tests/refinement/test_search_pull_into.py"),
    ),
    # Leases, fences and endings: a job is done once, by who holds it.
    Target("service/storage/leases.py", _STORE),
    Target(
        "service/storage/job_life.py",
        (*_STORE, "tests/service/storage/test_delivery_store.py"),
    ),
    Target("service/storage/job_store.py", _STORE),
    Target("service/storage/lines.py", ("tests/service/storage/test_turns.py",)),
    Target("service/jobs/turns.py", ("tests/service/storage/test_turns.py",)),
    # The address guard: no webhook leads in.
    Target("service/webhooks/excerpt.py", ("tests/service/webhooks/test_excerpt.py",)),
    Target("service/webhooks/address_guard.py", ("tests/service/webhooks/test_address_guard.py",
         "tests/service/webhooks/test_address_guard_edges.py")),
)  # fmt: skip
