/* Reads occluder files (.occ) in place: no allocation, no copy, no dependency.  C99 and C++.
 *
 *     occluder_file file;
 *     if (occluder_open(bytes, size, &file) != OCCLUDER_OK) ...
 *     occluder_level level = occluder_level_at(&file, 0);            // the finest
 *     for (i = 0; i < 3 * level.triangle_count; ++i)
 *         corner = level.positions + 3 * occluder_index(&level, i);  // x, y, z
 *
 * Positions are relative to `origin`; add it in double precision, or move the camera by it.
 * Triangles wind counter-clockwise seen from their front, in a right-handed space.  Unless the file
 * is `single_sided` they are to be drawn without culling back faces.
 *
 * occluder_open() checks every figure and every index: what it accepts can be used as it is, and a
 * damaged file is refused.  The bytes have to begin at a multiple of 4 (mapped files do; SIMD wants
 * 16, which all blocks keep where the file does) and to stay where they are while they are used.
 * The machine has to be little-endian, as all that software rasterisers run on are. */
#ifndef OCCLUDER_H
#define OCCLUDER_H

#include <stddef.h>
#include <stdint.h>
#include <string.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef enum {
    OCCLUDER_OK = 0,
    OCCLUDER_NOT_ONE,        /* does not begin as an occluder file */
    OCCLUDER_OTHER_VERSION,  /* of a version that this header does not know */
    OCCLUDER_WRONG_SIZE,     /* cut short, or with bytes behind its end */
    OCCLUDER_DAMAGED,        /* a figure or an index is out of range */
    OCCLUDER_UNALIGNED,      /* the bytes do not begin at a multiple of 4 */
    OCCLUDER_BIG_ENDIAN      /* the machine is */
} occluder_status;

typedef struct {
    const float *positions;   /* 3 * vertex_count, relative to the file's origin */
    const void *indices;      /* 3 * triangle_count, see occluder_index() */
    uint32_t vertex_count;
    uint32_t triangle_count;
    uint32_t index_bytes;     /* 2 or 4 */
    uint32_t resolution;      /* voxels along the longest edge, 0 if not known */
    double error_bound;       /* no point is further from the original; infinite if not known */
    double deviation;         /* what was measured of it, NaN if not known */
    double switch_distance;   /* good enough from here on, for the screen it was made for */
} occluder_level;

typedef struct {
    const unsigned char *bytes;
    size_t size;
    uint32_t level_count;     /* at least 1, finest first */
    uint32_t screen_height;   /* pixels that the switch distances are for, 0 for no levels */
    double fov;               /* degrees, vertical */
    double pixel_error;
    double origin[3];
    float low[3], high[3];    /* box of all levels, relative to the origin */
    int single_sided;
    int welded;               /* no two vertices of a level lie in the same place */
    size_t table;             /* where the levels' figures begin */
} occluder_file;

enum { OCCLUDER_HEADER_BYTES = 128, OCCLUDER_LEVEL_BYTES = 64, OCCLUDER_MOST_LEVELS = 64 };

static inline uint32_t occluder_u32_(const unsigned char *at)
{
    uint32_t value;
    memcpy(&value, at, sizeof value);
    return value;
}

static inline uint64_t occluder_u64_(const unsigned char *at)
{
    uint64_t value;
    memcpy(&value, at, sizeof value);
    return value;
}

static inline double occluder_f64_(const unsigned char *at)
{
    double value;
    memcpy(&value, at, sizeof value);
    return value;
}

/* The level, 0 the finest; `index` has to be below `level_count`. */
static inline occluder_level occluder_level_at(const occluder_file *file, uint32_t index)
{
    const unsigned char *row = file->bytes + file->table + (size_t)index * OCCLUDER_LEVEL_BYTES;
    occluder_level level;
    level.error_bound = occluder_f64_(row);
    level.deviation = occluder_f64_(row + 8);
    level.switch_distance = occluder_f64_(row + 16);
    level.positions = (const float *)(const void *)(file->bytes + (size_t)occluder_u64_(row + 24));
    level.indices = file->bytes + (size_t)occluder_u64_(row + 32);
    level.vertex_count = occluder_u32_(row + 40);
    level.triangle_count = occluder_u32_(row + 44);
    level.index_bytes = occluder_u32_(row + 48);
    level.resolution = occluder_u32_(row + 52);
    return level;
}

/* The vertex of a corner, 0 to 3 * triangle_count - 1; triangle k has corners 3k, 3k + 1, 3k + 2. */
static inline uint32_t occluder_index(const occluder_level *level, size_t corner)
{
    if (level->index_bytes == 2)
        return ((const uint16_t *)level->indices)[corner];
    return ((const uint32_t *)level->indices)[corner];
}

