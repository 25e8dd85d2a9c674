/* Times the C headers for bench/engine.py:
 *     engine raster FILE              a city's triangles and boxes, by occluder_buffer.h
 *     engine walk SCENE VIEWS MOST    frames of a scene, by occluder_tree.h
 * Prints medians, in milliseconds. */
#define _POSIX_C_SOURCE 200809L
#include "occluder_buffer.h"
#include "occluder_tree.h"
#include "given_view.h"
#include "read_all.h"

#include <stdio.h>
#include <stdlib.h>
#include <time.h>

enum { REPEATS = 101, NUMBERS = 16 };

static double now(void)
{
    struct timespec time;
    clock_gettime(CLOCK_MONOTONIC, &time);
    return 1e3 * (double)time.tv_sec + 1e-6 * (double)time.tv_nsec;
}

static int compare(const void *one, const void *other)
{
    const double a = *(const double *)one, b = *(const double *)other;
    return (a > b) - (a < b);
}

static double median(double *times, size_t count)
{
    qsort(times, count, sizeof *times, compare);
    return times[count / 2];
}

/* FILE: the view, then how many vertices, triangles and boxes, all as doubles; then the vertices and
 * boxes as floats around the eye, and the indices. */
static void raster(const char *name)
{
    static const float as_it_is[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
    size_t size;
    unsigned char *bytes = read_all(name, &size);
    const double *numbers = (const double *)(const void *)bytes;
    const occluder_view view = look(numbers);
    const uint32_t boxes = (uint32_t)numbers[NUMBERS + 2];
    const float *at = (const float *)(const void *)(numbers + NUMBERS + 4);
    double draws[REPEATS], tests[REPEATS];
    const float *corners;
    occluder_buffer buffer;
    occluder_mesh mesh;
    void *memory;
    uint32_t index, hidden = 0;
    int repeat;
    mesh.vertex_count = (uint32_t)numbers[NUMBERS];
    mesh.triangle_count = (uint32_t)numbers[NUMBERS + 1];
    mesh.positions = at;
    corners = at + 3 * (size_t)mesh.vertex_count;
    mesh.indices = corners + 6 * (size_t)boxes;
    mesh.index_bytes = 4;
    mesh.pairs = NULL;
    mesh.pair_count = 0;
    memory = malloc(occluder_buffer_bytes(view.rows, view.columns, mesh.vertex_count));
    if (!memory)
        exit(3);
    occluder_buffer_init(&buffer, memory, view.rows, view.columns, mesh.vertex_count, OCCLUDER_CENTRE);
    for (repeat = 0; repeat < REPEATS; ++repeat) {
        double begin, middle;
        occluder_buffer_begin(&buffer, &view);
        begin = now();
        occluder_buffer_draw(&buffer, &mesh, as_it_is, (float)numbers[NUMBERS + 3]);
        middle = now();
        hidden = 0;
        for (index = 0; index < boxes; ++index)
            hidden += occluder_buffer_test(&buffer, corners + 6 * (size_t)index,
                                           corners + 6 * (size_t)index + 3) == OCCLUDER_HIDDEN;
        draws[repeat] = middle - begin;
        tests[repeat] = now() - middle;
    }
    printf("%.4f %.4f %.6f\n", median(draws, REPEATS), median(tests, REPEATS),
           (double)hidden / (double)boxes);
    free(memory);
    free(bytes);
}

/* A line for each frame: milliseconds, triangles, nodes met, hidden parts; before them the time that
 * opening the file takes. */
static void walk(const char *name, const char *views_name, const char *most)
{
    size_t size, views_size, place;
    unsigned char *bytes = read_all(name, &size), *views = read_all(views_name, &views_size);
    double times[REPEATS];
    occluder_tree tree;
    occluder_limits limits;
    occluder_buffer buffer;
    occluder_view view = look((const double *)(const void *)views);
    void *memory, *room;
    unsigned char *verdicts;
    int repeat;
    for (repeat = 0; repeat < REPEATS; ++repeat) {
        const double begin = now();
        if (occluder_tree_open(bytes, size, &tree) != OCCLUDER_TREE_OK)
            exit(4);
        times[repeat] = now() - begin;
    }
    printf("%.4f\n", median(times, REPEATS));
    limits = tree.usual;
    if (atol(most) >= 0)
        limits.most_triangles = (uint32_t)atol(most);
    memory = malloc(occluder_buffer_bytes(view.rows, view.columns, tree.most_vertices));
    room = malloc(occluder_tree_room(&tree));
    verdicts = (unsigned char *)malloc(tree.part_count);
    if (!memory || !room || !verdicts)
        exit(3);
    occluder_buffer_init(&buffer, memory, view.rows, view.columns, tree.most_vertices,
                         tree.conservative ? OCCLUDER_INNER : OCCLUDER_CENTRE);
    for (place = 0; place + NUMBERS * sizeof(double) <= views_size; place += NUMBERS * sizeof(double)) {
        occluder_drawn drawn;
        uint32_t part, hidden = 0;
        view = look((const double *)(const void *)(views + place));
        for (repeat = 0; repeat < REPEATS; ++repeat) {
            const double begin = now();
            occluder_buffer_begin(&buffer, &view);
            occluder_tree_cull_into(&tree, &view, &limits, &buffer, room, verdicts, &drawn);
            times[repeat] = now() - begin;
        }
        for (part = 0; part < tree.part_count; ++part)
            hidden += verdicts[part] == OCCLUDER_HIDDEN;
        printf("%.4f %u %u %u\n", median(times, REPEATS), (unsigned)drawn.triangles,
               (unsigned)drawn.nodes, (unsigned)hidden);
    }
    free(verdicts);
    free(room);
    free(memory);
    free(views);
    free(bytes);
}

int main(int count, char **arguments)
{
    if (count == 3 && !strcmp(arguments[1], "raster"))
        raster(arguments[2]);
    else if (count == 5 && !strcmp(arguments[1], "walk"))
        walk(arguments[2], arguments[3], arguments[4]);
    else
        return 2;
    return 0;
}
