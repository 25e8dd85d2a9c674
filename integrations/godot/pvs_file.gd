extends RefCounted
## Reads a file of potentially visible sets, as [code]occluder pvs[/code] writes it.
##
## A wrong set would hide what can be seen, so all of the file is checked before any of it is used:
## what [method open] or [method parse] takes can be looked up in.  Nothing else is believed.

## Of a place outside of all cells, from which everything may be seen.
const NO_CELL := -1

const _HEADER := 144
const _GRID := 32
const _CELL := 32
const _GROUP := 16
const _GROUP_BITS := 4
const _NO_ROW := 0xFFFFFFFF
const _MAGIC: Array[int] = [0x89, 0x50, 0x56, 0x53, 0x0D, 0x0A, 0x1A, 0x0A]
const _KNOWN_FLAGS := 0x30F
const _SLICES := 2
const _ALTITUDES := 4
const _PART := 16
const _NEVER := 0xFFFF
const _MOST_OBJECTS := 0x7FFFFFFF

## Of the objects, in the scene's order.
var names := PackedStringArray()

var _bytes := PackedByteArray()
var _up := 0
var _origin: Array[float] = [0.0, 0.0, 0.0]
var _object_count := 0
var _cell_count := 0
var _row_count := 0
var _order := 0
var _cells := 0
var _grid := 0
var _row_of := 0
var _row_offsets := 0
var _rows := 0
## Where the altitudes begin; 0 where there are none.
var _altitudes := 0
var _columns := 0
var _lines := 0
var _at := 0


## Reads a file; returns what is wrong with it, and nothing where it can be used.
func open(path: String) -> String:
	var data := FileAccess.get_file_as_bytes(path)
	if data.is_empty():
		return "it is empty or cannot be read"
	return parse(data)


## As [method open], of the bytes of a file.
func parse(data: PackedByteArray) -> String:
	_bytes = data
	names = PackedStringArray()
	var fault := _check_start()
	if fault == "":
		fault = _read_header()
	if fault == "":
		fault = _check_order()
	if fault == "":
		fault = _check_cells()
	if fault == "":
		fault = _check_grid()
	if fault == "":
		fault = _check_rows()
	if fault == "":
		fault = _find_parts()
	if fault == "":
		fault = _read_names()
	if fault != "":
		_bytes = PackedByteArray()
		_object_count = 0
		_cell_count = 0
		_altitudes = 0
		names = PackedStringArray()
	return fault


## The first cell that holds a point of the scene's own space, or [constant NO_CELL].
func cell_at(point: Vector3) -> int:
	if _cell_count == 0:
		return NO_CELL
	var world: Array[float] = [point.x, point.y, point.z]
	var x := world[(_up + 1) % 3] - _origin[0]
	var y := world[(_up + 2) % 3] - _origin[1]
	var z := world[_up] - _origin[2]
	if not is_finite(x + y + z):
		return NO_CELL
	var edge := _bytes.decode_float(_grid + 8)
	var column := _step((x - _bytes.decode_float(_grid)) / edge, _columns)
	var line := _step((y - _bytes.decode_float(_grid + 4)) / edge, _lines)
	var tile := _grid + _GRID + 4 * (line * _columns + column)
	var listed := _grid + _GRID + 4 * (_columns * _lines + 1)
	for entry in range(_bytes.decode_u32(tile), _bytes.decode_u32(tile + 4)):
		var cell := _bytes.decode_u32(listed + 4 * entry)
		if _holds(_cells + _CELL * cell, x, y, z):
			return cell
	return NO_CELL


## A byte for each object: 1 where it may be seen from the cell.  All are 1 from outside of all
## cells, and from one that is not computed.
func seen_from(cell: int) -> PackedByteArray:
	var seen := PackedByteArray()
	seen.resize(_object_count)
	seen.fill(1)
	if cell < 0 or cell >= _cell_count:
		return seen
	var row := _bytes.decode_u32(_row_of + 4 * cell)
	if row == _NO_ROW:
		return seen
	seen.fill(0)
	var at := _rows + _bytes.decode_u32(_row_offsets + 4 * row)
	var end := _rows + _bytes.decode_u32(_row_offsets + 4 * row + 4)
	var place := 0
	var visible := false
	while at < end:
		var length := 0
		var shift := 0
		while true:
			var byte := _bytes[at]
			at += 1
			length |= (byte & 0x7F) << shift
			shift += 7
			if byte < 0x80:
				break
		if visible:
			for index in range(place, place + length):
				seen[_bytes.decode_u32(_order + 4 * index)] = 1
		place += length
		visible = not visible
	return seen


