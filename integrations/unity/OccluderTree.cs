// Reads the occluders of a scene (.occs) and decides which to draw in a frame, from near to far, as
// integrations/c/occluder_tree.h does; needs nothing of Unity.
//
//     var tree = OccluderTree.Read(File.ReadAllBytes("scene.occs"));
//     tree.Walk(eye, focal, tree.PixelError, OccluderTree.All, IsHidden, Draw);
//
// `IsHidden` is asked of each node that is met, by what was drawn before: what is hidden is left out with
// all below it. `Draw` gets the node and its mesh. Positions are those of the file: Unity is left-handed
// and files are not, so import both the same way (docs/integrations.md, "Axes and units").
//
// Read() checks the checksum, every figure and every index; a damaged file is refused by an
// InvalidDataException that says what is wrong.

using System;
using System.Collections.Generic;
using System.IO;
using System.Text;

public sealed class OccluderTree
{
    public const uint None = 0xffffffff;            // in place of a mesh
    public const uint All = 0xffffffff;             // in place of a budget of triangles

    public struct Node
    {
        public float[] Low, High;                   // of its box, relative to the tree's origin
        public uint FarMesh, NearMesh;              // or None
        public float FarError, SwitchError;         // how far the far one strays; what decides on it
        public float FarRadius, NearRadius;         // of the discs that hide as much
        public uint FirstChild, ChildCount, FirstPart, PartCount;
    }

    public struct Part
    {
        public uint Object, Transform, Node;
    }

    public sealed class Mesh
    {
        public double[] Origin;                     // that its positions are relative to
        public float[] Positions;                   // x, y, z of each vertex
        public int[] Indices;                       // three a triangle, to be drawn from both sides
    }

    public string[] Objects;
    public Node[] Nodes;                            // node 0 is the root
    public Part[] Parts;                            // in the scene's order
    public uint[] Order;                            // the parts as the leaves hold them
    public double[][] Transforms;                   // 12 numbers: three rows, from a mesh to the world
    public Mesh[] Meshes;
    public float[] Worth;                           // of each node, or null
    public double[] Origin = new double[3];
    public double PixelError, FieldOfView;
    public uint Rows;
    public int Up;                                  // 0 x, 1 y, 2 z
    public bool Conservative;

    const int HeaderBytes = 160;
    const uint MostShort = 65535;
    static readonly byte[] Magic = { 0x89, (byte)'O', (byte)'C', (byte)'S', 13, 10, 0x1a, 10 };

    byte[] data;
    double mostWorth = 1.0;

    public static OccluderTree Read(byte[] data)
    {
        var tree = new OccluderTree { data = data };
        tree.ReadHeader();
        tree.ReadNodes();
        tree.ReadParts();
        tree.ReadMeshes();
        tree.ReadNames();
        tree.ReadWorth();
        tree.data = null;
        return tree;
    }

    // Meets the nodes. `focal`: pixels that a unit length takes at unit depth. `eye`: world.
    public void Walk(
        double[] eye, double focal, double pixelError, uint mostTriangles, Func<int, bool> isHidden,
        Action<int, Mesh, bool> draw)
    {
        var heap = new List<Waiting>();
        uint left = mostTriangles;
        double size, distance = Distance(0, eye, out size);
        Push(heap, Waits(0, distance, size, focal, pixelError, mostTriangles));
        while (heap.Count > 0 && left > 0) {
            Waiting first = Pop(heap);
            Node node = Nodes[first.Node];
            if (isHidden(first.Node))
                continue;
            if (first.Level >= 0) {
                Mesh mesh = Meshes[first.Level == 1 ? node.NearMesh : node.FarMesh];
                if (left != All) {
                    uint count = (uint)(mesh.Indices.Length / 3);
                    if (count > left || first.Key == 0.0)
                        continue;
                    left -= count;
                }
                draw(first.Node, mesh, first.Level == 1);
                continue;
            }
            for (uint child = node.FirstChild; child < node.FirstChild + node.ChildCount; ++child) {
                distance = Distance((int)child, eye, out size);
                if (size * focal >= distance)
                    Push(heap, Waits((int)child, distance, size, focal, pixelError, mostTriangles));
            }
        }
    }

    // --- The walk

