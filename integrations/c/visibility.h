/* Reads files of potentially visible sets (.pvs) in place: no allocation, no copy, no dependency.
 * C99 and C++.
 *
 *     visibility_file file;
 *     if (visibility_open(bytes, size, &file) != VISIBILITY_OK) ...
 *     if (!visibility_scene_matches(&file, digest)) ...     // made of another scene
 *     cell = visibility_cell_at(&file, eye);                 // as the viewer moves
 *     visibility_set(&file, cell, bits);                     // visibility_words(&file) of 64 bits
 *     if (bits[object / 64] >> object % 64 & 1) ...          // may be seen: draw it
 *
 * Files of version 3 may tell besides from which altitude on an object is seen, and which of its
 * slices are to be drawn:
 *
 *     visibility_set_from(&file, cell, eye, bits);           // as the viewer climbs or falls, too
 *     slices = visibility_slices(&file, cell, object);
 *     visibility_drawn(&file, slices, drawn);                // slices to draw, of each axis
 *
 * Objects are numbered in the scene's order.  Everything is visible outside of all cells
 * (VISIBILITY_NO_CELL) and from cells that are not computed.  Where cells overlap, the set of each
 * of them holds all that a viewer there sees: take any, or join them by & for fewer objects.
 *
 * visibility_open() checks the checksum, every figure and every run: what it accepts can be used as
 * it is, and a damaged file is refused.  It needs 8 KiB of stack.  The bytes have to begin at a
 * multiple of 4 (mapped files do) and to stay where they are while they are used; any number of
 * threads may look up in them.  The machine has to be little-endian. */
#ifndef VISIBILITY_H
#define VISIBILITY_H

#include <stddef.h>
#include <stdint.h>
#include <string.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef enum {
    VISIBILITY_OK = 0,
    VISIBILITY_NOT_ONE,        /* does not begin as a file of visible sets */
    VISIBILITY_OTHER_VERSION,  /* of a version, or with parts, that this header does not know */
    VISIBILITY_WRONG_SIZE,     /* cut short, or with bytes behind its end */
    VISIBILITY_DAMAGED,        /* the checksum is another, or a figure is out of range */
    VISIBILITY_UNALIGNED,      /* the bytes do not begin at a multiple of 4 */
    VISIBILITY_BIG_ENDIAN      /* the machine is */
} visibility_status;

typedef enum {
    VISIBILITY_CULL_MAP = 0,
    VISIBILITY_SLICE_WISE,
    VISIBILITY_VOXEL_COLUMN,
    VISIBILITY_STRONG_OCCLUDER
} visibility_method;

typedef struct {
    const unsigned char *bytes;
    size_t size;
    uint32_t object_count, cell_count, row_count;
    visibility_method method;   /* that found the sets */
    int conservative;           /* what is not in a cell's set is hidden from all of it */
    int partial;                /* some cells are not computed */
    int up;                     /* the scene's up axis: 0 x, 1 y, 2 z */
    double origin[3];           /* of the cells, in their axes: two of the plan, then up */
    float low[3], high[3];      /* box of all cells, relative to the origin */
    const unsigned char *scene;     /* 8 bytes that tell this scene from another */
    const unsigned char *settings;  /* 8 bytes that tell settings from others */
    const uint32_t *order;      /* object_count: the object at each place of a row */
    const float *cells;         /* 8 a cell: x0 y0 x1 y1 x2 y2 z0 z1 */
    const uint32_t *row_of;     /* cell_count: the row of each cell */
    const uint32_t *row_offsets;    /* row_count + 1: where each row begins in `rows` */
    const unsigned char *rows;
    const uint32_t *name_offsets;   /* where each group of names begins in `names`, and the end; or
                                       NULL: there are no names */
    const unsigned char *names;
    float grid_low[2], tile_edge;
    uint32_t columns, lines;    /* of the look-up grid */
    const uint32_t *tile_offsets;   /* columns * lines + 1: where each begins in `tile_cells` */
    const uint32_t *tile_cells;
    uint32_t slice_count;       /* slices of an object's box along each axis; 0: there are none */
    const uint32_t *slice_starts;   /* cell_count + 1: the first object of each cell in `slices` */
    const int8_t *slices;
    float altitude_low, altitude_step;  /* altitude k is low + k step, a height less origin[2] */
    const uint16_t *altitudes;  /* object_count for each cell, in the scene's order; or NULL */
} visibility_file;

#define VISIBILITY_NO_CELL 0xFFFFFFFFu

/* In place of an altitude: nothing of the object is seen, however high the viewer is. */
#define VISIBILITY_NEVER 0xFFFFu

enum { VISIBILITY_HEADER_BYTES = 144, VISIBILITY_GRID_BYTES = 32, VISIBILITY_CELL_FLOATS = 8,
       VISIBILITY_NAME_GROUP = 16, VISIBILITY_PART_BYTES = 16 };

/* In place of a row: the cell is not computed. */
#define VISIBILITY_NO_ROW_ 0xFFFFFFFFu

