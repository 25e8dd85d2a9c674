// Times Intel's Masked Occlusion Culling for bench/engine.py: engine_intel FILE COLUMNS ROWS, of what
// engine.c's raster() reads.  Boxes are tested by the rectangle of their corners, grown by half a
// pixel, at the depth of the nearest.  Prints the medians of the fastest implementation here.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <new>
#include <vector>

#include <immintrin.h>

#include "MaskedOcclusionCulling.h"

static double now()
{
    return std::chrono::duration<double, std::milli>(
               std::chrono::steady_clock::now().time_since_epoch()).count();
}

static double median(std::vector<double> times)
{
    std::sort(times.begin(), times.end());
    return times[times.size() / 2];
}

// The eight corners of a box, two rows of a column-major matrix at a time; where it reaches before
// the near plane, nothing is told.
static bool rectangle(const float *m, const float *box, float near_depth, float *out, float *nearest)
{
    const __m128 c[4] = {_mm_loadu_ps(m), _mm_loadu_ps(m + 4), _mm_loadu_ps(m + 8), _mm_loadu_ps(m + 12)};
    __m128 least = _mm_set1_ps(1e30f), most = _mm_set1_ps(-1e30f), depth = _mm_set1_ps(1e30f);
    for (int corner = 0; corner < 8; ++corner) {
        __m128 at = c[3];
        for (int axis = 0; axis < 3; ++axis)
            at = _mm_add_ps(at, _mm_mul_ps(c[axis], _mm_set1_ps(box[axis + 3 * (corner >> axis & 1)])));
        const __m128 w = _mm_shuffle_ps(at, at, 0xff), place = _mm_div_ps(at, w);
        depth = _mm_min_ps(depth, w);
        least = _mm_min_ps(least, place);
        most = _mm_max_ps(most, place);
    }
    *nearest = _mm_cvtss_f32(depth);
    _mm_storel_pi((__m64 *)out, least);
    _mm_storel_pi((__m64 *)(out + 2), most);
    return *nearest >= near_depth;
}

int main(int count, char **arguments)
{
    if (count != 4)
        return 2;
    std::FILE *stream = std::fopen(arguments[1], "rb");
    double numbers[20];
    if (!stream || std::fread(numbers, 8, 20, stream) != 20)
        return 3;
    const size_t vertices = (size_t)numbers[16], triangles = (size_t)numbers[17], boxes = (size_t)numbers[18];
    std::vector<float> positions(3 * vertices), corners(6 * boxes);
    std::vector<unsigned> indices(3 * triangles);
    if (std::fread(positions.data(), 4, positions.size(), stream) != positions.size()
        || std::fread(corners.data(), 4, corners.size(), stream) != corners.size()
        || std::fread(indices.data(), 4, indices.size(), stream) != indices.size())
        return 3;
    std::fclose(stream);
    const unsigned columns = (unsigned)std::atoi(arguments[2]), rows = (unsigned)std::atoi(arguments[3]);
    const float near_depth = (float)numbers[13];
    const double across = 2.0 * numbers[12] / numbers[15], upwards = 2.0 * numbers[12] / numbers[14];
    float matrix[16] = {0};
    for (int axis = 0; axis < 3; ++axis) {
        matrix[4 * axis] = (float)(across * numbers[3 + axis]);
        matrix[4 * axis + 1] = (float)(upwards * numbers[6 + axis]);
        matrix[4 * axis + 2] = matrix[4 * axis + 3] = (float)numbers[9 + axis];
    }
    MaskedOcclusionCulling *culling = MaskedOcclusionCulling::Create();
    culling->SetResolution(columns, rows);
    culling->SetNearClipPlane(near_depth);
    std::vector<double> draws, tests;
    size_t hidden = 0;
    const float half_x = 1.0f / (float)columns, half_y = 1.0f / (float)rows;
    for (int repeat = 0; repeat < 101; ++repeat) {
        culling->ClearBuffer();
        const double begin = now();
        culling->RenderTriangles(
            positions.data(), indices.data(), (int)triangles, matrix, MaskedOcclusionCulling::BACKFACE_NONE,
            MaskedOcclusionCulling::CLIP_PLANE_ALL, MaskedOcclusionCulling::VertexLayout(12, 4, 8));
        const double middle = now();
        hidden = 0;
        for (size_t index = 0; index < boxes; ++index) {
            float out[4], nearest;
            if (!rectangle(matrix, &corners[6 * index], near_depth, out, &nearest)
                || out[2] < -1.0f || out[0] > 1.0f || out[3] < -1.0f || out[1] > 1.0f)
                continue;
            hidden += culling->TestRect(out[0] - half_x, out[1] - half_y, out[2] + half_x, out[3] + half_y,
                                        nearest) == MaskedOcclusionCulling::OCCLUDED;
        }
        draws.push_back(middle - begin);
        tests.push_back(now() - middle);
    }
    std::printf("%.4f %.4f %.6f\n", median(draws), median(tests), (double)hidden / (double)boxes);
    MaskedOcclusionCulling::Destroy(culling);
    return 0;
}
