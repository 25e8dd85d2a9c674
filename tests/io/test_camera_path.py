"""Camera paths as JSON: what is written comes back, what is wrong is named by frame and field."""

from __future__ import annotations

import json
from pathlib import Path

import jsonschema
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from simplifier.errors import OutputError, UnreadablePathError
from simplifier.geometry.camera import Camera, CameraPath
from simplifier.io.camera_path import load_camera_path, save_camera_path

SCHEMA = json.loads((Path(__file__).parents[2] / "docs" / "camera_path.schema.json").read_text())
FRAME = {"position": [1, 2, 3], "forward": [0, 0, -2], "up": [0, 3, 0], "fov": 60, "near": 0.5}


def schema_allows(root):
    return jsonschema.Draft202012Validator(SCHEMA).is_valid(root)


def root_of(*frames, **changes):
    return {"schema_version": 1, "name": "by hand", "frames": list(frames), **changes}


def frame(without=(), **changes):
    return {key: value for key, value in {**FRAME, **changes}.items() if key not in without}


@pytest.fixture
def load(tmp_path):
    """The path that a JSON value, a text or bytes are read as."""

    def read(root):
        path = tmp_path / "path.json"
        data = root if isinstance(root, (bytes, str)) else json.dumps(root)
        path.write_bytes(data if isinstance(data, bytes) else data.encode())
        return load_camera_path(path)

    return read


def test_a_frame_by_hand(load):
    path = load(root_of(FRAME))
    assert path.name == "by hand"
    (camera,) = path.cameras
    assert camera.position.tolist() == [1.0, 2.0, 3.0]
    assert camera.axes == pytest.approx(np.array([[1.0, 0, 0], [0, 1, 0], [0, 0, -1]]))
    assert (camera.fov, camera.near) == (60.0, 0.5)


def test_a_target_and_the_default_near(load):
    (camera,) = load(root_of(frame(("forward", "near"), target=[1, 2, 13]))).cameras
    assert camera.axes[2] == pytest.approx([0.0, 0.0, 1.0])
    assert camera.near == SCHEMA["$defs"]["frame"]["properties"]["near"]["default"]


def test_directions_of_any_length(load):
    (camera,) = load(root_of(frame(forward=[0, 0, -1e-200], up=[0, 1e140, 0]))).cameras
    assert camera.axes == pytest.approx(np.array([[1.0, 0, 0], [0, 1, 0], [0, 0, -1]]))


number = st.floats(-1e12, 1e12)


@given(
    places=st.lists(st.tuples(number, number, number), min_size=1, max_size=5),
    turn=st.floats(-3.2, 3.2), tilt=st.floats(-1.5, 1.5), fov=st.floats(0.1, 179.9),
    near=st.floats(1e-9, 1e9), name=st.text(),
)  # fmt: skip
def test_round_trip(tmp_path_factory, places, turn, tilt, fov, near, name):
    forward = np.array([np.cos(tilt) * np.cos(turn), np.sin(tilt), np.cos(tilt) * np.sin(turn)])
    cameras = [
        Camera.looking(np.array(place), forward, np.array([0.0, 1.0, 0.0]), fov, near)
        for place in places
    ]
    file = tmp_path_factory.getbasetemp() / "round.json"
    save_camera_path(CameraPath(name, tuple(cameras)), file)
    assert schema_allows(json.loads(file.read_text()))
    back = load_camera_path(file)
    assert back.name == name
    assert len(back.cameras) == len(cameras)
    for one, other in zip(cameras, back.cameras, strict=True):
        assert one.position.tobytes() == other.position.tobytes()
        assert one.axes == pytest.approx(other.axes, abs=1e-12)
        assert (one.fov, one.near) == (other.fov, other.near)


