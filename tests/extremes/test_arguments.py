"""Nothing but the library's own errors leaves a public function, whatever is handed to it."""

from __future__ import annotations

import inspect
import json
import math
import threading
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from fractions import Fraction
from functools import cache, partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import simplifier
from simplifier.errors import CancelledError, OccluderError, OptionError
from simplifier.report import gallery
from tests.fuzz.promises.scene_folders import BUILT
from tests.io.damaged_occs import town
from tests.solids import box

ODD: Mapping[str, Any] = {
    "none": None,
    "text": "odd",
    "no text": "",
    "text with NUL": "a\0b",
    "half a character": "\udcff",
    "bytes": b"odd",
    "NaN": math.nan,
    "infinity": math.inf,
    "below 0": -1,
    "a share": 0.5,
    "beyond all floats": 10**400,
    "a fraction beyond all floats": Fraction(10**400, 3),
    "beyond all that Python prints": 10**5000,
    "complex": 1j,
    "truth": True,
    "numpy's whole number": np.int64(3),
    "numpy's smallest whole number": np.uint8(200),
    "numpy's half": np.float32(0.5),
    "an array": np.array([1.0, 2.0]),
    "a mixed list": [1, "a"],
    "a list of lists": [[1], [2]],
    "a mapping": {"odd": 1},
    "a set": {1},
    "an object": object(),
    "a type": int,
}

FAST = {"resolution": 8, "budget": 12, "preset": "draft", "moves": 20}
JUDGED = {"views": 2, "image": 16, "quads": 10}


@dataclass(frozen=True)
class Call:
    """A function and arguments that it takes; ``own``: those whose errors are the caller's own."""

    function: Callable[..., Any]
    arguments: Mapping[str, Any] = field(default_factory=dict)
    own: tuple[str, ...] = ()


@dataclass(frozen=True)
class Given:
    """A mesh in memory and, at ``path``, on disk; overrides at ``overrides``."""

    folder: Path
    mesh: simplifier.TriangleMesh
    occluder: simplifier.Occluder
    path: Path
    overrides: Path

    def judged(self, function: Callable[..., Any], **more: Any) -> Call:
        return Call(function, {"mesh": self.mesh, "occluder": self.occluder, **more}, ("listener",))

    def made(self, function: Callable[..., Any], **more: Any) -> Call:
        # ``int`` can be called, so it is a listener, and what it raises ends the run.
        return Call(function, {"mesh": self.mesh, **more}, ("listener", "tell", "name"))

    def ended(self, function: Callable[..., Any], **more: Any) -> Call:
        """Before it begins: what does not depend on the work is refused all the same."""
        cancel = threading.Event()
        cancel.set()
        return replace(self.made(function, cancel=cancel, **more), own=("tell", "name", "cancel"))

    def arrays(self, function: Callable[..., Any], *own: str) -> Call:
        return Call(function, {"vertices": self.mesh.vertices, "faces": self.mesh.faces}, own)


VIEW = {"position": np.ones(3), "forward": np.array([-1.0, 0, 0]), "up": np.array([0, 1.0, 0])}
SWEEP = simplifier.TradeoffOptions((8,), (8,), (8,), (0.1,), repeats=1)
MADE = simplifier.SimplifyOptions(**FAST, **JUDGED)
JUDGE = simplifier.EvaluateOptions(resolution=8, **JUDGED)

ENDED = threading.Event()
"""A cancel that is set."""
ENDED.set()