static inline uint32_t visibility_u32_(const unsigned char *at)
{
    uint32_t value;
    memcpy(&value, at, sizeof value);
    return value;
}

static inline uint64_t visibility_u64_(const unsigned char *at)
{
    uint64_t value;
    memcpy(&value, at, sizeof value);
    return value;
}

/* By its bits, since compilers that assume finite numbers drop comparisons with NaN. */
static inline int visibility_is_finite_(float value)
{
    uint32_t bits;
    memcpy(&bits, &value, sizeof bits);
    return (bits & 0x7f800000u) != 0x7f800000u;
}

static inline int visibility_is_nan_(float value)
{
    uint32_t bits;
    memcpy(&bits, &value, sizeof bits);
    return (bits & 0x7fffffffu) > 0x7f800000u;
}

/* --- Cells */

/* A world point in the space of the cells: the last axis is up, and the origin is theirs. */
static inline void visibility_to_cells_(
    const visibility_file *file, const double world[3], double point[3])
{
    const int up = file->up;
    point[0] = world[up == 2 ? 0 : up + 1] - file->origin[0];
    point[1] = world[up == 0 ? 2 : up - 1] - file->origin[1];
    point[2] = world[up] - file->origin[2];
}

/* Whether (px, py) is to the left of the line from (ax, ay) to (bx, by), or on it. */
static inline int visibility_left_(float ax, float ay, float bx, float by, double px, double py)
{
    /* Two products, not their difference, which compilers may fuse and so round otherwise. */
    return ((double)bx - (double)ax) * (py - (double)ay)
        >= ((double)by - (double)ay) * (px - (double)ax);
}

static inline float visibility_least_(float a, float b, float c)
{
    const float least = a < b ? a : b;
    return least < c ? least : c;
}

static inline float visibility_most_(float a, float b, float c)
{
    const float most = a > b ? a : b;
    return most > c ? most : c;
}

/* Whether a cell holds a point of its space, borders included. */
static inline int visibility_holds_(const float *cell, const double point[3])
{
    const double x = point[0], y = point[1];
    if (!(point[2] >= (double)cell[6] && point[2] <= (double)cell[7]))
        return 0;
    if (visibility_is_nan_(cell[4])) /* a box */
        return x >= (double)cell[0] && x <= (double)cell[2] && y >= (double)cell[1]
            && y <= (double)cell[3];
    /* Within the box around a prism, too, as the look-up grid has it: edges alone may round. */
    return x >= (double)visibility_least_(cell[0], cell[2], cell[4])
        && x <= (double)visibility_most_(cell[0], cell[2], cell[4])
        && y >= (double)visibility_least_(cell[1], cell[3], cell[5])
        && y <= (double)visibility_most_(cell[1], cell[3], cell[5])
        && visibility_left_(cell[0], cell[1], cell[2], cell[3], x, y)
        && visibility_left_(cell[2], cell[3], cell[4], cell[5], x, y)
        && visibility_left_(cell[4], cell[5], cell[0], cell[1], x, y);
}

/* The column or line of a tile, held to the grid. */
static inline uint32_t visibility_step_(double along, float edge, uint32_t count)
{
    const double step = along / (double)edge;
    if (!(step >= 1.0))
        return 0;
    return step < (double)count ? (uint32_t)step : count - 1;
}

/* How many cells hold a world point, borders included; the first `most` of them, ascending, are
 * written to `cells`. */
static inline uint32_t visibility_cells_at(
    const visibility_file *file, const double world[3], uint32_t *cells, uint32_t most)
{
    double point[3];
    uint32_t found = 0, entry, end;
    size_t tile;
    int axis;
    visibility_to_cells_(file, world, point);
    for (axis = 0; axis < 3; ++axis)
        if (!(point[axis] >= (double)file->low[axis] && point[axis] <= (double)file->high[axis]))
            return 0;
    tile = visibility_step_(point[1] - (double)file->grid_low[1], file->tile_edge, file->lines);
    tile = tile * file->columns
        + visibility_step_(point[0] - (double)file->grid_low[0], file->tile_edge, file->columns);
    end = file->tile_offsets[tile + 1];
    for (entry = file->tile_offsets[tile]; entry < end; ++entry) {
        const uint32_t cell = file->tile_cells[entry];
        if (visibility_holds_(file->cells + (size_t)cell * VISIBILITY_CELL_FLOATS, point)) {
            if (found < most)
                cells[found] = cell;
            ++found;
        }
    }
    return found;
}

/* The first cell that holds a world point, or VISIBILITY_NO_CELL. */
static inline uint32_t visibility_cell_at(const visibility_file *file, const double world[3])
{
    uint32_t cell = VISIBILITY_NO_CELL;
    visibility_cells_at(file, world, &cell, 1);
    return cell;
}

/* --- Sets */

/* The runs of visible objects of a row: `first` and `count` are places in the row. */
typedef struct {
    const unsigned char *at, *end;
    uint32_t first, count;
} visibility_runs_;

