/* What of a scene may be seen: cc -O2 -I../../integrations/c cull.c -o cull -lm && ./cull scene.occs X Y Z */
#include "occluder_buffer.h" /* before occluder_tree.h */
#include "occluder_tree.h"
#include <stdio.h>
#include <stdlib.h>

int main(int count, char **given)
{
    static double memory[1 << 20]; /* of the file: 8 MiB */
    FILE *stream = count == 5 ? fopen(given[1], "rb") : NULL;
    const size_t size = stream ? fread(memory, 1, sizeof memory, stream) : 0;
    occluder_tree tree;
    occluder_buffer buffer;
    const occluder_tree_status status = occluder_tree_open(memory, size, &tree);
    if (status != OCCLUDER_TREE_OK)
        return fprintf(stderr, "usage: cull scene.occs X Y Z (%s)\n", occluder_tree_text(status)), 1;
    void *room = malloc(occluder_tree_room(&tree));
    void *pixels = malloc(occluder_buffer_bytes(180, 320, tree.most_vertices));
    unsigned char *verdicts = malloc(tree.part_count);
    occluder_buffer_init(&buffer, pixels, 180, 320, tree.most_vertices,
                         tree.conservative ? OCCLUDER_INNER : OCCLUDER_CENTRE);

    /* Each frame: */
    const double eye[3] = {atof(given[2]), atof(given[3]), atof(given[4])}, ahead[3] = {1, 0.1, 0.1};
    const double up[3] = {tree.up == 0, tree.up == 1, tree.up == 2};
    const occluder_view view = occluder_look(eye, ahead, up, 60.0, 0.1, 180, 320);
    occluder_buffer_begin(&buffer, &view);
    occluder_tree_cull_into(&tree, &view, &tree.usual, &buffer, room, verdicts, NULL);
    for (uint32_t part = 0; part < tree.part_count; ++part)
        if (verdicts[part] == OCCLUDER_VISIBLE) /* draw it */
            puts(occluder_tree_name(&tree, tree.parts[part].object));
    return 0;
}
