"""The page stands alone, escapes what comes from outside, and reads in both modes."""

from __future__ import annotations

import base64
import json
import re
from html.parser import HTMLParser
from pathlib import Path

import cv2
import numpy as np
import pytest

import simplifier.report
from examples.building import box
from simplifier.accuracy.accuracy import AccuracyOptions, evaluate_accuracy
from simplifier.errors import OutputError
from simplifier.geometry.mesh import TriangleMesh
from simplifier.geometry.occluder import Occluder
from simplifier.progress import STAGES
from simplifier.report.gallery import draw_gallery
from simplifier.report.page import page_text, write_page, write_pictures

HOSTILE = "\"><script>alert('1')</script> & {{ 7 * 7 }} {% raw %} <img src=x onerror=1>"
VOID = {"meta", "img", "br", "source"}


@pytest.fixture(scope="module")
def scene():
    block, core = box(4.0, 2.0, 2.0), box(3.0, 1.5, 1.0)
    mesh = TriangleMesh.from_soup(block.vertices, block.faces)
    occluder = Occluder(core.vertices, core.faces)
    return mesh, occluder, evaluate_accuracy(mesh, occluder, AccuracyOptions(views=9, image=64))


@pytest.fixture(scope="module")
def gallery(scene):
    return draw_gallery(*scene)


@pytest.fixture
def report(scene):
    """What ``build_report`` gives, with figures that can be told apart in the text."""
    _, _, accuracy = scene
    by_view = [
        {"direction": d.tolist(), "precision": float(p), "recall": float(r)}
        for d, p, r in zip(
            accuracy.directions, accuracy.precision_by_view, accuracy.recall_by_view, strict=True
        )
    ]
    return {
        "schema_version": 1,
        "version": "9.8.7",
        "verdict": {"word": "good", "reason": "it hides most of it", "next": None},
        "coverage": 0.0214,
        "triangles": 53,
        "precision": 0.99876,
        "recall": 0.8351,
        "by_view": by_view,
        "worst_view": {"index": 0, **by_view[0], "recall": 0.4321},
        "overhang": {
            "share": 0.0348,
            "stick_out": 0.0789,
            "worst_view": {"index": 1, "direction": [0.0, 0.0, 1.0], "share": 0.04701},
        },
        "front": {
            "share": 0.0234,
            "worst_view": {"index": 1, "direction": [0.0, 0.0, 1.0], "share": 0.05678},
        },
        "occlusion_measure": {"occluder": 1.0, "original": 1.5, "ratio": 0.7654},
        "error_bound": 0.05432,
        "deviation": 0.02345,
        "timings": dict.fromkeys(STAGES, 0.0) | {"sections": 1.25, "cut": 0.5},
        "options": {"budget": 64, "ground": True, "smallest_hole": None, "trim": "gain"},
        "input": {
            "triangles": 4968,
            "vertices": 2503,
            "bounds": [[-1.0, 0.0, -2.0], [1.0, 3.0, 2.5]],
            "dropped": {"non_finite": 3, "repeated_index": 0, "zero_area": 7},
            "omitted": [],
        },
        "solid": {
            "resolution": [64, 63, 50],
            "cell_size": 0.0123456,
            "inside_fraction": 0.4567,
            "closed_by": [{"by": "ground", "volume": 2.5}],
        },
        "warnings": [],
        "seed": 42,
    }