## Of a point of the scene's own space, how high it is as altitudes count: two points of a cell with
## the same level see the same.  Always 0 where the file has no altitudes.
func level_of(point: Vector3) -> int:
	if _altitudes == 0:
		return 0
	var world: Array[float] = [point.x, point.y, point.z]
	var height := world[_up] - _origin[2]
	var low := _bytes.decode_float(_altitudes)
	var step := _bytes.decode_float(_altitudes + 4)
	var least := 0
	var above := _NEVER
	while above - least > 1:
		var middle := (least + above) >> 1
		if low + middle * step > height:
			above = middle
		else:
			least = middle
	return least


## As [method seen_from], of what may be seen from a level of the cell: see [method level_of].
func seen_from_level(cell: int, level: int) -> PackedByteArray:
	var seen := seen_from(cell)
	if _altitudes == 0 or cell < 0 or cell >= _cell_count:
		return seen
	if _bytes.decode_u32(_row_of + 4 * cell) == _NO_ROW:
		return seen
	var at := _altitudes + _PART + 2 * cell * _object_count
	for object in range(_object_count):
		if _bytes.decode_u16(at + 2 * object) > level:
			seen[object] = 0
	return seen


## The column or line of a tile, held to the grid.
func _step(along: float, count: int) -> int:
	if not along >= 1.0:
		return 0
	return int(along) if along < count else count - 1


## Whether the cell that begins at a byte holds a point of its space, borders included.
func _holds(cell: int, x: float, y: float, z: float) -> bool:
	if z < _bytes.decode_float(cell + 24) or z > _bytes.decode_float(cell + 28):
		return false
	var ax := _bytes.decode_float(cell)
	var ay := _bytes.decode_float(cell + 4)
	var bx := _bytes.decode_float(cell + 8)
	var by := _bytes.decode_float(cell + 12)
	var cx := _bytes.decode_float(cell + 16)
	var cy := _bytes.decode_float(cell + 20)
	if is_nan(cx):
		return x >= ax and x <= bx and y >= ay and y <= by
	# The box around the triangle as well: its edges alone may round.
	if x < minf(ax, minf(bx, cx)) or x > maxf(ax, maxf(bx, cx)):
		return false
	if y < minf(ay, minf(by, cy)) or y > maxf(ay, maxf(by, cy)):
		return false
	return (
		_left(ax, ay, bx, by, x, y) and _left(bx, by, cx, cy, x, y) and _left(cx, cy, ax, ay, x, y)
	)


func _left(ax: float, ay: float, bx: float, by: float, x: float, y: float) -> bool:
	return (bx - ax) * (y - ay) >= (by - ay) * (x - ax)


func _check_start() -> String:
	if _bytes.size() < _HEADER:
		return "this is no file of visible sets: it is too short"
	for index in range(8):
		if _bytes[index] != _MAGIC[index]:
			return "this is no file of visible sets: it does not begin as one"
	if not _is_known():
		return "it is of another version, or holds what is not known"
	if _bytes.decode_u64(16) != _bytes.size():
		return "it is cut short, or longer than it says"
	if _checksum() != _bytes.decode_u32(140):
		return "it is damaged: its checksum is another"
	return ""


## Whether version and flags are known; slices and altitudes came with version 3.
func _is_known() -> bool:
	var flags := _bytes.decode_u32(12)
	if (flags & ~_KNOWN_FLAGS) != 0:
		return false
	if _bytes.decode_u32(8) == 2:
		return _parts() == 0 and (flags & (_SLICES | _ALTITUDES)) == 0
	return _bytes.decode_u32(8) == 3


## The flags of the parts that have a block.
func _parts() -> int:
	var slices := int(_bytes.decode_u32(112) != 0) * _SLICES
	return slices + int(_bytes.decode_u32(116) != 0) * _ALTITUDES


