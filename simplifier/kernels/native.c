/* The headers of integrations/c as a library for Python: native.py calls these by ctypes.  Arrays are
 * numpy's, checked there. */
#include "occluder_buffer.h"
#include "occluder_tree.h"

#if defined(_WIN32)
#define SHARED __declspec(dllexport)
#else
#define SHARED __attribute__((visibility("default")))
#endif

/* Whether this machine has the instructions that this was compiled for. */
SHARED int occluder_native_runs(void)
{
#if defined(__AVX2__) && defined(__GNUC__)
    return __builtin_cpu_supports("avx2");
#elif defined(__AVX2__)
    return 0; /* who knows */
#else
    return 1;
#endif
}

/* A depth buffer of numpy's, and the view that it is looked into with. */
typedef struct {
    float *depth;          /* rows, then columns, whole tiles; the tiles' three layers follow */
    float *points;         /* room for three numbers of each vertex */
    const double *eye;     /* 3 */
    const double *axes;    /* right, up, ahead */
    const double *lens;    /* focal length, near plane, margin, slack */
    int64_t rows, columns, most_vertices, inner;
} native_buffer;

static occluder_buffer opened(const native_buffer *native)
{
    occluder_buffer buffer;
    occluder_view view;
    size_t tiles;
    memset(&buffer, 0, sizeof buffer);
    buffer.rows = (uint32_t)native->rows;
    buffer.columns = (uint32_t)native->columns;
    buffer.tile_rows = occluder_tiles_(buffer.rows);
    buffer.tile_columns = occluder_tiles_(buffer.columns);
    buffer.stride = buffer.tile_columns * OCCLUDER_TILE;
    buffer.most_vertices = (uint32_t)native->most_vertices;
    buffer.coverage = native->inner ? OCCLUDER_INNER : OCCLUDER_CENTRE;
    buffer.margin = (float)native->lens[2];
    buffer.slack = (float)native->lens[3];
    tiles = (size_t)buffer.tile_rows * buffer.tile_columns;
    buffer.depth = native->depth;
    buffer.farthest = buffer.depth + tiles * OCCLUDER_TILE * OCCLUDER_TILE;
    buffer.blur = buffer.farthest + tiles;
    buffer.stale = buffer.blur + tiles;
    buffer.x = native->points;
    buffer.y = buffer.x + native->most_vertices;
    buffer.z = buffer.y + native->most_vertices;
    memcpy(view.eye, native->eye, sizeof view.eye);
    memcpy(view.right, native->axes, sizeof view.right);
    memcpy(view.up, native->axes + 3, sizeof view.up);
    memcpy(view.ahead, native->axes + 6, sizeof view.ahead);
    view.focal = native->lens[0];
    view.near_depth = native->lens[1];
    view.rows = buffer.rows;
    view.columns = buffer.columns;
    occluder_buffer_look(&buffer, &view);
    return buffer;
}

static occluder_mesh mesh_of(
    const float *positions, int64_t vertex_count, const int32_t *faces, int64_t face_count,
    const uint32_t *pairs, int64_t pair_count)
{
    occluder_mesh mesh;
    mesh.positions = positions;
    mesh.indices = faces;
    mesh.vertex_count = (uint32_t)vertex_count;
    mesh.triangle_count = (uint32_t)face_count;
    mesh.index_bytes = 4;
    mesh.pairs = pairs;
    mesh.pair_count = (uint32_t)pair_count;
    return mesh;
}

