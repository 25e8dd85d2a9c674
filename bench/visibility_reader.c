/* Times the reader of visible sets, for bench/visibility_reader.py: a file, and world points in its
 * cells.  Prints a line a task: microseconds, and what it is. */
#include "visibility.h"

#include <stdio.h>
#include <stdlib.h>
#include <time.h>

static const double least = 0.2; /* seconds that a timing lasts, so that the clock does not count */

static unsigned char *read_all(const char *name, size_t *size)
{
    FILE *stream = fopen(name, "rb");
    unsigned char *bytes;
    if (!stream || fseek(stream, 0, SEEK_END))
        exit(3);
    *size = (size_t)ftell(stream);
    rewind(stream);
    bytes = (unsigned char *)malloc(*size);
    if (!bytes || fread(bytes, 1, *size, stream) != *size)
        exit(3);
    fclose(stream);
    return bytes;
}

static double now(void)
{
    return (double)clock() / CLOCKS_PER_SEC;
}

typedef struct {
    const unsigned char *bytes;
    size_t size, points;
    const double *world;
    visibility_file file;
    uint64_t *bits;
    uint32_t *objects;
} bench;

static uint32_t open_file(bench *on, size_t index)
{
    (void)index;
    return (uint32_t)visibility_open(on->bytes, on->size, &on->file);
}

static uint32_t find_cell(bench *on, size_t index)
{
    return visibility_cell_at(&on->file, on->world + 3 * (index % on->points));
}

/* Cells out of order, so that no set is in the caches for having been the last. */
static uint32_t some_cell(const bench *on, size_t index)
{
    return (uint32_t)(index * 2654435761u % on->file.cell_count);
}

static uint32_t write_bits(bench *on, size_t index)
{
    visibility_set(&on->file, some_cell(on, index), on->bits);
    return (uint32_t)on->bits[0];
}

static uint32_t write_list(bench *on, size_t index)
{
    return visibility_visible(&on->file, some_cell(on, index), on->objects);
}

static uint32_t ask_one(bench *on, size_t index)
{
    const uint32_t object = (uint32_t)(index * 2246822519u % on->file.object_count);
    return (uint32_t)visibility_is_visible(&on->file, some_cell(on, index), object);
}

static uint32_t write_from(bench *on, size_t index)
{
    visibility_set_from(
        &on->file, some_cell(on, index), on->world + 3 * (index % on->points), on->bits);
    return (uint32_t)on->bits[0];
}

static uint32_t read_slices(bench *on, size_t index)
{
    const uint32_t cell = some_cell(on, index);
    uint32_t count, place, drawn[3][2], sum = visibility_visible(&on->file, cell, on->objects);
    const int8_t *slices = visibility_cell_slices(&on->file, cell, &count);
    for (place = 0; place < count; ++place) {
        visibility_drawn(&on->file, slices + 3 * (size_t)place, drawn);
        sum += drawn[0][1] + drawn[1][0] + drawn[2][0];
    }
    return sum;
}

static void time_task(bench *on, uint32_t (*task)(bench *, size_t), const char *what)
{
    volatile uint32_t sum = 0;
    size_t index = 0, count = 1;
    double begin = now();
    for (; now() - begin < least; count *= 2)
        for (; index < count; ++index)
            sum = sum + task(on, index);
    printf("%.6f %s\n", 1e6 * (now() - begin) / (double)index, what);
}

int main(int count, char **names)
{
    bench on;
    size_t size;
    if (count != 3)
        return 2;
    on.bytes = read_all(names[1], &on.size);
    on.world = (const double *)(const void *)read_all(names[2], &size);
    on.points = size / (3 * sizeof(double));
    if (visibility_open(on.bytes, on.size, &on.file) != VISIBILITY_OK)
        return 4;
    on.bits = (uint64_t *)malloc(visibility_words(&on.file) * sizeof *on.bits);
    on.objects = (uint32_t *)malloc(on.file.object_count * sizeof *on.objects);
    time_task(&on, open_file, "open and check the file");
    time_task(&on, find_cell, "find the cell of a point");
    time_task(&on, write_bits, "write a set as bits");
    time_task(&on, write_list, "write a set as a list");
    time_task(&on, write_from, "write what is seen from a height");
    time_task(&on, read_slices, "write a list, with the slices to draw");
    time_task(&on, ask_one, "ask for one object");
    return 0;
}