    struct Waiting
    {
        public double Key;
        public int Node, Level;                     // 0 the far occluder, 1 the near one, -1: open it

        public bool Before(Waiting other)
        {
            return Key < other.Key || (Key == other.Key && Node < other.Node);
        }
    }

    double Distance(int index, double[] eye, out double size)
    {
        double away = 0.0, across = 0.0;
        for (int axis = 0; axis < 3; ++axis) {
            double low = (double)Nodes[index].Low[axis] + Origin[axis];
            double high = (double)Nodes[index].High[axis] + Origin[axis];
            double past = Math.Max(Math.Max(low - eye[axis], eye[axis] - high), 0.0);
            away += past * past;
            across += (high - low) * (high - low);
        }
        size = Math.Sqrt(across);
        return Math.Sqrt(away);
    }

    static bool Serves(double error, double radius, double distance, double focal, double pixelError)
    {
        return radius > 0.0 && radius * focal >= distance
            && (error == 0.0 || error * focal <= pixelError * (distance - error));
    }

    Waiting Waits(
        int index, double distance, double size, double focal, double pixelError, uint mostTriangles)
    {
        Node node = Nodes[index];
        int level = -1;
        if (node.FarMesh != None
            && Serves(node.SwitchError, node.FarRadius, distance, focal, pixelError))
            level = 0;
        else if (node.NearMesh != None && Serves(0.0, node.NearRadius, distance, focal, pixelError))
            level = 1;
        double key = distance;
        if (mostTriangles != All) {
            double worth = Worth == null ? 1.0 : (double)Worth[index];
            double shown = level < 0 ? mostWorth * (0.5 * size)
                : worth * (double)(level == 1 ? node.NearRadius : node.FarRadius);
            key = distance > 0.0 ? -(shown / distance)
                : shown > 0.0 ? double.NegativeInfinity : 0.0;
        }
        return new Waiting { Key = key, Node = index, Level = level };
    }

    static void Push(List<Waiting> heap, Waiting one)
    {
        int place = heap.Count;
        heap.Add(one);
        for (; place > 0 && one.Before(heap[(place - 1) / 2]); place = (place - 1) / 2)
            heap[place] = heap[(place - 1) / 2];
        heap[place] = one;
    }

    static Waiting Pop(List<Waiting> heap)
    {
        Waiting first = heap[0], last = heap[heap.Count - 1];
        heap.RemoveAt(heap.Count - 1);
        int place = 0;
        for (int child; (child = 2 * place + 1) < heap.Count; place = child) {
            if (child + 1 < heap.Count && heap[child + 1].Before(heap[child]))
                ++child;
            if (!heap[child].Before(last))
                break;
            heap[place] = heap[child];
        }
        if (heap.Count > 0)
            heap[place] = last;
        return first;
    }

    // --- The file

    static InvalidDataException Wrong(string what)
    {
        return new InvalidDataException(what + ": copy it again, or build the scene again");
    }

    static void Check(bool good, string what)
    {
        if (!good)
            throw Wrong(what);
    }

    uint U32(long at) { return BitConverter.ToUInt32(data, (int)at); }

    float F32(long at) { return Finite(BitConverter.ToSingle(data, (int)at)); }

    double F64(long at)
    {
        double value = BitConverter.ToDouble(data, (int)at);
        Check(!double.IsNaN(value) && !double.IsInfinity(value), "a number is not finite");
        return value;
    }

    static float Finite(float value)
    {
        Check(!float.IsNaN(value) && !float.IsInfinity(value), "a number is not finite");
        return value;
    }

    // Where a block of so many bytes begins.
    long Block(int index, ulong length)
    {
        ulong begin = 16ul * U32(104 + 4 * index);
        Check(begin >= HeaderBytes && begin <= (ulong)data.Length
              && length <= (ulong)data.Length - begin, "a block is not in the file");
        return (long)begin;
    }

