// The same with Intel's Masked Occlusion Culling in place of occluder_buffer.h: README.md says how it
// is compiled.  Margins are those of docs/culling.md: boxes grow by the pixel error, as large as it
// is in a corner, and half a pixel, and are tested nearer by the share of their depth that it may be.
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <vector>

#include "MaskedOcclusionCulling.h"
#include "occluder_tree.h"

enum { ROWS = 720, COLUMNS = 1280 };

struct Culling {
    MaskedOcclusionCulling *buffer;
    occluder_view view;
    double pixel_error;
    std::vector<unsigned> indices;
};

// World axes around the eye to clip space, w the depth.
static void clip(const occluder_view &view, const double at[3], float out[4])
{
    out[0] = (float)(2.0 * view.focal / view.columns * occluder_dot_(view.right, at));
    out[1] = (float)(2.0 * view.focal / view.rows * occluder_dot_(view.up, at));
    out[2] = out[3] = (float)occluder_dot_(view.ahead, at);
}

static void draw(void *user, const occluder_drawing *drawing)
{
    Culling &culling = *(Culling *)user;
    const occluder_mesh &mesh = *drawing->mesh;
    float matrix[16]; // column by column
    for (int column = 0; column < 4; ++column) {
        const double axis[3] = {drawing->transform[column], drawing->transform[4 + column],
                                drawing->transform[8 + column]};
        clip(culling.view, axis, matrix + 4 * column);
    }
    culling.indices.resize(3 * (size_t)mesh.triangle_count);
    for (size_t corner = 0; corner < culling.indices.size(); ++corner)
        culling.indices[corner] = mesh.index_bytes == 2 ? ((const uint16_t *)mesh.indices)[corner]
                                                        : ((const uint32_t *)mesh.indices)[corner];
    culling.buffer->RenderTriangles(
        mesh.positions, culling.indices.data(), (int)mesh.triangle_count, matrix,
        MaskedOcclusionCulling::BACKFACE_NONE, MaskedOcclusionCulling::CLIP_PLANE_ALL,
        MaskedOcclusionCulling::VertexLayout(12, 4, 8));
}

static occluder_verdict test(void *user, const float low[3], const float high[3])
{
    Culling &culling = *(Culling *)user;
    const double across = 0.5 * COLUMNS / culling.view.focal, upwards = 0.5 * ROWS / culling.view.focal;
    const double error = culling.pixel_error * std::sqrt(1.0 + across * across + upwards * upwards);
    const double grown = error + 0.5;
    float least[2] = {1e30f, 1e30f}, most[2] = {-1e30f, -1e30f}, nearest = 1e30f;
    int beyond[5] = {0, 0, 0, 0, 0}; // corners, of a plane of the view frustum
    for (int corner = 0; corner < 8; ++corner) {
        const double at[3] = {corner & 1 ? high[0] : low[0], corner & 2 ? high[1] : low[1],
                              corner & 4 ? high[2] : low[2]};
        float place[4];
        clip(culling.view, at, place);
        beyond[4] += place[3] < (float)culling.view.near_depth;
        nearest = place[3] < nearest ? place[3] : nearest;
        for (int axis = 0; axis < 2; ++axis) {
            const float here = place[axis] / place[3];
            beyond[2 * axis] += place[axis] < -place[3];
            beyond[2 * axis + 1] += place[axis] > place[3];
            least[axis] = here < least[axis] ? here : least[axis];
            most[axis] = here > most[axis] ? here : most[axis];
        }
    }
    for (int plane = 0; plane < 5; ++plane)
        if (beyond[plane] == 8)
            return OCCLUDER_OUTSIDE;
    if (beyond[4])
        return OCCLUDER_VISIBLE;
    const float x = (float)(2.0 * grown / COLUMNS), y = (float)(2.0 * grown / ROWS);
    switch (culling.buffer->TestRect(
        least[0] - x, least[1] - y, most[0] + x, most[1] + y,
        nearest / (1.0f + (float)(error / culling.view.focal)))) {
    case MaskedOcclusionCulling::OCCLUDED: return OCCLUDER_HIDDEN;
    case MaskedOcclusionCulling::VIEW_CULLED: return OCCLUDER_OUTSIDE;
    default: return OCCLUDER_VISIBLE;
    }
}

int main(int count, char **given)
{
    static double memory[1 << 20]; // of the file: 8 MiB
    std::FILE *stream = count == 5 ? std::fopen(given[1], "rb") : nullptr;
    const size_t size = stream ? std::fread(memory, 1, sizeof memory, stream) : 0;
    occluder_tree tree;
    const occluder_tree_status status = occluder_tree_open(memory, size, &tree);
    if (status != OCCLUDER_TREE_OK)
        return std::fprintf(stderr, "usage: cull_intel scene.occs X Y Z (%s)\n", occluder_tree_text(status)), 1;
    const double eye[3] = {std::atof(given[2]), std::atof(given[3]), std::atof(given[4])};
    const double ahead[3] = {1, 0.1, 0.1};
    const double up[3] = {double(tree.up == 0), double(tree.up == 1), double(tree.up == 2)};
    Culling culling = {MaskedOcclusionCulling::Create(), occluder_look(eye, ahead, up, 60.0, 0.1, ROWS, COLUMNS),
                       tree.usual.pixel_error * ROWS / tree.rows, {}};
    culling.buffer->SetResolution(COLUMNS, ROWS);
    culling.buffer->SetNearClipPlane(0.1f);
    culling.buffer->ClearBuffer();
    std::vector<unsigned char> verdicts(tree.part_count);
    std::vector<double> room(occluder_tree_room(&tree) / sizeof(double) + 1);
    const occluder_rasteriser rasteriser = {&culling, draw, test};
    const occluder_limits limits = {culling.pixel_error, OCCLUDER_ALL};
    occluder_tree_cull(&tree, &culling.view, &limits, &rasteriser, room.data(), verdicts.data(), nullptr);
    for (uint32_t part = 0; part < tree.part_count; ++part)
        if (verdicts[part] == OCCLUDER_VISIBLE)
            std::puts(occluder_tree_name(&tree, tree.parts[part].object));
    MaskedOcclusionCulling::Destroy(culling.buffer);
    return 0;
}
