"""The rasteriser: a visibility buffer, a shadow map, and pixels that are shaded from both."""

import numpy as np

from hemline.compiled import kernel

from .kernel_inputs import GroundLook, Lighting, SceneMesh


@kernel(fastmath=True)
def accumulate_normals(vertices, faces, normals_out):
    """Computes area-weighted normals, not of unit length.

    Reads: vertices (verts, 3) [m]; faces (faces, 3).
    Writes: normals_out (verts, 3) [m^2].
    """
    normals_out[:] = 0.0
    for f in range(len(faces)):
        a, b, c = faces[f, 0], faces[f, 1], faces[f, 2]
        ux, uy, uz = vertices[b, 0] - vertices[a, 0], vertices[b, 1] - vertices[a, 1], vertices[b, 2] - vertices[a, 2]
        vx, vy, vz = vertices[c, 0] - vertices[a, 0], vertices[c, 1] - vertices[a, 1], vertices[c, 2] - vertices[a, 2]
        nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
        for v in (a, b, c):
            normals_out[v, 0] += nx
            normals_out[v, 1] += ny
            normals_out[v, 2] += nz


@kernel
def rasterise(screen, faces, depth_out, face_out):
    """Finds the nearest triangle of each pixel.

    Reads: screen (verts, 3): x, y [pixels, centres at +0.5], nearness (larger is nearer; <= 0 is behind the camera);
        faces (faces, 3).
    Writes: depth_out (height, width): nearness of what is seen, only raised; face_out (height, width): its triangle,
        not written where none is seen.
    """
    height, width = face_out.shape
    for f in range(len(faces)):
        a, b, c = faces[f, 0], faces[f, 1], faces[f, 2]
        xa, ya, za = screen[a, 0], screen[a, 1], screen[a, 2]
        xb, yb, zb = screen[b, 0], screen[b, 1], screen[b, 2]
        xc, yc, zc = screen[c, 0], screen[c, 1], screen[c, 2]
        if not (za > 0.0 and zb > 0.0 and zc > 0.0):
            continue
        area = (xb - xa) * (yc - ya) - (xc - xa) * (yb - ya)
        low_x, high_x = min(xa, xb, xc), max(xa, xb, xc)
        low_y, high_y = min(ya, yb, yc), max(ya, yb, yc)
        if area == 0.0 or high_x < 0.0 or low_x > width or high_y < 0.0 or low_y > height:
            continue
        inverse = np.float32(1.0) / area
        first, last = max(0, int(np.ceil(low_x - 0.5))), min(width - 1, int(np.floor(high_x - 0.5)))
        # weights of b and c at the pixel centre, and their change along x and y
        b_x, b_y = (yc - ya) * inverse, (xa - xc) * inverse
        c_x, c_y = (ya - yb) * inverse, (xb - xa) * inverse
        for y in range(max(0, int(np.ceil(low_y - 0.5))), min(height - 1, int(np.floor(high_y - 0.5))) + 1):
            py = np.float32(y) + np.float32(0.5) - ya
            for x in range(first, last + 1):
                px = np.float32(x) + np.float32(0.5) - xa
                wb, wc = b_x * px + b_y * py, c_x * px + c_y * py
                if wb < 0.0 or wc < 0.0 or wb + wc > 1.0:
                    continue
                z = za + wb * (zb - za) + wc * (zc - za)
                if z > depth_out[y, x]:
                    depth_out[y, x] = z
                    face_out[y, x] = f


@kernel
def box_blur(image, radius, sums, blurred_out):
    """Computes the mean over a square of 2 radius + 1 pixels, with zeros outside the picture.

    Reads: image (height, width); radius [pixels].
    Writes: sums (height, width): working memory; blurred_out (height, width).
    """
    height, width = image.shape
    weight = np.float32(1.0) / np.float32(2 * radius + 1)
    for y in range(height):
        total = np.float32(0.0)
        for x in range(-radius, width):
            if x + radius < width:
                total += image[y, x + radius]
            if x - radius - 1 >= 0:
                total -= image[y, x - radius - 1]
            if x >= 0:
                sums[y, x] = total * weight
    running = np.zeros(width, np.float32)
    for y in range(-radius, height):
        for x in range(width):
            if y + radius < height:
                running[x] += sums[y + radius, x]
            if y - radius - 1 >= 0:
                running[x] -= sums[y - radius - 1, x]
            if y >= 0:
                blurred_out[y, x] = running[x] * weight