class Reader(HTMLParser):
    """Checks that tags nest; collects tags, addresses, styles and words."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.tags: list[str] = []
        self.attributes: list[tuple[str, str, str | None]] = []
        self.words: list[str] = []
        self.feed(text)
        self.close()
        assert self.open == []

    def handle_starttag(self, tag, attrs):
        self.tags.append(tag)
        self.attributes += [(tag, name, value) for name, value in attrs]
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        if self.open[-1:] != ["style"]:
            self.words.append(data)

    @property
    def text(self) -> str:
        return " ".join(" ".join(self.words).split())


def test_the_page_fetches_and_executes_nothing(report, gallery):
    page = page_text(report, gallery)
    reader = Reader(page)
    assert "script" not in reader.tags
    assert "link" not in reader.tags
    for tag, name, value in reader.attributes:
        assert not name.startswith("on")
        if name in ("src", "href", "srcset"):
            assert (tag, name) == ("img", "src")
            assert value.startswith("data:image/png;base64,")
    style = page[page.index("<style>") : page.index("</style>")]
    assert "url(" not in style
    assert "@import" not in style
    assert "http:" not in page
    assert "https:" not in page
    policy = "default-src 'none'; img-src data:; style-src 'unsafe-inline'"
    assert ("meta", "content", policy) in reader.attributes


def test_hostile_words_stay_words(report, gallery):
    report["warnings"] = [HOSTILE + "warning"]
    report["options"] = {HOSTILE + "key": HOSTILE + "value", "other": [HOSTILE]}
    report["solid"]["closed_by"] = [{"by": HOSTILE, "volume": 1.0}]
    report["timings"] = {HOSTILE: 1.0}
    report["version"] = HOSTILE
    page = page_text(report, gallery, name=HOSTILE)
    reader = Reader(page)
    tame = json.loads(json.dumps(report).replace(json.dumps(HOSTILE)[1:-1], "x"))
    harmless = Reader(page_text(tame, gallery, name="x"))
    assert "alert" not in harmless.text
    assert "script" not in reader.tags
    assert reader.tags == harmless.tags
    for word in (HOSTILE, HOSTILE + "warning", HOSTILE + "value"):
        assert word in "".join(reader.words)


@pytest.mark.parametrize("name", ["", "caf\u00e9 \u57ce.glb", "\ud800 half", "a\x00b", "\u202eblg"])
def test_any_name_can_be_written(tmp_path, report, gallery, name):
    write_page(tmp_path / "page.html", report, gallery, name=name)
    Reader((tmp_path / "page.html").read_text("utf-8"))


def test_all_figures_are_there(report, gallery):
    text = Reader(page_text(report, gallery, name="bunny")).text
    for figure in (
        "bunny", "83.51 %", "99.87 %", "43.21 %", "76.54 %", "4,968", "2,503", "53", "0.05432",
        "0.02345", "-1.000, 0.000, -2.000", "1.000, 3.000, 2.500", "3 non finite, 7 zero area",
        "64 x 63 x 50 voxels", "0.01235 units", "45.6 %", "ground (added 2.500 cubic units)",
        "budget 64", "ground yes", "smallest hole default", "trim gain", "9.8.7", "seed 42",
        "Front 2.34 % of what is seen lies well behind it; at worst 5.68 %",
        "sections 1.25 s", "cut 500 ms", "total 1.75 s",
    ):  # fmt: skip
        assert figure in text, figure


def test_options_within_options_and_lists_are_words(report, gallery):
    report["options"] = {
        "refine": {"moves": 600, "draft": None, "deeper": {"on": True}},
        "bounds": [0.5, 1.0], "drawn": [],
    }  # fmt: skip
    report["input"]["omitted"] = [
        {"name": "material 'glass'", "see_through": True, "triangles": 1200}
    ]
    text = Reader(page_text(report, gallery)).text
    for words in (
        "refine: moves 600", "refine: draft default", "refine: deeper: on yes", "bounds 0.5, 1.0",
        "drawn none", "7 zero area, 1,200 of material 'glass'",
    ):  # fmt: skip
        assert words in text, words


def test_stages_that_did_not_run_are_left_out_and_bars_are_to_scale(report, gallery):
    page = page_text(report, gallery)
    assert "refine" not in Reader(page).text
    assert re.findall(r"width: ([\d.]+)%\"", page) == ["100.00", "40.00"]


def test_no_time_at_all(report, gallery):
    report["timings"] = dict.fromkeys(STAGES, 0.0)
    assert "total 0 ms" in Reader(page_text(report, gallery)).text


def test_warnings_come_first_and_only_when_there_are_some(report, gallery):
    assert 'class="warnings"' not in page_text(report, gallery)
    report["warnings"] = ["the surface is open", "12 triangles were left out"]
    page = page_text(report, gallery)
    text = Reader(page).text
    assert "the surface is open" in text
    assert "12 triangles were left out" in text
    assert page.index('class="warnings"') < page.index('class="tiles')


def test_the_verdict_comes_first_with_what_to_try(report, gallery):
    page = page_text(report, gallery)
    assert "Good for an engine It hides most of it." in Reader(page).text
    assert "Try next" not in page
    report["warnings"] = ["the surface is open"]
    report["verdict"] = {"word": "unusable", "reason": f"it is {HOSTILE}", "next": f"run {HOSTILE}"}
    page = page_text(report, gallery)
    reader = Reader(page)
    assert "Unusable for an engine" in reader.text
    assert "script" not in reader.tags
    assert "".join(reader.words).count(HOSTILE) == 2
    assert page.index('class="verdict unusable"') < page.index('class="warnings"')


def test_levels_are_a_table_and_only_when_there_are_some(report, gallery):
    assert "Levels of detail" not in page_text(report, gallery)
    level = {
        "level": 0, "triangles": 1053, "recall": 0.8351, "precision": 0.99876, "error_bound": 0.05,
        "deviation": 0.02, "resolution": 64, "switch_distance": 50.25, "file": HOSTILE,
        "overhang": {"share": 0.0123}, "verdict": {"word": "weak"},
    }  # fmt: skip
    coarse = {**level, "level": 1, "triangles": 8, "error_bound": None, "switch_distance": None}
    report["levels"] = [level, coarse]
    report["left_out"] = [{"resolution": 16, "reason": HOSTILE + "reason"}]
    page = page_text(report, gallery)
    reader = Reader(page)
    assert "script" not in reader.tags
    assert "".join(reader.words).count(HOSTILE) == 3
    assert "0 weak 1,053 83.51 % 99.87 % 1.23 % 0.05000 0.02000 64 any" in reader.text
    assert "1 weak 8 83.51 % 99.87 % 1.23 % no promise 0.02000 64 no promise" in reader.text
    assert "Left out: 16 voxels:" in reader.text
    report["left_out"] = []
    assert "Left out" not in page_text(report, gallery)


def test_an_occluder_without_a_promise(report, gallery):
    report["error_bound"] = None
    text = Reader(page_text(report, gallery)).text
    assert "no promise" in text
    assert "at most" not in text


def test_every_picture_is_in_the_page_with_words_for_who_cannot_see_it(report, gallery):
    reader = Reader(page_text(report, gallery))
    sources = [value for tag, name, value in reader.attributes if (tag, name) == ("img", "src")]
    inside = [base64.b64decode(source.partition(",")[2]) for source in sources]
    assert inside == [*gallery.view_files, gallery.recall, gallery.precision]
    words = [value for tag, name, value in reader.attributes if (tag, name) == ("img", "alt")]
    assert len(words) == len(sources)
    assert all(len(word) > 20 for word in words)
    assert "Worst" in reader.text


def luminance(colour: str) -> float:
    """Relative luminance of #rrggbb as the WCAG defines it."""
    share = np.array([int(colour[i : i + 2], 16) for i in (1, 3, 5)]) / 255.0
    linear = np.where(share <= 0.03928, share / 12.92, ((share + 0.055) / 1.055) ** 2.4)
    return float(linear @ [0.2126, 0.7152, 0.0722])


