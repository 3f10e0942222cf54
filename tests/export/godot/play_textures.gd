# Runs inside Godot 3: read the imported textures and mesh of NAME.vat as the shader does, write the vertices of all its
# frames to OUT (JSON).
extends SceneTree

var told = {}
var positions = null


func _init():
	var words = Array(OS.get_cmdline_args())
	words = words.slice(words.size() - 2, words.size() - 1)
	var file = File.new()
	file.open("res://" + words[0] + ".json", File.READ)
	told = parse_json(file.get_as_text())
	file.close()
	positions = load("res://" + words[0] + "_positions.png").get_data()
	positions.lock()
	var scene = load("res://" + words[0] + ".glb").instance()
	get_root().add_child(scene)
	var places = first_mesh(scene).surface_get_arrays(0)[Mesh.ARRAY_TEX_UV2]
	var played = []
	for frame in range(int(told["frames"])):
		played.append(frame_of(places, frame))
	file.open(words[1], File.WRITE)
	file.store_string(to_json(played))
	file.close()
	quit()


func first_mesh(node):
	if node.is_class("MeshInstance"):
		return node.mesh
	for child in node.get_children():
		var found = first_mesh(child)
		if found != null:
			return found
	return null


func frame_of(places, frame):
	var size = Vector2(told["width"], positions.get_height() / 2)
	var count = int(told["vertices"])
	var path = three("path_low") + three("path_size") * (share(at(count), frame) + share(at(count + 1), frame) / 65536)
	var found = []
	for place in places:
		var point = three("low") + three("size") * share((place * size).floor(), frame) + path
		found.append([point.x, point.y, point.z])
	return found


func three(name):
	return Vector3(told[name][0], told[name][1], told[name][2])


func at(index):
	return Vector2(index % int(told["width"]), index / int(told["width"]))


func share(place, frame):
	var height = positions.get_height() / 2
	var row = place.y + frame * int(told["rows"])
	var high = positions.get_pixel(place.x, row)
	var low = positions.get_pixel(place.x, row + height)
	return Vector3(high.r8 * 256 + low.r8, high.g8 * 256 + low.g8, high.b8 * 256 + low.b8) / 65535
