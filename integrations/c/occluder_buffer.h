/* A small depth buffer on the processor: occluders go in, boxes are asked about.  C99 and C++, no
 * dependency, no allocation, one thread; SIMD where the compiler has it (AVX2, SSE2 and SSE4.1, 64-bit
 * NEON), plain C elsewhere, with the same results bit for bit unless the compiler fuses or reorders.
 *
 *     occluder_view view = occluder_look(eye, ahead, up, 60.0, 0.1, 180, 320);
 *     size_t bytes = occluder_buffer_bytes(180, 320, most_vertices);
 *     occluder_buffer buffer;
 *     occluder_buffer_init(&buffer, malloc(bytes), 180, 320, most_vertices, OCCLUDER_CENTRE);
 *     ...
 *     occluder_buffer_begin(&buffer, &view);                       // each frame
 *     occluder_buffer_draw(&buffer, &mesh, transform, error);      // what hides
 *     if (occluder_buffer_test(&buffer, low, high) != OCCLUDER_VISIBLE) ...   // what is hidden
 *
 * Transforms and boxes are relative to the eye, so that float is enough in map coordinates, too: take
 * the eye's position from theirs in double precision, and turn nothing.
 *
 * Pixels hold the reciprocal of the view depth: linear over the screen, larger is nearer, 0 is
 * nothing.  Tiles of 8 x 8 pixels know the least of theirs (Greene, Kass, Miller: Hierarchical Z-Buffer
 * Visibility, 1993, with one level in place of a pyramid), so that triangles and boxes behind what is
 * drawn are settled by a few tiles.  Triangles are drawn eight at a time up to their edges, and tile by
 * tile by them (Pineda: A Parallel Algorithm for Polygon Rasterization, 1988).
 *
 * Doubt goes against the occluder.  docs/culling.md states the margins as formulas:
 * - it is drawn `error` further away than it is, and the boxes in front of its tiles grow by what the
 *   error is on the screen;
 * - where a pixel counts by its centre (OCCLUDER_CENTRE), boxes grow by half a pixel on all sides;
 * - occluders that keep wholly inside of what they stand for are drawn into the pixels that lie wholly
 *   inside of them (OCCLUDER_INNER): with them nothing is ever hidden wrongly;
 * - what 24 bits round is paid for in depth and in pixels. */
#ifndef OCCLUDER_BUFFER_H
#define OCCLUDER_BUFFER_H

#include <float.h>
#include <math.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#if defined(__AVX2__)
#include <immintrin.h>
#elif defined(__SSE4_1__)
#include <smmintrin.h>
#elif defined(__SSE2__) || defined(_M_X64)
#include <emmintrin.h>
#elif defined(__aarch64__) || defined(_M_ARM64)
#include <arm_neon.h>
#endif