    void ReadHeader()
    {
        bool begins = data.Length >= HeaderBytes;
        for (int place = 0; begins && place < Magic.Length; ++place)
            begins = data[place] == Magic[place];
        Check(begins, "this is no packed scene (.occs)");
        uint flags = U32(12);
        if (U32(8) != 1 || (flags & ~0x301u) != 0)
            throw new InvalidDataException(
                "of another version: update this script or build the scene again");
        Check(BitConverter.ToUInt64(data, 16) == (ulong)data.Length,
              "cut short, or with bytes behind its end");
        Check(Checksum() == U32(156), "damaged, the checksum is another");
        for (int axis = 0; axis < 3; ++axis)
            Origin[axis] = F64(56 + 8 * axis);
        PixelError = F64(80);
        FieldOfView = F64(88);
        Rows = U32(96);
        Conservative = (flags & 1) != 0;
        Up = (int)(flags >> 8 & 3);
        Check(Up < 3 && PixelError > 0.0 && FieldOfView >= 1e-6 && FieldOfView < 180.0 && Rows >= 1
              && Rows <= 1u << 31, "damaged, it is for no screen");
        Block(10, U32(100));
    }

    // CRC-32 as zlib's, with 0 in place of the checksum itself.
    uint Checksum()
    {
        var table = new uint[256];
        for (uint index = 0; index < 256; ++index) {
            uint value = index;
            for (int step = 0; step < 8; ++step)
                value = (value & 1) != 0 ? value >> 1 ^ 0xedb88320u : value >> 1;
            table[index] = value;
        }
        uint crc = 0xffffffff;
        for (int place = 0; place < data.Length; ++place) {
            int one = place >= HeaderBytes - 4 && place < HeaderBytes ? 0 : data[place];
            crc = table[(crc ^ (uint)one) & 255] ^ crc >> 8;
        }
        return ~crc;
    }

    void ReadNodes()
    {
        uint count = U32(24), parts = U32(28), meshes = U32(40);
        long at = Block(0, 64ul * count);
        ulong follow = 1;
        Check(count > 0, "damaged, it has no node");
        Nodes = new Node[count];
        for (uint index = 0; index < count; ++index, at += 64)
            Nodes[index] = new Node {
                Low = new[] { F32(at), F32(at + 4), F32(at + 8) },
                High = new[] { F32(at + 12), F32(at + 16), F32(at + 20) },
                FarMesh = U32(at + 24), NearMesh = U32(at + 28),
                FarError = F32(at + 32), SwitchError = F32(at + 36),
                FarRadius = F32(at + 40), NearRadius = F32(at + 44),
                FirstChild = U32(at + 48), ChildCount = U32(at + 52),
                FirstPart = U32(at + 56), PartCount = U32(at + 60),
            };
        Check(Nodes[0].FirstPart == 0 && Nodes[0].PartCount == parts, "damaged, in its parts");
        for (uint index = 0; index < count; ++index) {
            Node node = Nodes[index];
            for (int axis = 0; axis < 3; ++axis)
                Check(node.Low[axis] <= node.High[axis], "damaged, in a box");
            Check(node.FarError >= 0 && node.SwitchError >= 0 && node.FarRadius >= 0
                  && node.NearRadius >= 0, "damaged, in a node");
            Check((node.FarMesh < meshes || node.FarMesh == None)
                  && (node.NearMesh < meshes || node.NearMesh == None), "damaged, in an occluder");
            if (node.ChildCount == 0) {
                Check(node.FirstChild == 0 && node.PartCount == 1, "damaged, in a leaf");
                continue;
            }
            Check(node.NearMesh == None && node.FirstChild == follow && node.FirstChild > index
                  && node.ChildCount <= count - follow, "damaged, in its children");
            follow += node.ChildCount;
            ulong part = node.FirstPart;
            for (uint child = 0; child < node.ChildCount; ++child) {
                Node below = Nodes[node.FirstChild + child];
                Check(below.FirstPart == part, "damaged, in its parts");
                part += below.PartCount;
            }
            Check(part == (ulong)node.FirstPart + node.PartCount, "damaged, in its parts");
        }
        Check(follow == count, "damaged, in its children");
    }

