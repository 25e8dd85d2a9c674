extends SceneTree
## Prints as a line of JSON which nodes of a scene are visible from each of some points.  Named behind
## "--": the scene, the file of visible sets, and the points as "x,y,z".


func _initialize() -> void:
	var arguments := OS.get_cmdline_user_args()
	var scene := (load(arguments[0]) as PackedScene).instantiate() as Node3D
	scene.position = Vector3(10, 0, -3)
	root.add_child(scene)
	var culling: Node = load("res://pvs_culling.gd").new()
	culling.file = arguments[1]
	scene.add_child(culling)
	var seen := []
	for words in arguments.slice(2):
		var numbers := words.split_floats(",")
		culling.look_from(Vector3(numbers[0], numbers[1], numbers[2]) + scene.position)
		var visible := []
		for node in scene.find_children("*", "MeshInstance3D", true, false):
			if (node as Node3D).is_visible_in_tree():
				visible.append(str(node.name))
		seen.append(visible)
	print(JSON.stringify({"processing": culling.is_processing(), "seen": seen}))
	quit()