/* The coarsest level that is good enough at a distance from the eye to the nearest point. */
static inline uint32_t occluder_level_for(const occluder_file *file, double distance)
{
    uint32_t index = file->level_count - 1;
    while (index > 0 && !(occluder_level_at(file, index).switch_distance <= distance))
        --index;
    return index;
}

/* Whether a block lies in the file, behind the table, where it is aligned. */
static inline int occluder_fits_(uint64_t begin, uint64_t length, uint64_t size)
{
    return begin % 16 == 0 && begin >= OCCLUDER_HEADER_BYTES && begin <= size
        && length <= size - begin;
}

static inline occluder_status occluder_check_level_(const occluder_file *file, uint32_t index)
{
    const unsigned char *row = file->bytes + file->table + (size_t)index * OCCLUDER_LEVEL_BYTES;
    const uint64_t vertices = occluder_u32_(row + 40), triangles = occluder_u32_(row + 44);
    const uint64_t width = occluder_u32_(row + 48);
    occluder_level level;
    uint64_t corner;
    if ((width != 2 && width != 4) || !(occluder_f64_(row) >= 0.0)
        || !occluder_fits_(occluder_u64_(row + 24), 12 * vertices, file->size)
        || !occluder_fits_(occluder_u64_(row + 32), 3 * width * triangles, file->size))
        return OCCLUDER_DAMAGED;
    level = occluder_level_at(file, index);
    for (corner = 0; corner < 3 * triangles; ++corner)
        if (occluder_index(&level, (size_t)corner) >= vertices)
            return OCCLUDER_DAMAGED;
    return OCCLUDER_OK;
}

static inline occluder_status occluder_open(const void *bytes, size_t size, occluder_file *file)
{
    static const unsigned char magic[8] = {0x89, 'O', 'C', 'C', '\r', '\n', 0x1a, '\n'};
    const unsigned char *at = (const unsigned char *)bytes;
    const uint32_t one = 1;
    uint32_t index;
    memset(file, 0, sizeof *file);
    if (*(const unsigned char *)&one != 1)
        return OCCLUDER_BIG_ENDIAN;
    if ((uintptr_t)bytes % 4 != 0)
        return OCCLUDER_UNALIGNED;
    if (size < OCCLUDER_HEADER_BYTES || memcmp(at, magic, sizeof magic) != 0)
        return OCCLUDER_NOT_ONE;
    if (occluder_u32_(at + 8) != 1)
        return OCCLUDER_OTHER_VERSION;
    if (occluder_u64_(at + 16) != size)
        return OCCLUDER_WRONG_SIZE;
    file->bytes = at;
    file->size = size;
    file->single_sided = (occluder_u32_(at + 12) & 1u) != 0;
    file->welded = (occluder_u32_(at + 12) & 2u) != 0;
    file->level_count = occluder_u32_(at + 24);
    file->table = occluder_u32_(at + 28);
    memcpy(file->origin, at + 32, sizeof file->origin);
    memcpy(file->low, at + 56, sizeof file->low);
    memcpy(file->high, at + 68, sizeof file->high);
    file->pixel_error = occluder_f64_(at + 80);
    file->fov = occluder_f64_(at + 88);
    file->screen_height = occluder_u32_(at + 96);
    if (file->level_count < 1 || file->level_count > OCCLUDER_MOST_LEVELS
        || !occluder_fits_(file->table, (uint64_t)file->level_count * OCCLUDER_LEVEL_BYTES, size))
        return OCCLUDER_DAMAGED;
    for (index = 0; index < 3; ++index)
        if (!(file->origin[index] - file->origin[index] == 0.0)) /* NaN or infinite */
            return OCCLUDER_DAMAGED;
    for (index = 0; index < file->level_count; ++index)
        if (occluder_check_level_(file, index) != OCCLUDER_OK)
            return OCCLUDER_DAMAGED;
    return OCCLUDER_OK;
}

/* What a status means, in a few words. */
static inline const char *occluder_text(occluder_status status)
{
    switch (status) {
    case OCCLUDER_OK: return "all is well";
    case OCCLUDER_NOT_ONE: return "this is no occluder file";
    case OCCLUDER_OTHER_VERSION: return "an occluder file of another version";
    case OCCLUDER_WRONG_SIZE: return "the file is cut short, or longer than it says";
    case OCCLUDER_DAMAGED: return "the file is damaged";
    case OCCLUDER_UNALIGNED: return "the bytes do not begin at a multiple of 4";
    case OCCLUDER_BIG_ENDIAN: return "this machine is big-endian";
    }
    return "unknown";
}

#ifdef __cplusplus
}
#endif
#endif
