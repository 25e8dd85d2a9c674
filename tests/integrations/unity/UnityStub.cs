// What the postprocessor uses of Unity, as far as a test needs it: names, signatures, and the
// behaviour that its documentation gives.  Transforms have a place and no turn.

using System;
using System.Collections.Generic;
using System.IO;
using System.Linq;

namespace UnityEngine
{
    public class Object { public string name = ""; }
    public class Material : Object { public int renderQueue = 2000; }

    public struct Vector3
    {
        public float x, y, z;
        public Vector3(float x, float y, float z) { this.x = x; this.y = y; this.z = z; }
    }

    public struct Matrix4x4
    {
        public Vector3 Move;
        public static Matrix4x4 operator *(Matrix4x4 a, Matrix4x4 b) => new Matrix4x4
        {
            Move = new Vector3(a.Move.x + b.Move.x, a.Move.y + b.Move.y, a.Move.z + b.Move.z)
        };
        public Vector3 MultiplyPoint3x4(Vector3 p) =>
            new Vector3(p.x + Move.x, p.y + Move.y, p.z + Move.z);
    }

    public class Component : Object
    {
        public GameObject gameObject;
        public Transform transform => gameObject.transform;
        public T GetComponent<T>() where T : Component => gameObject.GetComponent<T>();
    }

    public class Transform : Component
    {
        public Vector3 Place;
        public Transform Parent;
        public List<Transform> Children = new List<Transform>();

        public void SetParent(Transform parent, bool worldPositionStays)
        {
            if (worldPositionStays)
                throw new NotImplementedException();
            Parent = parent;
            parent.Children.Add(this);
        }

        public Matrix4x4 localToWorldMatrix
        {
            get
            {
                var own = new Matrix4x4 { Move = Place };
                return Parent == null ? own : Parent.localToWorldMatrix * own;
            }
        }

        public Matrix4x4 worldToLocalMatrix
        {
            get
            {
                Vector3 move = localToWorldMatrix.Move;
                return new Matrix4x4 { Move = new Vector3(-move.x, -move.y, -move.z) };
            }
        }
    }

    public class GameObject : Object
    {
        public readonly List<Component> Components = new List<Component>();
        public UnityEditor.StaticEditorFlags Flags;

        public GameObject(string name) { this.name = name; AddComponent<Transform>(); }
        public Transform transform => Components.OfType<Transform>().First();

        public T AddComponent<T>() where T : Component, new()
        {
            var made = new T { gameObject = this };
            Components.Add(made);
            return made;
        }

        public T GetComponent<T>() where T : Component => Components.OfType<T>().FirstOrDefault();

        public T[] GetComponentsInChildren<T>(bool includeInactive) =>
            Components.OfType<T>()
                .Concat(transform.Children.SelectMany(
                    one => one.gameObject.GetComponentsInChildren<T>(includeInactive)))
                .ToArray();
    }

    public class Mesh : Object
    {
        public Vector3[] vertices = new Vector3[0];
        public List<int[]> Parts = new List<int[]>();
        public int subMeshCount => Parts.Count;
        public int[] GetTriangles(int submesh) => Parts[submesh];
        public void SetVertices(List<Vector3> them) { vertices = them.ToArray(); }
        public void SetTriangles(List<int> them, int submesh)
        {
            if (submesh != Parts.Count)
                throw new NotImplementedException();
            Parts.Add(them.ToArray());
        }

        public void RecalculateNormals() { }
        public void RecalculateBounds() { }
    }

    public class MeshFilter : Component { public Mesh sharedMesh; }
    public class Renderer : Component { public Material[] sharedMaterials = new Material[0]; }
    public class MeshRenderer : Renderer { }
}

namespace UnityEngine.Rendering
{
    public enum RenderQueue { Geometry = 2000, AlphaTest = 2450, Transparent = 3000 }
}

namespace UnityEditor.AssetImporters
{
    public class AssetImportContext
    {
        public readonly List<string> Errors = new List<string>(), Warnings = new List<string>(),
            Dependencies = new List<string>();
        public readonly List<UnityEngine.Object> Added = new List<UnityEngine.Object>();
        public void DependsOnSourceAsset(string path) { Dependencies.Add(path); }
        public void LogImportError(string text) { Errors.Add(text); }
        public void LogImportWarning(string text) { Warnings.Add(text); }
        public void AddObjectToAsset(string id, UnityEngine.Object it) { Added.Add(it); }
    }
}

namespace UnityEditor
{
    [Flags]
    public enum StaticEditorFlags { BatchingStatic = 4, OccluderStatic = 2, OccludeeStatic = 16 }

    public class AssetPostprocessor
    {
        public string assetPath { get; set; }
        public AssetImporters.AssetImportContext context { get; set; }
        public virtual uint GetVersion() => 0;
    }

    public static class GameObjectUtility
    {
        public static StaticEditorFlags GetStaticEditorFlags(UnityEngine.GameObject it) => it.Flags;
        public static void SetStaticEditorFlags(UnityEngine.GameObject it, StaticEditorFlags flags)
        {
            it.Flags = flags;
        }
    }

    public static class EditorPrefs
    {
        public static string GetString(string key, string otherwise) =>
            Environment.GetEnvironmentVariable("TEST_COMMAND") ?? otherwise;
    }

    public static class FileUtil
    {
        public static string GetUniqueTempPathInProject() =>
            Path.Combine("Temp", "UnityTempFile-" + Guid.NewGuid().ToString("N"));
    }
}
