#!/bin/sh
# Installs the service from a wheel of this source into a folder of its own, and compiles the
# kernels: install.sh SOURCE PREFIX [EXTRAS].  The image is made by this, and so is docker/check.sh's
# trial.
#
#   PREFIX/env      the virtual environment
#   PREFIX/kernels  the compiled kernels; the file 'made' in it names what they were made of
set -eu
source=$1 prefix=$2 extras=${3:-service,cluster}

python3 -m venv "$prefix/env"
"$prefix/env/bin/pip" wheel --quiet --no-deps --wheel-dir "$prefix/wheels" "$source"
wheel=$(ls "$prefix"/wheels/planar_occluder-*.whl)
# With bytecode, which takes 170 MB: without it each process that starts compiles all that it imports.
"$prefix/env/bin/pip" install --quiet -c "$source/constraints.txt" "${wheel}[$extras]"

# All that follows runs outside of the source, whose folders would hide what the wheel holds.
cd "$prefix"
. "$source/docker/processor.sh"
NUMBA_CACHE_DIR=$prefix/kernels env/bin/occluder warmup
sha256sum "$wheel" | cut -d ' ' -f 1 > kernels/made
rm -r wheels
