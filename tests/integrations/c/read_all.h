/* A file's bytes in a block that ends where they do, so that a sanitizer sees any read behind it. */
#ifndef READ_ALL_H
#define READ_ALL_H

#include <stdio.h>
#include <stdlib.h>

static unsigned char *read_all(const char *name, size_t *size)
{
    FILE *stream = fopen(name, "rb");
    unsigned char *bytes;
    long length;
    if (!stream || fseek(stream, 0, SEEK_END) || (length = ftell(stream)) < 0)
        exit(3);
    rewind(stream);
    *size = (size_t)length;
    bytes = (unsigned char *)malloc(*size ? *size : 1);
    if (!bytes || fread(bytes, 1, *size, stream) != *size)
        exit(3);
    fclose(stream);
    return bytes;
}

#endif
