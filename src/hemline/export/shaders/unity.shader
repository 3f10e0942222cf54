// Vertex-animation textures of hemline for Unity (built-in and universal pipelines, unlit but for one light). Put this on
// the mesh of NAME.glb and set the properties as they stand in NAME.json. Import both PNG with sRGB off, no mipmaps, no
// compression, filter Point, wrap Clamp, non-power of two None, Max Size 8192. An importer that keeps glTF's axes turns x
// (glTFast does): then leave Mirror X at 1. Enlarge the renderer's bounds to the path of the clip, or it is culled.
Shader "hemline/VertexAnimationTexture"
{
    Properties
    {
        _Color ("Colour", Color) = (0.72, 0.23, 0.17, 1)
        [NoScaleOffset] _Positions ("Positions", 2D) = "black" {}
        [NoScaleOffset] _Normals ("Normals", 2D) = "bump" {}
        _Low ("low", Vector) = (0, 0, 0, 0)
        _Size ("size", Vector) = (1, 1, 1, 0)
        _PathLow ("path_low", Vector) = (0, 0, 0, 0)
        _PathSize ("path_size", Vector) = (0, 0, 0, 0)
        _Frames ("frames", Float) = 1
        _Vertices ("vertices", Float) = 1
        _Fps ("fps", Float) = 30
        [Toggle] _InPlace ("In place", Float) = 0
        _MirrorX ("Mirror X", Float) = 1
    }
    SubShader
    {
        Tags { "RenderType" = "Opaque" }
        Cull Off
        Pass
        {
            HLSLPROGRAM
            #pragma vertex vert
            #pragma fragment frag
            #pragma target 4.5
            #include "UnityCG.cginc"

            Texture2D<float4> _Positions, _Normals;
            float4 _Color, _Low, _Size, _PathLow, _PathSize;
            float _Frames, _Vertices, _Fps, _InPlace, _MirrorX;

            struct appdata { float4 vertex : POSITION; float2 place : TEXCOORD1; };
            struct v2f { float4 position : SV_POSITION; float3 normal : TEXCOORD0; };

            // pixels are counted from the top here; Unity keeps the lowest row first
            float3 Texel(Texture2D<float4> from, int2 at)
            {
                uint width, height;
                from.GetDimensions(width, height);
                return from.Load(int3(at.x, (int)height - 1 - at.y, 0)).rgb;
            }

            float3 Share(int2 start, int frame, int height)
            {
                int2 at = int2(start.x, start.y + frame * (height / (int)_Frames));
                float3 high = Texel(_Positions, at), low = Texel(_Positions, at + int2(0, height));
                return (round(high * 255.0) * 256.0 + round(low * 255.0)) / 65535.0;
            }

            float3 PositionAt(int2 start, int frame, int2 size)
            {
                int count = (int)_Vertices;
                int2 coarse = int2(count % size.x, count / size.x), fine = int2((count + 1) % size.x, (count + 1) / size.x);
                float3 path = _PathLow.xyz + _PathSize.xyz * (Share(coarse, frame, size.y) + Share(fine, frame, size.y) / 65536.0);
                return _Low.xyz + _Size.xyz * Share(start, frame, size.y) + path * (1 - _InPlace);
            }

            float3 NormalAt(int2 start, int frame, int2 size)
            {
                return Texel(_Normals, int2(start.x, start.y + frame * (size.y / (int)_Frames))) * 2.0 - 1.0;
            }

            v2f vert (appdata v)
            {
                uint width, height;
                _Normals.GetDimensions(width, height);
                int2 size = int2(width, height);
                // importers of glTF turn v over: it counts from the bottom
                int2 start = int2(v.place.x * width, (1.0 - v.place.y) * height);
                float at = fmod(_Time.y * _Fps, max(_Frames - 1.0, 1.0));
                int first = (int)floor(at), second = min(first + 1, (int)_Frames - 1);
                float3 position = lerp(PositionAt(start, first, size), PositionAt(start, second, size), at - first);
                float3 normal = normalize(lerp(NormalAt(start, first, size), NormalAt(start, second, size), at - first));
                float3 mirror = float3(_MirrorX > 0.5 ? -1 : 1, 1, 1);
                v2f o;
                o.position = UnityObjectToClipPos(float4(position * mirror, 1));
                o.normal = UnityObjectToWorldNormal(normal * mirror);
                return o;
            }

            float4 frag (v2f i, float facing : VFACE) : SV_Target
            {
                float3 normal = normalize(i.normal) * (facing > 0 ? 1 : -1);
                float light = 0.35 + 0.65 * saturate(dot(normal, normalize(float3(0.4, 0.8, -0.4))));
                return float4(_Color.rgb * light, 1);
            }
            ENDHLSL
        }
    }
}