/* Whether the set of a cell is known; else everything is visible from it. */
static inline int visibility_runs_of_(
    const visibility_file *file, uint32_t cell, visibility_runs_ *runs)
{
    uint32_t row;
    if (cell >= file->cell_count || (row = file->row_of[cell]) == VISIBILITY_NO_ROW_)
        return 0;
    runs->at = file->rows + file->row_offsets[row];
    runs->end = file->rows + file->row_offsets[row + 1];
    runs->first = runs->count = 0;
    return 1;
}

static inline uint32_t visibility_number_(const unsigned char **at)
{
    uint32_t value = *(*at)++, part;
    unsigned shift;
    if (value < 0x80)
        return value;
    value &= 0x7f;
    for (shift = 7; (part = *(*at)++) >= 0x80; shift += 7)
        value |= (part & 0x7f) << shift;
    return value | part << shift;
}

static inline int visibility_next_(visibility_runs_ *runs)
{
    if (runs->at >= runs->end)
        return 0;
    runs->first += runs->count + visibility_number_(&runs->at);
    if (runs->at >= runs->end) /* what is behind the last run is hidden, told or not */
        return 0;
    runs->count = visibility_number_(&runs->at);
    return 1;
}

/* How many words of 64 bits a set takes. */
static inline size_t visibility_words(const visibility_file *file)
{
    return (size_t)file->object_count / 64 + (file->object_count % 64 != 0);
}

/* Writes the set of a cell as visibility_words() words: object k is bit k % 64 of word k / 64, and
 * bits behind the last object are 0.  All objects for VISIBILITY_NO_CELL and cells not computed. */
static inline void visibility_set(const visibility_file *file, uint32_t cell, uint64_t *bits)
{
    const size_t words = visibility_words(file);
    visibility_runs_ runs;
    if (!visibility_runs_of_(file, cell, &runs)) {
        memset(bits, 0xff, words * sizeof *bits);
        if (file->object_count % 64)
            bits[words - 1] = ((uint64_t)1 << file->object_count % 64) - 1;
        return;
    }
    memset(bits, 0, words * sizeof *bits);
    while (visibility_next_(&runs)) {
        const uint32_t *object = file->order + runs.first, *end = object + runs.count;
        for (; object < end; ++object)
            bits[*object / 64] |= (uint64_t)1 << *object % 64;
    }
}

/* Writes the objects that are visible from a cell, in no order that means anything, and returns how
 * many they are.  There has to be room for all objects. */
static inline uint32_t visibility_visible(
    const visibility_file *file, uint32_t cell, uint32_t *objects)
{
    visibility_runs_ runs;
    uint32_t count = 0;
    if (!visibility_runs_of_(file, cell, &runs)) {
        for (; count < file->object_count; ++count)
            objects[count] = count;
        return count;
    }
    for (; visibility_next_(&runs); count += runs.count)
        memcpy(objects + count, file->order + runs.first, runs.count * sizeof *objects);
    return count;
}

/* Whether one object is visible from a cell.  This looks through the cell's whole set: for many
 * objects take visibility_set(). */
static inline int visibility_is_visible(
    const visibility_file *file, uint32_t cell, uint32_t object)
{
    visibility_runs_ runs;
    if (!visibility_runs_of_(file, cell, &runs))
        return 1;
    while (visibility_next_(&runs)) {
        const uint32_t *other = file->order + runs.first, *end = other + runs.count;
        for (; other < end; ++other)
            if (*other == object)
                return 1;
    }
    return 0;
}

/* --- Altitudes */

/* From which altitude on an object is seen over the plan of a cell: 0 from any height, also where
 * none is known, and VISIBILITY_NEVER from none.  `object` has to be below `object_count`. */
static inline uint32_t visibility_altitude(
    const visibility_file *file, uint32_t cell, uint32_t object)
{
    if (!file->altitudes || cell >= file->cell_count
        || file->row_of[cell] == VISIBILITY_NO_ROW_)
        return 0;
    return file->altitudes[(size_t)cell * file->object_count + object];
}

/* The height of an altitude along the up axis of the world; of neither 0 nor VISIBILITY_NEVER. */
static inline double visibility_height(const visibility_file *file, uint32_t altitude)
{
    /* The product is exact, so compilers that fuse it with the sum round alike. */
    return (double)file->altitude_low + (double)altitude * (double)file->altitude_step
        + file->origin[2];
}

/* The highest altitude that a height in the cells' space reaches, or 0: from there those objects
 * are seen whose altitude is no higher. */
static inline uint32_t visibility_level_(const visibility_file *file, double height)
{
    uint32_t least = 0, above = VISIBILITY_NEVER;
    while (above - least > 1) {
        const uint32_t middle = least + (above - least) / 2;
        if ((double)file->altitude_low + (double)middle * (double)file->altitude_step > height)
            above = middle;
        else
            least = middle;
    }
    return least;
}

/* As visibility_set(), but of what may be seen from the height of a viewer at a world point over
 * the plan of the cell.  Without altitudes that is the cell's set, and all objects below and above
 * the cell; with them it is known at any height. */
