"""The add-on in Blender: what the button makes of a selection."""

from __future__ import annotations

import json
import os
import time
from pathlib import Path
from types import SimpleNamespace
from urllib.request import urlopen

import numpy as np
import pytest

bpy = pytest.importorskip(
    "bpy", reason="Blender's module bpy is not installed; `make test-blender` has it"
)


def select(*items):
    bpy.ops.object.select_all(action="DESELECT")
    for item in items:
        item.select_set(True)
    bpy.context.view_layer.objects.active = items[-1] if items else None


def torus(**placed):
    bpy.ops.mesh.primitive_torus_add(major_segments=24, minor_segments=12)
    return place(bpy.context.object, **placed)


def cube(**placed):
    bpy.ops.mesh.primitive_cube_add(size=2.0)
    return place(bpy.context.object, **placed)


def place(item, at=(0, 0, 0), turn=(0, 0, 0), scale=(1, 1, 1)):
    item.location, item.rotation_euler, item.scale = at, turn, scale
    bpy.context.view_layer.update()
    return item


def make():
    return bpy.ops.object.make_occluder()


def occluder_of(item):
    (child,) = (one for one in item.children if "planar_occluder" in one)
    bpy.context.view_layer.update()
    return child


def world_points(item):
    return np.array([item.matrix_world @ vertex.co for vertex in item.data.vertices])


def assert_fits(item, box, slack):
    """The corners of an object in the world reach those of a box, (2, 3), and not past them."""
    points = world_points(item)
    np.testing.assert_allclose([points.min(axis=0), points.max(axis=0)], box, atol=slack)


def test_the_result_is_a_child_of_at_most_the_budget(settings, part):
    ring = torus()
    select(ring)
    assert make() == {"FINISHED"}
    child = occluder_of(ring)
    assert child.name == f"{ring.name}_occluder"
    assert 0 < len(child.data.polygons) <= settings.budget
    assert {len(face.vertices) for face in child.data.polygons} == {3}
    assert np.array_equal(child.matrix_local, np.eye(4))
    assert child.hide_render
    assert child.users_collection == ring.users_collection
    assert child["planar_occluder"]["recall"] > 0.3
    assert part("panel").figures(ring)[0] == f"{len(child.data.polygons)} triangles"


def test_it_lies_where_a_turned_scaled_and_parented_object_is(settings):
    handle = place(bpy.data.objects.new("handle", None), (40, -7, 3), (0.3, 0.2, 1.0), (2, 2, 2))
    bpy.context.scene.collection.objects.link(handle)
    box = cube(at=(1, 2, 3), turn=(0.1, 0.7, -0.4), scale=(3, 0.5, 1.5))
    box.parent = handle
    bpy.context.view_layer.update()
    corners = world_points(box)
    select(box)
    assert make() == {"FINISHED"}
    found = world_points(occluder_of(box))
    distances = np.linalg.norm(found[:, None] - corners[None], axis=2)
    assert distances.min(axis=1).max() < 1e-4
    assert distances.min(axis=0).max() < 1e-4


def test_a_mirrored_object_gives_faces_that_look_outwards(settings):
    box = cube(at=(5, 0, 0), scale=(-1, 1, 2))
    select(box)
    assert make() == {"FINISHED"}
    child = occluder_of(box)
    for face in child.data.polygons:
        normal = child.matrix_world.to_3x3().inverted().transposed() @ face.normal
        assert normal.dot(child.matrix_world @ face.center - box.matrix_world.translation) > 0.0


def test_it_follows_its_object_also_when_that_is_turned_meanwhile(settings, preferences, part):
    box = cube(scale=(1, 2, 3))
    select(box)
    session = part("session").Session(bpy.context)
    session.step(bpy.context)
    place(box, (9, 9, 9), (1.0, 0.5, 0.0), (1, 2, 3))
    finish(session)
    assert session.failures == []
    np.testing.assert_allclose(
        np.abs([vertex.co for vertex in occluder_of(box).data.vertices]), 1.0, atol=1e-5
    )


def finish(session, seconds=60.0):
    end = time.monotonic() + seconds
    while not session.done:
        assert time.monotonic() < end
        session.step(bpy.context)
        time.sleep(0.01)


