// Opens packed scenes for the tests and walks them: WalkTree VIEWS FILE... VIEWS has six numbers of 64
// bits for each view: the eye, the focal length, the pixel error and the budget or -1. Every seventh
// node but the root counts as hidden.

using System;
using System.Globalization;
using System.IO;
using System.Text;

static class WalkTree
{
    static int Main(string[] names)
    {
        CultureInfo.CurrentCulture = CultureInfo.InvariantCulture;
        var output = new StreamWriter(Console.OpenStandardOutput(), new UTF8Encoding(false));
        byte[] views = File.ReadAllBytes(names[0]);
        for (int place = 1; place < names.Length; ++place) {
            OccluderTree tree;
            try {
                tree = OccluderTree.Read(File.ReadAllBytes(names[place]));
            } catch (InvalidDataException error) {
                output.WriteLine("== " + error.Message);
                continue;
            }
            output.WriteLine("== all is well");
            foreach (string name in tree.Objects)
                output.WriteLine("name " + name);
            foreach (OccluderTree.Part part in tree.Parts)
                output.WriteLine("part {0} {1} {2}", part.Object, part.Transform, part.Node);
            for (int index = 0; index < tree.Meshes.Length; ++index)
                foreach (int corner in tree.Meshes[index].Indices) {
                    float[] at = tree.Meshes[index].Positions;
                    output.WriteLine("corner {0} {1:R} {2:R} {3:R}", index, at[3 * corner],
                                     at[3 * corner + 1], at[3 * corner + 2]);
                }
            for (int view = 0; view < views.Length; view += 48)
                Walk(tree, views, view, output);
        }
        output.Flush();
        return 0;
    }

    static void Walk(OccluderTree tree, byte[] views, int at, TextWriter output)
    {
        var numbers = new double[6];
        Buffer.BlockCopy(views, at, numbers, 0, 48);
        output.Write("drawn");
        tree.Walk(
            new[] { numbers[0], numbers[1], numbers[2] }, numbers[3], numbers[4],
            numbers[5] < 0 ? OccluderTree.All : (uint)numbers[5], node => node % 7 == 3,
            (node, mesh, near) => output.Write(" {0}:{1}", node, near ? 1 : 0));
        output.WriteLine();
    }
}