static inline void visibility_set_from(
    const visibility_file *file, uint32_t cell, const double world[3], uint64_t *bits)
{
    double point[3];
    const uint16_t *altitudes;
    uint32_t level, object;
    visibility_runs_ runs;
    int within;
    if (!visibility_runs_of_(file, cell, &runs)) {
        visibility_set(file, VISIBILITY_NO_CELL, bits);
        return;
    }
    visibility_to_cells_(file, world, point);
    within = point[2] >= (double)file->cells[(size_t)cell * VISIBILITY_CELL_FLOATS + 6]
        && point[2] <= (double)file->cells[(size_t)cell * VISIBILITY_CELL_FLOATS + 7];
    if (!file->altitudes) {
        visibility_set(file, within ? cell : VISIBILITY_NO_CELL, bits);
        return;
    }
    altitudes = file->altitudes + (size_t)cell * file->object_count;
    level = visibility_level_(file, point[2]);
    memset(bits, 0, visibility_words(file) * sizeof *bits);
    if (!within) {
        for (object = 0; object < file->object_count; ++object)
            bits[object / 64] |= (uint64_t)(altitudes[object] <= level) << object % 64;
        return;
    }
    while (visibility_next_(&runs)) {
        const uint32_t *at = file->order + runs.first, *end = at + runs.count;
        for (; at < end; ++at)
            bits[*at / 64] |= (uint64_t)(altitudes[*at] <= level) << *at % 64;
    }
}

/* --- Slices */

/* The slices of all objects that are visible from a cell, three numbers each, in the order in which
 * visibility_visible() writes these.  NULL where all are drawn as wholes: the file has no slices,
 * or the cell is not computed. */
static inline const int8_t *visibility_cell_slices(
    const visibility_file *file, uint32_t cell, uint32_t *count)
{
    *count = 0;
    if (!file->slice_count || cell >= file->cell_count
        || file->row_of[cell] == VISIBILITY_NO_ROW_)
        return NULL;
    *count = file->slice_starts[cell + 1] - file->slice_starts[cell];
    return file->slices + 3 * (size_t)file->slice_starts[cell];
}

/* The slices of one object that is visible from a cell, three numbers; NULL where it is drawn as a
 * whole or hidden.  This looks through the cell's whole set: for many objects take
 * visibility_cell_slices(). */
static inline const int8_t *visibility_slices(
    const visibility_file *file, uint32_t cell, uint32_t object)
{
    visibility_runs_ runs;
    uint32_t count;
    const int8_t *slices = visibility_cell_slices(file, cell, &count);
    if (!slices || !visibility_runs_of_(file, cell, &runs))
        return NULL;
    while (visibility_next_(&runs)) {
        const uint32_t *other = file->order + runs.first, *end = other + runs.count;
        for (; other < end; ++other, slices += 3)
            if (*other == object)
                return slices;
    }
    return NULL;
}

/* Writes the lowest and the highest slice of each axis that is drawn of an object, counted from 1
 * at the low side of its box; 1 and 0 where that axis draws none.  The slices of all axes are
 * drawn: a triangle is hidden only if it is in no slice that any of them draws.  `slices` are three
 * numbers of the file.  Of an object that is drawn as a whole, NULL or three times 0, each axis
 * draws all; in a file without slices that is one. */
static inline void visibility_drawn(
    const visibility_file *file, const int8_t *slices, uint32_t drawn[3][2])
{
    const uint32_t count = file->slice_count ? file->slice_count : 1;
    const int whole = !slices || (!slices[0] && !slices[1] && !slices[2]);
    int axis;
    for (axis = 0; axis < 3; ++axis) {
        const int value = whole ? 0 : slices[axis];
        drawn[axis][0] = 1;
        drawn[axis][1] = whole ? count : 0;
        if (value < 0 || (value > 0 && axis == 2)) {
            drawn[axis][0] = (uint32_t)(value < 0 ? 1 - value : value);
            drawn[axis][1] = count;
        } else if (value > 0)
            drawn[axis][1] = (uint32_t)value;
    }
}

/* --- The scene */

/* Writes the name of an object, UTF-8 without a 0 behind it, as far as there is `room`, and returns
 * how many bytes it has; none if there are no names.  `object` has to be below `object_count`. */
static inline size_t visibility_name(
    const visibility_file *file, uint32_t object, char *name, size_t room)
{
    const unsigned char *at;
    size_t length = 0;
    uint32_t index = object - object % VISIBILITY_NAME_GROUP;
    if (!file->name_offsets)
        return 0;
    at = file->names + file->name_offsets[object / VISIBILITY_NAME_GROUP];
    for (; index <= object; ++index) { /* each has some bytes of the name before, and its own */
        const size_t shared = visibility_number_(&at), more = visibility_number_(&at);
        if (shared < room && more)
            memcpy(name + shared, at, more < room - shared ? more : room - shared);
        at += more;
        length = shared + more;
    }
    return length;
}

/* Whether the file is of the scene that has this digest. */
static inline int visibility_scene_matches(
    const visibility_file *file, const unsigned char digest[8])
{
    return memcmp(file->scene, digest, 8) == 0;
}

/* --- What visibility_open() checks */