BAD_FRAMES = {
    "position is missing": frame(["position"]),
    "up is missing": frame(["up"]),
    "fov is missing": frame(["fov"]),
    "neither forward nor target is given": frame(["forward"]),
    "both forward and target are given": frame(target=[0, 0, 0]),
    "position is [1, 2], not a list of three": frame(position=[1, 2]),
    "position is {}, not a list": frame(position={}),
    "position holds null, not a finite": frame(position=[1, None, 3]),
    "position holds true, not a finite": frame(position=[1, True, 3]),
    'up holds "y", not a finite': frame(up=["y", 0, 0]),
    "position holds 1e+200, not a finite": frame(position=[1e200, 0, 0]),
    "position holds 1000": frame(position=[10**400, 0, 0]),
    "forward is zero": frame(forward=[0, 0, 0]),
    "up is zero": frame(up=[0, 0, 0]),
    "target is the position": frame(["forward"], target=[1, 2, 3]),
    "up is parallel to forward": frame(forward=[0, -7, 1e-9]),
    "up is parallel to target": frame(["forward"], target=[1, 9, 3]),
    "fov is 0, not from 1e-06 to below 180": frame(fov=0),
    "fov is 180, not from 1e-06 to below 180": frame(fov=180),
    "fov is -20, not from 1e-06 to below 180": frame(fov=-20),
    "near is 0, not above 0": frame(near=0),
    "near is -1, not above 0": frame(near=-1),
    "near holds null, not a finite": frame(near=None),
    '"foward" is no known field': frame(foward=[0, 0, 1]),
    "this is not a JSON object": [1, 2, 3],
}

NOT_IN_THE_SCHEMA = {
    "forward is zero", "up is zero", "target is the position", "up is parallel to forward",
    "up is parallel to target",
}  # fmt: skip
"""Faults of directions, which the schema tells in words."""


@pytest.mark.parametrize("words", BAD_FRAMES)
def test_a_bad_frame_is_named(load, tmp_path, words):
    root = root_of(FRAME, FRAME, BAD_FRAMES[words], FRAME)
    with pytest.raises(UnreadablePathError) as caught:
        load(root)
    assert str(caught.value).startswith(f"{tmp_path / 'path.json'}: frame 2: {words}")
    assert str(caught.value).endswith("see docs/camera_path.schema.json for the format")
    assert len(str(caught.value)) < 400
    assert schema_allows(root) == (words in NOT_IN_THE_SCHEMA)


BAD_FILES = {
    "frames is not a list": root_of(frames={}),
    "frames is not a list of at least one frame": root_of(),
    "frames is missing": {"schema_version": 1, "name": ""},
    "schema_version is 2, not 1": root_of(FRAME, schema_version=2),
    "schema_version is true, not 1": root_of(FRAME, schema_version=True),
    "name is 7, not a text": root_of(FRAME, name=7),
    '"frame" is no known field': root_of(FRAME, frame=1),
    "this is not a JSON object": [FRAME],
}


@pytest.mark.parametrize("words", BAD_FILES)
def test_a_bad_file(load, words):
    with pytest.raises(UnreadablePathError, match=words):
        load(BAD_FILES[words])
    assert not schema_allows(BAD_FILES[words])


@pytest.mark.parametrize(
    "data",
    [
        b"glTF\2\0\0\0", b"{", b"\xff\xfe{", b"[" * 100_000,
        json.dumps(root_of(FRAME)).replace("60", "NaN"),
        json.dumps(root_of(FRAME)).replace("60", "-Infinity"),
        json.dumps(root_of(FRAME)).replace("60", "9" * 5000),
    ],
)  # fmt: skip
def test_not_json(load, data):
    with pytest.raises(UnreadablePathError, match="this is not JSON"):
        load(data)


def test_a_number_past_all_floats(load):
    with pytest.raises(UnreadablePathError, match="frame 0: fov holds Infinity, not a finite"):
        load(json.dumps(root_of(FRAME)).replace("60", "1e999"))


def test_a_byte_order_mark_is_no_fault(load):
    assert len(load(b"\xef\xbb\xbf" + json.dumps(root_of(FRAME)).encode()).cameras) == 1


def test_no_file(tmp_path):
    with pytest.raises(UnreadablePathError, match="there is no such file"):
        load_camera_path(tmp_path / "none.json")
    with pytest.raises(UnreadablePathError, match="this is a folder; name a camera path"):
        load_camera_path(tmp_path)
    (tmp_path / "empty.json").touch()
    with pytest.raises(UnreadablePathError, match="the file is empty"):
        load_camera_path(tmp_path / "empty.json")


def test_no_folder_to_write_to(tmp_path, load):
    with pytest.raises(OutputError, match="there is no folder"):
        save_camera_path(load(root_of(FRAME)), tmp_path / "none" / "path.json")


def test_the_schema_is_one():
    jsonschema.Draft202012Validator.check_schema(SCHEMA)
    assert schema_allows(root_of(FRAME))