#ifdef __cplusplus
extern "C" {
#endif

/* --- What occluder_tree.h has, too */

#ifndef OCCLUDER_VIEW
#define OCCLUDER_VIEW

/* A perspective view.  Its axes are orthonormal; pixels are square. */
typedef struct {
    double eye[3];                       /* world */
    double right[3], up[3], ahead[3];
    double focal;                        /* pixels that a unit length takes at unit depth */
    double near_depth;                   /* nothing at less depth is drawn; above 0 */
    uint32_t rows, columns;              /* of the buffer */
} occluder_view;

typedef enum {
    OCCLUDER_VISIBLE = 0,                /* it may be seen */
    OCCLUDER_HIDDEN,                     /* what was drawn hides it */
    OCCLUDER_OUTSIDE                     /* of the view frustum */
} occluder_verdict;

/* A mesh of triangles; positions and indices are those of a file, where they lie. */
typedef struct {
    const float *positions;              /* x, y, z of each vertex */
    const void *indices;                 /* three a triangle, of index_bytes each */
    uint32_t vertex_count, triangle_count;
    uint32_t index_bytes;                /* 2 or 4 */
    const uint32_t *pairs;               /* two corners that lie opposite of an edge which two
                                            triangles share; for OCCLUDER_INNER, or NULL */
    uint32_t pair_count;
} occluder_mesh;

static inline double occluder_dot_(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* The view from `eye` along `ahead` with `up` upwards in the picture, of any lengths; `fov` is the
 * vertical field of view, degrees. */
static inline occluder_view occluder_look(
    const double eye[3], const double ahead[3], const double up[3], double fov, double near_depth,
    uint32_t rows, uint32_t columns)
{
    occluder_view view;
    const double forward = 1.0 / sqrt(occluder_dot_(ahead, ahead));
    double across;
    int axis;
    for (axis = 0; axis < 3; ++axis) {
        view.eye[axis] = eye[axis];
        view.ahead[axis] = ahead[axis] * forward;
    }
    for (axis = 0; axis < 3; ++axis)
        view.right[axis] = view.ahead[(axis + 1) % 3] * up[(axis + 2) % 3]
            - view.ahead[(axis + 2) % 3] * up[(axis + 1) % 3];
    across = 1.0 / sqrt(occluder_dot_(view.right, view.right));
    for (axis = 0; axis < 3; ++axis)
        view.right[axis] *= across;
    for (axis = 0; axis < 3; ++axis)
        view.up[axis] = view.right[(axis + 1) % 3] * view.ahead[(axis + 2) % 3]
            - view.right[(axis + 2) % 3] * view.ahead[(axis + 1) % 3];
    view.focal = 0.5 * rows / tan(fov * (3.14159265358979323846 / 360.0));
    view.near_depth = near_depth;
    view.rows = rows;
    view.columns = columns;
    return view;
}

#endif /* OCCLUDER_VIEW */

/* --- Eight floats at a time */

#if defined(__GNUC__) && !defined(__clang__)
#define OCCLUDER_UNROLL_ _Pragma("GCC unroll 8") /* as others do without being told */
#else
#define OCCLUDER_UNROLL_
#endif
#if defined(__GNUC__)
#define OCCLUDER_INLINE_ static inline __attribute__((always_inline))
#elif defined(_MSC_VER)
#define OCCLUDER_INLINE_ static __forceinline
#else
#define OCCLUDER_INLINE_ static inline
#endif

#if defined(__AVX2__)

typedef __m256 occluder_lanes;
typedef __m256 occluder_mask;           /* all bits of a lane, or none */

OCCLUDER_INLINE_ occluder_lanes o8_all_(float a) { return _mm256_set1_ps(a); }
OCCLUDER_INLINE_ occluder_lanes o8_load_(const float *at) { return _mm256_loadu_ps(at); }
OCCLUDER_INLINE_ void o8_store_(float *at, occluder_lanes a) { _mm256_storeu_ps(at, a); }
OCCLUDER_INLINE_ occluder_lanes o8_add_(occluder_lanes a, occluder_lanes b) { return _mm256_add_ps(a, b); }
OCCLUDER_INLINE_ occluder_lanes o8_sub_(occluder_lanes a, occluder_lanes b) { return _mm256_sub_ps(a, b); }
OCCLUDER_INLINE_ occluder_lanes o8_mul_(occluder_lanes a, occluder_lanes b) { return _mm256_mul_ps(a, b); }
OCCLUDER_INLINE_ occluder_lanes o8_div_(occluder_lanes a, occluder_lanes b) { return _mm256_div_ps(a, b); }
OCCLUDER_INLINE_ occluder_lanes o8_min_(occluder_lanes a, occluder_lanes b) { return _mm256_min_ps(a, b); }
OCCLUDER_INLINE_ occluder_lanes o8_max_(occluder_lanes a, occluder_lanes b) { return _mm256_max_ps(a, b); }
OCCLUDER_INLINE_ occluder_lanes o8_abs_(occluder_lanes a)
{
    return _mm256_andnot_ps(_mm256_set1_ps(-0.0f), a);
}
OCCLUDER_INLINE_ occluder_mask o8_less_(occluder_lanes a, occluder_lanes b)
{
    return _mm256_cmp_ps(a, b, _CMP_LT_OQ);
}
OCCLUDER_INLINE_ occluder_mask o8_not_more_(occluder_lanes a, occluder_lanes b)
{
    return _mm256_cmp_ps(a, b, _CMP_LE_OQ);
}
OCCLUDER_INLINE_ occluder_mask o8_and_(occluder_mask a, occluder_mask b) { return _mm256_and_ps(a, b); }
OCCLUDER_INLINE_ occluder_mask o8_or_(occluder_mask a, occluder_mask b) { return _mm256_or_ps(a, b); }
OCCLUDER_INLINE_ unsigned o8_bits_(occluder_mask a) { return (unsigned)_mm256_movemask_ps(a); }
/* a where the mask is set, else b */
OCCLUDER_INLINE_ occluder_lanes o8_choose_(occluder_mask mask, occluder_lanes a, occluder_lanes b)
{
    return _mm256_blendv_ps(b, a, mask);
}
OCCLUDER_INLINE_ occluder_lanes o8_pick_(const float *from, const int32_t *places)
{
    return _mm256_i32gather_ps(from, _mm256_loadu_si256((const __m256i *)(const void *)places), 4);
}
OCCLUDER_INLINE_ void o8_store_whole_(int32_t *at, occluder_lanes a)
{
    _mm256_storeu_si256((__m256i *)(void *)at, _mm256_cvttps_epi32(a));
}
OCCLUDER_INLINE_ occluder_lanes o8_cut_(occluder_lanes a) /* towards 0 */
{
    return _mm256_cvtepi32_ps(_mm256_cvttps_epi32(a));
}
OCCLUDER_INLINE_ float o8_least_(occluder_lanes a)
{
    __m128 b = _mm_min_ps(_mm256_castps256_ps128(a), _mm256_extractf128_ps(a, 1));
    b = _mm_min_ps(b, _mm_movehl_ps(b, b));
    return _mm_cvtss_f32(_mm_min_ss(b, _mm_shuffle_ps(b, b, 1)));
}
OCCLUDER_INLINE_ float o8_most_(occluder_lanes a)
{
    __m128 b = _mm_max_ps(_mm256_castps256_ps128(a), _mm256_extractf128_ps(a, 1));
    b = _mm_max_ps(b, _mm_movehl_ps(b, b));
    return _mm_cvtss_f32(_mm_max_ss(b, _mm_shuffle_ps(b, b, 1)));
}
OCCLUDER_INLINE_ void o8_least4_(
    occluder_lanes a, occluder_lanes b, occluder_lanes c, occluder_lanes d, float least[4])
{
    const __m128 p = _mm_min_ps(_mm256_castps256_ps128(a), _mm256_extractf128_ps(a, 1));
    const __m128 q = _mm_min_ps(_mm256_castps256_ps128(b), _mm256_extractf128_ps(b, 1));
    const __m128 r = _mm_min_ps(_mm256_castps256_ps128(c), _mm256_extractf128_ps(c, 1));
    const __m128 t = _mm_min_ps(_mm256_castps256_ps128(d), _mm256_extractf128_ps(d, 1));
    const __m128 x = _mm_min_ps(_mm_unpacklo_ps(p, q), _mm_unpackhi_ps(p, q));
    const __m128 y = _mm_min_ps(_mm_unpacklo_ps(r, t), _mm_unpackhi_ps(r, t));
    _mm_storeu_ps(least, _mm_min_ps(_mm_movelh_ps(x, y), _mm_movehl_ps(y, x)));
}

#elif defined(__SSE2__) || defined(_M_X64)

typedef struct { __m128 a, b; } occluder_lanes;
typedef occluder_lanes occluder_mask;

#define O8_EACH_(name, operation)                                                               \
    OCCLUDER_INLINE_ occluder_lanes name(occluder_lanes x, occluder_lanes y)                       \
    {                                                                                           \
        occluder_lanes z;                                                                       \
        z.a = operation(x.a, y.a);                                                              \
        z.b = operation(x.b, y.b);                                                              \
        return z;                                                                               \
    }
O8_EACH_(o8_add_, _mm_add_ps)
O8_EACH_(o8_sub_, _mm_sub_ps)
O8_EACH_(o8_mul_, _mm_mul_ps)
O8_EACH_(o8_div_, _mm_div_ps)
O8_EACH_(o8_min_, _mm_min_ps)
O8_EACH_(o8_max_, _mm_max_ps)
O8_EACH_(o8_less_, _mm_cmplt_ps)
O8_EACH_(o8_not_more_, _mm_cmple_ps)
O8_EACH_(o8_and_, _mm_and_ps)
O8_EACH_(o8_or_, _mm_or_ps)
O8_EACH_(o8_but_, _mm_andnot_ps)
#undef O8_EACH_

OCCLUDER_INLINE_ occluder_lanes o8_all_(float a)
{
    occluder_lanes z;
    z.a = z.b = _mm_set1_ps(a);
    return z;
}
OCCLUDER_INLINE_ occluder_lanes o8_load_(const float *at)
{
    occluder_lanes z;
    z.a = _mm_loadu_ps(at);
    z.b = _mm_loadu_ps(at + 4);
    return z;
}
OCCLUDER_INLINE_ void o8_store_(float *at, occluder_lanes x)
{
    _mm_storeu_ps(at, x.a);
    _mm_storeu_ps(at + 4, x.b);
}
OCCLUDER_INLINE_ occluder_lanes o8_abs_(occluder_lanes x) { return o8_but_(o8_all_(-0.0f), x); }
OCCLUDER_INLINE_ unsigned o8_bits_(occluder_mask x)
{
    return (unsigned)_mm_movemask_ps(x.a) | (unsigned)_mm_movemask_ps(x.b) << 4;
}
OCCLUDER_INLINE_ occluder_lanes o8_choose_(occluder_mask mask, occluder_lanes x, occluder_lanes y)
{
    occluder_lanes z;
#if defined(__SSE4_1__)
    z.a = _mm_blendv_ps(y.a, x.a, mask.a);
    z.b = _mm_blendv_ps(y.b, x.b, mask.b);
#else
    z.a = _mm_or_ps(_mm_and_ps(mask.a, x.a), _mm_andnot_ps(mask.a, y.a));
    z.b = _mm_or_ps(_mm_and_ps(mask.b, x.b), _mm_andnot_ps(mask.b, y.b));
#endif
    return z;
}
OCCLUDER_INLINE_ occluder_lanes o8_pick_(const float *from, const int32_t *places)
{
    occluder_lanes z;
    z.a = _mm_setr_ps(from[places[0]], from[places[1]], from[places[2]], from[places[3]]);
    z.b = _mm_setr_ps(from[places[4]], from[places[5]], from[places[6]], from[places[7]]);
    return z;
}
OCCLUDER_INLINE_ void o8_store_whole_(int32_t *at, occluder_lanes x)
{
    _mm_storeu_si128((__m128i *)(void *)at, _mm_cvttps_epi32(x.a));
    _mm_storeu_si128((__m128i *)(void *)(at + 4), _mm_cvttps_epi32(x.b));
}
OCCLUDER_INLINE_ occluder_lanes o8_cut_(occluder_lanes x)
{
    x.a = _mm_cvtepi32_ps(_mm_cvttps_epi32(x.a));
    x.b = _mm_cvtepi32_ps(_mm_cvttps_epi32(x.b));
    return x;
}
OCCLUDER_INLINE_ float o8_least_(occluder_lanes a)
{
    __m128 b = _mm_min_ps(a.a, a.b);
    b = _mm_min_ps(b, _mm_movehl_ps(b, b));
    return _mm_cvtss_f32(_mm_min_ss(b, _mm_shuffle_ps(b, b, 1)));
}
OCCLUDER_INLINE_ float o8_most_(occluder_lanes a)
{
    __m128 b = _mm_max_ps(a.a, a.b);
    b = _mm_max_ps(b, _mm_movehl_ps(b, b));
    return _mm_cvtss_f32(_mm_max_ss(b, _mm_shuffle_ps(b, b, 1)));
}
OCCLUDER_INLINE_ void o8_least4_(
    occluder_lanes a, occluder_lanes b, occluder_lanes c, occluder_lanes d, float least[4])
{
    const __m128 p = _mm_min_ps(a.a, a.b);
    const __m128 q = _mm_min_ps(b.a, b.b);
    const __m128 r = _mm_min_ps(c.a, c.b);
    const __m128 t = _mm_min_ps(d.a, d.b);
    const __m128 x = _mm_min_ps(_mm_unpacklo_ps(p, q), _mm_unpackhi_ps(p, q));
    const __m128 y = _mm_min_ps(_mm_unpacklo_ps(r, t), _mm_unpackhi_ps(r, t));
    _mm_storeu_ps(least, _mm_min_ps(_mm_movelh_ps(x, y), _mm_movehl_ps(y, x)));
}

#elif defined(__aarch64__) || defined(_M_ARM64)

typedef struct { float32x4_t a, b; } occluder_lanes;
typedef struct { uint32x4_t a, b; } occluder_mask;

#define O8_EACH_(name, operation)                                                               \
    OCCLUDER_INLINE_ occluder_lanes name(occluder_lanes x, occluder_lanes y)                       \
    {                                                                                           \
        occluder_lanes z;                                                                       \
        z.a = operation(x.a, y.a);                                                              \
        z.b = operation(x.b, y.b);                                                              \
        return z;                                                                               \
    }
O8_EACH_(o8_add_, vaddq_f32)
O8_EACH_(o8_sub_, vsubq_f32)
O8_EACH_(o8_mul_, vmulq_f32)
O8_EACH_(o8_div_, vdivq_f32)
O8_EACH_(o8_min_, vminq_f32)
O8_EACH_(o8_max_, vmaxq_f32)
#undef O8_EACH_

OCCLUDER_INLINE_ occluder_lanes o8_all_(float a)
{
    occluder_lanes z;
    z.a = z.b = vdupq_n_f32(a);
    return z;
}
OCCLUDER_INLINE_ occluder_lanes o8_load_(const float *at)
{
    occluder_lanes z;
    z.a = vld1q_f32(at);
    z.b = vld1q_f32(at + 4);
    return z;
}
OCCLUDER_INLINE_ void o8_store_(float *at, occluder_lanes x)
{
    vst1q_f32(at, x.a);
    vst1q_f32(at + 4, x.b);
}
OCCLUDER_INLINE_ occluder_lanes o8_abs_(occluder_lanes x)
{
    x.a = vabsq_f32(x.a);
    x.b = vabsq_f32(x.b);
    return x;
}
OCCLUDER_INLINE_ occluder_mask o8_less_(occluder_lanes x, occluder_lanes y)
{
    occluder_mask z;
    z.a = vcltq_f32(x.a, y.a);
    z.b = vcltq_f32(x.b, y.b);
    return z;
}
OCCLUDER_INLINE_ occluder_mask o8_not_more_(occluder_lanes x, occluder_lanes y)
{
    occluder_mask z;
    z.a = vcleq_f32(x.a, y.a);
    z.b = vcleq_f32(x.b, y.b);
    return z;
}
OCCLUDER_INLINE_ occluder_mask o8_and_(occluder_mask x, occluder_mask y)
{
    x.a = vandq_u32(x.a, y.a);
    x.b = vandq_u32(x.b, y.b);
    return x;
}
OCCLUDER_INLINE_ occluder_mask o8_or_(occluder_mask x, occluder_mask y)
{
    x.a = vorrq_u32(x.a, y.a);
    x.b = vorrq_u32(x.b, y.b);
    return x;
}
OCCLUDER_INLINE_ unsigned o8_bits_(occluder_mask x)
{
    static const uint32_t first[4] = {1, 2, 4, 8};
    const uint32x4_t place = vld1q_u32(first);
    return vaddvq_u32(vandq_u32(x.a, place)) | vaddvq_u32(vandq_u32(x.b, place)) << 4;
}
OCCLUDER_INLINE_ occluder_lanes o8_choose_(occluder_mask mask, occluder_lanes x, occluder_lanes y)
{
    x.a = vbslq_f32(mask.a, x.a, y.a);
    x.b = vbslq_f32(mask.b, x.b, y.b);
    return x;
}
OCCLUDER_INLINE_ occluder_lanes o8_pick_(const float *from, const int32_t *places)
{
    float found[8];
    int lane;
    for (lane = 0; lane < 8; ++lane)
        found[lane] = from[places[lane]];
    return o8_load_(found);
}
OCCLUDER_INLINE_ void o8_store_whole_(int32_t *at, occluder_lanes x)
{
    vst1q_s32(at, vcvtq_s32_f32(x.a));
    vst1q_s32(at + 4, vcvtq_s32_f32(x.b));
}
OCCLUDER_INLINE_ occluder_lanes o8_cut_(occluder_lanes x)
{
    x.a = vcvtq_f32_s32(vcvtq_s32_f32(x.a));
    x.b = vcvtq_f32_s32(vcvtq_s32_f32(x.b));
    return x;
}
OCCLUDER_INLINE_ float o8_least_(occluder_lanes a)
{
    return vminvq_f32(vminq_f32(a.a, a.b));
}
OCCLUDER_INLINE_ float o8_most_(occluder_lanes a)
{
    return vmaxvq_f32(vmaxq_f32(a.a, a.b));
}
OCCLUDER_INLINE_ void o8_least4_(
    occluder_lanes a, occluder_lanes b, occluder_lanes c, occluder_lanes d, float least[4])
{
    const float32x4_t p = vpminq_f32(vminq_f32(a.a, a.b), vminq_f32(b.a, b.b));
    const float32x4_t q = vpminq_f32(vminq_f32(c.a, c.b), vminq_f32(d.a, d.b));
    vst1q_f32(least, vpminq_f32(p, q));
}

#else

typedef struct { float v[8]; } occluder_lanes;
typedef struct { uint32_t v[8]; } occluder_mask;

#define O8_EACH_(name, kind, result)                                                            \
    OCCLUDER_INLINE_ kind name(occluder_lanes x, occluder_lanes y)                                 \
    {                                                                                           \
        kind z;                                                                                 \
        int lane;                                                                               \
        for (lane = 0; lane < 8; ++lane) {                                                      \
            const float a = x.v[lane], b = y.v[lane];                                           \
            z.v[lane] = result;                                                                 \
        }                                                                                       \
        return z;                                                                               \
    }
O8_EACH_(o8_add_, occluder_lanes, a + b)
O8_EACH_(o8_sub_, occluder_lanes, a - b)
O8_EACH_(o8_mul_, occluder_lanes, a * b)
O8_EACH_(o8_div_, occluder_lanes, a / b)
O8_EACH_(o8_min_, occluder_lanes, a < b ? a : b)
O8_EACH_(o8_max_, occluder_lanes, a > b ? a : b)
O8_EACH_(o8_less_, occluder_mask, a < b)
O8_EACH_(o8_not_more_, occluder_mask, a <= b)
#undef O8_EACH_

OCCLUDER_INLINE_ occluder_lanes o8_all_(float a)
{
    occluder_lanes z;
    int lane;
    for (lane = 0; lane < 8; ++lane)
        z.v[lane] = a;
    return z;
}
OCCLUDER_INLINE_ occluder_lanes o8_load_(const float *at)
{
    occluder_lanes z;
    memcpy(z.v, at, sizeof z.v);
    return z;
}
OCCLUDER_INLINE_ void o8_store_(float *at, occluder_lanes x) { memcpy(at, x.v, sizeof x.v); }
OCCLUDER_INLINE_ occluder_lanes o8_abs_(occluder_lanes x)
{
    int lane;
    for (lane = 0; lane < 8; ++lane)
        x.v[lane] = x.v[lane] < 0.0f ? -x.v[lane] : x.v[lane];
    return x;
}
OCCLUDER_INLINE_ occluder_mask o8_and_(occluder_mask x, occluder_mask y)
{
    int lane;
    for (lane = 0; lane < 8; ++lane)
        x.v[lane] &= y.v[lane];
    return x;
}
OCCLUDER_INLINE_ occluder_mask o8_or_(occluder_mask x, occluder_mask y)
{
    int lane;
    for (lane = 0; lane < 8; ++lane)
        x.v[lane] |= y.v[lane];
    return x;
}
OCCLUDER_INLINE_ unsigned o8_bits_(occluder_mask x)
{
    unsigned bits = 0;
    int lane;
    for (lane = 0; lane < 8; ++lane)
        bits |= (unsigned)x.v[lane] << lane;
    return bits;
}
OCCLUDER_INLINE_ occluder_lanes o8_choose_(occluder_mask mask, occluder_lanes x, occluder_lanes y)
{
    int lane;
    for (lane = 0; lane < 8; ++lane)
        x.v[lane] = mask.v[lane] ? x.v[lane] : y.v[lane];
    return x;
}
OCCLUDER_INLINE_ occluder_lanes o8_pick_(const float *from, const int32_t *places)
{
    occluder_lanes z;
    int lane;
    for (lane = 0; lane < 8; ++lane)
        z.v[lane] = from[places[lane]];
    return z;
}
OCCLUDER_INLINE_ void o8_store_whole_(int32_t *at, occluder_lanes x)
{
    int lane;
    for (lane = 0; lane < 8; ++lane)
        at[lane] = (int32_t)x.v[lane];
}
OCCLUDER_INLINE_ occluder_lanes o8_cut_(occluder_lanes x)
{
    int lane;
    for (lane = 0; lane < 8; ++lane)
        x.v[lane] = (float)(int32_t)x.v[lane];
    return x;
}
OCCLUDER_INLINE_ float o8_least_(occluder_lanes a)
{
    float found = a.v[0];
    int lane;
    for (lane = 1; lane < 8; ++lane)
        found = a.v[lane] < found ? a.v[lane] : found;
    return found;
}
OCCLUDER_INLINE_ float o8_most_(occluder_lanes a)
{
    float found = a.v[0];
    int lane;
    for (lane = 1; lane < 8; ++lane)
        found = a.v[lane] > found ? a.v[lane] : found;
    return found;
}
OCCLUDER_INLINE_ void o8_least4_(
    occluder_lanes a, occluder_lanes b, occluder_lanes c, occluder_lanes d, float least[4])
{
    least[0] = o8_least_(a);
    least[1] = o8_least_(b);
    least[2] = o8_least_(c);
    least[3] = o8_least_(d);
}

#endif

OCCLUDER_INLINE_ occluder_lanes o8_floor_(occluder_lanes a)
{
    const occluder_lanes cut = o8_cut_(a);
    return o8_choose_(o8_less_(a, cut), o8_sub_(cut, o8_all_(1.0f)), cut);
}

OCCLUDER_INLINE_ occluder_lanes o8_ceil_(occluder_lanes a)
{
    const occluder_lanes cut = o8_cut_(a);
    return o8_choose_(o8_less_(cut, a), o8_add_(cut, o8_all_(1.0f)), cut);
}

/* 0, 1, 2, 3, 4, 5, 6, 7 */
OCCLUDER_INLINE_ occluder_lanes o8_steps_(void)
{
    static const float steps[8] = {0, 1, 2, 3, 4, 5, 6, 7};
    return o8_load_(steps);
}

/* --- The buffer */

typedef enum {
    OCCLUDER_CENTRE = 0,   /* an occluder is drawn into pixels whose centre is in it */
    OCCLUDER_INNER         /* into those that lie wholly in it; for what keeps inside */
} occluder_coverage;

typedef struct {
    uint32_t rows, columns;
    uint32_t tile_rows, tile_columns;    /* of 8 x 8 pixels */
    uint32_t stride;                     /* floats from a row of `depth` to the next */
    uint32_t most_vertices;              /* of a mesh that is drawn */
    occluder_coverage coverage;
    float margin;                        /* pixels that boxes grow by at least, for centres */
    float slack;                         /* pixels that rounding may move anything by */
    float *depth;                        /* reciprocal; past the screen FLT_MAX */
    float *farthest;                     /* of each tile; of a stale one a lower bound */
    float *blur;                         /* pixels that an occluder in the tile may be off */
    float *stale;                        /* 1 where a tile was drawn to since */
    float *x, *y, *z;                    /* of the vertices of the mesh that is drawn last: pixels
                                            with centres at whole numbers, and depth, or -1 */
    occluder_view view;
    double screen[9];                    /* takes world axes to pixels times depth, and depth */
    float rows_[9];                      /* the same */
} occluder_buffer;

enum { OCCLUDER_TILE = 8 };

#define OCCLUDER_ROUNDED_ (1.0f / 1048576.0f)       /* 2^-20: what a few roundings take */
#define OCCLUDER_NEARER_ (1.0f + 1.0f / 1048576.0f)
#define OCCLUDER_FARTHER_ (1.0f - 1.0f / 1048576.0f)
#define OCCLUDER_LARGEST_ 1e30f                     /* of a length; products have to fit */

static inline uint32_t occluder_tiles_(uint32_t pixels)
{
    return pixels / OCCLUDER_TILE + (pixels % OCCLUDER_TILE != 0);
}

/* How many bytes of memory a buffer takes; meshes of up to so many vertices can be drawn into it. */
static inline size_t occluder_buffer_bytes(uint32_t rows, uint32_t columns, uint32_t most_vertices)
{
    const size_t tiles = (size_t)occluder_tiles_(rows) * occluder_tiles_(columns);
    return sizeof(float)
        * (tiles * (OCCLUDER_TILE * OCCLUDER_TILE + 3) + 3 * (size_t)most_vertices + OCCLUDER_TILE);
}

/* Forget what was drawn. */
static inline void occluder_buffer_clear(occluder_buffer *buffer)
{
    const uint32_t height = buffer->tile_rows * OCCLUDER_TILE;
    const size_t tiles = (size_t)buffer->tile_rows * buffer->tile_columns;
    uint32_t row, column;
    memset(buffer->depth, 0, sizeof(float) * buffer->stride * buffer->rows);
    for (row = 0; row < buffer->rows; ++row)
        for (column = buffer->columns; column < buffer->stride; ++column)
            buffer->depth[(size_t)row * buffer->stride + column] = FLT_MAX;
    for (; row < height; ++row)
        for (column = 0; column < buffer->stride; ++column)
            buffer->depth[(size_t)row * buffer->stride + column] = FLT_MAX;
    memset(buffer->farthest, 0, sizeof(float) * tiles);
    memset(buffer->blur, 0, sizeof(float) * tiles);
    memset(buffer->stale, 0, sizeof(float) * tiles);
}

/* `memory` of occluder_buffer_bytes(), aligned for float, has to stay where it is; each side has 1
 * to 16,384 pixels. */
static inline void occluder_buffer_init(
    occluder_buffer *buffer, void *memory, uint32_t rows, uint32_t columns, uint32_t most_vertices,
    occluder_coverage coverage)
{
    const size_t tiles = (size_t)occluder_tiles_(rows) * occluder_tiles_(columns);
    const uint32_t longest = rows > columns ? rows : columns;
    memset(buffer, 0, sizeof *buffer);
    buffer->rows = rows;
    buffer->columns = columns;
    buffer->tile_rows = occluder_tiles_(rows);
    buffer->tile_columns = occluder_tiles_(columns);
    buffer->stride = buffer->tile_columns * OCCLUDER_TILE;
    buffer->most_vertices = most_vertices;
    buffer->coverage = coverage;
    buffer->margin = coverage == OCCLUDER_CENTRE ? 0.5f : 0.0f;
    buffer->slack = (float)longest / 262144.0f;
    buffer->depth = (float *)memory;
    buffer->farthest = buffer->depth + tiles * OCCLUDER_TILE * OCCLUDER_TILE;
    buffer->blur = buffer->farthest + tiles;
    buffer->stale = buffer->blur + tiles;
    buffer->x = buffer->stale + tiles;
    buffer->y = buffer->x + most_vertices;
    buffer->z = buffer->y + most_vertices;
    occluder_buffer_clear(buffer);
}

/* Look from another place; what was drawn stays, and belongs to the view before. */
static inline void occluder_buffer_look(occluder_buffer *buffer, const occluder_view *view)
{
    int axis;
    buffer->view = *view;
    for (axis = 0; axis < 3; ++axis) {
        buffer->screen[axis] = view->focal * view->right[axis]
            + 0.5 * buffer->columns * view->ahead[axis];
        buffer->screen[3 + axis] = -view->focal * view->up[axis]
            + 0.5 * buffer->rows * view->ahead[axis];
        buffer->screen[6 + axis] = view->ahead[axis];
    }
    for (axis = 0; axis < 9; ++axis)
        buffer->rows_[axis] = (float)buffer->screen[axis];
}

/* Begin a frame: nothing is drawn as yet. */
static inline void occluder_buffer_begin(occluder_buffer *buffer, const occluder_view *view)
{
    occluder_buffer_look(buffer, view);
    occluder_buffer_clear(buffer);
}

/* Whether none of a tile's pixels is farther than a reciprocal depth, or all are nearer; a stale tile's
 * least is found anew.  All lanes decide at once: a branch need not wait for the least of them. */
OCCLUDER_INLINE_ int occluder_buffer_reaches_(
    occluder_buffer *buffer, uint32_t row, uint32_t column, float value, int nearer)
{
    const size_t tile = (size_t)row * buffer->tile_columns + column;
    if (buffer->stale[tile] != 0.0f) {
        const size_t stride = buffer->stride;
        const float *at = buffer->depth + (size_t)OCCLUDER_TILE * (row * stride + column);
        const float *below = at + 4 * stride;
        const occluder_lanes least = o8_min_(
            o8_min_(o8_min_(o8_load_(at), o8_load_(at + stride)),
                    o8_min_(o8_load_(at + 2 * stride), o8_load_(at + 3 * stride))),
            o8_min_(o8_min_(o8_load_(below), o8_load_(below + stride)),
                    o8_min_(o8_load_(below + 2 * stride), o8_load_(below + 3 * stride))));
        const occluder_lanes limit = o8_all_(value);
        buffer->farthest[tile] = o8_least_(least);
        buffer->stale[tile] = 0.0f;
        return !o8_bits_(nearer ? o8_not_more_(least, limit) : o8_less_(least, limit));
    }
    return nearer ? buffer->farthest[tile] > value : buffer->farthest[tile] >= value;
}

/* --- Drawing */

/* A convex region of the screen: inside of half planes a (x - px) + b (y - py) + c >= 0, whose
 * numbers stand `step` floats apart; pixels from (left, top) to (right, bottom).  There are 3 of them
 * or 8, of which some may hold everything. */
typedef struct {
    const float *a, *b, *c, *px, *py;
    const float *out, *in;               /* what a half plane's value may grow or fall by in a tile */
    size_t step;
    int32_t left, top, right, bottom;
} occluder_region_;

/* Reciprocal depth `value` at (x, y), with slopes, and never less than `least`. */
typedef struct {
    float slope_x, slope_y, value, x, y, least;
} occluder_plane_;

OCCLUDER_INLINE_ float occluder_plane_at_(const occluder_plane_ *plane, float x, float y)
{
    return (plane->value + plane->slope_x * (x - plane->x)) + plane->slope_y * (y - plane->y);
}

/* Draws a region of `count` half planes as far as it is nearer than what is there.  `nearest` is no
 * less than any of its values.  Where `other` is given, the farther of both planes holds. */
OCCLUDER_INLINE_ void occluder_buffer_fill_(
    occluder_buffer *buffer, const occluder_region_ *region, const int count,
    const occluder_plane_ *plane, const occluder_plane_ *other, float nearest, float blur)
{
    const occluder_lanes steps = o8_steps_(), zero = o8_all_(0.0f);
    const occluder_lanes rise = o8_mul_(o8_all_(plane->slope_x), steps);
    const occluder_lanes least = o8_all_(plane->least);
    const float slope_y = plane->slope_y;
    const int32_t low_x = region->left, high_x = region->right;
    const int32_t low_y = region->top, high_y = region->bottom;
    const size_t stride = buffer->stride, tile_columns = buffer->tile_columns;
    occluder_lanes across[8];
    float a[8], b[8], edge[8];
    int32_t row, column;
    int k;
    OCCLUDER_UNROLL_
    for (k = 0; k < count; ++k) {
        a[k] = region->a[region->step * (size_t)k];
        b[k] = region->b[region->step * (size_t)k];
        across[k] = o8_mul_(o8_all_(a[k]), steps);
    }
    for (row = low_y >> 3; row <= high_y >> 3; ++row)
        for (column = low_x >> 3; column <= high_x >> 3; ++column) {
            const size_t tile = (size_t)row * tile_columns + (size_t)column;
            const float x = (float)(8 * column), y = (float)(8 * row);
            const int32_t first = low_y > 8 * row ? low_y - 8 * row : 0;
            const int32_t last = high_y < 8 * row + 7 ? high_y - 8 * row : 7;
            const int32_t left = low_x - 8 * column, right = high_x - 8 * column;
            float *at = buffer->depth + (size_t)(8 * row + first) * stride + 8 * (size_t)column;
            occluder_lanes here, there, bound, within[8];
            int32_t line;
            int whole = left <= 0 && right >= 7, beside = 0;
            if (buffer->farthest[tile] >= nearest)
                continue;
            OCCLUDER_UNROLL_
            for (k = 0; k < count; ++k) {
                const size_t place = region->step * (size_t)k;
                edge[k] = region->c[place]
                    + (a[k] * (x - region->px[place]) + b[k] * (y - region->py[place]));
                beside |= edge[k] + region->out[place] < 0.0f;
                whole &= edge[k] + region->in[place] >= 0.0f;
            }
            if (beside
                || occluder_buffer_reaches_(
                    buffer, (uint32_t)row, (uint32_t)column, nearest, 0))
                continue;
            buffer->stale[tile] = 1.0f;
            if (blur > buffer->blur[tile])
                buffer->blur[tile] = blur;
            here = o8_add_(
                o8_all_(occluder_plane_at_(plane, x, y) + slope_y * (float)first), rise);
            there = here;
            if (other)
                there = o8_add_(
                    o8_all_(occluder_plane_at_(other, x, y) + other->slope_y * (float)first),
                    o8_mul_(o8_all_(other->slope_x), steps));
            bound = o8_min_(
                o8_sub_(steps, o8_all_((float)left)), o8_sub_(o8_all_((float)right), steps));
            OCCLUDER_UNROLL_
            for (k = 0; k < count; ++k)
                within[k] = o8_add_(o8_all_(edge[k] + b[k] * (float)first), across[k]);
            for (line = first; line <= last; ++line, at += stride) {
                const occluder_lanes old = o8_load_(at);
                occluder_lanes depth = o8_max_(here, least);
                if (other) {
                    depth = o8_min_(depth, o8_max_(there, o8_all_(other->least)));
                    there = o8_add_(there, o8_all_(other->slope_y));
                }
                here = o8_add_(here, o8_all_(slope_y));
                depth = o8_max_(depth, old);
                if (!whole) {
                    occluder_lanes inside = bound;
                    OCCLUDER_UNROLL_
                    for (k = 0; k < count; ++k) {
                        inside = o8_min_(inside, within[k]);
                        within[k] = o8_add_(within[k], o8_all_(b[k]));
                    }
                    depth = o8_choose_(o8_less_(inside, zero), old, depth);
                }
                o8_store_(at, depth);
            }
        }
}

/* Draws eight triangles, those of the bits of `chosen`: pixels and depths of their corners. */
static inline void occluder_buffer_eight_(
    occluder_buffer *buffer, occluder_lanes corner[3][3], occluder_lanes error, unsigned chosen)
{
    const int inner = buffer->coverage == OCCLUDER_INNER;
    const occluder_lanes zero = o8_all_(0.0f), one = o8_all_(1.0f);
    const occluder_lanes seven = o8_all_(7.0f), eight = o8_all_(8.0f);
    const occluder_lanes slack = o8_all_(buffer->slack);
    const occluder_lanes inset = o8_all_(inner ? 0.5f + buffer->slack : -buffer->slack);
    const occluder_lanes ax = corner[0][0], ay = corner[0][1], az = corner[0][2];
    const occluder_lanes bx = corner[1][0], by = corner[1][1], bz = corner[1][2];
    const occluder_lanes cx = corner[2][0], cy = corner[2][1], cz = corner[2][2];
    const occluder_lanes least_x = o8_min_(ax, o8_min_(bx, cx)), most_x = o8_max_(ax, o8_max_(bx, cx));
    const occluder_lanes least_y = o8_min_(ay, o8_min_(by, cy)), most_y = o8_max_(ay, o8_max_(by, cy));
    const occluder_lanes depth = o8_min_(az, o8_min_(bz, cz));
    const occluder_lanes nearest = o8_div_(o8_all_(OCCLUDER_NEARER_), o8_add_(depth, error));
    const occluder_lanes low_x = o8_max_(o8_ceil_(o8_add_(least_x, inset)), zero);
    const occluder_lanes low_y = o8_max_(o8_ceil_(o8_add_(least_y, inset)), zero);
    const occluder_lanes high_x = o8_min_(
        o8_floor_(o8_sub_(most_x, inset)), o8_all_((float)(buffer->columns - 1)));
    const occluder_lanes high_y = o8_min_(
        o8_floor_(o8_sub_(most_y, inset)), o8_all_((float)(buffer->rows - 1)));
    int32_t left[8], top[8], right[8], bottom[8];
    float near_[8];
    unsigned open = 0;
    int lane;
    /* Of a region without a centre of a pixel the low end is above the high one. */
    chosen &= ~(o8_bits_(o8_less_(high_x, low_x)) | o8_bits_(o8_less_(high_y, low_y)));
    if (!chosen)
        return;
    o8_store_whole_(left, low_x);
    o8_store_whole_(top, low_y);
    o8_store_whole_(right, high_x);
    o8_store_whole_(bottom, high_y);
    o8_store_(near_, nearest);
    for (lane = 0; lane < 8; ++lane) {
        int32_t row, column;
        int behind = 1;
        if (!(chosen >> lane & 1))
            continue;
        for (row = top[lane] >> 3; behind && row <= bottom[lane] >> 3; ++row)
            for (column = left[lane] >> 3; behind && column <= right[lane] >> 3; ++column) {
                const size_t tile = (size_t)row * buffer->tile_columns + (size_t)column;
                behind = buffer->farthest[tile] >= near_[lane]
                    || occluder_buffer_reaches_(
                        buffer, (uint32_t)row, (uint32_t)column, near_[lane], 0);
            }
        if (!behind)
            open |= 1u << lane;
    }
    if (open) {
        const occluder_lanes p = o8_div_(one, o8_add_(az, error));
        const occluder_lanes q = o8_div_(one, o8_add_(bz, error));
        const occluder_lanes r = o8_div_(one, o8_add_(cz, error));
        const occluder_lanes ux = o8_sub_(bx, ax), uy = o8_sub_(by, ay);
        const occluder_lanes vx = o8_sub_(cx, ax), vy = o8_sub_(cy, ay);
        const occluder_lanes area = o8_sub_(o8_mul_(ux, vy), o8_mul_(vx, uy));
        const occluder_lanes wide = o8_sub_(most_x, least_x), high = o8_sub_(most_y, least_y);
        const occluder_mask turned = o8_less_(area, zero);
        /* Thinner than what rounding may move its corners it has no plane. */
        const occluder_mask thick = o8_less_(o8_mul_(o8_max_(wide, high), slack), o8_abs_(area));
        const occluder_lanes share = o8_div_(one, o8_choose_(thick, area, one));
        const occluder_lanes dq = o8_sub_(q, p), dr = o8_sub_(r, p);
        const occluder_lanes slope_x = o8_mul_(
            o8_sub_(o8_mul_(dq, vy), o8_mul_(dr, uy)), share);
        const occluder_lanes slope_y = o8_mul_(
            o8_sub_(o8_mul_(dr, ux), o8_mul_(dq, vx)), share);
        const occluder_lanes steep_x = o8_abs_(slope_x), steep_y = o8_abs_(slope_y);
        const occluder_lanes slender = o8_add_(one, o8_abs_(o8_mul_(o8_mul_(wide, high), share)));
        const occluder_lanes spread = o8_add_(
            o8_mul_(steep_x, o8_add_(wide, eight)), o8_mul_(steep_y, o8_add_(high, eight)));
        const occluder_lanes push = o8_add_(
            o8_mul_(o8_all_(OCCLUDER_ROUNDED_), o8_add_(nearest, o8_mul_(spread, slender))),
            o8_mul_(o8_all_(inner ? 0.5f + 2.0f * buffer->slack : 2.0f * buffer->slack),
                    o8_add_(steep_x, steep_y)));
        const occluder_lanes least = o8_mul_(
            o8_min_(p, o8_min_(q, r)), o8_all_(OCCLUDER_FARTHER_));
        const occluder_lanes blur = o8_div_(
            o8_mul_(error, o8_all_((float)buffer->view.focal * OCCLUDER_NEARER_)), depth);
        float a[3][8], b[3][8], c[3][8], x[3][8], y[3][8], out[3][8], in[3][8];
        float sx[8], sy[8], value[8], far_[8], blurred[8];
        int k;
        open &= o8_bits_(thick);
        for (k = 0; k < 3; ++k) {
            const int after = k == 2 ? 0 : k + 1;
            const occluder_lanes da = o8_sub_(corner[k][1], corner[after][1]);
            const occluder_lanes db = o8_sub_(corner[after][0], corner[k][0]);
            const occluder_lanes ka = o8_choose_(turned, o8_sub_(zero, da), da);
            const occluder_lanes kb = o8_choose_(turned, o8_sub_(zero, db), db);
            o8_store_(a[k], ka);
            o8_store_(b[k], kb);
            o8_store_(c[k], o8_sub_(zero, o8_mul_(inset, o8_add_(o8_abs_(da), o8_abs_(db)))));
            o8_store_(out[k], o8_mul_(seven, o8_add_(o8_max_(ka, zero), o8_max_(kb, zero))));
            o8_store_(in[k], o8_mul_(seven, o8_add_(o8_min_(ka, zero), o8_min_(kb, zero))));
            o8_store_(x[k], corner[k][0]);
            o8_store_(y[k], corner[k][1]);
        }
        o8_store_(sx, slope_x);
        o8_store_(sy, slope_y);
        o8_store_(value, o8_sub_(p, push));
        o8_store_(far_, least);
        o8_store_(blurred, blur);
        for (lane = 0; lane < 8; ++lane)
            if (open >> lane & 1) {
                occluder_region_ region;
                occluder_plane_ plane;
                region.a = a[0] + lane;
                region.b = b[0] + lane;
                region.c = c[0] + lane;
                region.px = x[0] + lane;
                region.py = y[0] + lane;
                region.out = out[0] + lane;
                region.in = in[0] + lane;
                region.step = 8;
                region.left = left[lane];
                region.top = top[lane];
                region.right = right[lane];
                region.bottom = bottom[lane];
                plane.slope_x = sx[lane];
                plane.slope_y = sy[lane];
                plane.value = value[lane];
                plane.x = x[0][lane];
                plane.y = y[0][lane];
                plane.least = far_[lane];
                occluder_buffer_fill_(buffer, &region, 3, &plane, NULL, near_[lane], blurred[lane]);
            }
    }
}

/* Homogeneous pixels of a point by the twelve numbers `matrix`: pixels times depth, and depth. */
static inline void occluder_project_(const double matrix[12], const float *point, double out[3])
{
    const double x = point[0], y = point[1], z = point[2];
    int axis;
    for (axis = 0; axis < 3; ++axis)
        out[axis] = ((matrix[4 * axis] * x + matrix[4 * axis + 1] * y)
                     + matrix[4 * axis + 2] * z) + matrix[4 * axis + 3];
}

/* Pixels from the screen's corner beyond which triangles are clipped. */
static inline double occluder_buffer_guard_(const occluder_buffer *buffer)
{
    return 4.0 * (buffer->rows > buffer->columns ? buffer->rows : buffer->columns);
}

#if defined(__AVX2__)
/* As occluder_project_() of four points: one row of `matrix`. */
OCCLUDER_INLINE_ __m256d occluder_project4_(const double row[4], __m256d x, __m256d y, __m256d z)
{
    return _mm256_add_pd(
        _mm256_add_pd(_mm256_add_pd(_mm256_mul_pd(_mm256_set1_pd(row[0]), x),
                                    _mm256_mul_pd(_mm256_set1_pd(row[1]), y)),
                      _mm256_mul_pd(_mm256_set1_pd(row[2]), z)),
        _mm256_set1_pd(row[3]));
}
#endif

static inline void occluder_buffer_points_(
    occluder_buffer *buffer, const float *positions, uint32_t count, const double matrix[12])
{
    const double near_depth = buffer->view.near_depth, guard = occluder_buffer_guard_(buffer);
    uint32_t index = 0;
#if defined(__AVX2__)
    const __m256d sign = _mm256_set1_pd(-0.0), one = _mm256_set1_pd(1.0), half = _mm256_set1_pd(0.5);
    for (; count - index >= 4; index += 4) {
        const float *from = positions + 3 * (size_t)index;
        const __m128 a = _mm_loadu_ps(from), b = _mm_loadu_ps(from + 4), c = _mm_loadu_ps(from + 8);
        const __m128 late = _mm_shuffle_ps(b, c, _MM_SHUFFLE(2, 1, 3, 2));  /* x y x y, the last two */
        const __m128 early = _mm_shuffle_ps(a, b, _MM_SHUFFLE(1, 0, 2, 1)); /* y z y z, the first two */
        const __m256d x = _mm256_cvtps_pd(_mm_shuffle_ps(a, late, _MM_SHUFFLE(2, 0, 3, 0)));
        const __m256d y = _mm256_cvtps_pd(_mm_shuffle_ps(early, late, _MM_SHUFFLE(3, 1, 2, 0)));
        const __m256d z = _mm256_cvtps_pd(_mm_shuffle_ps(early, c, _MM_SHUFFLE(3, 0, 3, 1)));
        const __m256d across = occluder_project4_(matrix, x, y, z);
        const __m256d down = occluder_project4_(matrix + 4, x, y, z);
        const __m256d depth = occluder_project4_(matrix + 8, x, y, z);
        const __m256d most = _mm256_mul_pd(_mm256_set1_pd(guard), depth);
        const __m256d drawable = _mm256_and_pd(
            _mm256_and_pd(_mm256_cmp_pd(depth, _mm256_set1_pd(near_depth), _CMP_GE_OQ),
                          _mm256_cmp_pd(depth, _mm256_set1_pd(OCCLUDER_LARGEST_), _CMP_LT_OQ)),
            _mm256_and_pd(_mm256_cmp_pd(_mm256_andnot_pd(sign, across), most, _CMP_LE_OQ),
                          _mm256_cmp_pd(_mm256_andnot_pd(sign, down), most, _CMP_LE_OQ)));
        const __m256d share = _mm256_div_pd(one, _mm256_blendv_pd(one, depth, drawable));
        _mm_storeu_ps(buffer->x + index, _mm256_cvtpd_ps(_mm256_and_pd(
            drawable, _mm256_sub_pd(_mm256_mul_pd(across, share), half))));
        _mm_storeu_ps(buffer->y + index, _mm256_cvtpd_ps(_mm256_and_pd(
            drawable, _mm256_sub_pd(_mm256_mul_pd(down, share), half))));
        _mm_storeu_ps(buffer->z + index, _mm256_cvtpd_ps(
            _mm256_blendv_pd(_mm256_set1_pd(-1.0), depth, drawable)));
    }
#endif
    for (; index < count; ++index) {
        double at[3], share;
        int drawable;
        occluder_project_(matrix, positions + 3 * (size_t)index, at);
        drawable = at[2] >= near_depth && at[2] < OCCLUDER_LARGEST_
            && fabs(at[0]) <= guard * at[2] && fabs(at[1]) <= guard * at[2];
        share = 1.0 / (drawable ? at[2] : 1.0);
        buffer->x[index] = drawable ? (float)(at[0] * share - 0.5) : 0.0f;
        buffer->y[index] = drawable ? (float)(at[1] * share - 0.5) : 0.0f;
        buffer->z[index] = drawable ? (float)at[2] : -1.0f;
    }
}

enum { OCCLUDER_MOST_CORNERS_ = 8 };     /* of a triangle clipped by five planes */

/* Above or at 0 on the side of a plane that is kept: before the near one, within four others. */
static inline double occluder_side_(const double corner[3], int plane, double near_depth, double guard)
{
    if (plane == 0)
        return corner[2] - near_depth;
    return guard * corner[2] + (plane & 1 ? 1.0 : -1.0) * corner[(plane - 1) >> 1];
}

/* Corners that are left of a triangle of homogeneous pixels, in `polygon`: 0 or 3 to 8.  A crossing is
 * computed from the end that is kept, so that triangles with a common edge get the same. */
static inline int occluder_clip_(
    double polygon[OCCLUDER_MOST_CORNERS_][3], double near_depth, double guard)
{
    double kept[OCCLUDER_MOST_CORNERS_][3];
    int count = 3, plane, corner, axis;
    for (corner = 0; corner < 3; ++corner) {
        const double *at = polygon[corner];
        if (!(fabs(at[0]) + fabs(at[1]) + fabs(at[2]) < OCCLUDER_LARGEST_))
            return 0;
    }
    for (plane = 0; plane < 5; ++plane) {
        int left = 0;
        for (corner = 0; corner < count; ++corner) {
            const int after = corner + 1 < count ? corner + 1 : 0;
            const double here = occluder_side_(polygon[corner], plane, near_depth, guard);
            const double there = occluder_side_(polygon[after], plane, near_depth, guard);
            if (here >= 0.0)
                memcpy(kept[left++], polygon[corner], sizeof kept[0]);
            if ((here >= 0.0) != (there >= 0.0)) {
                const double *within = polygon[here >= 0.0 ? corner : after];
                const double *beyond = polygon[here >= 0.0 ? after : corner];
                const double share = (here >= 0.0 ? here : there) / (fabs(here) + fabs(there));
                for (axis = 0; axis < 3; ++axis)
                    kept[left][axis] = within[axis] + share * (beyond[axis] - within[axis]);
                if (plane == 0)
                    kept[left][2] = near_depth;
                ++left;
            }
        }
        if (left < 3)
            return 0;
        count = left;
        memcpy(polygon, kept, sizeof kept[0] * (size_t)count);
    }
    return count;
}

static inline float occluder_area_(const float a[3], const float b[3], const float c[3])
{
    return (b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1]);
}

static inline float occluder_larger_(float a, float b) { return a > b ? a : b; }
static inline float occluder_smaller_(float a, float b) { return a < b ? a : b; }

/* Eight half planes, of which some may hold everything. */
typedef struct {
    float a[8], b[8], c[8], x[8], y[8], out[8], in[8];
} occluder_edges8_;

/* The side of an edge that lies to the left of it where `sign` is 1, `inset` pixels' squares in. */
static inline void occluder_set_edge_(
    occluder_edges8_ *edges, int k, const float from[3], const float to[3], float sign, float inset)
{
    const float a = sign * (from[1] - to[1]), b = sign * (to[0] - from[0]);
    edges->a[k] = a;
    edges->b[k] = b;
    edges->c[k] = -inset * (fabsf(a) + fabsf(b));
    edges->x[k] = from[0];
    edges->y[k] = from[1];
    edges->out[k] = 7.0f * (occluder_larger_(a, 0.0f) + occluder_larger_(b, 0.0f));
    edges->in[k] = 7.0f * (occluder_smaller_(a, 0.0f) + occluder_smaller_(b, 0.0f));
}

static inline void occluder_set_region_(occluder_region_ *region, const occluder_edges8_ *edges)
{
    region->a = edges->a;
    region->b = edges->b;
    region->c = edges->c;
    region->px = edges->x;
    region->py = edges->y;
    region->out = edges->out;
    region->in = edges->in;
    region->step = 1;
}

/* Bounds of points (pixels and depth), and the least depth. */
static inline void occluder_bounds_(
    const float (*points)[3], int count, float low[3], float high[3])
{
    int index, axis;
    for (axis = 0; axis < 3; ++axis) {
        low[axis] = high[axis] = points[0][axis];
        for (index = 1; index < count; ++index) {
            low[axis] = occluder_smaller_(low[axis], points[index][axis]);
            high[axis] = occluder_larger_(high[axis], points[index][axis]);
        }
    }
}

/* The plane of the reciprocal depth through three of some points, pushed away by their error and by
 * what rounding takes over all of them; `spare` pixels around them are paid for, too.  0 where the
 * three are too thin for one; then the plane is level. */
static inline int occluder_plane_of_(
    const occluder_buffer *buffer, const float (*points)[3], int count, int second, int third,
    float error, float spare, occluder_plane_ *plane)
{
    const float *a = points[0], *b = points[second], *c = points[third];
    const float p = 1.0f / (a[2] + error);
    const float dq = 1.0f / (b[2] + error) - p, dr = 1.0f / (c[2] + error) - p;
    const float ux = b[0] - a[0], uy = b[1] - a[1], vx = c[0] - a[0], vy = c[1] - a[1];
    const float area = ux * vy - vx * uy;
    float low[3], high[3], wide, tall, share, spread;
    occluder_bounds_(points, count, low, high);
    wide = high[0] - low[0];
    tall = high[1] - low[1];
    plane->least = 1.0f / (high[2] + error) * OCCLUDER_FARTHER_;
    plane->slope_x = plane->slope_y = 0.0f;
    plane->value = plane->least;
    plane->x = a[0];
    plane->y = a[1];
    if (!(fabsf(area) > occluder_larger_(wide, tall) * buffer->slack))
        return 0;
    share = 1.0f / area;
    plane->slope_x = (dq * vy - dr * uy) * share;
    plane->slope_y = (dr * ux - dq * vx) * share;
    spread = fabsf(plane->slope_x) * (wide + 8.0f) + fabsf(plane->slope_y) * (tall + 8.0f);
    plane->value = p
        - OCCLUDER_ROUNDED_ * (OCCLUDER_NEARER_ / (low[2] + error)
                               + spread * (1.0f + fabsf(wide * tall * share)))
        - (spare + 2.0f * buffer->slack) * (fabsf(plane->slope_x) + fabsf(plane->slope_y));
    return 1;
}

/* A region's pixels, held to the screen; whether there are any. */
static inline int occluder_buffer_hold_(
    const occluder_buffer *buffer, occluder_region_ *region, float left, float top, float right,
    float bottom)
{
    const float columns = (float)(buffer->columns - 1), rows = (float)(buffer->rows - 1);
    if (!(left <= columns && right >= 0.0f && top <= rows && bottom >= 0.0f))
        return 0;
    region->left = left > 0.0f ? (int32_t)ceilf(left) : 0;
    region->top = top > 0.0f ? (int32_t)ceilf(top) : 0;
    region->right = (int32_t)floorf(right < columns ? right : columns);
    region->bottom = (int32_t)floorf(bottom < rows ? bottom : rows);
    return region->left <= region->right && region->top <= region->bottom;
}

/* Draws a convex polygon of 3 to 8 corners into the pixels that lie wholly in it.
 *
 * The pushed corners of a clipped one do not lie in a plane: there s / (1 + e s) is replaced by its
 * chord from the farthest corner's s to the nearest one's, which is nowhere nearer. */
static inline void occluder_buffer_polygon_(
    occluder_buffer *buffer, const float (*points)[3], int count, float error)
{
    const float inset = 0.5f + buffer->slack;
    float low[3], high[3], area = 0.0f, largest = -1.0f, sign, chord, most, least;
    occluder_edges8_ edges;
    occluder_region_ region;
    occluder_plane_ plane;
    int corner, best = 2;
    occluder_bounds_(points, count, low, high);
    if (!occluder_buffer_hold_(buffer, &region, low[0] + inset, low[1] + inset, high[0] - inset,
                               high[1] - inset))
        return;
    for (corner = 2; corner < count; ++corner) {
        const float part = occluder_area_(points[0], points[corner - 1], points[corner]);
        area += part;
        if (fabsf(part) > largest) {
            largest = fabsf(part);
            best = corner;
        }
    }
    sign = area > 0.0f ? 1.0f : -1.0f;
    for (corner = 0; corner < OCCLUDER_MOST_CORNERS_; ++corner) /* of no length past the last */
        occluder_set_edge_(&edges, corner, points[corner < count ? corner : 0],
                           points[corner + 1 < count ? corner + 1 : 0], sign, inset);
    occluder_set_region_(&region, &edges);
    most = OCCLUDER_NEARER_ / low[2];
    least = OCCLUDER_FARTHER_ / high[2];
    if (occluder_plane_of_(buffer, points, count, best - 1, best, 0.0f, 0.5f, &plane)) {
        chord = OCCLUDER_FARTHER_ / ((1.0f + error * least) * (1.0f + error * most));
        plane.value = chord * (plane.value - least) + least / (1.0f + error * least)
            - OCCLUDER_ROUNDED_ * most;
        plane.slope_x *= chord;
        plane.slope_y *= chord;
        plane.least = OCCLUDER_FARTHER_ * (1.0f / (high[2] + error));
    } else
        plane.value = plane.least = OCCLUDER_FARTHER_ * (1.0f / (high[2] + error));
    occluder_buffer_fill_(
        buffer, &region, 8, &plane, NULL, OCCLUDER_NEARER_ / (low[2] + error),
        error * ((float)buffer->view.focal * OCCLUDER_NEARER_) / low[2]);
}

/* Draws a triangle that reaches before the near plane or far out. */
static inline void occluder_buffer_clipped_(
    occluder_buffer *buffer, double polygon[OCCLUDER_MOST_CORNERS_][3], float error)
{
    const int count = occluder_clip_(
        polygon, buffer->view.near_depth, occluder_buffer_guard_(buffer));
    float points[OCCLUDER_MOST_CORNERS_][3], fan[3][3][8];
    occluder_lanes corner[3][3];
    int index, axis, k;
    if (count < 3)
        return;
    for (index = 0; index < count; ++index) {
        const double share = 1.0 / polygon[index][2];
        points[index][0] = (float)(polygon[index][0] * share - 0.5);
        points[index][1] = (float)(polygon[index][1] * share - 0.5);
        points[index][2] = (float)polygon[index][2];
    }
    if (buffer->coverage == OCCLUDER_INNER) {
        occluder_buffer_polygon_(buffer, (const float (*)[3])points, count, error);
        return;
    }
    for (index = 0; index < 8; ++index)
        for (axis = 0; axis < 3; ++axis) {
            const int last = index + 2 < count ? index + 2 : count - 1;
            fan[0][axis][index] = points[0][axis];
            fan[1][axis][index] = points[last - 1][axis];
            fan[2][axis][index] = points[last][axis];
        }
    for (k = 0; k < 3; ++k)
        for (axis = 0; axis < 3; ++axis)
            corner[k][axis] = o8_load_(fan[k][axis]);
    occluder_buffer_eight_(buffer, corner, o8_all_(error), (1u << (count - 2)) - 1);
}

/* Draws the pixels across an edge that two triangles share which lie in both together: a square
 * inside the other two edges of each is inside of their union.  Points: the ends of the edge, then
 * the corners opposite of it. */
static inline void occluder_buffer_pair_(
    occluder_buffer *buffer, const float points[4][3], float error, float other)
{
    static const int from[8] = {0, 1, 2, 1, 0, 3, 0, 0}, to[8] = {1, 2, 0, 0, 3, 1, 0, 0};
    const float inset = 0.5f + buffer->slack;
    const float *p = points[0], *q = points[1];
    const float first = occluder_area_(p, q, points[2]), second = occluder_area_(p, q, points[3]);
    const float sign = first > 0.0f ? 1.0f : -1.0f;
    float mine[3][3], theirs[3][3], depth;
    occluder_edges8_ edges;
    occluder_region_ region;
    occluder_plane_ plane, beyond;
    int k;
    if (first == 0.0f || sign * second >= 0.0f) /* no area, or folded: both lie on one side */
        return;
    if (!occluder_buffer_hold_(
            buffer, &region, occluder_smaller_(p[0], q[0]) - 1.0f,
            occluder_smaller_(p[1], q[1]) - 1.0f, occluder_larger_(p[0], q[0]) + 1.0f,
            occluder_larger_(p[1], q[1]) + 1.0f))
        return;
    for (k = 0; k < 8; ++k) /* the shared one, seen from either side, holds what it passes through */
        occluder_set_edge_(
            &edges, k, points[from[k]], points[to[k]], sign, k % 3 == 0 ? -0.5f : inset);
    occluder_set_region_(&region, &edges);
    memcpy(mine, points, sizeof mine);
    memcpy(theirs, points, sizeof theirs);
    memcpy(theirs[2], points[3], sizeof theirs[2]);
    occluder_plane_of_(buffer, (const float (*)[3])mine, 3, 1, 2, error, 0.5f, &plane);
    occluder_plane_of_(buffer, (const float (*)[3])theirs, 3, 1, 2, other, 0.5f, &beyond);
    depth = occluder_smaller_(occluder_smaller_(p[2], q[2]),
                              occluder_smaller_(points[2][2], points[3][2]));
    occluder_buffer_fill_(
        buffer, &region, 8, &plane, &beyond,
        OCCLUDER_NEARER_ / (depth + occluder_smaller_(error, other)),
        occluder_larger_(error, other) * ((float)buffer->view.focal * OCCLUDER_NEARER_) / depth);
}

static inline uint32_t occluder_index_(const occluder_mesh *mesh, size_t corner)
{
    if (mesh->index_bytes == 2)
        return ((const uint16_t *)mesh->indices)[corner];
    return ((const uint32_t *)mesh->indices)[corner];
}

/* Draws a triangle by the positions of its corners. */
static inline void occluder_buffer_near_(
    occluder_buffer *buffer, const occluder_mesh *mesh, size_t triangle, const double matrix[12],
    float error)
{
    double polygon[OCCLUDER_MOST_CORNERS_][3];
    size_t k;
    for (k = 0; k < 3; ++k)
        occluder_project_(
            matrix, mesh->positions + 3 * (size_t)occluder_index_(mesh, 3 * triangle + k),
            polygon[k]);
    occluder_buffer_clipped_(buffer, polygon, error);
}

static inline void occluder_buffer_triangles_(
    occluder_buffer *buffer, const occluder_mesh *mesh, const double matrix[12],
    const float *errors, float error)
{
    const occluder_lanes zero = o8_all_(0.0f);
    uint32_t begin;
    for (begin = 0; begin < mesh->triangle_count; begin += 8) {
        const uint32_t count = mesh->triangle_count - begin < 8 ? mesh->triangle_count - begin : 8;
        int32_t places[3][8];
        occluder_lanes corner[3][3], strayed = o8_all_(error);
        unsigned chosen = (1u << count) - 1, behind;
        uint32_t lane;
        int k;
        for (lane = 0; lane < 8; ++lane) {
            const size_t first = 3 * (size_t)(begin + (lane < count ? lane : 0));
            for (k = 0; k < 3; ++k)
                places[k][lane] = (int32_t)occluder_index_(mesh, first + (size_t)k);
        }
        if (errors) {
            float each[8];
            for (lane = 0; lane < 8; ++lane) {
                each[lane] = errors[begin + (lane < count ? lane : 0)];
                if (!(each[lane] < OCCLUDER_LARGEST_))
                    chosen &= ~(1u << lane);
            }
            strayed = o8_load_(each);
        }
        for (k = 0; k < 3; ++k) {
            corner[k][0] = o8_pick_(buffer->x, places[k]);
            corner[k][1] = o8_pick_(buffer->y, places[k]);
            corner[k][2] = o8_pick_(buffer->z, places[k]);
        }
        behind = chosen & o8_bits_(o8_less_(
            o8_min_(corner[0][2], o8_min_(corner[1][2], corner[2][2])), zero));
        if (chosen & ~behind)
            occluder_buffer_eight_(buffer, corner, strayed, chosen & ~behind);
        for (lane = 0; behind >> lane; ++lane)
            if (behind >> lane & 1)
                occluder_buffer_near_(
                    buffer, mesh, begin + lane, matrix, errors ? errors[begin + lane] : error);
    }
}

static inline void occluder_buffer_pairs_(
    occluder_buffer *buffer, const occluder_mesh *mesh, const float *errors, float error)
{
    uint32_t pair;
    for (pair = 0; pair < mesh->pair_count; ++pair) {
        const uint32_t one = mesh->pairs[2 * (size_t)pair], two = mesh->pairs[2 * (size_t)pair + 1];
        const float mine = errors ? errors[one / 3] : error, theirs = errors ? errors[two / 3] : error;
        uint32_t places[4];
        float points[4][3];
        int k;
        places[0] = occluder_index_(mesh, one - one % 3 + (one + 1) % 3);
        places[1] = occluder_index_(mesh, one - one % 3 + (one + 2) % 3);
        places[2] = occluder_index_(mesh, one);
        places[3] = occluder_index_(mesh, two);
        for (k = 0; k < 4; ++k) {
            points[k][0] = buffer->x[places[k]];
            points[k][1] = buffer->y[places[k]];
            points[k][2] = buffer->z[places[k]];
            if (points[k][2] < 0.0f)
                break;
        }
        if (k == 4 && mine < OCCLUDER_LARGEST_ && theirs < OCCLUDER_LARGEST_)
            occluder_buffer_pair_(buffer, (const float (*)[3])points, mine, theirs);
    }
}

/* As occluder_buffer_draw(), with an error for each triangle; `errors` may be NULL. */
static inline int occluder_buffer_draw_each_(
    occluder_buffer *buffer, const occluder_mesh *mesh, const float transform[12],
    const float *errors, float error)
{
    double matrix[12];
    int row, column;
    if (mesh->vertex_count > buffer->most_vertices)
        return 0;
    if (!(error < OCCLUDER_LARGEST_)) /* nobody knows where it is */
        return 1;
    for (row = 0; row < 3; ++row)
        for (column = 0; column < 4; ++column) {
            const double *axes = buffer->screen + 3 * row;
            matrix[4 * row + column] = (axes[0] * transform[column]
                                        + axes[1] * transform[4 + column])
                + axes[2] * transform[8 + column];
        }
    occluder_buffer_points_(buffer, mesh->positions, mesh->vertex_count, matrix);
    occluder_buffer_triangles_(buffer, mesh, matrix, errors, error);
    if (buffer->coverage == OCCLUDER_INNER)
        occluder_buffer_pairs_(buffer, mesh, errors, error);
    return 1;
}

/* Draws both sides of a mesh.  `transform` has three rows of four numbers and takes columns (x, y, z, 1)
 * of the mesh to world axes around the eye; `error` is how far it may be off, world units.  0 where
 * the mesh has more vertices than the buffer has room for: then nothing is drawn. */
static inline int occluder_buffer_draw(
    occluder_buffer *buffer, const occluder_mesh *mesh, const float transform[12], float error)
{
    return occluder_buffer_draw_each_(buffer, mesh, transform, NULL, error);
}

/* --- Testing */

enum { OCCLUDER_BOX_EDGES_ = 12, OCCLUDER_ROUNDS_ = 8 };

/* What a box shows: pixels of its corners and their bounds, by how much rounding may be off. */
typedef struct {
    float x[8], y[8];
    float left, right, top, bottom;
    float nearest;           /* depth, rounded down */
    float slack;             /* pixels */
} occluder_outline_;

static inline int occluder_is_finite_(float value)
{
    uint32_t bits;
    memcpy(&bits, &value, sizeof bits);
    return (bits & 0x7f800000u) != 0x7f800000u;
}

/* The pixel of a row or column that holds a place, or the one at that end of the screen. */
OCCLUDER_INLINE_ uint32_t occluder_pixel_(float place, uint32_t count)
{
    return (uint32_t)(int32_t)occluder_smaller_(
        occluder_larger_(place, 0.0f), (float)(int32_t)(count - 1));
}

/* Which corners of a box are at its high ends: those whose number has bit 0 along x, bit 1 along y,
 * bit 2 along z. */
OCCLUDER_INLINE_ void occluder_ends_(occluder_mask ends[3])
{
    static const float high[3][8] = {
        {0, 1, 0, 1, 0, 1, 0, 1}, {0, 0, 1, 1, 0, 0, 1, 1}, {0, 0, 0, 0, 1, 1, 1, 1}};
    int axis;
    for (axis = 0; axis < 3; ++axis)
        ends[axis] = o8_less_(o8_all_(0.0f), o8_load_(high[axis]));
}

/* A row of the view's numbers times the corners of a box. */
OCCLUDER_INLINE_ occluder_lanes occluder_corners_(
    const float row[3], const float low[3], const float high[3], const occluder_mask ends[3])
{
    const occluder_lanes x = o8_choose_(ends[0], o8_all_(row[0] * high[0]), o8_all_(row[0] * low[0]));
    const occluder_lanes y = o8_choose_(ends[1], o8_all_(row[1] * high[1]), o8_all_(row[1] * low[1]));
    const occluder_lanes z = o8_choose_(ends[2], o8_all_(row[2] * high[2]), o8_all_(row[2] * low[2]));
    return o8_add_(o8_add_(x, y), z);
}

/* OUTSIDE when all corners lie beyond one plane of the view frustum, VISIBLE when the box reaches
 * before the near plane or is no box, and HIDDEN, which is to be proved, otherwise. */
static inline occluder_verdict occluder_buffer_outline_(
    const occluder_buffer *buffer, const float low[3], const float high[3], occluder_outline_ *out)
{
    const float columns = (float)buffer->columns, rows = (float)buffer->rows;
    const float longest = columns > rows ? columns : rows, focal = (float)buffer->view.focal;
    const float near_depth = (float)buffer->view.near_depth;
    const float size = occluder_larger_(fabsf(low[0]), fabsf(high[0]))
        + occluder_larger_(fabsf(low[1]), fabsf(high[1]))
        + occluder_larger_(fabsf(low[2]), fabsf(high[2]));
    const float deep = OCCLUDER_ROUNDED_ * size, wide = deep * (focal + 2.0f * longest);
    const occluder_lanes zero = o8_all_(0.0f);
    occluder_mask ends[3];
    occluder_lanes x, y, z, share;
    float nearest, ends_at[4];
    if (!occluder_is_finite_(low[0] + low[1] + low[2] + high[0] + high[1] + high[2])
        || !(size < OCCLUDER_LARGEST_))
        return OCCLUDER_VISIBLE;
    occluder_ends_(ends);
    x = occluder_corners_(buffer->rows_, low, high, ends);
    y = occluder_corners_(buffer->rows_ + 3, low, high, ends);
    z = occluder_corners_(buffer->rows_ + 6, low, high, ends);
    nearest = o8_least_(z);
    if (nearest - deep < near_depth) {
        const occluder_lanes past_x = o8_sub_(o8_mul_(o8_all_(columns), z), x);
        const occluder_lanes past_y = o8_sub_(o8_mul_(o8_all_(rows), z), y);
        return o8_most_(z) + deep < near_depth || o8_most_(x) + wide < 0.0f || o8_most_(y) + wide < 0.0f
            || o8_most_(past_x) + wide < 0.0f || o8_most_(past_y) + wide < 0.0f
            ? OCCLUDER_OUTSIDE : OCCLUDER_VISIBLE;
    }
    share = o8_div_(o8_all_(1.0f), z);
    x = o8_mul_(x, share);
    y = o8_mul_(y, share);
    o8_store_(out->x, x);
    o8_store_(out->y, y);
    o8_least4_(x, o8_sub_(zero, x), y, o8_sub_(zero, y), ends_at);
    out->left = ends_at[0];
    out->right = -ends_at[1];
    out->top = ends_at[2];
    out->bottom = -ends_at[3];
    out->nearest = nearest - deep;
    out->slack = 2.0f * buffer->slack + wide / out->nearest;
    return out->right + out->slack < 0.0f || out->left - out->slack > columns
        || out->bottom + out->slack < 0.0f || out->top - out->slack > rows
        ? OCCLUDER_OUTSIDE : OCCLUDER_HIDDEN;
}

/* A block of pixels: the rectangle of an outline grown by `reach`. */
typedef struct { uint32_t top, bottom, left, right; } occluder_block_;

OCCLUDER_INLINE_ occluder_block_ occluder_buffer_block_(
    const occluder_buffer *buffer, const occluder_outline_ *out, float reach)
{
    occluder_block_ block;
    block.top = occluder_pixel_(out->top - reach, buffer->rows);
    block.bottom = occluder_pixel_(out->bottom + reach, buffer->rows);
    block.left = occluder_pixel_(out->left - reach, buffer->columns);
    block.right = occluder_pixel_(out->right + reach, buffer->columns);
    return block;
}

/* Which of eight tiles from `column` on hold no more than a limit, and are none past `last`. */
OCCLUDER_INLINE_ unsigned occluder_up_to_(
    const float *tiles, float limit, uint32_t column, uint32_t last)
{
    const unsigned few = last - column < 7 ? 0xffu >> (7 - (last - column)) : 0xffu;
    return few & ~o8_bits_(o8_less_(o8_all_(limit), o8_load_(tiles)));
}

/* Whether a block is known, at once, to meet at most two rows of eight tiles with no more blur than
 * that, all nearer than a reciprocal depth: what most hidden boxes are. */
OCCLUDER_INLINE_ int occluder_buffer_settles_(
    const occluder_buffer *buffer, const occluder_block_ *block, float blur, float value)
{
    const uint32_t column = block->left >> 3, last = block->right >> 3;
    const size_t first = (size_t)(block->top >> 3) * buffer->tile_columns + column;
    const size_t second = (size_t)(block->bottom >> 3) * buffer->tile_columns + column;
    const unsigned few = 0xffu >> (7 - ((last - column) & 7u));
    const occluder_lanes most = o8_all_(blur), least = o8_all_(value);
    const occluder_mask bad = o8_or_(
        o8_or_(o8_less_(most, o8_load_(buffer->blur + first)),
               o8_less_(most, o8_load_(buffer->blur + second))),
        o8_or_(o8_not_more_(o8_load_(buffer->farthest + first), least),
               o8_not_more_(o8_load_(buffer->farthest + second), least)));
    return !(few & o8_bits_(bad)) & (last - column < 8)
        & ((block->bottom >> 3) - (block->top >> 3) < 2);
}

/* The largest blur of the tiles that a block meets; `known` where none has more. */
OCCLUDER_INLINE_ float occluder_buffer_blur_(
    const occluder_buffer *buffer, const occluder_block_ *block, float known)
{
    const uint32_t last = block->right >> 3;
    const occluder_lanes steps = o8_steps_();
    occluder_lanes most = o8_all_(known);
    uint32_t row, column;
    for (column = block->left >> 3; column <= last; column += 8) {
        const occluder_mask few = o8_less_(steps, o8_all_((float)(int32_t)(last - column) + 0.5f));
        for (row = block->top >> 3; row <= block->bottom >> 3; ++row)
            most = o8_max_(most, o8_choose_(
                few, o8_load_(buffer->blur + (size_t)row * buffer->tile_columns + column),
                o8_all_(0.0f)));
    }
    return o8_most_(most);
}

/* Whether all of a block of pixels are nearer than a reciprocal depth. */
OCCLUDER_INLINE_ int occluder_buffer_is_nearer_(
    occluder_buffer *buffer, const occluder_block_ *block, float value)
{
    const uint32_t top = block->top, bottom = block->bottom;
    const uint32_t left = block->left, right = block->right;
    const occluder_lanes steps = o8_steps_(), limit = o8_all_(value);
    uint32_t row, column, begin;
    if (right - left < 8 && bottom - top < 16) { /* small: sooner done by pixels than by tiles */
        const float *at = buffer->depth + (size_t)top * buffer->stride + left;
        const unsigned few = 0xffu >> (7 - (right - left));
        occluder_lanes least = o8_load_(at);
        for (row = top; row < bottom; ++row)
            least = o8_min_(least, o8_load_(at += buffer->stride));
        return !(few & ~o8_bits_(o8_less_(limit, least)));
    }
    for (row = top >> 3; row <= bottom >> 3; ++row)
        for (begin = left >> 3; begin <= right >> 3; begin += 8) {
            const float *tiles = buffer->farthest + (size_t)row * buffer->tile_columns + begin;
            unsigned open = occluder_up_to_(tiles, value, begin, right >> 3);
            for (column = begin; open; ++column, open >>= 1) {
                const uint32_t first = top > 8 * row ? top : 8 * row;
                const uint32_t last = bottom < 8 * row + 7 ? bottom : 8 * row + 7;
                const float *at = buffer->depth + (size_t)first * buffer->stride + 8 * (size_t)column;
                unsigned within;
                uint32_t line;
                if (!(open & 1u) || occluder_buffer_reaches_(buffer, row, column, value, 1))
                    continue;
                within = o8_bits_(o8_and_(
                    o8_less_(o8_all_((float)left - (float)(8 * column) - 0.5f), steps),
                    o8_less_(steps, o8_all_((float)right - (float)(8 * column) + 0.5f))));
                for (line = first; line <= last; ++line, at += buffer->stride)
                    if (within & ~o8_bits_(o8_less_(limit, o8_load_(at))))
                        return 0;
            }
        }
    return 1;
}

/* The edges of a box on the screen, twelve and the last four again: x at the upper end, and how it
 * goes on.  Those that rise by less than a pixel count as a whole. */
typedef struct {
    float top[16], bottom[16], x[16], slope[16];
    float steep[16];             /* 1 where it rises by more than a pixel */
    float low[16], high[16];     /* of x, and `give` beyond */
    float give[16];              /* pixels that x may be off */
} occluder_edges_;

/* An outline's edges are among the box's twelve, and the others lie within it. */
static inline void occluder_edges_of_(const occluder_outline_ *out, occluder_edges_ *edges)
{
    static const int32_t from[16] = {0, 2, 4, 6, 0, 1, 4, 5, 0, 1, 2, 3, 0, 1, 2, 3};
    static const int32_t to[16] = {1, 3, 5, 7, 2, 3, 6, 7, 4, 5, 6, 7, 4, 5, 6, 7};
    const float far_x = occluder_larger_(fabsf(out->left), fabsf(out->right));
    const float far_y = occluder_larger_(fabsf(out->top), fabsf(out->bottom));
    const occluder_lanes give = o8_all_(2.0f * OCCLUDER_ROUNDED_ * occluder_larger_(far_x, far_y));
    const occluder_lanes zero = o8_all_(0.0f), one = o8_all_(1.0f);
    int k;
    for (k = 0; k < 16; k += 8) {
        const occluder_lanes ax = o8_pick_(out->x, from + k), ay = o8_pick_(out->y, from + k);
        const occluder_lanes bx = o8_pick_(out->x, to + k), by = o8_pick_(out->y, to + k);
        const occluder_mask turned = o8_less_(by, ay);
        const occluder_lanes top = o8_choose_(turned, by, ay), bottom = o8_choose_(turned, ay, by);
        const occluder_lanes x = o8_choose_(turned, bx, ax), end = o8_choose_(turned, ax, bx);
        const occluder_lanes rise = o8_sub_(bottom, top);
        const occluder_mask steep = o8_less_(one, rise);
        const occluder_lanes slope = o8_choose_(
            steep, o8_div_(o8_sub_(end, x), o8_choose_(steep, rise, one)), zero);
        const occluder_lanes off = o8_mul_(give, o8_add_(one, o8_abs_(slope)));
        o8_store_(edges->top + k, top);
        o8_store_(edges->bottom + k, bottom);
        o8_store_(edges->x + k, x);
        o8_store_(edges->slope + k, slope);
        o8_store_(edges->steep + k, o8_choose_(steep, one, zero));
        o8_store_(edges->low + k, o8_min_(ax, bx));
        o8_store_(edges->high + k, o8_max_(ax, bx));
        o8_store_(edges->give + k, off);
    }
}

/* Least and largest x of the outline in eight rows, from `reach` above their upper borders to as much
 * below their lower ones. */
static inline void occluder_extents_(
    const occluder_edges_ *edges, float row, float reach, float left[8], float right[8])
{
    const occluder_lanes low = o8_add_(o8_all_(row - reach), o8_steps_());
    const occluder_lanes high = o8_add_(o8_all_(row + 1.0f + reach), o8_steps_());
    const occluder_lanes half = o8_all_(0.5f);
    occluder_lanes least = o8_all_(FLT_MAX), most = o8_all_(-FLT_MAX);
    int k;
    for (k = 0; k < OCCLUDER_BOX_EDGES_; ++k) {
        const occluder_lanes top = o8_all_(edges->top[k]), bottom = o8_all_(edges->bottom[k]);
        const occluder_lanes begin = o8_max_(top, low), end = o8_min_(bottom, high);
        const occluder_lanes x = o8_all_(edges->x[k]), slope = o8_all_(edges->slope[k]);
        const occluder_lanes one = o8_add_(x, o8_mul_(o8_sub_(begin, top), slope));
        const occluder_lanes two = o8_add_(x, o8_mul_(o8_sub_(end, top), slope));
        const occluder_mask steep = o8_less_(half, o8_all_(edges->steep[k]));
        const occluder_lanes here = o8_choose_(steep, o8_min_(one, two), o8_all_(edges->low[k]));
        const occluder_lanes there = o8_choose_(steep, o8_max_(one, two), o8_all_(edges->high[k]));
        const occluder_lanes give = o8_all_(edges->give[k]);
        const occluder_mask beside = o8_less_(end, begin);
        least = o8_min_(least, o8_choose_(beside, o8_all_(FLT_MAX), o8_sub_(here, give)));
        most = o8_max_(most, o8_choose_(beside, o8_all_(-FLT_MAX), o8_add_(there, give)));
    }
    o8_store_(left, least);
    o8_store_(right, most);
}

/* Sides of a box that face the eye: where a line of sight is behind all of them, the box begins.
 * Reciprocal depth as a + b column + c row at a pixel's centre, plus what it may rise within `reach`
 * pixels of it and what rounding takes.  How many there are. */
static inline int occluder_buffer_fronts_(
    const occluder_buffer *buffer, const float low[3], const float high[3], float reach,
    float fronts[3][3])
{
    const float focal = (float)buffer->view.focal;
    const float middle_x = 0.5f * (float)buffer->columns, middle_y = 0.5f * (float)buffer->rows;
    int axis, count = 0;
    for (axis = 0; axis < 3; ++axis) {
        const float gap = low[axis] > 0.0f ? low[axis] : high[axis];
        const float ahead = (float)buffer->view.ahead[axis];
        float a, b, c;
        if (!(low[axis] > 0.0f || high[axis] < 0.0f))
            continue;
        b = (float)buffer->view.right[axis] / (focal * gap);
        c = (float)buffer->view.up[axis] / (-focal * gap);
        a = (ahead / gap - b * (middle_x - 0.5f)) - c * (middle_y - 0.5f);
        fronts[count][0] = (a + (fabsf(b) + fabsf(c)) * reach)
            + 4.0f * OCCLUDER_ROUNDED_
                * (fabsf(ahead / gap) + (2.0f * fabsf(b)) * middle_x + (2.0f * fabsf(c)) * middle_y);
        fronts[count][1] = b;
        fronts[count][2] = c;
        ++count;
    }
    return count;
}

/* Reciprocal depth beyond which all of a row's pixels from `column` on hide a box, and a bit for each
 * of the eight that are not nearer. */
OCCLUDER_INLINE_ unsigned occluder_buffer_open_(
    const occluder_buffer *buffer, float fronts[3][3], int count, float value, uint32_t row,
    uint32_t column)
{
    const occluder_lanes place = o8_add_(o8_all_((float)(int32_t)column), o8_steps_());
    occluder_lanes entry = o8_all_(value);
    int k;
    for (k = 0; k < count; ++k)
        entry = o8_min_(entry, o8_add_(
            o8_all_(fronts[k][0] + fronts[k][2] * (float)(int32_t)row),
            o8_mul_(o8_all_(fronts[k][1]), place)));
    return ~o8_bits_(o8_less_(
        entry, o8_load_(buffer->depth + (size_t)row * buffer->stride + column)));
}

/* Which of eight tiles from `tile` of a row of them on are not known to hide a box in pixel rows
 * `first` to `last`, which are theirs: an entry grows along a row or a column, or falls, so that none
 * in a tile is nearer than that of one of its corners, rounded as it is. */
OCCLUDER_INLINE_ unsigned occluder_buffer_open_tiles_(
    const occluder_buffer *buffer, float fronts[3][3], int count, float value, uint32_t first,
    uint32_t last, uint32_t tile)
{
    const occluder_lanes begins = o8_mul_(
        o8_all_(8.0f), o8_add_(o8_all_((float)(int32_t)tile), o8_steps_()));
    const occluder_lanes ends = o8_add_(begins, o8_all_(7.0f));
    occluder_lanes entry = o8_all_(value);
    int k;
    for (k = 0; k < count; ++k) {
        const float row = (float)(int32_t)(fronts[k][2] > 0.0f ? last : first);
        entry = o8_min_(entry, o8_add_(
            o8_all_(fronts[k][0] + fronts[k][2] * row),
            o8_mul_(o8_all_(fronts[k][1]), fronts[k][1] > 0.0f ? ends : begins)));
    }
    return 0xffu & ~o8_bits_(o8_less_(
        entry, o8_load_(buffer->farthest + (size_t)(first >> 3) * buffer->tile_columns + tile)));
}

/* Whether the buffer is nearer wherever a box may be seen, by its own outline and its own front:
 * exacter than its rectangle at the depth of its nearest corner, and dearer.  `value` is the
 * reciprocal of that depth, `reach` the pixels that the outline grows by on all sides. */
static inline int occluder_buffer_hides_outline_(
    const occluder_buffer *buffer, const float low[3], const float high[3],
    const occluder_outline_ *out, float value, float reach)
{
    const float columns = (float)(int32_t)buffer->columns, rows = (float)(int32_t)buffer->rows;
    /* A corner and the one across the box: what lies between is within the outline. */
    const float middle_x = 0.5f * (out->x[0] + out->x[7]), middle_y = 0.5f * (out->y[0] + out->y[7]);
    occluder_edges_ edges;
    float fronts[3][3], left[8], right[8];
    const int count = occluder_buffer_fronts_(buffer, low, high, reach + 0.5f, fronts);
    uint32_t top, bottom, begin, row;
    if (middle_x >= 0.0f && middle_x < columns && middle_y >= 0.0f && middle_y < rows) {
        const uint32_t column = occluder_pixel_(middle_x, buffer->columns);
        row = occluder_pixel_(middle_y, buffer->rows);
        if (occluder_buffer_open_(buffer, fronts, count, value, row, column & ~7u) >> (column & 7u) & 1)
            return 0; /* as most that can be seen, without a look at the rest */
    }
    top = occluder_pixel_(out->top - reach, buffer->rows);
    bottom = occluder_pixel_(out->bottom + reach, buffer->rows);
    occluder_edges_of_(out, &edges);
    for (begin = top; begin <= bottom; begin += 8) {
        const uint32_t end = begin + 7 < bottom ? begin + 7 : bottom;
        uint32_t first[8], last[8], least = buffer->columns, most = 0, tile;
        occluder_extents_(&edges, (float)(int32_t)begin, reach, left, right);
        for (row = begin; row <= end; ++row) {
            const float low_x = left[row - begin] - reach, high_x = right[row - begin] + reach;
            const int met = low_x <= high_x && high_x >= 0.0f && low_x <= columns;
            first[row - begin] = met ? occluder_pixel_(low_x, buffer->columns) : 1;
            last[row - begin] = met ? occluder_pixel_(high_x, buffer->columns) : 0;
            if (met && first[row - begin] < least)
                least = first[row - begin];
            if (met && last[row - begin] > most)
                most = last[row - begin];
        }
        if (least > most)
            continue;
        for (tile = least >> 3; tile <= most >> 3; tile += 8) {
            const unsigned few = (most >> 3) - tile < 7 ? 0xffu >> (7 - ((most >> 3) - tile)) : 0xffu;
            uint32_t upper = begin | 7u, lower = begin;
            for (; lower <= end; lower = upper + 1, upper += 8) {
                const uint32_t until = upper < end ? upper : end;
                unsigned open = few & occluder_buffer_open_tiles_(
                    buffer, fronts, count, value, lower, until, tile);
                uint32_t column;
                for (column = 8 * tile; open; column += 8, open >>= 1)
                    for (row = lower; open & 1u && row <= until; ++row) {
                        const uint32_t from = first[row - begin], to = last[row - begin];
                        unsigned within = 0xffu;
                        if (from > to || column > to || column + 7 < from)
                            continue;
                        if (column < from)
                            within &= 0xffu << (from - column);
                        if (to - column < 7)
                            within &= 0xffu >> (7 - (to - column));
                        if (within & occluder_buffer_open_(buffer, fronts, count, value, row, column))
                            return 0;
                    }
            }
        }
    }
    return 1;
}

/* Whether what was drawn hides a box: from its lowest corner to its highest, in world axes around the
 * eye.
 *
 * The box's rectangle on the screen grows by the margin: the largest blur of the tiles that the grown
 * rectangle meets, half a pixel where centres count, and the slack.  It is hidden where every pixel
 * that the rectangle meets is nearer than its nearest corner, or else every pixel that its outline
 * meets is nearer than where the line of sight enters it. */
static inline occluder_verdict occluder_buffer_test(
    occluder_buffer *buffer, const float low[3], const float high[3])
{
    occluder_outline_ out;
    const occluder_verdict verdict = occluder_buffer_outline_(buffer, low, high, &out);
    occluder_block_ block;
    float value, blur;
    int round;
    if (verdict != OCCLUDER_HIDDEN)
        return verdict;
    value = OCCLUDER_NEARER_ / out.nearest;
    /* No margin is less than that of a tile which the box meets anyway. */
    blur = buffer->blur[(size_t)(occluder_pixel_(out.top, buffer->rows) >> 3) * buffer->tile_columns
                        + (occluder_pixel_(out.left, buffer->columns) >> 3)];
    block = occluder_buffer_block_(buffer, &out, buffer->margin + blur + out.slack);
    if (occluder_buffer_settles_(buffer, &block, blur, value))
        return OCCLUDER_HIDDEN;
    for (round = 0; round < OCCLUDER_ROUNDS_; ++round) {
        const float needed = occluder_buffer_blur_(buffer, &block, blur);
        if (!(needed > blur))
            return occluder_buffer_is_nearer_(buffer, &block, value)
                    || occluder_buffer_hides_outline_(
                        buffer, low, high, &out, value, buffer->margin + blur + out.slack)
                ? OCCLUDER_HIDDEN : OCCLUDER_VISIBLE;
        blur = needed;
        block = occluder_buffer_block_(buffer, &out, buffer->margin + blur + out.slack);
    }
    return OCCLUDER_VISIBLE; /* it has not settled */
}

#ifdef __cplusplus
}
#endif
#endif