def test_modifiers_are_applied(settings):
    box = cube()
    array = box.modifiers.new("row", "ARRAY")
    array.count, array.use_relative_offset, array.use_constant_offset = 2, False, True
    array.constant_offset_displace = (4, 0, 0)
    select(box)
    assert make() == {"FINISHED"}
    assert_fits(occluder_of(box), [[-1, -1, -1], [5, 1, 1]], 1e-5)


def test_each_of_several_has_its_own(settings):
    boxes = [cube(at=(3 * n, 0, 0)) for n in range(3)]
    select(*boxes)
    assert make() == {"FINISHED"}
    for box in boxes:
        assert len(occluder_of(box).data.polygons) == 12


def test_several_together_have_one_below_the_active_object(settings):
    left, right = cube(at=(-3, 0, 0)), cube(at=(3, 0, 0), turn=(0, 0, 0.5))
    settings.scope = "TOGETHER"
    select(left, right)
    assert make() == {"FINISHED"}
    assert left.children == ()
    corners = np.concatenate([world_points(left), world_points(right)])
    assert_fits(occluder_of(right), [corners.min(axis=0), corners.max(axis=0)], 1e-4)


@pytest.mark.parametrize("nested", [False, True])
def test_instances_of_a_collection_count_as_what_they_show_without_its_occluders(
    settings, nested, part
):
    box = cube(at=(1, 0, 0))
    select(box)
    make()
    collection = bpy.data.collections.new("props")
    for item in (box, occluder_of(box)):
        collection.objects.link(item)
    if nested:
        inner = bpy.data.objects.new("inner", None)
        inner.instance_type, inner.instance_collection = "COLLECTION", collection
        collection = bpy.data.collections.new("outer")
        collection.objects.link(inner)
    holder = bpy.data.objects.new("holder", None)
    holder.instance_type, holder.instance_collection = "COLLECTION", collection
    bpy.context.scene.collection.objects.link(holder)
    place(holder, (0, 0, 10), (0, 0, np.pi / 2))
    select(holder)
    vertices, _, _ = part("geometry").triangles_of(bpy.context, [holder], holder, "leave-out")
    assert len(vertices) == 8
    assert make() == {"FINISHED"}
    assert_fits(occluder_of(holder), [[-1, 0, 9], [1, 2, 11]], 1e-4)


def test_points_of_geometry_nodes_that_carry_instances_count(settings, part):
    box = cube()
    bpy.ops.mesh.primitive_plane_add(size=20.0)
    ground = bpy.context.object
    ground.instance_type = "VERTS"
    box.parent = ground
    bpy.context.view_layer.update()
    vertices, faces, _ = part("geometry").triangles_of(bpy.context, [ground], ground, "leave-out")
    # Four boxes, one a corner; the instancer is shown as well.
    assert len(faces) in (4 * 12, 4 * 12 + 2)
    assert np.abs(vertices[:, :2]).max() == pytest.approx(11.0)


def test_text_and_curves_count_as_their_surface(settings):
    bpy.ops.object.text_add()
    text = bpy.context.object
    text.data.extrude = 0.2
    select(text)
    assert make() == {"FINISHED"}
    assert len(occluder_of(text).data.polygons) > 0


def test_a_second_one_takes_the_place_of_the_first(settings):
    ring = torus()
    select(ring)
    make()
    first, meshes = occluder_of(ring), len(bpy.data.meshes)
    settings.budget, settings.suffix = 10, "-occonly"
    make()
    assert occluder_of(ring) == first
    assert first.name == f"{ring.name}-occonly"
    assert 0 < len(first.data.polygons) <= 10
    assert len(bpy.data.meshes) == meshes


def test_undo_takes_it_back(settings):
    select(cube())
    bpy.ops.ed.undo_push(message="a cube")
    count = len(bpy.data.objects)
    make()
    bpy.ops.ed.undo_push(message="an occluder")
    assert len(bpy.data.objects) == count + 1
    bpy.ops.ed.undo()
    assert len(bpy.data.objects) == count


def test_an_object_that_is_deleted_meanwhile_is_told_of_and_the_others_are_made(settings, part):
    doomed, kept = cube(), cube()
    select(doomed, kept)
    session = part("session").Session(bpy.context)
    session.step(bpy.context)
    bpy.data.objects.remove(doomed)
    finish(session)
    assert session.made == 1
    assert session.failures == ["an object: it is there no more"]
    occluder_of(kept)


