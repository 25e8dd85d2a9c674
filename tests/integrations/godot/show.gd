extends SceneTree
## Prints a line of JSON for each resource named behind "--": its nodes, and the corners of its
## triangles in the space of its root.


func _init() -> void:
	for path in OS.get_cmdline_user_args():
		var found := load(path)
		var nodes := []
		if found is PackedScene:
			var scene: Node = (found as PackedScene).instantiate()
			_add(nodes, scene, Transform3D.IDENTITY)
			scene.free()
		elif found is Occluder3D:
			nodes.append(
				{"kind": "Occluder3D", "triangles": _numbers(_corners(found as Occluder3D))}
			)
		print(JSON.stringify({"path": path, "nodes": nodes}))
	quit()


func _add(nodes: Array, node: Node, above: Transform3D) -> void:
	var place := above
	if node is Node3D:
		place = above * (node as Node3D).transform
	var corners := PackedVector3Array()
	if node is OccluderInstance3D:
		corners = _corners((node as OccluderInstance3D).occluder)
	elif node is MeshInstance3D:
		corners = (node as MeshInstance3D).mesh.get_faces()
	nodes.append({"kind": node.get_class(), "triangles": _numbers(place * corners)})
	for child in node.get_children():
		_add(nodes, child, place)


func _corners(occluder: Occluder3D) -> PackedVector3Array:
	var corners := PackedVector3Array()
	for index in occluder.get_indices():
		corners.append(occluder.get_vertices()[index])
	return corners


func _numbers(corners: PackedVector3Array) -> Array:
	var numbers := []
	for corner in corners:
		numbers.append([corner.x, corner.y, corner.z])
	return numbers
