#!/bin/sh
# Starts a command of 'occluder' with kernels that it may add to: PREFIX/start.sh serve.
#
# Those of the image are for a kind of processors (processor.sh) and need no compiling there.  They
# are copied to a place that can be written to and stays, $NUMBA_CACHE_DIR: numba wants that, and on
# other processors they are compiled once, for a minute or two, and kept there.
set -eu
prefix=$(dirname "$(readlink -f "$0")")
. "$prefix/processor.sh"

if ! cmp -s "$prefix/kernels/made" "$NUMBA_CACHE_DIR/made"; then
    # By way of a copy, so that a start that is broken off leaves none that is half there.
    rm -rf "$NUMBA_CACHE_DIR" "$NUMBA_CACHE_DIR.new"
    mkdir -p "$(dirname "$NUMBA_CACHE_DIR")"
    cp -R "$prefix/kernels" "$NUMBA_CACHE_DIR.new"
    chmod -R u+w "$NUMBA_CACHE_DIR.new"
    mv "$NUMBA_CACHE_DIR.new" "$NUMBA_CACHE_DIR"
fi
exec "$prefix/env/bin/occluder" "$@"
