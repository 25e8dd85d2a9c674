// Gives imported models an occluder, made by the `occluder` command.  Belongs into an Editor folder.
//
// A model takes part if a text file stands beside it with ".occluder" added to its name:
// Castle.fbx and Castle.fbx.occluder.  What the file says are options of `occluder simplify`, as
// "--budget 64 --ground"; it may be empty.  A change of it imports the model again.
//
// The occluder is a child, "Castle_Occluder", that is Occluder Static and has no material; the
// model's own renderers become occludees alone.
//
// Positions pass as they are, though Unity is left-handed and files are not: the command sees the
// mirror image of the model and gives that of the occluder, whose numbers are those that Unity wants.
//
// Submeshes that are drawn with the cut-out and the transparent ones pass with the names of their
// materials, as what one can see through: the command leaves them out, and says so in the import's
// log, unless the options have "--transparent keep".

using System;
using System.Collections.Generic;
using System.Diagnostics;
using System.Globalization;
using System.IO;
using System.Linq;
using System.Text;
using System.Text.RegularExpressions;
using UnityEditor;
using UnityEngine;
using UnityEngine.Rendering;

public sealed class OccluderPostprocessor : AssetPostprocessor
{
    // Where the command is not on PATH: EditorPrefs.SetString(CommandKey, "/path/to/occluder").
    public const string CommandKey = "PlanarOccluder.Command";

    private const string Warning = "warning: "; // how the command begins such lines

    public override uint GetVersion() => 2;

    private void OnPostprocessModel(GameObject root)
    {
        string optionsPath = assetPath + ".occluder";
        context.DependsOnSourceAsset(optionsPath);
        if (!File.Exists(optionsPath))
            return;
        string folder = FileUtil.GetUniqueTempPathInProject();
        Directory.CreateDirectory(folder);
        try
        {
            string source = Path.Combine(folder, "mesh.obj");
            string target = Path.Combine(folder, "occluder.obj");
            WriteObj(root, source);
            string options = string.Join(" ", File.ReadAllLines(optionsPath));
            string said = Run($"simplify --quiet \"{source}\" -o \"{target}\" {options}");
            foreach (string line in said.Split('\n'))
                if (line.StartsWith(Warning, StringComparison.Ordinal))
                    context.LogImportWarning($"{assetPath}: {line.Substring(Warning.Length).Trim()}");
            Add(root, ReadObj(target));
        }
        catch (Exception error)
        {
            context.LogImportError($"{assetPath}: no occluder was made: {error.Message}");
        }
        finally
        {
            Directory.Delete(folder, true);
        }
    }

    // All meshes below the root, in its space; beside it an MTL file of what one can see through.
    private static void WriteObj(GameObject root, string path)
    {
        string library = Path.ChangeExtension(path, ".mtl");
        // What comes before any material is opaque, whatever the others are called.
        var vertexLines = new StringBuilder($"mtllib {Path.GetFileName(library)}\n");
        StringBuilder opaque = new StringBuilder(), clear = new StringBuilder();
        var names = new HashSet<string>();
        int first = 1;
        foreach (MeshFilter filter in root.GetComponentsInChildren<MeshFilter>(true))
        {
            Mesh mesh = filter.sharedMesh;
            if (mesh == null)
                continue;
            Matrix4x4 toRoot =
                root.transform.worldToLocalMatrix * filter.transform.localToWorldMatrix;
            Vector3[] vertices = mesh.vertices;
            foreach (Vector3 vertex in vertices)
            {
                Vector3 p = toRoot.MultiplyPoint3x4(vertex);
                vertexLines.AppendLine(FormattableString.Invariant($"v {p.x:R} {p.y:R} {p.z:R}"));
            }
            var renderer = filter.GetComponent<Renderer>();
            Material[] materials = renderer == null ? new Material[0] : renderer.sharedMaterials;
            for (int part = 0; part < mesh.subMeshCount; part++)
            {
                Material material = part < materials.Length ? materials[part] : null;
                bool seeThrough =
                    material != null && material.renderQueue >= (int)RenderQueue.AlphaTest;
                if (seeThrough)
                {
                    names.Add(Word(material.name));
                    clear.AppendLine("usemtl " + Word(material.name));
                }
                WriteFaces(seeThrough ? clear : opaque, mesh.GetTriangles(part), first);
            }
            first += vertices.Length;
        }
        File.WriteAllText(path, vertexLines.Append(opaque).Append(clear).ToString());
        File.WriteAllLines(library, names.Select(name => $"newmtl {name}\nd 0.5"));
    }

    // A name as a line of OBJ can hold it: in one line, which no backslash joins to the next.
    private static string Word(string name)
    {
        string word = Regex.Replace(name, @"[\\\s]+", " ").Trim();
        return word == "" ? "unnamed" : word;
    }

    private static void WriteFaces(StringBuilder text, int[] corners, int first)
    {
        for (int i = 0; i < corners.Length; i += 3)
        {
            int a = first + corners[i], b = first + corners[i + 1], c = first + corners[i + 2];
            text.AppendLine($"f {a} {b} {c}");
        }
    }

    private static Mesh ReadObj(string path)
    {
        var vertices = new List<Vector3>();
        var corners = new List<int>();
        foreach (string line in File.ReadLines(path))
        {
            string[] words = line.Split(new[] { ' ' }, StringSplitOptions.RemoveEmptyEntries);
            if (words.Length == 4 && words[0] == "v")
                vertices.Add(new Vector3(Number(words[1]), Number(words[2]), Number(words[3])));
            else if (words.Length == 4 && words[0] == "f")
                for (int i = 1; i < 4; i++)
                    corners.Add(int.Parse(words[i].Split('/')[0], CultureInfo.InvariantCulture) - 1);
        }
        var mesh = new Mesh();
        mesh.SetVertices(vertices);
        mesh.SetTriangles(corners, 0);
        mesh.RecalculateNormals();
        mesh.RecalculateBounds();
        return mesh;
    }

    private static float Number(string word) => float.Parse(word, CultureInfo.InvariantCulture);

    // What the command says beside its results.
    private static string Run(string arguments)
    {
        var start = new ProcessStartInfo(EditorPrefs.GetString(CommandKey, "occluder"), arguments)
        {
            UseShellExecute = false,
            CreateNoWindow = true,
            RedirectStandardError = true,
        };
        using (Process process = Process.Start(start))
        {
            string said = process.StandardError.ReadToEnd().Trim();
            process.WaitForExit();
            if (process.ExitCode != 0)
                throw new InvalidOperationException(said);
            return said;
        }
    }

    private void Add(GameObject root, Mesh mesh)
    {
        foreach (Renderer renderer in root.GetComponentsInChildren<Renderer>(true))
        {
            StaticEditorFlags flags = GameObjectUtility.GetStaticEditorFlags(renderer.gameObject);
            flags = (flags & ~StaticEditorFlags.OccluderStatic) | StaticEditorFlags.OccludeeStatic;
            GameObjectUtility.SetStaticEditorFlags(renderer.gameObject, flags);
        }
        var child = new GameObject(root.name + "_Occluder");
        child.transform.SetParent(root.transform, false);
        mesh.name = child.name;
        child.AddComponent<MeshFilter>().sharedMesh = mesh;
        child.AddComponent<MeshRenderer>().sharedMaterials = new Material[0];
        GameObjectUtility.SetStaticEditorFlags(child, StaticEditorFlags.OccluderStatic);
        context.AddObjectToAsset(mesh.name, mesh);
    }
}
