extends Node3D
## Gives each part of a scene its occluder, from the file that [code]occluder scene[/code] writes.
##
## Put it below the instance of the scene that the file was made of, at its origin, and set
## [member file].  It makes an OccluderInstance3D for each part that has an occluder: an object,
## or a piece of a large one.  Parts of the same mesh share one ArrayOccluder3D.  All of the file
## that is used is checked before; a file that is damaged makes none, and is an error in the log.

const _HEADER := 160
const _NODE := 64
const _PART := 12
const _TRANSFORM := 96
const _MESH := 48
const _NONE := 0xFFFFFFFF
const _MOST_SHORT := 65535
const _MAGIC: Array[int] = [0x89, 0x4F, 0x43, 0x53, 0x0D, 0x0A, 0x1A, 0x0A]

## What [code]occluder scene[/code] wrote as [code]scene.occs[/code].
@export_file("*.occs") var file: String = ""

var _bytes := PackedByteArray()
var _node_count := 0
var _part_count := 0
var _mesh_count := 0
var _transform_count := 0
var _nodes := 0
var _parts := 0
var _transforms := 0
var _meshes := 0
var _positions := 0
var _indices := 0


func _ready() -> void:
	var fault := parse(FileAccess.get_file_as_bytes(file))
	if fault != "":
		push_error("%s: %s" % [file, fault])
		return
	var made := {}
	for part in range(_part_count):
		var mesh := mesh_of(part)
		if mesh != _NONE:
			if mesh not in made:
				made[mesh] = _occluder(mesh)
			var instance := OccluderInstance3D.new()
			instance.name = "Occluder%d" % part
			instance.occluder = made[mesh]
			instance.transform = _transform(part)
			add_child(instance)


## Reads the bytes of a file; returns what is wrong with them, and nothing where they can be used.
func parse(data: PackedByteArray) -> String:
	_bytes = data
	var fault := _check_start()
	if fault == "":
		fault = _find_blocks()
	if fault == "":
		fault = _check_parts()
	if fault == "":
		fault = _check_meshes()
	if fault != "":
		_bytes = PackedByteArray()
		_part_count = 0
	return fault


func part_count() -> int:
	return _part_count


## The occluder that a part is drawn by near by, or else far away; 0xFFFFFFFF where it has none.
func mesh_of(part: int) -> int:
	var node := _nodes + _NODE * _bytes.decode_u32(_parts + _PART * part + 8)
	var found := _bytes.decode_u32(node + 28)
	if found == _NONE:
		found = _bytes.decode_u32(node + 24)
	return found


## Corners of an occluder, in the space of the part's mesh: three numbers each.
func positions_of(mesh: int) -> Array:
	var row := _meshes + _MESH * mesh
	var first := _bytes.decode_u32(row + 24)
	var found := []
	for place in range(3 * _bytes.decode_u32(row + 28)):
		var origin := _bytes.decode_double(row + 8 * (place % 3))
		found.append(origin + _bytes.decode_float(_positions + 12 * first + 4 * place))
	return found


## Three a triangle.
func indices_of(mesh: int) -> PackedInt32Array:
	var row := _meshes + _MESH * mesh
	var at := _indices + 4 * _bytes.decode_u32(row + 32)
	var short := _bytes.decode_u32(row + 28) <= _MOST_SHORT
	var found := PackedInt32Array()
	for corner in range(3 * _bytes.decode_u32(row + 36)):
		if short:
			found.append(_bytes.decode_u16(at + 2 * corner))
		else:
			found.append(_bytes.decode_u32(at + 4 * corner))
	return found


## Twelve numbers: three rows that take (x, y, z, 1) of a part's mesh to the scene.
func rows_of(part: int) -> Array:
	var at := _transforms + _TRANSFORM * _bytes.decode_u32(_parts + _PART * part + 4)
	var found := []
	for place in range(12):
		found.append(_bytes.decode_double(at + 8 * place))
	return found


