extends Node
## Hides the nodes that cannot be seen from where the camera is, by a file of visible sets.
##
## Add a [Node] with this script, name the [member file] that [code]occluder pvs[/code] wrote for
## a scene file, and the node that is the imported scene.  Nodes are known by their names.  Whenever
## the camera comes into another cell, those that no viewer in it can see are hidden, and all others
## that were hidden here are shown again.  A file with altitudes hides by the camera's height, too.
## Outside of all cells nothing is hidden, and neither by a file that cannot be used, which is an
## error in the log.

const PvsFile := preload("pvs_file.gd")
const _NOWHERE := -2

## What [code]occluder pvs[/code] wrote.
@export_file("*.pvs") var file := ""

## The scene that the file is of, where its importer put it; the parent if empty.
@export var scene: Node3D

## Whose place counts; the viewport's current one if empty.
@export var camera: Camera3D

var _sets := PvsFile.new()
var _cell := _NOWHERE
var _level := 0
## Each node comes after those that it is below.
var _nodes: Array[Node3D] = []
## The place in the list of the nearest node above that is in it, or -1.
var _above := PackedInt32Array()
## The place in the list of each object's node, or -1.
var _node_of := PackedInt32Array()
var _hidden := PackedByteArray()


func _ready() -> void:
	if scene == null:
		scene = get_parent() as Node3D
	load_sets()


func _exit_tree() -> void:
	show_all()


func _process(_delta: float) -> void:
	var eye := camera if camera != null else get_viewport().get_camera_3d()
	if eye != null:
		look_from(eye.global_position)


## Reads the file, anew if it was read before.
func load_sets() -> void:
	show_all()
	_nodes.clear()
	_above = PackedInt32Array()
	_node_of = PackedInt32Array()
	var fault := "there is no scene to hide nodes of" if scene == null else _sets.open(file)
	set_process(fault == "")
	if fault != "":
		push_error("%s: %s; nothing is hidden" % [file, fault])
		return
	var wanted := {}
	for object in _sets.names:
		wanted[object.validate_node_name()] = 0
	_count(scene, wanted)
	var places := {}
	_collect(scene, -1, wanted, places)
	var missing := 0
	for object in _sets.names:
		var place: int = places.get(object.validate_node_name(), -1)
		_node_of.append(place)
		missing += int(place < 0)
	_hidden.resize(_nodes.size())
	_hidden.fill(0)
	if missing > 0:
		var words := "%s: %d of %d objects have no node of their own name, and stay visible"
		push_warning(words % [file, missing, _sets.names.size()])


## Shows and hides for a viewer at a place of the world; does nothing within the same cell and step
## of its altitudes.
func look_from(place: Vector3) -> void:
	var point: Vector3 = scene.global_transform.affine_inverse() * place
	var cell: int = _sets.cell_at(point)
	var level: int = _sets.level_of(point) if cell >= 0 else 0
	if cell != _cell or level != _level:
		_cell = cell
		_level = level
		_show(_sets.seen_from_level(cell, level))


## Shows all that was hidden here, until the camera moves on.
func show_all() -> void:
	for index in range(_nodes.size()):
		_set_hidden(index, false)
	_cell = _NOWHERE


func _show(seen: PackedByteArray) -> void:
	var shown := PackedByteArray()
	shown.resize(_nodes.size())
	shown.fill(0)
	for object in range(_node_of.size()):
		if _node_of[object] >= 0 and seen[object] != 0:
			shown[_node_of[object]] = 1
	# A node that is hidden takes those below it along.
	for index in range(_nodes.size() - 1, -1, -1):
		if shown[index] != 0 and _above[index] >= 0:
			shown[_above[index]] = 1
	for index in range(_nodes.size()):
		_set_hidden(index, shown[index] == 0)


## Only what was hidden here is shown again: a game hides nodes for reasons of its own.
func _set_hidden(index: int, hide: bool) -> void:
	if not is_instance_valid(_nodes[index]):
		return
	if hide and _hidden[index] == 0 and _nodes[index].visible:
		_nodes[index].visible = false
		_hidden[index] = 1
	elif not hide and _hidden[index] != 0:
		_nodes[index].visible = true
		_hidden[index] = 0


## How many nodes have each of the wanted names.
func _count(node: Node, wanted: Dictionary) -> void:
	var own := str(node.name)
	if node is Node3D and own in wanted:
		wanted[own] += 1
	for child in node.get_children():
		_count(child, wanted)


## Lists the nodes that alone have a wanted name; which is meant of several cannot be known.
func _collect(node: Node, above: int, wanted: Dictionary, places: Dictionary) -> void:
	var own := str(node.name)
	var place := above
	if node is Node3D and wanted.get(own, 0) == 1:
		place = _nodes.size()
		places[own] = place
		_nodes.append(node as Node3D)
		_above.append(above)
	for child in node.get_children():
		_collect(child, place, wanted, places)