# What one can see through.


def material(name):
    made = bpy.data.materials.new(name)
    if bpy.app.version < (5, 0, 0):  # later ones have nodes, and do not like to be asked
        made.use_nodes = True
    return made


def principled(made):
    return made.node_tree.nodes["Principled BSDF"]


def add(tree, kind, source=None, into=None):
    """A node; of its inputs, ``into`` is fed by what ``source`` gives first."""
    node = tree.nodes.new(kind)
    if source is not None:
        tree.links.new(source.outputs[0], node.inputs[into or 0])
    return node


def finish_with(made, node):
    """Make a node the surface."""
    tree = made.node_tree
    tree.links.new(node.outputs[0], tree.get_output_node("EEVEE").inputs["Surface"])


def glass(name="glass"):
    made = material(name)
    principled(made).inputs["Transmission Weight"].default_value = 0.9
    return made


def blended(made):
    made.surface_render_method = "BLENDED"


def thin(made):
    principled(made).inputs["Alpha"].default_value = 0.99


def cut_out(made):
    image = made.node_tree.nodes.new("ShaderNodeTexImage")
    made.node_tree.links.new(image.outputs["Alpha"], principled(made).inputs["Alpha"])


def transmissive(made):
    principled(made).inputs["Transmission Weight"].default_value = 0.01


def transmissive_by_picture(made):
    image = made.node_tree.nodes.new("ShaderNodeTexImage")
    weight = principled(made).inputs["Transmission Weight"]
    made.node_tree.links.new(image.outputs["Color"], weight)


def of_glass(made):
    finish_with(made, made.node_tree.nodes.new("ShaderNodeBsdfGlass"))


def refracting(made):
    finish_with(made, made.node_tree.nodes.new("ShaderNodeBsdfRefraction"))


def mixed(made):
    tree = made.node_tree
    mix = add(tree, "ShaderNodeMixShader", principled(made), 1)
    tree.links.new(add(tree, "ShaderNodeBsdfTransparent").outputs[0], mix.inputs[2])
    finish_with(made, add(tree, "NodeReroute", mix))
    return mix


def glass_through_a_muted_mix(made):
    transmissive(made)
    mixed(made).mute = True


def clear_in_cycles_alone(made):
    tree = made.node_tree
    tree.get_output_node("EEVEE").target = "EEVEE"
    other = add(tree, "ShaderNodeOutputMaterial", add(tree, "ShaderNodeBsdfTransparent"))
    other.target = "CYCLES"


def grouped(made, alpha=0.5):
    """A group with a surface whose alpha is set outside of it."""
    inside = bpy.data.node_groups.new("paint", "ShaderNodeTree")
    inside.interface.new_socket("How much", in_out="INPUT", socket_type="NodeSocketFloat")
    inside.interface.new_socket("Shader", in_out="OUTPUT", socket_type="NodeSocketShader")
    bend = add(inside, "NodeReroute", add(inside, "NodeGroupInput"))
    paint = add(inside, "ShaderNodeBsdfPrincipled", bend, "Alpha")
    add(inside, "NodeGroupOutput", paint)
    group = made.node_tree.nodes.new("ShaderNodeGroup")
    group.node_tree = inside
    group.inputs[0].default_value = alpha
    finish_with(made, group)


def foggy(made):
    tree, output = made.node_tree, made.node_tree.get_output_node("EEVEE")
    tree.nodes.remove(principled(made))
    fog = tree.nodes.new("ShaderNodeVolumePrincipled")
    tree.links.new(fog.outputs[0], output.inputs["Volume"])


def as_it_comes(made):
    pass


def clear_shader_that_goes_nowhere(made):
    made.node_tree.nodes.new("ShaderNodeBsdfTransparent")


def mix_that_is_muted(made):
    mixed(made).mute = True


def link_that_is_muted(made):
    cut_out(made)
    principled(made).inputs["Alpha"].links[0].is_muted = True


def group_with_full_alpha(made):
    grouped(made, 1.0)


def unlinked(made):
    made.node_tree.nodes.remove(principled(made))