CALLS: dict[str, Callable[[Given], Call]] = {
    "simplify": lambda given: given.made(simplifier.simplify, **FAST),
    "simplify, cancelled": lambda given: given.ended(simplifier.simplify, options=MADE),
    "sweep_tradeoff": lambda given: given.ended(simplifier.sweep_tradeoff, options=SWEEP),
    "evaluate": lambda given: given.judged(simplifier.evaluate, **JUDGED),
    "evaluate, by an object": lambda given: given.judged(simplifier.evaluate, options=JUDGE),
    "draw_report": lambda given: given.judged(
        simplifier.draw_report,
        folder=given.folder / "drawn",
        name="ball",
        report=simplifier.evaluate(given.mesh, given.occluder, resolution=8, **JUDGED).report(),
    ),
    "save_loss_map": lambda given: given.judged(
        simplifier.save_loss_map,
        path=given.folder / "loss.json",
        report=simplifier.evaluate(given.mesh, given.occluder, resolution=8, **JUDGED).report(),
    ),
    "picture_of": lambda given: given.judged(simplifier.picture_of, size=16),
    "load": lambda given: Call(simplifier.load, {"path": given.path}),
    "check_file": lambda given: Call(simplifier.check_file, {"path": given.path, "options": MADE}),
    "estimate_memory": lambda given: Call(simplifier.estimate_memory, {"mesh": given.mesh}),
    "load_overrides": lambda given: Call(simplifier.load_overrides, {"path": given.overrides}),
    "Viewpoint": lambda given: Call(simplifier.Viewpoint, {"mesh": given.mesh, "size": 16}),
    "load_scene": lambda given: Call(simplifier.load_scene, {"path": given.path}),
    "load_occluder": lambda given: Call(simplifier.load_occluder, {"path": given.path}),
    "load_lods": lambda given: Call(simplifier.load_lods, {"path": given.path}),
    "load_camera_path": lambda given: Call(simplifier.load_camera_path, {"path": given.path}),
    "load_pvs": lambda given: Call(simplifier.load_pvs, {"path": given.path}),
    "load_occluder_tree": lambda given: Call(
        simplifier.load_occluder_tree, {"folder": given.folder}
    ),
    "pack_tree": lambda given: Call(
        simplifier.pack_tree, {"tree": simplifier.load_occluder_tree(BUILT)}
    ),
    "save_packed_tree": lambda given: Call(
        simplifier.save_packed_tree, {"tree": town(), "path": given.folder / "town.occs"}
    ),
    "load_packed_tree": lambda given: Call(simplifier.load_packed_tree, {"path": given.path}),
    "save": lambda given: Call(
        simplifier.save, {"result": given.occluder, "path": given.folder / "saved.glb"}
    ),
    "save_for_viewing": lambda given: given.made(
        simplifier.save_for_viewing, path=given.folder / "shown.glb"
    ),
    # The seed is out of range, so that no scene is ever made.
    "simplify_scene": lambda given: Call(
        partial(simplifier.simplify_scene, seed=-1),
        {"scene": simplifier.load_scene(given.path), "folder": given.folder / "scene"},
    ),
    "record_walk": lambda given: Call(
        simplifier.record_walk,
        {
            "scene": simplifier.load_scene(given.path),
            "occluders": simplifier.load_occluder_tree(BUILT),
            "cancel": ENDED,
        },
    ),
    "find_visible_sets": lambda given: Call(
        simplifier.find_visible_sets,
        {"path": given.path, "cancel": ENDED},
        ("tell", "tell_objects", "cancel"),
    ),
    "SimplifyOptions": lambda given: Call(simplifier.SimplifyOptions),
    "SimplifyOptions.of": lambda given: Call(simplifier.SimplifyOptions.of, {"chosen": {}}),
    "EvaluateOptions": lambda given: Call(simplifier.EvaluateOptions),
    "EvaluateOptions.of": lambda given: Call(simplifier.EvaluateOptions.of, {"chosen": {}}),
    "TradeoffOptions": lambda given: Call(simplifier.TradeoffOptions),
    "TradeoffOptions.of": lambda given: Call(simplifier.TradeoffOptions.of, {"chosen": {}}),
    "DepthBuffer": lambda given: Call(simplifier.DepthBuffer, {"rows": 16, "columns": 16}),
    "Lens": lambda given: Call(simplifier.Lens),
    "Camera.looking": lambda given: Call(
        simplifier.Camera.looking, {**VIEW, "fov": 60.0, "near": 0.1}
    ),
    "TriangleMesh": lambda given: given.arrays(simplifier.TriangleMesh),
    "TriangleMesh.from_soup": lambda given: given.arrays(simplifier.TriangleMesh.from_soup),
    "Occluder": lambda given: given.arrays(simplifier.Occluder),
}


def histogram(name: str, values: np.ndarray, low: float, digits: int) -> bytes:
    """Each drawn once: matplotlib takes long."""
    return drawn_histogram(name, values.tobytes(), low, digits)


draw_histogram = gallery._histogram