func _read_header() -> String:
	_up = _bytes.decode_u32(12) >> 8 & 3
	_object_count = _bytes.decode_u32(24)
	_cell_count = _bytes.decode_u32(28)
	_row_count = _bytes.decode_u32(32)
	if _up > 2 or _object_count > _MOST_OBJECTS or _bytes.decode_u32(36) > 3:
		return "it is damaged: a figure of its header is out of range"
	for axis in range(3):
		_origin[axis] = _bytes.decode_double(40 + 8 * axis)
		if not is_finite(_origin[axis]):
			return "it is damaged: its origin is not finite"
	_order = _block(0, 4 * _object_count)
	_cells = _block(1, _CELL * _cell_count)
	_grid = _block(2, _GRID + 4)
	_row_of = _block(3, 4 * _cell_count)
	_row_offsets = _block(4, 4 * _row_count + 4)
	_rows = _block(5, 0)
	if _order < 0 or _cells < 0 or _grid < 0 or _row_of < 0 or _row_offsets < 0 or _rows < 0:
		return "it is damaged: a block is not in the file"
	return ""


## CRC-32 of the file with 0 in the checksum's place.
func _checksum() -> int:
	var whole := _bytes.duplicate()
	whole.encode_u32(140, 0)
	# What gzip writes ends in the CRC-32 and the length.  In GDScript it would take a hundred times
	# as long.
	var packed := whole.compress(FileAccess.COMPRESSION_GZIP)
	return packed.decode_u32(packed.size() - 8) if packed.size() > 8 else -1


## Where a block begins; -1 where so many bytes of it are not in the file.
func _block(index: int, length: int) -> int:
	var begin := 16 * _bytes.decode_u32(88 + 4 * index)
	return begin if begin >= _HEADER and begin + length <= _bytes.size() else -1


## Whether so many numbers and one more begin with 0 and never fall.
func _ascends(at: int, count: int) -> bool:
	var last := 0
	for index in range(count + 1):
		var value := _bytes.decode_u32(at + 4 * index)
		if value < last or (index == 0 and value != 0):
			return false
		last = value
	return true


func _check_order() -> String:
	var known := PackedByteArray()
	known.resize(_object_count)
	known.fill(0)
	for index in range(_object_count):
		var object := _bytes.decode_u32(_order + 4 * index)
		if object >= _object_count or known[object] != 0:
			return "it is damaged: its order does not name each object once"
		known[object] = 1
	return ""


func _check_cells() -> String:
	for index in range(_cell_count):
		var row := _bytes.decode_u32(_row_of + 4 * index)
		if (row >= _row_count and row != _NO_ROW) or not _is_filled(_cells + _CELL * index):
			return "it is damaged: cell %d holds nothing, or has no row" % index
	return ""


func _is_filled(cell: int) -> bool:
	var of: Array[float] = []
	for number in range(8):
		of.append(_bytes.decode_float(cell + 4 * number))
	if not is_finite(of[0] + of[1] + of[2] + of[3] + of[6] + of[7]) or not of[6] < of[7]:
		return false
	if is_nan(of[4]) and is_nan(of[5]):
		return of[0] < of[2] and of[1] < of[3]
	# Counter-clockwise, and so with an area; no comparison holds of what is no number.
	return (of[2] - of[0]) * (of[5] - of[1]) > (of[3] - of[1]) * (of[4] - of[0])


func _check_grid() -> String:
	var fault := "it is damaged: its look-up grid does not list its cells"
	_columns = _bytes.decode_u32(_grid + 12)
	_lines = _bytes.decode_u32(_grid + 16)
	var low := _bytes.decode_float(_grid) + _bytes.decode_float(_grid + 4)
	var edge := _bytes.decode_float(_grid + 8)
	if not is_finite(low + edge) or not edge > 0.0 or _columns < 1 or _lines < 1:
		return fault
	# Each below 2^32, so that no product is too large once both are below the size.
	if _columns > _bytes.size() or _lines > _bytes.size():
		return fault
	var tiles := _columns * _lines
	var listed := _grid + _GRID + 4 * (tiles + 1)
	if listed > _bytes.size() or not _ascends(_grid + _GRID, tiles):
		return fault
	var count := _bytes.decode_u32(listed - 4)
	if listed + 4 * count > _bytes.size():
		return fault
	for entry in range(count):
		if _bytes.decode_u32(listed + 4 * entry) >= _cell_count:
			return fault
	return ""