@kernel(inline="always")
def bilinear(image, x, y):
    """Interpolates an image bilinearly.

    Reads: image (height, width); x, y [pixels].
    Returns: the value there; 0 outside.
    """
    height, width = image.shape
    x, y = x - np.float32(0.5), y - np.float32(0.5)
    if not (x >= 0.0 and y >= 0.0 and x < width - 1 and y < height - 1):
        return np.float32(0.0)
    i, j = int(x), int(y)
    s, t = x - np.float32(i), y - np.float32(j)
    one = np.float32(1.0)
    top = image[j, i] * (one - s) + image[j, i + 1] * s
    return top * (one - t) + (image[j + 1, i] * (one - s) + image[j + 1, i + 1] * s) * t


@kernel(inline="always")
def light_fraction(shadow, x, y, nearness):
    """Computes the fraction of light that arrives, by 3 x 3 comparisons with the shadow map around a point.

    Reads: shadow (height, width): nearness of what the light meets [m]; x, y [texels] and nearness [m] of the point.
    Returns: the fraction, 0 to 1.
    """
    height, width = shadow.shape
    i, j = int(x), int(y)
    if i < 1 or j < 1 or i >= width - 1 or j >= height - 1:
        return np.float32(1.0)
    free = 0
    for dy in range(-1, 2):
        for dx in range(-1, 2):
            if shadow[j + dy, i + dx] <= nearness:
                free += 1
    return np.float32(free) * np.float32(1.0 / 9.0)


@kernel(fastmath=True)
def shade_ground(rays, eye, ground: GroundLook, light_map, blurred, picture_out):
    """Shades background and ground plane for every pixel, in linear light.

    Reads: rays (3, 3): direction at pixel (0, 0), its change along x, along y; eye (3,) [m]; ground; light_map (3, 4):
        world to x, y [texels] and nearness [m] of the shadow map; blurred: soft occupancy of the shadow map, 0 to 1.
    Writes: picture_out (height, width, 3).
    """
    height, width = picture_out.shape[:2]
    level, tile_size, fade_radius, middle, colours = ground
    for j in range(height):
        up = np.float32(1.0) - np.float32(j) / np.float32(height)
        for i in range(width):
            x = rays[0, 0] + rays[1, 0] * np.float32(i) + rays[2, 0] * np.float32(j)
            y = rays[0, 1] + rays[1, 1] * np.float32(i) + rays[2, 1] * np.float32(j)
            z = rays[0, 2] + rays[1, 2] * np.float32(i) + rays[2, 2] * np.float32(j)
            opacity, tile, shadow = np.float32(0.0), 2, np.float32(0.0)
            t = (level - eye[1]) / y
            if t > 0.0 and fade_radius > 0.0:
                px, pz = eye[0] + t * x, eye[2] + t * z
                radius = np.sqrt((px - middle[0]) ** 2 + (pz - middle[2]) ** 2) / fade_radius
                if radius < 1.0:
                    opacity = (np.float32(1.0) - radius * radius) ** 2
                    odd = (int(np.floor(px / tile_size)) + int(np.floor(pz / tile_size))) & 1
                    tile = 2 + odd
                    u = light_map[0, 0] * px + light_map[0, 1] * level + light_map[0, 2] * pz + light_map[0, 3]
                    v = light_map[1, 0] * px + light_map[1, 1] * level + light_map[1, 2] * pz + light_map[1, 3]
                    shadow = bilinear(blurred, u, v)
            for k in range(3):
                sky = colours[1, k] + (colours[0, k] - colours[1, k]) * up
                floor = colours[tile, k] * (np.float32(1.0) - np.float32(0.55) * shadow)
                picture_out[j, i, k] = sky + (floor - sky) * opacity