/* Four bytes at a time; `crc` is 0xFFFFFFFF at first, and what all parts give is to be inverted. */
static inline uint32_t visibility_crc_(
    uint32_t table[4][256], uint32_t crc, const unsigned char *at, size_t size)
{
    for (; size >= 4; size -= 4, at += 4) {
        crc ^= visibility_u32_(at);
        crc = table[3][crc & 0xff] ^ table[2][crc >> 8 & 0xff] ^ table[1][crc >> 16 & 0xff]
            ^ table[0][crc >> 24];
    }
    for (; size; --size, ++at)
        crc = table[0][(crc ^ *at) & 0xff] ^ crc >> 8;
    return crc;
}

/* Whether the CRC-32 of the whole file is the one in its header, taken with 0 in its place. */
static inline int visibility_check_crc_(const unsigned char *bytes, size_t size)
{
    static const unsigned char nothing[4] = {0, 0, 0, 0};
    const size_t place = VISIBILITY_HEADER_BYTES - 4;
    uint32_t table[4][256], index, crc;
    int bit;
    for (index = 0; index < 256; ++index) {
        for (crc = index, bit = 0; bit < 8; ++bit)
            crc = crc >> 1 ^ (crc & 1 ? 0xEDB88320u : 0);
        table[0][index] = crc;
    }
    for (index = 0; index < 256; ++index)
        for (bit = 1; bit < 4; ++bit)
            table[bit][index] = table[0][table[bit - 1][index] & 0xff] ^ table[bit - 1][index] >> 8;
    crc = visibility_crc_(table, 0xFFFFFFFFu, bytes, place);
    crc = visibility_crc_(table, crc, nothing, sizeof nothing);
    crc = visibility_crc_(
        table, crc, bytes + VISIBILITY_HEADER_BYTES, size - VISIBILITY_HEADER_BYTES);
    return ~crc == visibility_u32_(bytes + place);
}

/* The block of a place in the header's table, or NULL where `length` bytes of it, behind the first
 * `skip`, are not in the file. */
static inline const unsigned char *visibility_block_(
    const visibility_file *file, int place, uint64_t skip, uint64_t length)
{
    const uint64_t begin = 16 * (uint64_t)visibility_u32_(file->bytes + 88 + 4 * place) + skip;
    if (begin < VISIBILITY_HEADER_BYTES || begin > file->size || length > file->size - begin)
        return NULL;
    return file->bytes + (size_t)begin;
}

static inline const uint32_t *visibility_numbers_(
    const visibility_file *file, int place, uint64_t skip, uint64_t count)
{
    return (const uint32_t *)(const void *)visibility_block_(file, place, skip, 4 * count);
}

/* Whether `count` + 1 offsets begin with 0 and never fall. */
static inline int visibility_ascend_(const uint32_t *offsets, uint64_t count)
{
    uint64_t index;
    if (!offsets || offsets[0] != 0)
        return 0;
    for (index = 0; index < count; ++index)
        if (offsets[index + 1] < offsets[index])
            return 0;
    return 1;
}

/* Whether the order names each object once. */
static inline int visibility_check_order_(const visibility_file *file)
{
    unsigned char seen[4096]; /* a bit an object; more objects take turns */
    const uint32_t count = file->object_count, step = 8 * (uint32_t)sizeof seen;
    uint64_t begin;
    uint32_t place;
    for (begin = 0; begin < count; begin += step) {
        memset(seen, 0, sizeof seen);
        for (place = 0; place < count; ++place) {
            const uint32_t object = file->order[place], bit = object - (uint32_t)begin;
            if (object >= count)
                return 0;
            if (object < begin || bit >= step)
                continue;
            if (seen[bit / 8] >> bit % 8 & 1)
                return 0;
            seen[bit / 8] = (unsigned char)(seen[bit / 8] | 1u << bit % 8);
        }
    }
    return 1;
}

static inline int visibility_check_cell_(const float *cell)
{
    const double ux = (double)cell[2] - (double)cell[0], uy = (double)cell[3] - (double)cell[1];
    const int box = visibility_is_nan_(cell[4]) && visibility_is_nan_(cell[5]);
    int index;
    for (index = 0; index < VISIBILITY_CELL_FLOATS; ++index)
        if (!(box && (index == 4 || index == 5)) && !visibility_is_finite_(cell[index]))
            return 0;
    if (!(cell[6] < cell[7]))
        return 0;
    if (box)
        return cell[0] < cell[2] && cell[1] < cell[3];
    /* Counter-clockwise, and so with an area. */
    return ux * ((double)cell[5] - (double)cell[1]) > uy * ((double)cell[4] - (double)cell[0]);
}