func _check_rows() -> String:
	var fault := "it is damaged: a row is no set of its objects"
	if not _ascends(_row_offsets, _row_count):
		return fault
	if _rows + _bytes.decode_u32(_row_offsets + 4 * _row_count) > _bytes.size():
		return fault
	for row in range(_row_count):
		var begin := _rows + _bytes.decode_u32(_row_offsets + 4 * row)
		if not _is_row(begin, _rows + _bytes.decode_u32(_row_offsets + 4 * row + 4)):
			return fault
	return ""


## Whether bytes are runs of no more than all objects, none but the first empty.
func _is_row(begin: int, end: int) -> bool:
	var at := begin
	var total := 0
	while at < end:
		var first := at == begin
		var length := 0
		var shift := 0
		while true:
			if at == end or shift > 28:
				return false
			var byte := _bytes[at]
			at += 1
			length |= (byte & 0x7F) << shift
			shift += 7
			if byte < 0x80:
				break
		total += length
		if (length == 0 and not first) or total > _object_count:
			return false
	return true


## Finds the altitudes.  Slices are left alone: nodes are shown as wholes.
func _find_parts() -> String:
	_altitudes = 0
	if (_bytes.decode_u32(12) & (_SLICES | _ALTITUDES)) != _parts():
		return "it is damaged: it does not say truly what parts it has"
	if _bytes.decode_u32(116) == 0:
		return ""
	_altitudes = _block(7, _PART)
	if _altitudes < 0:
		return "it is damaged: a block is not in the file"
	# Each factor is below the size, as the objects and cells are in the file.
	if _block(7, _PART + 2 * _cell_count * _object_count) < 0:
		return "it is damaged: a block is not in the file"
	var low := _bytes.decode_float(_altitudes)
	var step := _bytes.decode_float(_altitudes + 4)
	if not is_finite(low) or not is_finite(step) or not step > 0.0:
		return "it is damaged: its altitudes count by no number"
	return ""


## Each name is what it has beyond the name before, in groups of which the first is whole.
func _read_names() -> String:
	var fault := "it is damaged: its names are no text"
	if _bytes.decode_u32(120) == 0:
		return "it names no objects, so no node can be found" if _object_count > 0 else ""
	var groups := (_object_count + _GROUP - 1) >> _GROUP_BITS
	var offsets := _block(8, 4 * groups + 4)
	if offsets < 0 or not _ascends(offsets, groups):
		return fault
	var text := offsets + 4 * groups + 4
	if text + _bytes.decode_u32(text - 4) > _bytes.size():
		return fault
	for group in range(groups):
		var begin := text + _bytes.decode_u32(offsets + 4 * group)
		var end := text + _bytes.decode_u32(offsets + 4 * group + 4)
		if not _read_group(begin, end, mini(_GROUP, _object_count - _GROUP * group)):
			return fault
	return ""


## Adds so many names; false where the bytes hold others than these.
func _read_group(begin: int, end: int, count: int) -> bool:
	var before := PackedByteArray()
	_at = begin
	for index in range(count):
		var shared := _read_number(end)
		var more := _read_number(end)
		if shared < 0 or more < 0 or shared > before.size() or more > end - _at:
			return false
		before = before.slice(0, shared)
		before.append_array(_bytes.slice(_at, _at + more))
		_at += more
		var decoded := before.get_string_from_utf8()
		if decoded.to_utf8_buffer() != before:
			return false
		names.append(decoded)
	return _at == end


## The number at the place that is read, by 7 bits a byte; -1 where it goes on past the end.
func _read_number(end: int) -> int:
	var value := 0
	for place in range(5):
		if _at >= end:
			return -1
		var byte := _bytes[_at]
		_at += 1
		value |= (byte & 0x7F) << (7 * place)
		if byte < 0x80:
			return value
	return -1
