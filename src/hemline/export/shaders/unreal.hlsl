// Vertex-animation textures of hemline for Unreal: the code of one Custom node (output CMOT Float 3) whose result, less
// Absolute Local Position, goes into World Position Offset through a Transform Vector (Local to World).
// Inputs: Positions, Normals (Texture Object), UV (TexCoord index 1), Time (Time * 1.0), and Low, Size, PathLow, PathSize,
// Frames, Vertices, Fps, InPlace as they stand in NAME.json.
// Import both PNG with sRGB off, compression VectorDisplacementmap (RGBA8), mipmaps off, filter Nearest, Maximum Size 8192.
// On the mesh of NAME.glb set Use Full Precision UVs, and enlarge its bounds to the path of the clip, or it is culled.
// For normals make a second node that returns NormalAt as below instead of the last line.
uint width, height;
Normals.GetDimensions(width, height);
int2 size = int2(width, height);
int rows = size.y / (int)Frames;
int2 start = int2(UV * float2(width, height));

float at = fmod(Time * Fps, max(Frames - 1.0, 1.0));
int frames[2] = { (int)floor(at), min((int)floor(at) + 1, (int)Frames - 1) };
int count = (int)Vertices;
int2 places[3] = { start, int2(count % size.x, count / size.x), int2((count + 1) % size.x, (count + 1) / size.x) };

float3 found[2];
for (int n = 0; n < 2; n++)
{
    float3 shares[3];
    for (int p = 0; p < 3; p++)
    {
        int3 texel = int3(places[p].x, places[p].y + frames[n] * rows, 0);
        float3 high = Positions.Load(texel).rgb, low = Positions.Load(texel + int3(0, size.y, 0)).rgb;
        shares[p] = (round(high * 255.0) * 256.0 + round(low * 255.0)) / 65535.0;
    }
    float3 path = PathLow + PathSize * (shares[1] + shares[2] / 65536.0);
    found[n] = Low + Size * shares[0] + path * (1.0 - InPlace);
}
float3 metres = lerp(found[0], found[1], at - floor(at));

// normals: NormalAt = lerp(Normals.Load(int3(start.x, start.y + frames[0] * rows, 0)).rgb,
//                          Normals.Load(int3(start.x, start.y + frames[1] * rows, 0)).rgb, at - floor(at)) * 2.0 - 1.0;
// turned as the positions are: float3(NormalAt.x, NormalAt.z, NormalAt.y).

// glTF is y up in metres; Unreal is z up in centimetres, left-handed
return 100.0 * float3(metres.x, metres.z, metres.y);
