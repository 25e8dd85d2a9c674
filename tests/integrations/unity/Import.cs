// Imports a model as Unity would, and prints what became of it as lines of words.
//
// Import.exe Wedge.fbx [QUEUE:MATERIAL ...]: a wedge for each material, ten apart along x, all of
// one mesh; "none" is a submesh without a material.  Without any a single wedge has none.

using System;
using System.Collections.Generic;
using System.Globalization;
using System.Linq;
using System.Reflection;
using System.Threading;
using UnityEditor;
using UnityEditor.AssetImporters;
using UnityEngine;

public static class Import
{
    // A wedge without a mirror image in itself, so that a flipped axis shows.
    private static readonly Vector3[] Corners =
    {
        new Vector3(0, 0, 0), new Vector3(3, 0, 0), new Vector3(0, 2, 0), new Vector3(0, 0, 1),
    };

    // Clockwise as seen from outside, in Unity's left-handed space.
    private static readonly int[] Faces = { 0, 2, 1, 0, 3, 2, 0, 1, 3, 1, 2, 3 };

    public static int Main(string[] arguments)
    {
        // A culture that writes 0,5: files must not depend on it.
        Thread.CurrentThread.CurrentCulture = new CultureInfo("de-DE");
        var root = new GameObject("Wedge");
        root.transform.Place = new Vector3(100, 0, 0);
        var part = new GameObject("part");
        part.transform.Place = new Vector3(0.5f, 0.25f, -4);
        part.transform.SetParent(root.transform, false);
        Material[] materials = arguments.Skip(1).Select(MaterialOf).ToArray();
        part.AddComponent<MeshFilter>().sharedMesh = Wedges(Math.Max(materials.Length, 1));
        part.AddComponent<MeshRenderer>().sharedMaterials = materials;
        part.Flags = StaticEditorFlags.OccluderStatic | StaticEditorFlags.BatchingStatic;

        var context = new AssetImportContext();
        var importer = new OccluderPostprocessor { assetPath = arguments[0], context = context };
        typeof(OccluderPostprocessor)
            .GetMethod("OnPostprocessModel", BindingFlags.Instance | BindingFlags.NonPublic)
            .Invoke(importer, new object[] { root });

        Thread.CurrentThread.CurrentCulture = CultureInfo.InvariantCulture;
        foreach (string path in context.Dependencies)
            Console.WriteLine("depends " + path);
        foreach (string text in context.Errors)
            Console.WriteLine("error " + text);
        foreach (string text in context.Warnings)
            Console.WriteLine("warning " + text);
        Console.WriteLine("part " + part.Flags);
        foreach (Transform child in root.transform.Children)
        {
            if (child.gameObject == part)
                continue;
            Console.WriteLine("child " + child.gameObject.name + " " + child.gameObject.Flags);
            foreach (MeshFilter filter in child.gameObject.GetComponentsInChildren<MeshFilter>(true))
            {
                Console.WriteLine("stored " + context.Added.Contains(filter.sharedMesh));
                foreach (Vector3 p in filter.sharedMesh.vertices)
                    Console.WriteLine($"vertex {p.x:R} {p.y:R} {p.z:R}");
                int[] t = filter.sharedMesh.GetTriangles(0);
                for (int i = 0; i < t.Length; i += 3)
                    Console.WriteLine($"face {t[i]} {t[i + 1]} {t[i + 2]}");
            }
        }
        return 0;
    }

    private static Material MaterialOf(string said)
    {
        string[] words = said.Split(new[] { ':' }, 2);
        return words.Length == 1
            ? null : new Material { name = words[1], renderQueue = int.Parse(words[0]) };
    }

    private static Mesh Wedges(int count)
    {
        var mesh = new Mesh();
        var vertices = new List<Vector3>();
        for (int part = 0; part < count; part++)
        {
            int first = vertices.Count;
            vertices.AddRange(Corners.Select(p => new Vector3(p.x + 10 * part, p.y, p.z)));
            mesh.SetTriangles(Faces.Select(corner => first + corner).ToList(), part);
        }
        mesh.SetVertices(vertices);
        return mesh;
    }
}