/* Whether every cell holds something, has a row, and lies in the box of all, which fits them. */
static inline int visibility_check_cells_(const visibility_file *file)
{
    float low[3] = {0, 0, 0}, high[3] = {0, 0, 0};
    uint32_t index;
    int axis;
    for (index = 0; index < file->cell_count; ++index) {
        const float *cell = file->cells + (size_t)index * VISIBILITY_CELL_FLOATS;
        const uint32_t row = file->row_of[index];
        if (!visibility_check_cell_(cell)
            || (row != VISIBILITY_NO_ROW_ && row >= file->row_count))
            return 0;
        for (axis = 0; axis < 3; ++axis) {
            const int box = visibility_is_nan_(cell[4]);
            const float a = axis == 2 ? cell[6] : cell[axis];
            const float b = axis == 2 ? cell[7] : cell[axis + 2];
            const float c = axis == 2 || box ? a : cell[axis + 4];
            const float least = visibility_least_(a, b, c), most = visibility_most_(a, b, c);
            if (index == 0 || least < low[axis])
                low[axis] = least;
            if (index == 0 || most > high[axis])
                high[axis] = most;
        }
    }
    for (axis = 0; axis < 3; ++axis)
        if (!visibility_is_finite_(file->low[axis]) || !visibility_is_finite_(file->high[axis])
            || low[axis] != file->low[axis] || high[axis] != file->high[axis])
            return 0;
    return 1;
}

/* Whether the look-up grid names cells that there are, ascending in each tile. */
static inline int visibility_check_grid_(const visibility_file *file)
{
    const uint64_t tiles = (uint64_t)file->columns * file->lines;
    uint64_t tile;
    if (!visibility_is_finite_(file->grid_low[0]) || !visibility_is_finite_(file->grid_low[1])
        || !visibility_is_finite_(file->tile_edge) || !(file->tile_edge > 0.0f))
        return 0;
    for (tile = 0; tile < tiles; ++tile) {
        uint32_t entry = file->tile_offsets[tile];
        const uint32_t begin = entry, end = file->tile_offsets[tile + 1];
        for (; entry < end; ++entry)
            if (file->tile_cells[entry] >= file->cell_count
                || (entry > begin && file->tile_cells[entry] <= file->tile_cells[entry - 1]))
                return 0;
    }
    return 1;
}

/* Whether the bytes of a row are runs of at most `objects` in all, none but the first empty. */
static inline int visibility_check_row_(
    const unsigned char *at, const unsigned char *end, uint32_t objects)
{
    const unsigned char *begin = at;
    uint64_t total = 0;
    while (at < end) {
        const int first = at == begin;
        uint64_t value = 0;
        unsigned shift = 0;
        for (;; shift += 7) {
            if (at == end || shift > 28)
                return 0;
            value |= (uint64_t)(*at & 0x7f) << shift;
            if (*at++ < 0x80)
                break;
        }
        total += value;
        if ((value == 0 && !first) || total > objects)
            return 0;
    }
    return 1;
}

static inline int visibility_check_utf8_(const unsigned char *at, const unsigned char *end)
{
    while (at < end) {
        const unsigned char lead = *at++;
        /* What the next byte may be: fewer values where the letter would be told too long, be half
         * a letter of UTF-16, or lie behind the last. */
        unsigned char low = lead == 0xe0 ? 0xa0 : lead == 0xf0 ? 0x90 : 0x80;
        unsigned char high = lead == 0xed ? 0x9f : lead == 0xf4 ? 0x8f : 0xbf;
        int more = lead < 0x80 ? 0 : lead < 0xe0 ? 1 : lead < 0xf0 ? 2 : 3;
        if ((lead >= 0x80 && lead < 0xc2) || lead > 0xf4 || end - at < more)
            return 0;
        for (; more; --more, ++at) {
            if (*at < low || *at > high)
                return 0;
            low = 0x80;
            high = 0xbf;
        }
    }
    return 1;
}

/* Finds the look-up grid; its tiles are in the file if this succeeds. */
static inline int visibility_find_grid_(visibility_file *file)
{
    const unsigned char *head = visibility_block_(file, 2, 0, VISIBILITY_GRID_BYTES);
    uint64_t tiles;
    if (!head)
        return 0;
    memcpy(file->grid_low, head, sizeof file->grid_low);
    memcpy(&file->tile_edge, head + 8, sizeof file->tile_edge);
    file->columns = visibility_u32_(head + 12);
    file->lines = visibility_u32_(head + 16);
    tiles = (uint64_t)file->columns * file->lines;
    if (tiles == 0 || tiles > file->size / 4) /* so that no sum below is too large */
        return 0;
    file->tile_offsets = visibility_numbers_(file, 2, VISIBILITY_GRID_BYTES, tiles + 1);
    if (!visibility_ascend_(file->tile_offsets, tiles))
        return 0;
    file->tile_cells = visibility_numbers_(
        file, 2, VISIBILITY_GRID_BYTES + 4 * (tiles + 1), file->tile_offsets[tiles]);
    return file->tile_cells != NULL;
}

/* Finds the rows and checks their runs. */
static inline int visibility_find_rows_(visibility_file *file)
{
    const uint32_t count = file->row_count;
    uint32_t row;
    file->row_offsets = visibility_numbers_(file, 4, 0, (uint64_t)count + 1);
    if (!visibility_ascend_(file->row_offsets, count))
        return 0;
    file->rows = visibility_block_(file, 5, 0, file->row_offsets[count]);
    if (!file->rows)
        return 0;
    for (row = 0; row < count; ++row)
        if (!visibility_check_row_(file->rows + file->row_offsets[row],
                                   file->rows + file->row_offsets[row + 1], file->object_count))
            return 0;
    return 1;
}