    void ReadParts()
    {
        uint count = U32(28), objects = U32(32), transforms = U32(36);
        long at = Block(1, 12ul * count), order = Block(2, 4ul * count);
        Parts = new Part[count];
        Order = new uint[count];
        uint before = None;
        for (uint index = 0; index < count; ++index, at += 12, order += 4) {
            Part part = Parts[index] = new Part {
                Object = U32(at), Transform = U32(at + 4), Node = U32(at + 8)
            };
            Order[index] = U32(order);
            Check(Order[index] < count && part.Transform < transforms && part.Node < Nodes.Length
                  && Nodes[part.Node].ChildCount == 0
                  && (part.Object == before || part.Object == unchecked(before + 1)),
                  "damaged, in a part");
            before = part.Object;
        }
        Check(unchecked(before + 1) == objects, "damaged, in its objects");
        for (uint index = 0; index < Nodes.Length; ++index)
            if (Nodes[index].ChildCount == 0)
                Check(Nodes[index].FirstPart < count
                      && Parts[Order[Nodes[index].FirstPart]].Node == index, "damaged, in a part");
        at = Block(3, 96ul * transforms);
        Transforms = new double[transforms][];
        for (uint index = 0; index < transforms; ++index) {
            Transforms[index] = new double[12];
            for (int place = 0; place < 12; ++place, at += 8)
                Transforms[index][place] = F64(at);
        }
    }

    void ReadMeshes()
    {
        uint count = U32(40), vertices = U32(44), words = U32(48), pairs = U32(52);
        long at = Block(4, 48ul * count), positions = Block(5, 12ul * vertices);
        long indices = Block(6, 4ul * words), edges = pairs > 0 ? Block(7, 8ul * pairs) : 0;
        ulong vertex = 0, word = 0, pair = 0;
        Meshes = new Mesh[count];
        for (uint index = 0; index < count; ++index, at += 48) {
            uint some = U32(at + 28), triangles = U32(at + 36), shared = U32(at + 44);
            int width = some <= MostShort ? 2 : 4;
            ulong length = (3ul * triangles * (ulong)width + 3) / 4;
            Check(U32(at + 24) == vertex && U32(at + 32) == word && U32(at + 40) == pair
                  && some <= vertices - vertex && length <= words - word && shared <= pairs - pair,
                  "damaged, in a mesh");
            var mesh = Meshes[index] = new Mesh {
                Origin = new[] { F64(at), F64(at + 8), F64(at + 16) },
                Positions = new float[3 * some], Indices = new int[3 * triangles],
            };
            for (int place = 0; place < mesh.Positions.Length; ++place)
                mesh.Positions[place] = F32(positions + 4 * (3 * (long)vertex + place));
            for (long place = 0; place < (long)(4 * length) / width; ++place) {
                long from = indices + 4 * (long)word + width * place;
                uint corner = width == 2 ? BitConverter.ToUInt16(data, (int)from) : U32(from);
                Check(corner < some, "damaged, in an index");
                if (place < mesh.Indices.Length)
                    mesh.Indices[place] = (int)corner;
            }
            for (uint place = 0; place < 2 * shared; ++place)
                Check(U32(edges + 8 * (long)pair + 4 * place) < 3ul * triangles, "damaged, in a pair");
            vertex += some;
            word += length;
            pair += shared;
        }
        Check(vertex == vertices && word == words && pair == pairs, "damaged, in its meshes");
    }

    void ReadNames()
    {
        uint count = U32(32);
        long at = Block(9, 4ul * ((ulong)count + 1)), text = at + 4 * ((long)count + 1);
        var strict = new UTF8Encoding(false, true);
        uint end = U32(at + 4 * (long)count);
        Check(U32(at) == 0 && end <= data.Length - text, "damaged, in a name");
        Objects = new string[count];
        for (uint index = 0; index < count; ++index) {
            uint begin = U32(at + 4 * index), after = U32(at + 4 * index + 4);
            Check(after > begin && after <= end, "damaged, in a name");
            try {
                Objects[index] = strict.GetString(data, (int)(text + begin), (int)(after - begin - 1));
            } catch (ArgumentException) {
                throw Wrong("damaged, in a name");
            }
            Check(data[text + after - 1] == 0 && Objects[index].IndexOf('\0') < 0, "damaged, in a name");
        }
    }

    void ReadWorth()
    {
        if (U32(104 + 4 * 8) == 0)
            return;
        long at = Block(8, 4ul * (ulong)Nodes.Length);
        Worth = new float[Nodes.Length];
        mostWorth = 0.0;
        for (int index = 0; index < Worth.Length; ++index) {
            Worth[index] = F32(at + 4 * index);
            Check(Worth[index] >= 0, "damaged, in a worth");
            mostWorth = Math.Max(mostWorth, Worth[index]);
        }
    }
}
