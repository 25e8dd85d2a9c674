#!/bin/bash
# The steps of the image and of its first start, in an empty folder and without an engine:
# docker/check.sh [FOLDER].  Installs from a wheel, which takes some minutes.
set -euo pipefail
source=$(cd "$(dirname "$0")/.." && pwd)
work=$(mktemp -d "${1:-${TMPDIR:-/tmp}}/occluder.XXXXXX")
server=
trap '[ -z "$server" ] || kill -9 "$server" || true; chmod -R u+w "$work"; rm -rf "$work"' EXIT

# What .dockerignore lets through, and nothing else.
mkdir "$work/source"
(cd "$source" && tar --exclude __pycache__ -cf - pyproject.toml README.md constraints.txt \
    simplifier service docker integrations/c) | tar -xf - -C "$work/source"

sh "$work/source/docker/install.sh" "$work/source" "$work/app"
cp "$work/source/docker/health.py" "$work/app"
rm -rf "$work/source"

port=$(python3 -c 'import socket; s = socket.socket(); s.bind(("127.0.0.1", 0)); print(s.getsockname()[1])')
export OCCLUDER_DATA=$work/data/service OCCLUDER_PORT=$port OCCLUDER_WORKERS=1
export OCCLUDER_HOST=127.0.0.1 OCCLUDER_REQUIRE_KEYS=true
export NUMBA_CACHE_DIR=$work/data/kernels MPLCONFIGDIR=$work/data/matplotlib PYTHONDONTWRITEBYTECODE=1
unset PYTHONPATH NUMBA_CPU_NAME
python=$work/app/env/bin/python occluder=$work/app/env/bin/occluder
cd "$work"
chmod -R a-w app  # the image's root filesystem may be read-only

echo '== without a key nothing is served'
if "$occluder" serve; then exit 1; fi

echo '== a key, and the server'
key=$("$occluder" keys create --name check --scope write)
SECONDS=0
"$occluder" serve & server=$!
for _ in $(seq 600); do
    "$python" -I app/health.py 2> /dev/null && break
    kill -0 "$server"
    sleep 0.2
done
"$python" -I app/health.py
until curl --silent --fail --output /dev/null "http://127.0.0.1:$port/readyz"; do
    kill -0 "$server"
    [ "$SECONDS" -lt 300 ]
    sleep 0.2
done
echo "ready after $SECONDS s"

echo '== a mesh goes in, an occluder comes out'
cat > box.off <<'MESH'
OFF
8 6 0
0 0 0
1 0 0
1 1 0
0 1 0
0 0 1
1 0 1
1 1 1
0 1 1
4 3 2 1 0
4 4 5 6 7
4 0 1 5 4
4 1 2 6 5
4 2 3 7 6
4 3 0 4 7
MESH
"$occluder" submit box.off --server "http://127.0.0.1:$port" --key "$key" --preset draft
"$python" -c 'import simplifier; print(len(simplifier.load("box_occluder.glb").faces), "triangles")'
curl --silent --fail --header "X-API-Key: $key" --header 'Accept: text/html' --output page.html \
    --data-binary @box.off --header 'Prefer: wait=60' \
    "http://127.0.0.1:$port/v1/occluders?filename=box.off&preset=draft"
grep -q '<title>Occluder of box.off' page.html

echo '== nothing was compiled'
if find "$NUMBA_CACHE_DIR" -name '*.o' -o -name '*.nb?' 2> /dev/null | grep .; then exit 1; fi

echo '== it ends in good order'
kill -TERM "$server"
wait "$server"
server=
echo 'all is well'