/* Reads a number of at most five bytes that end before `end`, and says whether there is one. */
static inline int visibility_take_(
    const unsigned char **at, const unsigned char *end, uint64_t *value)
{
    unsigned shift;
    *value = 0;
    for (shift = 0; shift <= 28 && *at < end; shift += 7) {
        const unsigned char byte = *(*at)++;
        *value |= (uint64_t)(byte & 0x7f) << shift;
        if (byte < 0x80)
            return 1;
    }
    return 0;
}

/* Whether a group holds `count` names in UTF-8, each with whole letters of the name before. */
static inline int visibility_check_names_(
    const unsigned char *at, const unsigned char *end, uint32_t count)
{
    const unsigned char *own[VISIBILITY_NAME_GROUP]; /* what each name adds, */
    uint64_t begins[VISIBILITY_NAME_GROUP];          /* from which of its bytes on */
    uint64_t length = 0, shared, more;
    uint32_t index, before;
    for (index = 0; index < count; ++index) {
        if (!visibility_take_(&at, end, &shared) || !visibility_take_(&at, end, &more)
            || shared > length || more > (uint64_t)(end - at)
            || !visibility_check_utf8_(at, at + more))
            return 0;
        if (shared < length) { /* the byte of the name before at which it is cut */
            for (before = index - 1; begins[before] > shared;)
                --before;
            if ((own[before][shared - begins[before]] & 0xc0) == 0x80)
                return 0;
        }
        own[index] = at;
        begins[index] = shared;
        length = shared + more;
        at += more;
    }
    return at == end;
}

/* Finds the names, if there are any, and checks them. */
static inline int visibility_find_names_(visibility_file *file)
{
    const uint32_t size = VISIBILITY_NAME_GROUP, count = file->object_count;
    const uint32_t groups = count / size + (count % size != 0);
    uint32_t group;
    if (visibility_u32_(file->bytes + 120) == 0)
        return 1;
    file->name_offsets = visibility_numbers_(file, 8, 0, (uint64_t)groups + 1);
    if (!visibility_ascend_(file->name_offsets, groups))
        return 0;
    file->names
        = visibility_block_(file, 8, 4 * ((uint64_t)groups + 1), file->name_offsets[groups]);
    if (!file->names)
        return 0;
    for (group = 0; group < groups; ++group)
        if (!visibility_check_names_(file->names + file->name_offsets[group],
                                     file->names + file->name_offsets[group + 1],
                                     count - size * group < size ? count - size * group : size))
            return 0;
    return 1;
}

/* Finds the slices, if there are any, and checks that each visible object has its own. */
static inline int visibility_find_slices_(visibility_file *file)
{
    const uint64_t starts = (uint64_t)file->cell_count + 1;
    const unsigned char *head;
    visibility_runs_ runs;
    uint32_t cell, index;
    if (visibility_u32_(file->bytes + 112) == 0)
        return 1;
    head = visibility_block_(file, 6, 0, VISIBILITY_PART_BYTES);
    if (!head || (file->slice_count = visibility_u32_(head)) == 0 || file->slice_count > 127)
        return 0;
    file->slice_starts = visibility_numbers_(file, 6, VISIBILITY_PART_BYTES, starts);
    if (!visibility_ascend_(file->slice_starts, starts - 1))
        return 0;
    file->slices = (const int8_t *)(const void *)visibility_block_(
        file, 6, VISIBILITY_PART_BYTES + 4 * starts, 3 * (uint64_t)file->slice_starts[starts - 1]);
    if (!file->slices)
        return 0;
    for (cell = 0; cell < file->cell_count; ++cell) {
        uint32_t visible = 0;
        if (visibility_runs_of_(file, cell, &runs))
            while (visibility_next_(&runs))
                visible += runs.count;
        if (file->slice_starts[cell + 1] - file->slice_starts[cell] != visible)
            return 0;
    }
    for (index = 0; index < file->slice_starts[file->cell_count]; ++index) {
        const int8_t *slices = file->slices + 3 * (size_t)index;
        const int count = (int)file->slice_count;
        if (slices[0] > count || slices[0] <= -count || slices[1] > count || slices[1] <= -count
            || slices[2] > count || slices[2] < 0)
            return 0;
    }
    return 1;
}

/* Finds the altitudes, if there are any. */
static inline int visibility_find_altitudes_(visibility_file *file)
{
    const uint64_t count = (uint64_t)file->cell_count * file->object_count;
    const unsigned char *head;
    if (visibility_u32_(file->bytes + 116) == 0)
        return 1;
    head = visibility_block_(file, 7, 0, VISIBILITY_PART_BYTES);
    if (!head)
        return 0;
    memcpy(&file->altitude_low, head, sizeof file->altitude_low);
    memcpy(&file->altitude_step, head + 4, sizeof file->altitude_step);
    file->altitudes = (const uint16_t *)(const void *)visibility_block_(
        file, 7, VISIBILITY_PART_BYTES, 2 * count);
    return file->altitudes && visibility_is_finite_(file->altitude_low)
        && visibility_is_finite_(file->altitude_step) && file->altitude_step > 0.0f;
}