@cache
def drawn_histogram(name: str, values: bytes, low: float, digits: int) -> bytes:
    return draw_histogram(name, np.frombuffer(values), low, digits)


@pytest.fixture
def given(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Given:
    """Where a path may be any text, files go to an empty folder."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(gallery, "_histogram", histogram)
    mesh = box()
    occluder = simplifier.Occluder(mesh.vertices, mesh.faces)
    simplifier.save(occluder, tmp_path / "box.glb")
    overrides = tmp_path / "box.overrides.toml"
    overrides.write_text('[ignore]\ntransparent = "keep"\n')
    return Given(tmp_path, mesh, occluder, tmp_path / "box.glb", overrides)


@pytest.mark.parametrize("name", CALLS)
def test_whatever_is_handed_over_is_taken_or_refused(given: Given, name: str) -> None:
    """A refusal names the argument's place and says what to do; there is no other way to fail."""
    call = CALLS[name](given)
    parameters = inspect.signature(call.function).parameters
    for parameter in set(parameters) - {*call.own, "changes"}:
        for odd in ODD.values():
            try:
                call.function(**{**call.arguments, parameter: odd})
            except CancelledError:
                pass
            except OccluderError as error:
                assert error.remedy, error  # noqa: PT017


def test_no_public_function_is_left_out() -> None:
    functions = {
        name for name in simplifier.__all__ if inspect.isfunction(getattr(simplifier, name))
    }
    assert functions - set(CALLS) == {"default_limit", "warm_up"}  # which take nothing


@pytest.mark.parametrize("listener", ["odd", 5, object()])
@pytest.mark.parametrize("name", ["simplify", "simplify, cancelled", "evaluate"])
def test_a_listener_that_cannot_be_called(given: Given, name: str, listener: object) -> None:
    call = CALLS[name](given)
    with pytest.raises(OptionError, match=r"^listener: .* cannot be called; give a function$"):
        call.function(**{**call.arguments, "listener": listener})


@pytest.mark.parametrize("cancel", ["odd", 5, object()])
@pytest.mark.parametrize("name", ["simplify, cancelled", "sweep_tradeoff", "simplify_scene"])
def test_a_cancel_that_cannot_be_asked(given: Given, name: str, cancel: object) -> None:
    call = CALLS[name](given)
    with pytest.raises(OptionError, match=r"^cancel: .* has no method is_set; give a threading"):
        call.function(**{**call.arguments, "cancel": cancel})


def test_numbers_of_numpy_are_taken_as_python_s(given: Given) -> None:
    """A seed of numpy overflowed a sum; others came into a report, which no JSON takes."""
    options = {"budget": np.uint8(12), "resolution": np.int64(8), "moves": np.int16(20)}
    more = {"seed": np.int64(7), "min_precision": np.float32(0.5), "smallest_hole": np.float64(0)}
    ours = simplifier.simplify(
        given.mesh, preset="draft", budget=12, resolution=8, moves=20, seed=7, min_precision=0.5
    ).occluder
    theirs = simplifier.simplify(given.mesh, preset="draft", **options, **more).occluder
    assert theirs.vertices.tobytes() == ours.vertices.tobytes()
    assert theirs.faces.tobytes() == ours.faces.tobytes()
    small, large = np.uint8(200), 200  # three times the former is 88
    pictures = [simplifier.picture_of(given.mesh, ours, size=size) for size in (small, large)]
    assert pictures[0] == pictures[1]
    product = simplifier.simplify(
        given.mesh, simplifier.SimplifyOptions(preset="draft", **options, **more, **JUDGED)
    ).measure()
    assert json.loads(json.dumps(product.report()))["seed"] == 7


@pytest.mark.parametrize(
    "view",
    [
        {"forward": [0, 0, 0]},
        {"up": [0, 0, 0]},
        {"up": [2, 0, 0]},
        {"forward": [np.nan, 0, 0]},
        {"position": [0, np.inf, 0]},
        {"near": 0.0},
        {"fov": 180.0},
        {"fov": np.nan},
    ],
)
def test_a_view_that_cannot_be(view: Mapping[str, Any]) -> None:
    """A direction of length 0 gave a camera of NaN, before which nothing was hidden or seen."""
    with pytest.raises(OptionError):
        simplifier.Camera.looking(**{**VIEW, "fov": 60.0, "near": 0.1, **view})
