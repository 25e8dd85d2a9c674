/* The occluders of a scene (.occs), read in place, and the walk that decides which to draw in a frame
 * and what they hide.  C99 and C++, no dependency, no allocation.
 *
 *     occluder_tree tree;
 *     if (occluder_tree_open(bytes, size, &tree) != OCCLUDER_TREE_OK) ...
 *     void *room = malloc(occluder_tree_room(&tree));              // once
 *     ...
 *     occluder_view view = occluder_look(eye, ahead, up, 60.0, 0.1, 180, 320);   // each frame
 *     occluder_buffer_begin(&buffer, &view);
 *     occluder_tree_cull_into(&tree, &view, &tree.usual, &buffer, room, verdicts, NULL);
 *     if (verdicts[part] == OCCLUDER_VISIBLE) ...                  // draw tree.parts[part].object
 *
 * The last two lines need occluder_buffer.h, included first.  With another rasteriser hand its
 * functions to occluder_tree_cull(), which calls them to draw an occluder and to test a box.
 *
 * Nodes are met from near to far.  What is hidden when the walk gets to it is skipped with all below
 * it, since it hides nothing.  A node's far occluder stands for all that is in it, and is drawn once
 * its error does not show: where
 *
 *     error * focal <= pixels * (distance - error)
 *
 * with `focal` the pixels that a unit length takes at unit depth and `distance` from the eye to the
 * node's box, so never while the eye is within the error of the box.  Otherwise the node is opened; a
 * leaf has its near occluder then, or none.  What hides no more than a disc of one pixel's radius is
 * not drawn, and what is no larger than a pixel is not met.  docs/culling.md says why.
 *
 * With a budget (`most_triangles`) the occluders that hide most of the screen are drawn first, by
 * worth * radius / distance, as far as the triangles go.
 *
 * occluder_tree_open() checks the checksum, every figure and every index: what it accepts is a tree
 * whose walk ends, and a damaged file is refused.  It needs 17 KiB of stack.  The bytes have to begin at
 * a multiple of 8 (mapped files do; the blocks keep 16 where the file does) and to stay where they
 * are.  Any number of threads may walk one tree, each with room of its own.  The machine has to be
 * little-endian. */
#ifndef OCCLUDER_TREE_H
#define OCCLUDER_TREE_H

