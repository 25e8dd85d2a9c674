/* Prints occluder files for the tests: each name of the command line. */
#include "occluder.h"
#include "read_all.h"

static void print(const occluder_file *file)
{
    uint32_t index, k;
    printf("origin %.17g %.17g %.17g\n", file->origin[0], file->origin[1], file->origin[2]);
    printf("box %.9g %.9g %.9g %.9g %.9g %.9g\n", file->low[0], file->low[1], file->low[2],
           file->high[0], file->high[1], file->high[2]);
    printf("sides %d welded %d screen %u fov %.17g pixels %.17g\n",
           file->single_sided ? 1 : 2, file->welded, (unsigned)file->screen_height, file->fov, file->pixel_error);
    for (index = 0; index < file->level_count; ++index) {
        const occluder_level level = occluder_level_at(file, index);
        printf("level %u bound %.17g deviation %.17g from %.17g resolution %u width %u\n",
               (unsigned)index, level.error_bound, level.deviation, level.switch_distance,
               (unsigned)level.resolution, (unsigned)level.index_bytes);
        for (k = 0; k < level.vertex_count; ++k)
            printf("v %.9g %.9g %.9g\n", level.positions[3 * k], level.positions[3 * k + 1],
                   level.positions[3 * k + 2]);
        for (k = 0; k < level.triangle_count; ++k)
            printf("f %u %u %u\n", (unsigned)occluder_index(&level, 3 * (size_t)k),
                   (unsigned)occluder_index(&level, 3 * (size_t)k + 1),
                   (unsigned)occluder_index(&level, 3 * (size_t)k + 2));
    }
    for (k = 0; k < 20; ++k)
        printf("at %u level %u\n", (unsigned)(1u << k), (unsigned)occluder_level_for(file, 1u << k));
}

int main(int count, char **names)
{
    int place;
    for (place = 1; place < count; ++place) {
        occluder_file file;
        size_t size;
        unsigned char *bytes = read_all(names[place], &size);
        const occluder_status status = occluder_open(bytes, size, &file);
        printf("== %s\n", occluder_text(status));
        if (status == OCCLUDER_OK)
            print(&file);
        free(bytes);
    }
    return 0;
}