func _occluder(mesh: int) -> ArrayOccluder3D:
	var numbers := positions_of(mesh)
	var corners := PackedVector3Array()
	for corner in range(numbers.size() / 3):
		var at := 3 * corner
		corners.append(Vector3(numbers[at], numbers[at + 1], numbers[at + 2]))
	var made := ArrayOccluder3D.new()
	made.set_arrays(corners, indices_of(mesh))
	return made


func _transform(part: int) -> Transform3D:
	var rows := rows_of(part)
	return Transform3D(
		Vector3(rows[0], rows[4], rows[8]),
		Vector3(rows[1], rows[5], rows[9]),
		Vector3(rows[2], rows[6], rows[10]),
		Vector3(rows[3], rows[7], rows[11])
	)


func _check_start() -> String:
	if _bytes.size() < _HEADER:
		return "it is no packed scene (.occs)"
	for place in range(8):
		if _bytes[place] != _MAGIC[place]:
			return "it is no packed scene (.occs)"
	if _bytes.decode_u32(8) != 1 or (_bytes.decode_u32(12) & ~0x301) != 0:
		return "it is of another version: take the scripts of that release"
	if _bytes.decode_u64(16) != _bytes.size():
		return "it is cut short, or has bytes behind its end"
	# gzip ends with the checksum that the file has, which counts itself as 0.
	var whole := _bytes.duplicate()
	whole.encode_u32(156, 0)
	var packed := whole.compress(FileAccess.COMPRESSION_GZIP)
	if packed.decode_u32(packed.size() - 8) != _bytes.decode_u32(156):
		return "its bytes are not those that were written"
	return ""


func _find_blocks() -> String:
	_node_count = _bytes.decode_u32(24)
	_part_count = _bytes.decode_u32(28)
	_transform_count = _bytes.decode_u32(36)
	_mesh_count = _bytes.decode_u32(40)
	_nodes = _block(0, _NODE * _node_count)
	_parts = _block(1, _PART * _part_count)
	_transforms = _block(3, _TRANSFORM * _transform_count)
	_meshes = _block(4, _MESH * _mesh_count)
	_positions = _block(5, 12 * _bytes.decode_u32(44))
	_indices = _block(6, 4 * _bytes.decode_u32(48))
	if mini(mini(_nodes, _parts), mini(_transforms, _meshes)) == 0:
		return "a block is not in the file"
	if mini(_positions, _indices) == 0:
		return "a block is not in the file"
	return ""


## Where a block of so many bytes begins; 0 where it is not in the file.
func _block(index: int, length: int) -> int:
	var begin := 16 * _bytes.decode_u32(104 + 4 * index)
	if begin < _HEADER or begin + length > _bytes.size():
		return 0
	return begin


func _check_parts() -> String:
	for part in range(_part_count):
		var at := _parts + _PART * part
		if _bytes.decode_u32(at + 4) >= _transform_count:
			return "a part names a transform that is not there"
		if _bytes.decode_u32(at + 8) >= _node_count:
			return "a part names a leaf that is not there"
		if mesh_of(part) >= _mesh_count and mesh_of(part) != _NONE:
			return "a leaf names an occluder that is not there"
		for number in rows_of(part):
			if not is_finite(number):
				return "a transform is not finite"
	return ""


func _check_meshes() -> String:
	var vertices := _bytes.decode_u32(44)
	var words := _bytes.decode_u32(48)
	for mesh in range(_mesh_count):
		var row := _meshes + _MESH * mesh
		var count := _bytes.decode_u32(row + 28)
		var bytes := 3 * _bytes.decode_u32(row + 36) * (2 if count <= _MOST_SHORT else 4)
		if _bytes.decode_u32(row + 24) + count > vertices:
			return "a mesh has vertices that are not there"
		if 4 * _bytes.decode_u32(row + 32) + bytes > 4 * words:
			return "a mesh has indices that are not there"
		for number in positions_of(mesh):
			if not is_finite(number):
				return "a position is not finite"
		for corner in indices_of(mesh):
			if corner >= count:
				return "a mesh names a vertex that it does not have"
	return ""
