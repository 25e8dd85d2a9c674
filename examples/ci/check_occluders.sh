#!/bin/sh
# Fails a change whose occluders are stale, below their thresholds, or hide less than before it.
#
#   check_occluders.sh [REVISION] [MANIFEST]
#
# REVISION is what the change goes into, fetched with its files: by default origin/main. Nothing is
# made: whoever changes a mesh builds, and commits occluders.lock and the outputs with it.
set -eu

revision=${1:-origin/main}
manifest=${2:-occluders.toml}

exec occluder build "$manifest" --check --against "$revision" \
    --junit occluders.xml --markdown "${GITHUB_STEP_SUMMARY:-occluders.md}"