/* `vertices` in the world; `positions` is room for as many of float32. */
SHARED void occluder_native_draw(
    const native_buffer *native, const double *vertices, int64_t vertex_count,
    const int32_t *faces, int64_t face_count, const uint32_t *pairs, int64_t pair_count,
    const float *errors, int64_t error_count, float *positions)
{
    static const float around_eye[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
    occluder_buffer buffer = opened(native);
    const occluder_mesh mesh = mesh_of(positions, vertex_count, faces, face_count, pairs, pair_count);
    int64_t index;
    for (index = 0; index < vertex_count; ++index) {
        positions[3 * index] = (float)(vertices[3 * index] - native->eye[0]);
        positions[3 * index + 1] = (float)(vertices[3 * index + 1] - native->eye[1]);
        positions[3 * index + 2] = (float)(vertices[3 * index + 2] - native->eye[2]);
    }
    if (error_count == 1)
        occluder_buffer_draw(&buffer, &mesh, around_eye, errors[0]);
    else
        occluder_buffer_draw_each_(&buffer, &mesh, around_eye, errors, 0.0f);
}

SHARED void occluder_native_test(
    const native_buffer *native, const double *boxes, int64_t count, uint8_t *verdicts)
{
    occluder_buffer buffer = opened(native);
    int64_t index;
    for (index = 0; index < count; ++index) {
        float corners[6];
        int k;
        for (k = 0; k < 6; ++k)
            corners[k] = (float)(boxes[6 * index + k] - native->eye[k % 3]);
        verdicts[index] = (uint8_t)occluder_buffer_test(&buffer, corners, corners + 3);
    }
}

/* As occluder_native_draw(), of positions in a space of their own. */
SHARED void occluder_native_draw_placed(
    const native_buffer *native, const float *positions, int64_t vertex_count, const int32_t *faces,
    int64_t face_count, const uint32_t *pairs, int64_t pair_count, const float *transform,
    const float *error)
{
    occluder_buffer buffer = opened(native);
    const occluder_mesh mesh = mesh_of(positions, vertex_count, faces, face_count, pairs, pair_count);
    occluder_buffer_draw(&buffer, &mesh, transform, error[0]);
}

SHARED int64_t occluder_native_tree_bytes(void)
{
    return (int64_t)sizeof(occluder_tree);
}

/* Opens a file; the status, and in `sizes` the bytes of room, the nodes and the most vertices. */
SHARED int64_t occluder_native_open(
    const void *bytes, int64_t size, occluder_tree *tree, int64_t sizes[3])
{
    const occluder_tree_status status = occluder_tree_open(bytes, (size_t)size, tree);
    sizes[0] = (int64_t)occluder_tree_room(tree);
    sizes[1] = tree->node_count;
    sizes[2] = tree->most_vertices;
    return status;
}

typedef struct {
    occluder_buffer buffer;
    uint32_t *drawn;         /* node and level of each */
} recorder;

static void draw_recorded(void *user, const occluder_drawing *drawing)
{
    recorder *one = (recorder *)user;
    *one->drawn++ = drawing->node;
    *one->drawn++ = (uint32_t)drawing->is_near;
    occluder_buffer_draw(&one->buffer, drawing->mesh, drawing->transform, drawing->error);
}

static occluder_verdict test_recorded(void *user, const float low[3], const float high[3])
{
    return occluder_buffer_test(&((recorder *)user)->buffer, low, high);
}

/* A frame in a buffer that was cleared; in `counts` the occluders, triangles and nodes. */
SHARED void occluder_native_cull(
    const native_buffer *native, const occluder_tree *tree, void *room, double pixel_error,
    int64_t most_triangles, uint32_t *drawn, uint8_t *verdicts, int64_t counts[3])
{
    recorder one;
    occluder_rasteriser rasteriser;
    occluder_limits limits;
    occluder_drawn found;
    one.buffer = opened(native);
    one.drawn = drawn;
    rasteriser.user = &one;
    rasteriser.draw = draw_recorded;
    rasteriser.test = test_recorded;
    limits.pixel_error = pixel_error;
    limits.most_triangles = (uint32_t)most_triangles;
    occluder_tree_cull(tree, &one.buffer.view, &limits, &rasteriser, room, verdicts, &found);
    counts[0] = found.occluders;
    counts[1] = found.triangles;
    counts[2] = found.nodes;
}
