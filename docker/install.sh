#!/bin/sh
# Installs the service from a wheel of this source into the virtual environment PREFIX/env, and
# compiles the kernels into it, for each kind of processors: install.sh SOURCE PREFIX [EXTRAS].  The
# image is made by this, and so is docker/check.sh's trial.
set -eu
source=$1 prefix=$2 extras=${3:-service,cluster}

python3 -m venv "$prefix/env"
"$prefix/env/bin/pip" wheel --quiet --no-deps --wheel-dir "$prefix/wheels" "$source"
wheel=$(ls "$prefix"/wheels/planar_occluder-*.whl)
# With bytecode, which takes 170 MB: without it each process that starts compiles all that it imports.
"$prefix/env/bin/pip" install --quiet -c "$source/constraints.txt" "${wheel}[$extras]"

rm -r "$prefix/wheels"

# Outside of the source, whose folders would hide what the wheel holds.
cd "$prefix"
env/bin/python -m simplifier.kernels.compiled.shipping
