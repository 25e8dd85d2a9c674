@tool
extends EditorScenePostImport
## Gives an imported scene an occluder, made by the [code]occluder[/code] command.
##
## Choose this file as "Import Script" of a scene in the Import dock.  All meshes of the scene
## become one OccluderInstance3D below its root, in the root's space: metres, +y up, as they are.
## Surfaces with a transparent material are left out, for they must hide nothing.
## Another budget for some scenes: a script that extends this one and sets [member budget] in
## [code]_init[/code].

## Most triangles of the occluder.
var budget := 64

## Further options of [code]occluder simplify[/code], as ["--ground", "--preset", "best"].
var options: PackedStringArray = []


func _post_import(scene: Node) -> Object:
	var triangles := _triangles_of(scene, Transform3D.IDENTITY)
	if triangles.is_empty():
		push_warning("%s: it has no opaque mesh to make an occluder of" % get_source_file())
		return scene
	var occluder := _made_of(triangles)
	if occluder != null:
		var instance := OccluderInstance3D.new()
		instance.name = "Occluder"
		instance.occluder = occluder
		scene.add_child(instance)
		instance.owner = scene
	return scene


## Corners of all opaque triangles below a node, three by three, in the space that [param above]
## leads to.
func _triangles_of(node: Node, above: Transform3D) -> PackedVector3Array:
	var place := above
	if node is Node3D and node.get_parent() != null:
		place = above * (node as Node3D).transform
	var found := PackedVector3Array()
	if node is MeshInstance3D and (node as MeshInstance3D).mesh != null:
		found = place * _opaque_triangles(node as MeshInstance3D)
	for child in node.get_children():
		found.append_array(_triangles_of(child, place))
	return found


## Corners of the triangles that one cannot see through, three by three, in the mesh's own space.
func _opaque_triangles(instance: MeshInstance3D) -> PackedVector3Array:
	var found := PackedVector3Array()
	for surface in instance.mesh.get_surface_count():
		var material := instance.get_active_material(surface) as BaseMaterial3D
		if material != null and material.transparency != BaseMaterial3D.TRANSPARENCY_DISABLED:
			continue
		var tool := SurfaceTool.new()
		tool.create_from(instance.mesh, surface)
		if tool.get_primitive_type() == Mesh.PRIMITIVE_TRIANGLES:
			tool.deindex()
			found.append_array(tool.commit_to_arrays()[Mesh.ARRAY_VERTEX])
	return found


## The occluder that the command makes; null, and an error in the log, where it makes none.
func _made_of(triangles: PackedVector3Array) -> ArrayOccluder3D:
	var folder := OS.get_cache_dir().path_join("planar_occluder_%d" % OS.get_process_id())
	DirAccess.make_dir_recursive_absolute(folder)
	# Scenes may be imported at the same time.
	var place := folder.path_join("%x" % get_instance_id())
	var mesh_file := place + ".stl"
	var made_file := place + ".tres"
	var made: ArrayOccluder3D = null
	if _write_stl(mesh_file, triangles):
		var command: String = ProjectSettings.get_setting("planar_occluder/command", "occluder")
		var arguments := PackedStringArray(
			["simplify", "--quiet", mesh_file, "-o", made_file, "--budget", str(budget)]
		)
		var said := []
		if OS.execute(command, arguments + options, said, true) == 0:
			# A copy belongs to the scene; the file that it came from is removed.
			var read := ResourceLoader.load(made_file, "", ResourceLoader.CACHE_MODE_IGNORE)
			made = read.duplicate() as ArrayOccluder3D
		else:
			push_error(
				(
					"%s: no occluder was made: '%s' said: %s"
					% [get_source_file(), command, "".join(said).strip_edges()]
				)
			)
	for file: String in [mesh_file, made_file]:
		if FileAccess.file_exists(file):
			DirAccess.remove_absolute(file)
	DirAccess.remove_absolute(folder)  # stays while another scene has files there
	return made


func _write_stl(path: String, triangles: PackedVector3Array) -> bool:
	var file := FileAccess.open(path, FileAccess.WRITE)
	if file == null:
		push_error("%s: cannot be written (%s)" % [path, error_string(FileAccess.get_open_error())])
		return false
	var header := PackedByteArray()
	header.resize(80)
	file.store_buffer(header)
	@warning_ignore("integer_division")
	file.store_32(triangles.size() / 3)
	for first in range(0, triangles.size(), 3):
		# No normal; Godot's triangles are wound clockwise, files' against the clock.
		for corner: Vector3 in [
			Vector3.ZERO, triangles[first], triangles[first + 2], triangles[first + 1]
		]:
			file.store_float(corner.x)
			file.store_float(corner.y)
			file.store_float(corner.z)
		file.store_16(0)
	return true