def left_out(part, *items, transparent="leave-out"):
    """Counts of triangles by material, of objects at the origin."""
    return dict(part("geometry").triangles_of(bpy.context, items, items[0], transparent)[2])


@pytest.mark.parametrize(
    "declare",
    [
        blended, thin, cut_out, transmissive, transmissive_by_picture, of_glass, refracting, mixed,
        glass_through_a_muted_mix, clear_in_cycles_alone, grouped, foggy,
    ],
)  # fmt: skip
def test_what_declares_that_one_can_see_through_is_left_out(settings, part, declare):
    box, made = cube(), material("pane")
    declare(made)
    box.data.materials.append(made)
    bpy.context.view_layer.update()
    assert left_out(part, box) == {"pane": 12}
    assert left_out(part, box, transparent="keep") == {}


@pytest.mark.parametrize(
    "declare",
    [
        as_it_comes, clear_shader_that_goes_nowhere, mix_that_is_muted, link_that_is_muted,
        group_with_full_alpha, unlinked,
    ],
)  # fmt: skip
def test_what_shows_nothing_behind_it_is_taken(settings, part, declare):
    box, made = cube(), material("wall")
    declare(made)
    box.data.materials.append(made)
    bpy.context.view_layer.update()
    assert left_out(part, box) == {}


def test_a_material_counts_where_it_is_shown(settings, part):
    """By the face's slot, the object's own material before the mesh's, the last for what is past
    them; a slot without faces, and one without a material, hide what they did."""
    stone, pane, unused = material("stone"), glass("pane"), glass("unused")
    box = cube()
    for one in (pane, None, pane, unused):
        box.data.materials.append(one)
    box.material_slots[0].link = "OBJECT"
    box.material_slots[0].material = stone
    for face, slot in zip(box.data.polygons, (0, 0, 0, 1, 2, 2), strict=True):
        face.material_index = slot
    bpy.context.view_layer.update()
    assert left_out(part, box) == {"pane": 4}
    box.data.polygons[0].material_index = 7
    box.data.update()
    bpy.context.view_layer.update()
    assert left_out(part, box) == {"pane": 4, "unused": 2}


def test_instances_have_the_materials_of_what_they_show(settings, part):
    box = cube()
    box.data.materials.append(glass())
    bpy.ops.mesh.primitive_plane_add(size=20.0)
    ground = bpy.context.object
    ground.instance_type = "VERTS"
    box.parent = ground
    bpy.context.view_layer.update()
    assert left_out(part, ground) == {"glass": 4 * 12}


def house(at=(0, 0, 0)):
    """A box with a wing of glass to its right, one object."""
    body, wing = cube(), cube(at=(3, 0, 0))
    body.data.materials.append(material("stone"))
    wing.data.materials.append(glass())
    select(wing, body)
    bpy.ops.object.join()
    return place(body, at)


def test_glass_is_left_out_of_the_occluder_and_told_of(settings, part):
    one = house()
    select(one)
    press = Press(part)
    assert pressed(press) == {"FINISHED"}
    assert_fits(occluder_of(one), [[-1, -1, -1], [1, 1, 1]], 1e-5)
    assert press.reports == [
        ("WARNING", "Cube: 12 see-through triangles were left out (material 'glass'); keep them "
         "with See-through: Keep"),
        ("INFO", "1 occluder made"),
    ]  # fmt: skip


def test_glass_is_kept_where_that_is_asked_for(settings, part):
    one = house()
    settings.transparent = "keep"
    select(one)
    press = Press(part)
    assert pressed(press) == {"FINISHED"}
    assert_fits(occluder_of(one), [[-1, -1, -1], [4, 1, 1]], 1e-5)
    assert press.reports == [("INFO", "1 occluder made")]


def test_an_object_of_which_nothing_is_left_is_told_of_and_the_others_are_made(settings, part):
    lamp, wall = cube(), cube(at=(5, 0, 0))
    lamp.name = "lamp"
    lamp.data.materials.append(glass())
    select(lamp, wall)
    press = Press(part)
    assert pressed(press) == {"FINISHED"}
    assert lamp.children == ()
    occluder_of(wall)
    assert press.reports == [
        ("WARNING", "lamp: nothing opaque is left: 12 see-through triangles were left out "
         "(material 'glass'); keep them with See-through: Keep"),
        ("INFO", "1 occluder made"),
    ]  # fmt: skip