@pytest.mark.parametrize("mode", ["light", "dark"])
def test_contrast_of_words_is_at_least_4_5(mode):
    text = (Path(simplifier.report.__file__).parent / "page.html").read_text("utf-8")
    light, dark = re.findall(r":root \{(.*?)\}", text, flags=re.S)
    colours = dict(re.findall(r"--([\w-]+): (#[0-9a-f]{6})", light if mode == "light" else dark))
    for ground in ("page", "card", "alert"):
        for ink in ("ink",) if ground == "alert" else ("ink", "soft", "bad", "fine", "doubt"):
            low, high = sorted(luminance(colours[name]) for name in (ground, ink))
            assert (high + 0.05) / (low + 0.05) >= 4.5, (ground, ink)


def test_folder_gets_every_picture_and_the_page(tmp_path, scene, report):
    folder = tmp_path / "deep" / "pictures"
    written = write_pictures(folder, *scene, report, name="block")
    assert sorted(written) == sorted(folder.iterdir())
    names = [path.name for path in written]
    assert names[0] == "silhouettes.png"
    assert names[1].startswith("view_00_worst_recall")
    assert names[-3:] == ["recall.png", "precision.png", "report.html"]
    assert len(names) == 1 + 6 + 3
    for path in written[:-1]:
        assert cv2.imread(str(path)) is not None
    Reader(written[-1].read_text("utf-8"))


def test_writing_again_gives_the_same_bytes(tmp_path, scene, report):
    first = {path.name: path.read_bytes() for path in write_pictures(tmp_path, *scene, report)}
    second = {path.name: path.read_bytes() for path in write_pictures(tmp_path, *scene, report)}
    assert first == second


def test_a_file_in_the_way_of_the_folder_is_an_output_error(tmp_path, scene, report):
    (tmp_path / "taken").write_text("mine")
    with pytest.raises(OutputError, match="taken"):
        write_pictures(tmp_path / "taken", *scene, report)
    assert (tmp_path / "taken").read_text() == "mine"


def test_a_folder_in_the_way_of_the_page_is_an_output_error(tmp_path, report, gallery):
    (tmp_path / "page.html").mkdir()
    with pytest.raises(OutputError):
        write_page(tmp_path / "page.html", report, gallery)
    assert [path.name for path in tmp_path.iterdir()] == ["page.html"]


def test_a_page_that_cannot_be_made_leaves_the_old_one(tmp_path, report, gallery):
    path = tmp_path / "page.html"
    path.write_text("old")
    del report["input"]
    with pytest.raises(KeyError):
        write_page(path, report, gallery)
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]