#include <math.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#ifdef __cplusplus
extern "C" {
#endif

/* --- What occluder_buffer.h has, too */

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

/* --- The file */

typedef enum {
    OCCLUDER_TREE_OK = 0,
    OCCLUDER_TREE_NOT_ONE,        /* does not begin as occluders of a scene */
    OCCLUDER_TREE_OTHER_VERSION,  /* of a version, or with flags, that this header does not know */
    OCCLUDER_TREE_WRONG_SIZE,     /* cut short, or with bytes behind its end */
    OCCLUDER_TREE_DAMAGED,        /* the checksum is another, or a figure is out of range */
    OCCLUDER_TREE_UNALIGNED,      /* the bytes do not begin at a multiple of 8 */
    OCCLUDER_TREE_BIG_ENDIAN      /* the machine is */
} occluder_tree_status;

static inline const char *occluder_tree_text(occluder_tree_status status)
{
    switch (status) {
    case OCCLUDER_TREE_OK: return "all is well";
    case OCCLUDER_TREE_NOT_ONE: return "this is no packed scene (.occs)";
    case OCCLUDER_TREE_OTHER_VERSION: return "of another version: update the header or build the scene again";
    case OCCLUDER_TREE_WRONG_SIZE: return "cut short, or with bytes behind its end: copy it again";
    case OCCLUDER_TREE_DAMAGED: return "damaged: copy it again, or build the scene again";
    case OCCLUDER_TREE_UNALIGNED: return "load it to an address that is a multiple of 8";
    default: return "this machine is big-endian";
    }
}

#define OCCLUDER_NONE 0xffffffffu        /* in place of a mesh */
#define OCCLUDER_ALL 0xffffffffu         /* in place of a budget */

/* A box with what is in it; node 0 is the root, and parents come before their children. */
typedef struct {
    float low[3], high[3];               /* relative to the tree's origin */
    uint32_t far_mesh, near_mesh;        /* or OCCLUDER_NONE */
    float far_error;                     /* world units that the far occluder may stray */
    float switch_error;                  /* what decides whether it is drawn, no less */
    float far_radius, near_radius;       /* of the discs that hide as much, world units */
    uint32_t first_child, child_count;
    uint32_t first_part, part_count;     /* places in `order` */
} occluder_node;

/* An object, or a piece of a large one: what is tested. */
typedef struct {
    uint32_t object, transform, node;
} occluder_part;

typedef struct {
    double origin[3];
    uint32_t first_vertex, vertex_count, first_index, triangle_count, first_pair, pair_count;
} occluder_mesh_row_;

/* What a walk may do. */
typedef struct {
    double pixel_error;                  /* of the buffer, that a far occluder may stray by */
    uint32_t most_triangles;             /* to draw in a frame, or OCCLUDER_ALL */
} occluder_limits;

typedef struct {
    const unsigned char *bytes;
    size_t size;
    uint32_t node_count, part_count, object_count, transform_count, mesh_count;
    uint32_t most_vertices;              /* of a mesh: what a depth buffer needs room for */
    uint32_t rows;                       /* the screen that it was built for, */
    double fov;                          /* its vertical field of view, degrees, */
    occluder_limits usual;               /* and the error on it */
    double origin[3];                    /* of the nodes' boxes, world units */
    int up;                              /* the scene's up axis: 0 x, 1 y, 2 z */
    int conservative;                    /* its occluders keep wholly inside of closed objects:
                                            by OCCLUDER_INNER nothing is hidden wrongly */
    const occluder_node *nodes;
    const occluder_part *parts;          /* in the scene's order; those of an object follow each
                                            other */
    const uint32_t *order;               /* the parts as the leaves hold them */
    const double *transforms;            /* three rows of four each, from a mesh to the world */
    const occluder_mesh_row_ *meshes;
    const float *positions;
    const uint32_t *indices, *pairs;
    const float *worth;                  /* of each node, or NULL: all are worth 1 */
    double most_worth;
    const uint32_t *name_ends;
    const char *names;
} occluder_tree;

enum { OCCLUDER_TREE_HEADER_BYTES_ = 160, OCCLUDER_TREE_MOST_SHORT_ = 65535 };

static inline uint32_t occluder_tree_u32_(const unsigned char *at)
{
    uint32_t value;
    memcpy(&value, at, sizeof value);
    return value;
}

static inline uint64_t occluder_tree_u64_(const unsigned char *at)
{
    uint64_t value;
    memcpy(&value, at, sizeof value);
    return value;
}

static inline double occluder_tree_f64_(const unsigned char *at)
{
    double value;
    memcpy(&value, at, sizeof value);
    return value;
}

/* The name of an object, UTF-8. */
static inline const char *occluder_tree_name(const occluder_tree *tree, uint32_t object)
{
    return tree->names + tree->name_ends[object];
}

/* One of the occluders, in its own space around `origin`. */
static inline occluder_mesh occluder_tree_mesh(const occluder_tree *tree, uint32_t index)
{
    const occluder_mesh_row_ *row = tree->meshes + index;
    occluder_mesh mesh;
    mesh.positions = tree->positions + 3 * (size_t)row->first_vertex;
    mesh.indices = tree->indices + row->first_index;
    mesh.vertex_count = row->vertex_count;
    mesh.triangle_count = row->triangle_count;
    mesh.index_bytes = row->vertex_count <= OCCLUDER_TREE_MOST_SHORT_ ? 2 : 4;
    mesh.pairs = row->pair_count ? tree->pairs + 2 * (size_t)row->first_pair : NULL;
    mesh.pair_count = row->pair_count;
    return mesh;
}

/* CRC-32 as zlib's, sixteen bytes a step (Kounavis and Berry: A Systematic Approach to Building High
 * Performance, Software-based, CRC Generators, 2005). */
static inline uint32_t occluder_tree_crc_(
    uint32_t (*table)[256], uint32_t crc, const unsigned char *at, size_t count)
{
    crc = ~crc;
    for (; count >= 16; count -= 16, at += 16) {
        const uint32_t a = occluder_tree_u32_(at) ^ crc, b = occluder_tree_u32_(at + 4);
        const uint32_t c = occluder_tree_u32_(at + 8), d = occluder_tree_u32_(at + 12);
        crc = (table[15][a & 255] ^ table[14][a >> 8 & 255] ^ table[13][a >> 16 & 255] ^ table[12][a >> 24])
            ^ (table[11][b & 255] ^ table[10][b >> 8 & 255] ^ table[9][b >> 16 & 255] ^ table[8][b >> 24])
            ^ (table[7][c & 255] ^ table[6][c >> 8 & 255] ^ table[5][c >> 16 & 255] ^ table[4][c >> 24])
            ^ (table[3][d & 255] ^ table[2][d >> 8 & 255] ^ table[1][d >> 16 & 255] ^ table[0][d >> 24]);
    }
    for (; count; --count, ++at)
        crc = table[0][(crc ^ *at) & 255] ^ crc >> 8;
    return ~crc;
}

/* Of a file with 0 in place of the checksum itself. */
static inline uint32_t occluder_tree_checksum_(const unsigned char *bytes, size_t size)
{
    static const unsigned char zeros[4] = {0, 0, 0, 0};
    uint32_t table[16][256], crc, index;
    int step;
    for (index = 0; index < 256; ++index) {
        crc = index;
        for (step = 0; step < 8; ++step)
            crc = crc >> 1 ^ (crc & 1 ? 0xedb88320u : 0u);
        table[0][index] = crc;
    }
    for (index = 0; index < 256; ++index)
        for (step = 1; step < 16; ++step)
            table[step][index] = table[step - 1][index] >> 8
                ^ table[0][table[step - 1][index] & 255];
    crc = occluder_tree_crc_(table, 0, bytes, OCCLUDER_TREE_HEADER_BYTES_ - 4);
    crc = occluder_tree_crc_(table, crc, zeros, 4);
    return occluder_tree_crc_(table, crc, bytes + OCCLUDER_TREE_HEADER_BYTES_,
                              size - OCCLUDER_TREE_HEADER_BYTES_);
}

static inline int occluder_tree_finite_(const float *at, size_t count)
{
    size_t place;
    uint32_t any = 0;
    for (place = 0; place < count; ++place) {
        uint32_t bits;
        memcpy(&bits, at + place, sizeof bits);
        any |= (bits & 0x7f800000u) == 0x7f800000u;
    }
    return !any;
}

static inline int occluder_tree_finite64_(const double *at, size_t count)
{
    size_t place;
    uint64_t any = 0;
    for (place = 0; place < count; ++place) {
        uint64_t bits;
        memcpy(&bits, at + place, sizeof bits);
        any |= (bits & 0x7ff0000000000000u) == 0x7ff0000000000000u;
    }
    return !any;
}

/* Each node but the root is the child of one before it, children follow in the order of their
 * parents, and the parts below a node are those below its children, one after the other. */
static inline int occluder_tree_check_nodes_(const occluder_tree *tree)
{
    uint64_t follow = 1;
    uint32_t index, child;
    if (!tree->node_count || tree->nodes[0].first_part != 0
        || tree->nodes[0].part_count != tree->part_count)
        return 0;
    for (index = 0; index < tree->node_count; ++index) {
        const occluder_node *node = tree->nodes + index;
        uint64_t part = node->first_part;
        if (!occluder_tree_finite_(node->low, 6) || !occluder_tree_finite_(&node->far_error, 4)
            || !(node->low[0] <= node->high[0] && node->low[1] <= node->high[1]
                 && node->low[2] <= node->high[2])
            || !(node->far_error >= 0.0f && node->switch_error >= 0.0f
                 && node->far_radius >= 0.0f && node->near_radius >= 0.0f)
            || (node->far_mesh >= tree->mesh_count && node->far_mesh != OCCLUDER_NONE)
            || (node->near_mesh >= tree->mesh_count && node->near_mesh != OCCLUDER_NONE))
            return 0;
        if (node->child_count == 0) {
            if (node->first_child != 0 || node->part_count != 1)
                return 0;
            continue;
        }
        if (node->near_mesh != OCCLUDER_NONE || node->first_child != follow
            || node->first_child <= index || node->child_count > tree->node_count - follow)
            return 0;
        follow += node->child_count;
        for (child = 0; child < node->child_count; ++child) {
            const occluder_node *below = tree->nodes + node->first_child + child;
            if (below->first_part != part)
                return 0;
            part += below->part_count;
        }
        if (part != (uint64_t)node->first_part + node->part_count)
            return 0;
    }
    return follow == tree->node_count;
}

/* Each part is in one leaf, and those of an object follow each other. */
static inline int occluder_tree_check_parts_(const occluder_tree *tree)
{
    uint32_t index, object = OCCLUDER_NONE;
    for (index = 0; index < tree->node_count; ++index) {
        const occluder_node *node = tree->nodes + index;
        uint32_t part;
        if (node->child_count)
            continue;
        if (node->first_part >= tree->part_count)
            return 0;
        part = tree->order[node->first_part];
        if (part >= tree->part_count || tree->parts[part].node != index)
            return 0;
    }
    for (index = 0; index < tree->part_count; ++index) {
        const occluder_part *part = tree->parts + index;
        if (tree->order[index] >= tree->part_count || part->transform >= tree->transform_count
            || part->node >= tree->node_count || tree->nodes[part->node].child_count
            || (part->object != object && part->object != object + 1))
            return 0;
        object = part->object;
    }
    return object + 1 == tree->object_count
        && occluder_tree_finite64_(tree->transforms, 12 * (size_t)tree->transform_count);
}

/* The largest of the indices, what fills their last word among them, and 1: 0 where there is none. */
static inline uint32_t occluder_tree_past_(const occluder_mesh *mesh)
{
    const size_t corners = 3 * (size_t)mesh->triangle_count;
    const size_t count = corners + (mesh->index_bytes == 2 ? corners % 2 : 0);
    uint32_t most = 0;
    size_t corner;
    if (!count)
        return 0;
    if (mesh->index_bytes == 2) {
        const uint16_t *short_indices = (const uint16_t *)mesh->indices;
        for (corner = 0; corner < count; ++corner)
            most = short_indices[corner] > most ? short_indices[corner] : most;
    } else {
        const uint32_t *indices = (const uint32_t *)mesh->indices;
        for (corner = 0; corner < count; ++corner)
            most = indices[corner] > most ? indices[corner] : most;
        if (most == 0xffffffffu)
            return most;
    }
    return most + 1;
}

/* Each begins where the one before ends, and names no vertex or corner that it does not have. */
static inline int occluder_tree_check_meshes_(
    occluder_tree *tree, uint64_t vertices, uint64_t words, uint64_t pairs)
{
    uint64_t vertex = 0, word = 0, pair = 0;
    uint32_t index;
    for (index = 0; index < tree->mesh_count; ++index) {
        const occluder_mesh_row_ *row = tree->meshes + index;
        const uint64_t width = row->vertex_count <= OCCLUDER_TREE_MOST_SHORT_ ? 2 : 4;
        const uint64_t length = (3 * (uint64_t)row->triangle_count * width + 3) / 4;
        occluder_mesh mesh;
        size_t place;
        if (row->first_vertex != vertex || row->first_index != word || row->first_pair != pair
            || row->vertex_count > vertices - vertex || length > words - word
            || row->pair_count > pairs - pair || !occluder_tree_finite64_(row->origin, 3))
            return 0;
        vertex += row->vertex_count;
        word += length;
        pair += row->pair_count;
        mesh = occluder_tree_mesh(tree, index);
        if (occluder_tree_past_(&mesh) > row->vertex_count)
            return 0;
        for (place = 0; place < 2 * (size_t)row->pair_count; ++place)
            if (mesh.pairs[place] >= 3 * (uint64_t)row->triangle_count)
                return 0;
        if (row->vertex_count > tree->most_vertices)
            tree->most_vertices = row->vertex_count;
    }
    return vertex == vertices && word == words && pair == pairs
        && occluder_tree_finite_(tree->positions, 3 * (size_t)vertices);
}

/* Bytes of the UTF-8 character that begins here, which may take so many; 0 where there is none.  By
 * the Unicode standard, table 3-7: none that is longer than it needs to be, and no surrogate. */
static inline size_t occluder_tree_character_(const unsigned char *at, size_t count)
{
    const unsigned lead = at[0];
    const size_t length = lead < 0x80 ? 1 : lead < 0xe0 ? 2 : lead < 0xf0 ? 3 : 4;
    size_t place;
    if (length > count || (lead >= 0x80 && lead < 0xc2) || lead > 0xf4)
        return 0;
    for (place = 1; place < length; ++place)
        if ((at[place] & 0xc0) != 0x80)
            return 0;
    if ((lead == 0xe0 && at[1] < 0xa0) || (lead == 0xed && at[1] > 0x9f)
        || (lead == 0xf0 && at[1] < 0x90) || (lead == 0xf4 && at[1] > 0x8f))
        return 0;
    return length;
}

/* Each name ends with a 0, which is in none of them; `room` bytes hold the offsets and the text. */
static inline int occluder_tree_check_names_(const occluder_tree *tree, uint64_t room)
{
    const uint32_t *ends = tree->name_ends;
    const uint64_t table = 4 * ((uint64_t)tree->object_count + 1);
    uint64_t place = 0;
    uint32_t object;
    if (ends[0] != 0 || ends[tree->object_count] > room - table)
        return 0;
    for (object = 0; object < tree->object_count; ++object)
        if (ends[object + 1] <= ends[object] || ends[object + 1] > ends[tree->object_count])
            return 0;
    for (object = 0; object < tree->object_count; ++object) {
        const uint64_t last = (uint64_t)ends[object + 1] - 1;
        while (place < last) {
            const unsigned char *at = (const unsigned char *)tree->names + place;
            const size_t length = occluder_tree_character_(at, (size_t)(last - place));
            if (!length || !*at)
                return 0;
            place += length;
        }
        if (tree->names[place])
            return 0;
        ++place;
    }
    return 1;
}

static inline int occluder_tree_check_worth_(occluder_tree *tree)
{
    uint32_t index;
    tree->most_worth = tree->worth ? 0.0 : 1.0;
    if (!tree->worth)
        return 1;
    if (!occluder_tree_finite_(tree->worth, tree->node_count))
        return 0;
    for (index = 0; index < tree->node_count; ++index) {
        if (!(tree->worth[index] >= 0.0f))
            return 0;
        if (tree->worth[index] > tree->most_worth)
            tree->most_worth = tree->worth[index];
    }
    return 1;
}

/* Where a block of so many bytes begins; NULL where it is not in the file. */
static inline const unsigned char *occluder_tree_block_(
    const occluder_tree *tree, int block, uint64_t length)
{
    const uint64_t begin = 16 * (uint64_t)occluder_tree_u32_(tree->bytes + 104 + 4 * block);
    if (begin < OCCLUDER_TREE_HEADER_BYTES_ || begin > tree->size || length > tree->size - begin)
        return NULL;
    return tree->bytes + (size_t)begin;
}

/* Finds the blocks and looks at all that is in them. */
static inline int occluder_tree_check_(occluder_tree *tree)
{
    const unsigned char *header = tree->bytes, *block[11];
    const uint64_t vertices = occluder_tree_u32_(header + 44);
    const uint64_t words = occluder_tree_u32_(header + 48), pairs = occluder_tree_u32_(header + 52);
    uint64_t length[11];
    int index;
    length[0] = sizeof(occluder_node) * (uint64_t)tree->node_count;
    length[1] = sizeof(occluder_part) * (uint64_t)tree->part_count;
    length[2] = 4 * (uint64_t)tree->part_count;
    length[3] = 96 * (uint64_t)tree->transform_count;
    length[4] = sizeof(occluder_mesh_row_) * (uint64_t)tree->mesh_count;
    length[5] = 12 * vertices;
    length[6] = 4 * words;
    length[7] = 8 * pairs;
    length[8] = 4 * (uint64_t)tree->node_count;
    length[9] = 4 * ((uint64_t)tree->object_count + 1);
    length[10] = occluder_tree_u32_(header + 100);
    for (index = 0; index < 11; ++index) {
        block[index] = occluder_tree_block_(tree, index, length[index]);
        if (!block[index] && !(index == 7 && !pairs)
            && !(index == 8 && !occluder_tree_u32_(header + 104 + 4 * index)))
            return 0;
    }
    tree->nodes = (const occluder_node *)(const void *)block[0];
    tree->parts = (const occluder_part *)(const void *)block[1];
    tree->order = (const uint32_t *)(const void *)block[2];
    tree->transforms = (const double *)(const void *)block[3];
    tree->meshes = (const occluder_mesh_row_ *)(const void *)block[4];
    tree->positions = (const float *)(const void *)block[5];
    tree->indices = (const uint32_t *)(const void *)block[6];
    tree->pairs = (const uint32_t *)(const void *)block[7];
    tree->worth = (const float *)(const void *)block[8];
    tree->name_ends = (const uint32_t *)(const void *)block[9];
    tree->names = (const char *)(block[9] + (size_t)length[9]);
    return occluder_tree_check_nodes_(tree) && occluder_tree_check_parts_(tree)
        && occluder_tree_check_meshes_(tree, vertices, words, pairs)
        && occluder_tree_check_names_(tree, (uint64_t)(tree->bytes + tree->size - block[9]))
        && occluder_tree_check_worth_(tree);
}

/* Looks through a file of `size` bytes, which `tree` then points into. */
static inline occluder_tree_status occluder_tree_open(
    const void *bytes, size_t size, occluder_tree *tree)
{
    static const unsigned char magic[8] = {0x89, 'O', 'C', 'S', '\r', '\n', 0x1a, '\n'};
    const unsigned char *header = (const unsigned char *)bytes;
    const uint32_t one = 1;
    unsigned char first;
    uint32_t flags;
    int axis;
    memset(tree, 0, sizeof *tree);
    memcpy(&first, &one, 1);
    if (first != 1)
        return OCCLUDER_TREE_BIG_ENDIAN;
    if (size < OCCLUDER_TREE_HEADER_BYTES_ || memcmp(header, magic, sizeof magic))
        return OCCLUDER_TREE_NOT_ONE;
    if ((uintptr_t)bytes % 8)
        return OCCLUDER_TREE_UNALIGNED;
    flags = occluder_tree_u32_(header + 12);
    if (occluder_tree_u32_(header + 8) != 1 || (flags & ~0x301u))
        return OCCLUDER_TREE_OTHER_VERSION;
    if (occluder_tree_u64_(header + 16) != size)
        return OCCLUDER_TREE_WRONG_SIZE;
    if (occluder_tree_checksum_(header, size) != occluder_tree_u32_(header + 156))
        return OCCLUDER_TREE_DAMAGED;
    tree->bytes = header;
    tree->size = size;
    tree->node_count = occluder_tree_u32_(header + 24);
    tree->part_count = occluder_tree_u32_(header + 28);
    tree->object_count = occluder_tree_u32_(header + 32);
    tree->transform_count = occluder_tree_u32_(header + 36);
    tree->mesh_count = occluder_tree_u32_(header + 40);
    for (axis = 0; axis < 3; ++axis)
        tree->origin[axis] = occluder_tree_f64_(header + 56 + 8 * axis);
    tree->usual.pixel_error = occluder_tree_f64_(header + 80);
    tree->usual.most_triangles = OCCLUDER_ALL;
    tree->fov = occluder_tree_f64_(header + 88);
    tree->rows = occluder_tree_u32_(header + 96);
    tree->conservative = (int)(flags & 1);
    tree->up = (int)(flags >> 8 & 3);
    if (tree->up == 3 || !occluder_tree_finite64_(tree->origin, 3)
        || !occluder_tree_finite64_(&tree->usual.pixel_error, 1) || !(tree->usual.pixel_error > 0.0)
        || !(tree->fov >= 1e-6 && tree->fov < 180.0) || tree->rows < 1 || tree->rows > 2147483648u
        || !occluder_tree_check_(tree)) {
        memset(tree, 0, sizeof *tree);
        return OCCLUDER_TREE_DAMAGED;
    }
    return OCCLUDER_TREE_OK;
}

/* --- The walk */

/* An occluder that is to be drawn, from both sides. */
typedef struct {
    const occluder_mesh *mesh;
    float transform[12];                 /* three rows of four: takes columns (x, y, z, 1) of the
                                            mesh to world axes around the eye */
    float error;                         /* world units that it may stray: draw it further away by
                                            as much, and grow boxes by what that is on the screen */
    uint32_t node;
    int is_near;                         /* the near one of a leaf */
} occluder_drawing;

/* A rasteriser.  Boxes are relative to the eye, in world axes. */
typedef struct {
    void *user;                          /* handed to both */
    void (*draw)(void *user, const occluder_drawing *drawing);
    occluder_verdict (*test)(void *user, const float low[3], const float high[3]);
} occluder_rasteriser;

/* What a walk did; NULL where nobody asks. */
typedef struct {
    uint32_t occluders, triangles;       /* drawn */
    uint32_t nodes;                      /* met, and tested */
} occluder_drawn;

typedef struct {
    double key;                          /* least first */
    uint32_t node;
    int32_t level;                       /* 0 the far occluder, 1 the near one, -1 to be opened */
} occluder_waiting_;

/* Bytes of memory, aligned for double, that a walk works in. */
static inline size_t occluder_tree_room(const occluder_tree *tree)
{
    return sizeof(occluder_waiting_) * (size_t)tree->node_count;
}

/* A node's box around the eye. */
static inline void occluder_tree_box(
    const occluder_tree *tree, uint32_t node, const double eye[3], float low[3], float high[3])
{
    int axis;
    for (axis = 0; axis < 3; ++axis) {
        low[axis] = (float)(((double)tree->nodes[node].low[axis] + tree->origin[axis]) - eye[axis]);
        high[axis] = (float)(((double)tree->nodes[node].high[axis] + tree->origin[axis]) - eye[axis]);
    }
}

/* From the eye to the nearest point of a node's box, 0 inside; `size` is its diagonal. */
static inline double occluder_tree_distance_(
    const occluder_tree *tree, const occluder_node *node, const double eye[3], double *size)
{
    double away[3], extent[3];
    int axis;
    for (axis = 0; axis < 3; ++axis) {
        const double low = (double)node->low[axis] + tree->origin[axis];
        const double high = (double)node->high[axis] + tree->origin[axis];
        const double before = low - eye[axis], behind = eye[axis] - high;
        const double past = before > behind ? before : behind;
        away[axis] = past > 0.0 ? past : 0.0;
        extent[axis] = high - low;
    }
    *size = sqrt((extent[0] * extent[0] + extent[1] * extent[1]) + extent[2] * extent[2]);
    return sqrt((away[0] * away[0] + away[1] * away[1]) + away[2] * away[2]);
}

/* Whether an occluder is exact enough and hides enough: more than a disc of one pixel's radius. */
static inline int occluder_tree_serves_(
    double error, double radius, double distance, double focal, double pixel_error)
{
    return radius > 0.0 && radius * focal >= distance
        && (error == 0.0 || error * focal <= pixel_error * (distance - error));
}

/* Which occluder of a node is drawn at a distance, and where it comes in the walk. */
static inline occluder_waiting_ occluder_tree_waiting_(
    const occluder_tree *tree, uint32_t index, double distance, double size, double focal,
    const occluder_limits *limits)
{
    const occluder_node *node = tree->nodes + index;
    const double worth = tree->worth ? (double)tree->worth[index] : 1.0;
    occluder_waiting_ waiting;
    waiting.node = index;
    waiting.level = -1;
    if (node->far_mesh != OCCLUDER_NONE
        && occluder_tree_serves_(
            node->switch_error, node->far_radius, distance, focal, limits->pixel_error))
        waiting.level = 0;
    else if (node->near_mesh != OCCLUDER_NONE
             && occluder_tree_serves_(0.0, node->near_radius, distance, focal, limits->pixel_error))
        waiting.level = 1;
    waiting.key = distance;
    if (limits->most_triangles != OCCLUDER_ALL) {
        /* Nothing below a node that is opened hides more than a disc around its box. */
        const double shown = waiting.level < 0 ? tree->most_worth * (0.5 * size)
            : worth * (double)(waiting.level ? node->near_radius : node->far_radius);
        waiting.key = distance > 0.0 ? -(shown / distance) : shown > 0.0 ? -HUGE_VAL : 0.0;
    }
    return waiting;
}

static inline int occluder_tree_before_(const occluder_waiting_ *one, const occluder_waiting_ *other)
{
    return one->key < other->key || (one->key == other->key && one->node < other->node);
}

/* A binary heap, whose first is before all others. */
static inline void occluder_tree_push_(
    occluder_waiting_ *heap, uint32_t *count, const occluder_waiting_ *one)
{
    uint32_t place = (*count)++;
    while (place && occluder_tree_before_(one, heap + (place - 1) / 2)) {
        heap[place] = heap[(place - 1) / 2];
        place = (place - 1) / 2;
    }
    heap[place] = *one;
}

static inline occluder_waiting_ occluder_tree_pop_(occluder_waiting_ *heap, uint32_t *count)
{
    const occluder_waiting_ first = heap[0], last = heap[--*count];
    uint32_t place = 0, child;
    while ((child = 2 * place + 1) < *count) {
        if (child + 1 < *count && occluder_tree_before_(heap + child + 1, heap + child))
            ++child;
        if (!occluder_tree_before_(heap + child, &last))
            break;
        heap[place] = heap[child];
        place = child;
    }
    heap[place] = last;
    return first;
}

/* From the space of a node's occluder to world axes around the eye. */
static inline void occluder_tree_place_(
    const occluder_tree *tree, uint32_t index, uint32_t mesh, const double eye[3],
    float transform[12])
{
    static const double as_it_is[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
    const occluder_node *node = tree->nodes + index;
    const double *origin = tree->meshes[mesh].origin, *rows = as_it_is;
    int row, column;
    if (!node->child_count)
        rows = tree->transforms
            + 12 * (size_t)tree->parts[tree->order[node->first_part]].transform;
    for (row = 0; row < 3; ++row) {
        const double *each = rows + 4 * row;
        for (column = 0; column < 3; ++column)
            transform[4 * row + column] = (float)each[column];
        transform[4 * row + 3] = (float)((((each[0] * origin[0] + each[1] * origin[1])
            + each[2] * origin[2]) + each[3]) - eye[row]);
    }
}

/* Meets the nodes, and draws.  `room` has occluder_tree_room() bytes. */
static inline void occluder_tree_walk(
    const occluder_tree *tree, const occluder_view *view, const occluder_limits *limits,
    const occluder_rasteriser *rasteriser, void *room, occluder_drawn *drawn)
{
    occluder_waiting_ *heap = (occluder_waiting_ *)room;
    const double focal = view->focal;
    uint32_t count = 0, left = limits->most_triangles, child;
    double size;
    occluder_waiting_ waiting;
    double distance = occluder_tree_distance_(tree, tree->nodes, view->eye, &size);
    if (drawn)
        memset(drawn, 0, sizeof *drawn);
    waiting = occluder_tree_waiting_(tree, 0, distance, size, focal, limits);
    occluder_tree_push_(heap, &count, &waiting);
    while (count && left) {
        const occluder_node *node;
        float low[3], high[3];
        waiting = occluder_tree_pop_(heap, &count);
        node = tree->nodes + waiting.node;
        occluder_tree_box(tree, waiting.node, view->eye, low, high);
        if (drawn)
            ++drawn->nodes;
        if (rasteriser->test(rasteriser->user, low, high) != OCCLUDER_VISIBLE)
            continue;
        if (waiting.level >= 0) {
            const uint32_t index = waiting.level ? node->near_mesh : node->far_mesh;
            const occluder_mesh mesh = occluder_tree_mesh(tree, index);
            occluder_drawing drawing;
            if (left != OCCLUDER_ALL) {
                if (mesh.triangle_count > left || waiting.key == 0.0)
                    continue;
                left -= mesh.triangle_count;
            }
            drawing.mesh = &mesh;
            occluder_tree_place_(tree, waiting.node, index, view->eye, drawing.transform);
            drawing.error = waiting.level ? 0.0f : node->far_error;
            drawing.node = waiting.node;
            drawing.is_near = waiting.level;
            rasteriser->draw(rasteriser->user, &drawing);
            if (drawn) {
                ++drawn->occluders;
                drawn->triangles += mesh.triangle_count;
            }
            continue;
        }
        for (child = 0; child < node->child_count; ++child) {
            const uint32_t index = node->first_child + child;
            distance = occluder_tree_distance_(tree, tree->nodes + index, view->eye, &size);
            if (size * focal >= distance) {
                waiting = occluder_tree_waiting_(tree, index, distance, size, focal, limits);
                occluder_tree_push_(heap, &count, &waiting);
            }
        }
    }
}

/* What of the scene is hidden by what was drawn: `verdicts` of all parts, an occluder_verdict each. */
static inline void occluder_tree_judge(
    const occluder_tree *tree, const occluder_view *view, const occluder_rasteriser *rasteriser,
    void *room, unsigned char *verdicts)
{
    uint32_t *stack = (uint32_t *)room, count = 1, index;
    stack[0] = 0;
    while (count) {
        const uint32_t at = stack[--count];
        const occluder_node *node = tree->nodes + at;
        occluder_verdict verdict;
        float low[3], high[3];
        occluder_tree_box(tree, at, view->eye, low, high);
        verdict = rasteriser->test(rasteriser->user, low, high);
        if (verdict == OCCLUDER_VISIBLE && node->child_count) {
            for (index = 0; index < node->child_count; ++index)
                stack[count++] = node->first_child + index;
            continue;
        }
        for (index = 0; index < node->part_count; ++index)
            verdicts[tree->order[node->first_part + index]] = (unsigned char)verdict;
    }
}

/* A frame: draws what hides, then judges all parts. */
static inline void occluder_tree_cull(
    const occluder_tree *tree, const occluder_view *view, const occluder_limits *limits,
    const occluder_rasteriser *rasteriser, void *room, unsigned char *verdicts,
    occluder_drawn *drawn)
{
    occluder_tree_walk(tree, view, limits, rasteriser, room, drawn);
    occluder_tree_judge(tree, view, rasteriser, room, verdicts);
}

#ifdef OCCLUDER_BUFFER_H

static inline void occluder_tree_draw_into_(void *user, const occluder_drawing *drawing)
{
    occluder_buffer_draw((occluder_buffer *)user, drawing->mesh, drawing->transform, drawing->error);
}

static inline occluder_verdict occluder_tree_test_in_(
    void *user, const float low[3], const float high[3])
{
    return occluder_buffer_test((occluder_buffer *)user, low, high);
}

/* A frame in a buffer that was begun with the same view, and has room for `most_vertices`. */
static inline void occluder_tree_cull_into(
    const occluder_tree *tree, const occluder_view *view, const occluder_limits *limits,
    occluder_buffer *buffer, void *room, unsigned char *verdicts, occluder_drawn *drawn)
{
    occluder_rasteriser rasteriser;
    rasteriser.user = buffer;
    rasteriser.draw = occluder_tree_draw_into_;
    rasteriser.test = occluder_tree_test_in_;
    occluder_tree_cull(tree, view, limits, &rasteriser, room, verdicts, drawn);
}

#endif

#ifdef __cplusplus
}
#endif
#endif