def test_the_first_few_materials_are_named(part):
    words = part("materials").omitted_words
    assert words({"a": 1}) == "1 see-through triangle was left out (material 'a')"
    assert words(dict.fromkeys("abcdefg", 2)) == (
        "14 see-through triangles were left out (material 'a', material 'b', material 'c', "
        "material 'd', material 'e' and 2 more)"
    )


# What goes wrong.


def refused(match):
    with pytest.raises(RuntimeError, match=match):
        make()


def test_nothing_selected_is_an_error(settings):
    select()
    refused("Nothing was made: select objects")


def test_an_occluder_is_no_asset(settings):
    box = cube()
    select(box)
    make()
    select(occluder_of(box))
    refused("select objects that are no occluders")


def test_an_object_without_faces_is_an_error(settings):
    bpy.ops.object.light_add()
    select(bpy.context.object)
    refused("Point: it shows no triangles")


def test_an_object_scaled_to_nothing_is_an_error(settings):
    select(cube(scale=(1, 0, 1)))
    refused("its scale is 0 along an axis")


def test_a_command_that_is_not_there_is_an_error(settings, preferences):
    preferences.command = "no-such-occluder"
    select(cube())
    refused("Cube: there is no command 'no-such-occluder'")


@pytest.mark.parametrize(
    ("script", "said"),
    [
        ("echo 'error: the mesh is odd' >&2; exit 1", "error: the mesh is odd"),
        ("exit 3", "the command ended with status 3"),
        ("exit 0", "No such file"),
        ('echo ply >"$4"; echo {} >"$6"', "no PLY of triangles"),
    ],
)
def test_what_a_command_says_or_leaves_undone_is_told(
    settings, preferences, tmp_path, script, said
):
    preferences.command = str(program(tmp_path, script))
    select(cube())
    refused(said)
    assert list(Path(bpy.app.tempdir).iterdir()) == []


def test_edit_mode_is_an_error(settings):
    select(cube())
    bpy.ops.object.mode_set(mode="EDIT")
    try:
        assert not bpy.ops.object.make_occluder.poll()
    finally:
        bpy.ops.object.mode_set(mode="OBJECT")


# In a window.


def program(folder, script):
    path = folder / "occluder"
    path.write_text(f"#!/bin/sh\n{script}\n")
    path.chmod(0o755)
    return path


class Window:
    """The context, but that a handler may be any object: Blender sends events to windows alone."""

    def __init__(self):
        self.timers = []
        self.window_manager = SimpleNamespace(
            event_timer_add=self._add, event_timer_remove=self.timers.remove,
            modal_handler_add=lambda operator: None,
            progress_begin=lambda low, high: None, progress_update=lambda share: None,
            progress_end=lambda: None,
        )  # fmt: skip

    def _add(self, step, window):
        self.timers.append(step)
        return step

    def __getattr__(self, name):
        return getattr(bpy.context, name)


class Press:
    """The button as it is pressed in a window, with the events that follow."""

    def __init__(self, part):
        self._kind = part("operator").OBJECT_OT_make_occluder
        self.window, self.reports = Window(), []
        self.state = self._kind.invoke(self, self.window, None)

    def send(self, event):
        self.state = self._kind.modal(self, self.window, SimpleNamespace(type=event))

    def report(self, kinds, text):
        self.reports.append((*kinds, text))

    def __getattr__(self, name):
        return getattr(self._kind, name).__get__(self)


def pressed(press, seconds=60.0):
    """How a press ends that is left alone."""
    end = time.monotonic() + seconds
    while press.state <= {"RUNNING_MODAL", "PASS_THROUGH"}:
        assert time.monotonic() < end
        press.send("TIMER")
    return press.state


def test_a_press_in_a_window_ends_by_its_timer(settings, part):
    box = cube()
    select(box)
    press = Press(part)
    assert press.state == {"RUNNING_MODAL"}
    assert len(press.window.timers) == 1
    assert not bpy.ops.object.make_occluder.poll()
    assert pressed(press) == {"FINISHED"}
    assert press.window.timers == []
    assert press.reports == [("INFO", "1 occluder made")]
    assert bpy.ops.object.make_occluder.poll()
    occluder_of(box)


