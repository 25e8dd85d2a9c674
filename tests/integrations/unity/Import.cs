// Imports a model as Unity would, and prints what became of it as lines of words.

using System;
using System.Globalization;
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
        part.AddComponent<MeshFilter>().sharedMesh =
            new Mesh { vertices = Corners, triangles = Faces };
        part.AddComponent<MeshRenderer>();
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
                int[] t = filter.sharedMesh.triangles;
                for (int i = 0; i < t.Length; i += 3)
                    Console.WriteLine($"face {t[i]} {t[i + 1]} {t[i + 2]}");
            }
        }
        return 0;
    }
}
