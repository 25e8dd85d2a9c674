#!/bin/sh
# Starts a command of 'occluder' with kernels that it may add to: PREFIX/start.sh serve.
#
# Machine code is for the kind of processor that it was compiled on.  Kernels are therefore copied
# to a place that stays, $NUMBA_CACHE_DIR: on another kind of processor they are compiled once, for
# a minute or two, and kept there.
set -eu
prefix=$(dirname "$(readlink -f "$0")")

if ! cmp -s "$prefix/kernels/made" "$NUMBA_CACHE_DIR/made"; then
    # By way of a copy, so that a start that is broken off leaves none that is half there.
    rm -rf "$NUMBA_CACHE_DIR" "$NUMBA_CACHE_DIR.new"
    mkdir -p "$(dirname "$NUMBA_CACHE_DIR")"
    cp -R "$prefix/kernels" "$NUMBA_CACHE_DIR.new"
    chmod -R u+w "$NUMBA_CACHE_DIR.new"
    mv "$NUMBA_CACHE_DIR.new" "$NUMBA_CACHE_DIR"
fi
exec "$prefix/env/bin/occluder" "$@"
