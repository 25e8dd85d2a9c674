/* Opens packed scenes for the tests and walks them: walk_tree VIEWS FILE...  VIEWS has 21 numbers of
 * 64 bits for each view (see `look`). */
#include "occluder_buffer.h"
#include "occluder_tree.h"
#include "given_view.h"
#include "read_all.h"

enum { NUMBERS = 21 };

typedef struct {
    occluder_buffer buffer;
    uint32_t drawn;
} recorder;

static void draw(void *user, const occluder_drawing *drawing)
{
    recorder *one = (recorder *)user;
    printf(" %u:%d", (unsigned)drawing->node, drawing->is_near);
    if (!occluder_buffer_draw(&one->buffer, drawing->mesh, drawing->transform, drawing->error))
        exit(4);
    ++one->drawn;
}

static occluder_verdict test(void *user, const float low[3], const float high[3])
{
    return occluder_buffer_test(&((recorder *)user)->buffer, low, high);
}

static void walk(const occluder_tree *tree, const double *numbers)
{
    const occluder_view view = look(numbers);
    const uint32_t rows = view.rows, columns = view.columns, most = tree->most_vertices;
    void *memory = malloc(occluder_buffer_bytes(rows, columns, most));
    void *room = malloc(occluder_tree_room(tree));
    unsigned char *verdicts = (unsigned char *)malloc(tree->part_count);
    unsigned char *again = (unsigned char *)malloc(tree->part_count);
    occluder_limits limits;
    occluder_rasteriser rasteriser;
    occluder_drawn drawn, twice;
    recorder one;
    uint32_t part;
    if (!memory || !room || !verdicts || !again)
        exit(3);
    limits.pixel_error = numbers[17];
    limits.most_triangles = numbers[18] < 0 ? OCCLUDER_ALL : (uint32_t)numbers[18];
    occluder_buffer_init(&one.buffer, memory, rows, columns, most,
                         numbers[16] != 0.0 ? OCCLUDER_INNER : OCCLUDER_CENTRE);
    occluder_buffer_begin(&one.buffer, &view);
    one.drawn = 0;
    rasteriser.user = &one;
    rasteriser.draw = draw;
    rasteriser.test = test;
    printf("drawn");
    occluder_tree_cull(tree, &view, &limits, &rasteriser, room, verdicts, &drawn);
    printf("\ncounts %u %u\n", (unsigned)drawn.occluders, (unsigned)drawn.triangles);
    printf("verdicts");
    for (part = 0; part < tree->part_count; ++part)
        printf(" %d", verdicts[part]);
    printf("\n");
    occluder_buffer_begin(&one.buffer, &view);
    occluder_tree_cull_into(tree, &view, &limits, &one.buffer, room, again, &twice);
    if (one.drawn != drawn.occluders || memcmp(&drawn, &twice, sizeof drawn)
        || memcmp(verdicts, again, tree->part_count))
        exit(5);
    free(memory);
    free(room);
    free(verdicts);
    free(again);
}

static void print(const occluder_tree *tree)
{
    uint32_t index, corner;
    printf("scene nodes %u parts %u vertices %u rows %u fov %.17g pixels %.17g up %d conservative %d\n",
           (unsigned)tree->node_count, (unsigned)tree->part_count, (unsigned)tree->most_vertices,
           (unsigned)tree->rows, tree->fov, tree->usual.pixel_error, tree->up, tree->conservative);
    for (index = 0; index < tree->object_count; ++index)
        printf("name %s\n", occluder_tree_name(tree, index));
    for (index = 0; index < tree->part_count; ++index)
        printf("part %u %u %u\n", (unsigned)tree->parts[index].object,
               (unsigned)tree->parts[index].transform, (unsigned)tree->parts[index].node);
    for (index = 0; index < tree->mesh_count; ++index) {
        const occluder_mesh mesh = occluder_tree_mesh(tree, index);
        for (corner = 0; corner < 3 * mesh.triangle_count; ++corner) {
            const float *at = mesh.positions + 3 * (size_t)occluder_index_(&mesh, corner);
            printf("corner %u %.9g %.9g %.9g\n", (unsigned)index, at[0], at[1], at[2]);
        }
    }
}

int main(int count, char **names)
{
    size_t size, views_size;
    unsigned char *views;
    int place;
    if (count < 2)
        return 2;
    views = read_all(names[1], &views_size);
    for (place = 2; place < count; ++place) {
        unsigned char *bytes = read_all(names[place], &size);
        occluder_tree tree;
        const occluder_tree_status status = occluder_tree_open(bytes, size, &tree);
        printf("== %s\n", occluder_tree_text(status));
        if (status == OCCLUDER_TREE_OK) {
            size_t view;
            print(&tree);
            for (view = 0; view + NUMBERS * sizeof(double) <= views_size;
                 view += NUMBERS * sizeof(double))
                walk(&tree, (const double *)(const void *)(views + view));
        }
        free(bytes);
    }
    free(views);
    return 0;
}