static inline int visibility_check_header_(const visibility_file *file, uint32_t method)
{
    int axis;
    for (axis = 0; axis < 3; ++axis) {
        uint64_t bits;
        memcpy(&bits, &file->origin[axis], sizeof bits);
        if ((bits >> 52 & 0x7ff) == 0x7ff) /* NaN or infinite */
            return 0;
    }
    return method <= VISIBILITY_STRONG_OCCLUDER && file->up < 3
        && file->object_count <= 0x7fffffffu;
}

/* Whether some cells are not computed. */
static inline int visibility_is_partial_(const visibility_file *file)
{
    uint32_t cell;
    for (cell = 0; cell < file->cell_count; ++cell)
        if (file->row_of[cell] == VISIBILITY_NO_ROW_)
            return 1;
    return 0;
}

static inline visibility_status visibility_open(
    const void *bytes, size_t size, visibility_file *file)
{
    static const unsigned char magic[8] = {0x89, 'P', 'V', 'S', '\r', '\n', 0x1a, '\n'};
    const unsigned char *at = (const unsigned char *)bytes;
    const uint32_t one = 1;
    uint32_t flags, parts, version, method;
    memset(file, 0, sizeof *file);
    if (*(const unsigned char *)&one != 1)
        return VISIBILITY_BIG_ENDIAN;
    if ((uintptr_t)bytes % 4 != 0)
        return VISIBILITY_UNALIGNED;
    if (size < VISIBILITY_HEADER_BYTES || memcmp(at, magic, sizeof magic) != 0)
        return VISIBILITY_NOT_ONE;
    flags = visibility_u32_(at + 12);
    version = visibility_u32_(at + 8);
    parts = (visibility_u32_(at + 112) ? 2u : 0u) | (visibility_u32_(at + 116) ? 4u : 0u);
    /* Known are conservative (1), partial (8) and the up axis (bits 8 and 9), and of version 3
     * slices (2) and altitudes (4), each with a block. */
    if ((version != 2 && version != 3) || (flags & ~(15u | 3u << 8)) != 0
        || (version == 2 && (parts | (flags & 6u)) != 0))
        return VISIBILITY_OTHER_VERSION;
    if (visibility_u64_(at + 16) != size)
        return VISIBILITY_WRONG_SIZE;
    if (!visibility_check_crc_(at, size) || (flags & 6u) != parts)
        return VISIBILITY_DAMAGED;
    file->bytes = at;
    file->size = size;
    file->conservative = (flags & 1u) != 0;
    file->partial = (flags & 8u) != 0;
    file->up = (int)(flags >> 8 & 3u);
    file->object_count = visibility_u32_(at + 24);
    file->cell_count = visibility_u32_(at + 28);
    file->row_count = visibility_u32_(at + 32);
    method = visibility_u32_(at + 36);
    memcpy(file->origin, at + 40, sizeof file->origin);
    memcpy(file->low, at + 64, sizeof file->low);
    memcpy(file->high, at + 76, sizeof file->high);
    file->scene = at + 124;
    file->settings = at + 132;
    if (!visibility_check_header_(file, method))
        return VISIBILITY_DAMAGED;
    file->method = (visibility_method)method;
    file->order = visibility_numbers_(file, 0, 0, file->object_count);
    file->cells = (const float *)(const void *)visibility_numbers_(
        file, 1, 0, (uint64_t)file->cell_count * VISIBILITY_CELL_FLOATS);
    file->row_of = visibility_numbers_(file, 3, 0, file->cell_count);
    if (!file->order || !file->cells || !file->row_of || !visibility_check_order_(file)
        || !visibility_check_cells_(file) || visibility_is_partial_(file) != file->partial
        || !visibility_find_grid_(file) || !visibility_check_grid_(file)
        || !visibility_find_rows_(file) || !visibility_find_slices_(file)
        || !visibility_find_altitudes_(file) || !visibility_find_names_(file))
        return VISIBILITY_DAMAGED;
    return VISIBILITY_OK;
}

/* What a status means, in a few words. */
static inline const char *visibility_text(visibility_status status)
{
    switch (status) {
    case VISIBILITY_OK: return "all is well";
    case VISIBILITY_NOT_ONE: return "this is no file of visible sets";
    case VISIBILITY_OTHER_VERSION: return "visible sets of another version";
    case VISIBILITY_WRONG_SIZE: return "the file is cut short, or longer than it says";
    case VISIBILITY_DAMAGED: return "the file is damaged";
    case VISIBILITY_UNALIGNED: return "the bytes do not begin at a multiple of 4";
    case VISIBILITY_BIG_ENDIAN: return "this machine is big-endian";
    }
    return "unknown";
}

#ifdef __cplusplus
}
#endif
#endif
