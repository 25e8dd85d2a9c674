/* Prints files of visible sets for the tests.  The command line names a file of such files one after
 * the other: how long it and its points are, each in 64 bits; itself; and world points to look up in
 * it, three doubles each. */
#include "read_all.h"
#include "visibility.h"

enum { MOST = 4 };

/* Ends the program where the ways to ask for a set do not agree. */
static void print_set(const visibility_file *file, uint32_t cell)
{
    const size_t words = visibility_words(file);
    uint64_t *bits = (uint64_t *)malloc((words ? words : 1) * sizeof *bits);
    uint32_t *objects = (uint32_t *)malloc((file->object_count + 1u) * sizeof *objects);
    uint32_t object, count, place, others = 0;
    size_t word;
    if (!bits || !objects)
        exit(3);
    visibility_set(file, cell, bits);
    count = visibility_visible(file, cell, objects);
    for (place = 0; place < count; ++place)
        if (!(bits[objects[place] / 64] >> objects[place] % 64 & 1))
            exit(4);
    for (object = 0; object < file->object_count; ++object) {
        const int visible = (int)(bits[object / 64] >> object % 64 & 1);
        others += (uint32_t)visible;
        if (visible != visibility_is_visible(file, cell, object))
            exit(5);
    }
    if (others != count)
        exit(6);
    printf("set");
    for (word = 0; word < words; ++word)
        printf(" %08lx%08lx", (unsigned long)(bits[word] >> 32),
               (unsigned long)(bits[word] & 0xffffffffu));
    printf("\n");
    free(bits);
    free(objects);
}

/* Prints the slices of a cell, a sum of those that are drawn, and one of its altitudes. */
static void print_parts(const visibility_file *file, uint32_t cell)
{
    uint32_t *objects = (uint32_t *)malloc((file->object_count + 1u) * sizeof *objects);
    uint32_t place, visible, count, drawn[3][2], sum = 0, altitudes = 0;
    const int8_t *all = visibility_cell_slices(file, cell, &count);
    if (!objects)
        exit(3);
    visible = visibility_visible(file, cell, objects);
    if (all ? count != visible : count != 0)
        exit(9);
    printf(all ? "slices" : "slices none");
    for (place = 0; place < visible; ++place) {
        const uint32_t object = objects[place];
        const int8_t *slices = all ? all + 3 * (size_t)place : NULL;
        uint32_t number;
        if (place % 7 == 0 && visibility_slices(file, cell, object) != slices)
            exit(10);
        visibility_drawn(file, slices, drawn);
        for (number = 0; number < 6; ++number)
            sum += drawn[number / 2][number % 2] * (number + 1) * (object + 1);
        if (slices)
            printf(" %d %d %d", slices[0], slices[1], slices[2]);
    }
    for (place = 0; place < file->object_count; ++place)
        altitudes += visibility_altitude(file, cell, place) * (place + 1);
    printf("\ndrawn %lu %lu\n", (unsigned long)sum, (unsigned long)altitudes);
    free(objects);
}

/* Prints how many objects are seen from a point over a cell, and a sum of them. */
static void print_from(const visibility_file *file, uint32_t cell, const double *world)
{
    const size_t words = visibility_words(file);
    uint64_t *bits = (uint64_t *)malloc((words ? words : 1) * sizeof *bits);
    uint32_t object, count = 0, sum = 0;
    if (!bits)
        exit(3);
    visibility_set_from(file, cell, world, bits);
    for (object = 0; object < 64 * words; ++object)
        if (bits[object / 64] >> object % 64 & 1) {
            ++count;
            sum += (object + 1) * (object + 1);
        }
    printf("from %u %lu\n", (unsigned)count, (unsigned long)sum);
    free(bits);
}

static void print_point(const visibility_file *file, const double *world, uint32_t index)
{
    uint32_t cells[MOST];
    const uint32_t count = visibility_cells_at(file, world, cells, MOST);
    const uint32_t first = visibility_cell_at(file, world);
    uint32_t place;
    if (first != (count ? cells[0] : VISIBILITY_NO_CELL))
        exit(7);
    printf("at %u", (unsigned)count);
    for (place = 0; place < count && place < MOST; ++place)
        printf(" %u", (unsigned)cells[place]);
    printf("\n");
    print_from(file, count || !file->cell_count ? first : index % file->cell_count, world);
}

static void print(const visibility_file *file, const unsigned char *points, size_t size)
{
    uint32_t index;
    size_t at, length;
    char *name, *half;
    printf("counts %u %u %u method %d conservative %d partial %d up %d\n",
           (unsigned)file->object_count, (unsigned)file->cell_count, (unsigned)file->row_count,
           (int)file->method, file->conservative, file->partial, file->up);
    printf("origin %.17g %.17g %.17g\n", file->origin[0], file->origin[1], file->origin[2]);
    printf("scene ");
    for (index = 0; index < 8; ++index)
        printf("%02x", (unsigned)file->scene[index]);
    printf(" %d settings ", visibility_scene_matches(file, file->scene));
    for (index = 0; index < 8; ++index)
        printf("%02x", (unsigned)file->settings[index]);
    printf("\n");
    for (index = 0; index < file->object_count; ++index) {
        length = visibility_name(file, index, NULL, 0);
        name = (char *)malloc(length ? length : 1);
        half = (char *)malloc(length / 2 ? length / 2 : 1);
        if (!name || !half)
            exit(3);
        if (visibility_name(file, index, name, length) != length
            || visibility_name(file, index, half, length / 2) != length
            || memcmp(name, half, length / 2) != 0)
            exit(8);
        printf("name ");
        for (at = 0; at < length; ++at)
            printf("%02x", (unsigned)(unsigned char)name[at]);
        printf("\n");
        free(name);
        free(half);
    }
    printf("parts %u %d", (unsigned)file->slice_count, file->altitudes != NULL);
    if (file->altitudes)
        printf(" %.17g %.17g", visibility_height(file, 1), visibility_height(file, 65534));
    printf("\n");
    print_set(file, VISIBILITY_NO_CELL);
    print_parts(file, VISIBILITY_NO_CELL);
    for (index = 0; index < file->cell_count; ++index) {
        print_set(file, index);
        print_parts(file, index);
    }
    for (at = 0, index = 0; at < size; at += 3 * sizeof(double), ++index) {
        double world[3];
        memcpy(world, points + at, sizeof world);
        print_point(file, world, index);
    }
}

/* A copy in a block that ends where it does, so that a sanitizer sees any read behind it. */
static unsigned char *copied(const unsigned char *from, size_t size)
{
    unsigned char *bytes = (unsigned char *)malloc(size ? size : 1);
    if (!bytes)
        exit(3);
    memcpy(bytes, from, size);
    return bytes;
}

int main(int count, char **names)
{
    size_t size, at = 0;
    unsigned char *all = read_all(names[count - 1], &size);
    while (at < size) {
        visibility_file file;
        uint64_t sizes[2];
        unsigned char *bytes, *points;
        visibility_status status;
        memcpy(sizes, all + at, sizeof sizes);
        at += sizeof sizes;
        bytes = copied(all + at, (size_t)sizes[0]);
        points = copied(all + at + sizes[0], (size_t)sizes[1]);
        at += (size_t)(sizes[0] + sizes[1]);
        status = visibility_open(bytes, (size_t)sizes[0], &file);
        printf("== %s\n", visibility_text(status));
        if (status == VISIBILITY_OK)
            print(&file, points, (size_t)sizes[1]);
        free(bytes);
        free(points);
    }
    free(all);
    return 0;
}