@kernel(fastmath=True)
def shade(screen, mesh: SceneMesh, eye, light: Lighting, face_seen, background, picture_out):
    """Shades each pixel from the 2 x 2 samples of the visibility buffer, in linear light.

    Reads: screen (verts, 3), as for `rasterise`; mesh; eye (3,) [m]; light; face_seen (2 height, 2 width): triangle of
        each sample, -1 for none; background (height, width, 3).
    Writes: picture_out (height, width, 3).
    """
    faces, face_surfaces, vertices, normals, colours, looks = mesh
    lamps, light_map, shadow, bias = light
    height, width = picture_out.shape[:2]
    one, zero = np.float32(1.0), np.float32(0.0)
    for j in range(height):
        for i in range(width):
            red, green, blue = zero, zero, zero
            first, second = face_seen[2 * j, 2 * i], face_seen[2 * j, 2 * i + 1]
            third, fourth = face_seen[2 * j + 1, 2 * i], face_seen[2 * j + 1, 2 * i + 1]
            if first < 0 and second < 0 and third < 0 and fourth < 0:
                for k in range(3):
                    picture_out[j, i, k] = background[j, i, k]
                continue
            stride, weight = 1, np.float32(0.25)
            if first >= 0 and second >= 0 and third >= 0 and fourth >= 0:
                surface = face_surfaces[first]
                same = face_surfaces[second] == surface and face_surfaces[third] == surface
                if same and face_surfaces[fourth] == surface:  # no outline runs here: the diagonal is enough
                    stride, weight = 3, np.float32(0.5)
            for sample in range(0, 4, stride):
                y, x = 2 * j + (sample >> 1), 2 * i + (sample & 1)
                f = face_seen[y, x]
                if f < 0:
                    red += background[j, i, 0]
                    green += background[j, i, 1]
                    blue += background[j, i, 2]
                    continue
                a, b, c = faces[f, 0], faces[f, 1], faces[f, 2]
                xa, ya = screen[a, 0], screen[a, 1]
                area = (screen[b, 0] - xa) * (screen[c, 1] - ya) - (screen[c, 0] - xa) * (screen[b, 1] - ya)
                px, py = np.float32(x) + np.float32(0.5) - xa, np.float32(y) + np.float32(0.5) - ya
                wb = (px * (screen[c, 1] - ya) - py * (screen[c, 0] - xa)) / area
                wc = (py * (screen[b, 0] - xa) - px * (screen[b, 1] - ya)) / area
                wa, wb, wc = (one - wb - wc) * screen[a, 2], wb * screen[b, 2], wc * screen[c, 2]
                total = one / (wa + wb + wc)
                wa, wb, wc = wa * total, wb * total, wc * total
                nx = wa * normals[a, 0] + wb * normals[b, 0] + wc * normals[c, 0]
                ny = wa * normals[a, 1] + wb * normals[b, 1] + wc * normals[c, 1]
                nz = wa * normals[a, 2] + wb * normals[b, 2] + wc * normals[c, 2]
                qx = wa * vertices[a, 0] + wb * vertices[b, 0] + wc * vertices[c, 0]
                qy = wa * vertices[a, 1] + wb * vertices[b, 1] + wc * vertices[c, 1]
                qz = wa * vertices[a, 2] + wb * vertices[b, 2] + wc * vertices[c, 2]
                vx, vy, vz = eye[0] - qx, eye[1] - qy, eye[2] - qz
                scale = one / np.sqrt(vx * vx + vy * vy + vz * vz)
                vx, vy, vz = vx * scale, vy * scale, vz * scale
                scale = one / (np.sqrt(nx * nx + ny * ny + nz * nz) + np.float32(1e-12))
                back = area > zero  # y points down on the screen: what is wound clockwise there shows its back
                if back:
                    scale = -scale
                nx, ny, nz = nx * scale, ny * scale, nz * scale
                key = nx * lamps[0, 0] + ny * lamps[0, 1] + nz * lamps[0, 2]
                # a point a little off the surface, towards the viewer's side, is looked up in the shadow map
                ox, oy, oz = qx + bias * nx, qy + bias * ny, qz + bias * nz
                if key > zero:
                    u = light_map[0, 0] * ox + light_map[0, 1] * oy + light_map[0, 2] * oz + light_map[0, 3]
                    v = light_map[1, 0] * ox + light_map[1, 1] * oy + light_map[1, 2] * oz + light_map[1, 3]
                    w = light_map[2, 0] * ox + light_map[2, 1] * oy + light_map[2, 2] * oz + light_map[2, 3]
                    key *= light_fraction(shadow, u, v, w + bias)
                else:
                    key = zero
                fill = max(zero, nx * lamps[1, 0] + ny * lamps[1, 1] + nz * lamps[1, 2])
                up = np.float32(0.5) + np.float32(0.5) * ny
                s = face_surfaces[f]
                graze = one - min(one, abs(nx * vx + ny * vy + nz * vz))
                sheen = looks[s, 3] * graze * graze * graze * (np.float32(0.3) + key)
                for k in range(3):
                    paint = wa * colours[a, k] + wb * colours[b, k] + wc * colours[c, k]
                    if back:
                        paint *= looks[s, k]
                    ambient = lamps[3, k] + (lamps[2, k] - lamps[3, k]) * up
                    value = paint * (ambient + np.float32(0.95) * key + np.float32(0.16) * fill) + sheen
                    if k == 0:
                        red += value
                    elif k == 1:
                        green += value
                    else:
                        blue += value
            picture_out[j, i, 0] = weight * red
            picture_out[j, i, 1] = weight * green
            picture_out[j, i, 2] = weight * blue


@kernel
def encode(picture, table, bytes_out):
    """Converts linear light to sRGB bytes.

    Reads: picture (height, width, 3); table (levels,): sRGB bytes of evenly spaced values from 0 to 1.
    Writes: bytes_out (height, width, 3).
    """
    height, width = picture.shape[:2]
    last = len(table) - 1
    for j in range(height):
        for i in range(width):
            for k in range(3):
                value = min(np.float32(1.0), max(np.float32(0.0), picture[j, i, k]))
                bytes_out[j, i, k] = table[int(value * np.float32(last) + np.float32(0.5))]