@pytest.mark.parametrize("closed", [False, True])
def test_the_end_of_it_ends_the_command_and_leaves_nothing(
    settings, preferences, part, tmp_path, closed
):
    pid = tmp_path / "pid"
    script = f"echo $$ >{pid}.new; mv {pid}.new {pid}; exec sleep 600"
    preferences.command = str(program(tmp_path, script))
    box = cube()
    select(box, cube())
    press = Press(part)
    end = time.monotonic() + 30.0
    while not pid.exists():
        press.send("TIMER")
        assert time.monotonic() < end
    if closed:
        press.cancel(press.window)
    else:
        press.send("ESC")
        assert press.state == {"CANCELLED"}
    assert press.window.timers == []
    with pytest.raises(ProcessLookupError):
        os.kill(int(pid.read_text()), 0)
    assert list(Path(bpy.app.tempdir).iterdir()) == []
    assert box.children == ()


# The overlay.


def test_the_preview_draws_while_it_is_on(settings, part):
    overlay = part("overlay")
    assert not overlay.is_shown()
    settings.preview = True
    assert overlay.is_shown()
    settings.preview = True
    settings.preview = False
    assert not overlay.is_shown()


def test_the_preview_holds_the_occluders_that_can_be_seen(settings, part):
    box, other = cube(at=(4, 0, 0)), cube()
    select(box, other)
    make()
    occluder_of(other).hide_set(True)
    ((points, triangles, edges),) = part("overlay").shapes(bpy.context)
    assert (len(points), len(triangles), len(edges)) == (8, 12, 18)
    assert points[:, 0].min() == pytest.approx(3.0)


def test_the_add_on_leaves_nothing_when_it_is_disabled(settings, part, installed):
    settings.preview = True
    overlay = part("overlay")
    bpy.ops.preferences.addon_disable(module=installed.__name__)
    try:
        assert not overlay.is_shown()
        assert not hasattr(bpy.types.Scene, "planar_occluder")
        assert not hasattr(bpy.types, "VIEW3D_PT_planar_occluder")
        assert overlay._follow_file not in bpy.app.handlers.load_post
    finally:
        bpy.ops.preferences.addon_enable(module=installed.__name__)


# By a service.


@pytest.fixture
def by_service(settings, preferences, server):
    bpy.context.preferences.system.use_online_access = True
    preferences.maker, preferences.server = "SERVICE", server
    yield preferences
    bpy.context.preferences.system.use_online_access = False


def test_a_service_makes_the_same_as_the_command(by_service):
    ring = torus()
    select(ring)
    assert make() == {"FINISHED"}
    first = world_points(occluder_of(ring))
    by_service.maker = "COMMAND"
    make()
    np.testing.assert_array_equal(world_points(occluder_of(ring)), first)


def test_a_refusal_of_the_service_is_told(by_service):
    by_service.key = "occ_wrong"
    by_service.server += "/nowhere"
    select(cube())
    refused("http://127.0.0.1:[0-9]+/nowhere: ")


def test_a_service_that_does_not_answer_is_told(by_service):
    by_service.server = "http://127.0.0.1:1"
    select(cube())
    refused("does not answer .*check the address")


def test_what_is_no_address_is_told(by_service):
    by_service.server = "file:///etc/passwd"
    select(cube())
    refused("is not an address of a service")


def test_without_online_access_nothing_is_asked(by_service):
    bpy.context.preferences.system.use_online_access = False
    select(cube())
    refused("allow online access")


def test_a_cancelled_job_ends_on_the_server(by_service, server, part):
    settings = bpy.context.scene.planar_occluder
    settings.preset = "best"
    bpy.ops.mesh.primitive_monkey_add()
    select(bpy.context.object)
    session = part("session").Session(bpy.context)
    session.step(bpy.context)
    end = time.monotonic() + 60.0

    def states():
        with urlopen(f"{server}/v1/jobs") as answer:
            return [job["state"] for job in json.load(answer)["items"]]

    while "running" not in states():
        session.step(bpy.context)
        assert session.failures == []
        assert time.monotonic() < end
    session.cancel()
    while "cancelled" not in states():
        assert time.monotonic() < end
    assert session.made == 0
