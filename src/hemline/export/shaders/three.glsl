// Vertex-animation textures of hemline for three.js (GLSL 3, `glslVersion: THREE.GLSL3`): put this in front of your vertex
// shader, give the geometry's second set of texture coordinates (`uv1`), and use vat_position(uv1), vat_normal(uv1).
// Textures: NearestFilter, no mipmaps, flipY = false, NoColorSpace. Uniforms are in NAME.json; vat_time is in seconds.
uniform highp sampler2D vat_positions, vat_normals;
uniform highp vec3 vat_low, vat_size, vat_path_low, vat_path_size;
uniform highp float vat_fps, vat_time;
uniform highp int vat_frames, vat_vertices;
in vec2 uv1;

ivec2 vat_place(ivec2 start, int frame, int band) {
    int height = textureSize(vat_normals, 0).y;
    return ivec2(start.x, start.y + frame * (height / vat_frames) + band * height);
}

vec3 vat_share(ivec2 start, int frame) {
    vec3 high = texelFetch(vat_positions, vat_place(start, frame, 0), 0).rgb;
    vec3 low = texelFetch(vat_positions, vat_place(start, frame, 1), 0).rgb;
    return (round(high * 255.0) * 256.0 + round(low * 255.0)) / 65535.0;
}

ivec2 vat_start(vec2 uv) {
    return ivec2(uv * vec2(textureSize(vat_normals, 0)));
}

ivec2 vat_mark(int number) {
    int width = textureSize(vat_normals, 0).x;
    return ivec2((vat_vertices + number) % width, (vat_vertices + number) / width);
}

vec3 vat_path(int frame) {
    return vat_path_low + vat_path_size * (vat_share(vat_mark(0), frame) + vat_share(vat_mark(1), frame) / 65536.0);
}

// The two frames around the time, and how far it is from the first to the second; it repeats for ever.
ivec2 vat_frames_now(out float between) {
    float at = mod(vat_time * vat_fps, float(max(vat_frames - 1, 1)));
    int first = int(floor(at));
    between = at - float(first);
    return ivec2(first, min(first + 1, vat_frames - 1));
}

vec3 vat_position(vec2 uv) {
    float between;
    ivec2 now = vat_frames_now(between), start = vat_start(uv);
    vec3 first = vat_low + vat_size * vat_share(start, now.x) + vat_path(now.x);
    vec3 second = vat_low + vat_size * vat_share(start, now.y) + vat_path(now.y);
    return mix(first, second, between);
}

vec3 vat_normal(vec2 uv) {
    float between;
    ivec2 now = vat_frames_now(between), start = vat_start(uv);
    vec3 first = texelFetch(vat_normals, vat_place(start, now.x, 0), 0).rgb;
    vec3 second = texelFetch(vat_normals, vat_place(start, now.y, 0), 0).rgb;
    return normalize(mix(first, second, between) * 2.0 - 1.0);
}
