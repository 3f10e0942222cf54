# Runs inside Godot 3: play the imported scene FILE for FRAMES frames at FPS, write each mesh's vertices in the world to
# OUT (JSON). Godot's renderer is a dummy without a screen, so that morph targets and skins are applied here.
extends SceneTree


func _init():
	var words = Array(OS.get_cmdline_args())
	words = words.slice(words.size() - 4, words.size() - 1)
	var scene = load("res://" + words[0]).instance()
	get_root().add_child(scene)
	var played = {}
	var meshes = of_class(scene, "MeshInstance")
	var players = of_class(scene, "AnimationPlayer")
	for each in meshes:
		played[each.name] = []
	for frame in range(int(words[1])):
		for player in players:
			player.play(player.get_animation_list()[0])
			player.seek(frame / float(words[2]), true)
		for each in meshes:
			played[each.name].append(in_the_world(each))
	var file = File.new()
	file.open(words[3], File.WRITE)
	file.store_string(to_json(played))
	file.close()
	quit()


func of_class(node, kind):
	var found = [node] if node.is_class(kind) else []
	for child in node.get_children():
		found += of_class(child, kind)
	return found


func in_the_world(instance):
	var mesh = instance.mesh
	var arrays = mesh.surface_get_arrays(0)
	var vertices = morphed(instance, arrays[Mesh.ARRAY_VERTEX])
	var transform = instance.global_transform
	if instance.skin != null:
		vertices = skinned(instance, vertices, arrays)
		transform = instance.get_node(instance.skeleton).global_transform
	var found = []
	for each in vertices:
		var point = transform.xform(each)
		found.append([point.x, point.y, point.z])
	return found


func morphed(instance, base):
	var mesh = instance.mesh
	var relative = mesh.blend_shape_mode == Mesh.BLEND_SHAPE_MODE_RELATIVE
	var moved = PoolVector3Array(base)
	var targets = mesh.surface_get_blend_shape_arrays(0)
	for index in range(targets.size()):
		var weight = instance.get("blend_shapes/" + mesh.get_blend_shape_name(index))
		if weight != 0:
			var target = targets[index][Mesh.ARRAY_VERTEX]
			for vertex in range(base.size()):
				var offset = target[vertex] if relative else target[vertex] - base[vertex]
				moved[vertex] += weight * offset
	return moved


func skinned(instance, vertices, arrays):
	var skeleton = instance.get_node(instance.skeleton)
	var bones = []
	for index in range(instance.skin.get_bind_count()):
		var bone = skeleton.find_bone(instance.skin.get_bind_name(index))
		bones.append(skeleton.get_bone_global_pose(bone) * instance.skin.get_bind_pose(index))
	var moved = PoolVector3Array()
	for vertex in range(vertices.size()):
		var point = Vector3()
		for influence in range(4 * vertex, 4 * vertex + 4):
			var bone = bones[arrays[Mesh.ARRAY_BONES][influence]]
			point += arrays[Mesh.ARRAY_WEIGHTS][influence] * bone.xform(vertices[vertex])
		moved.append(point)
	return moved
