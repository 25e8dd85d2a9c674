#!/bin/sh
# For --then: commit an occluder that was written, on the branch that is checked out.
set -eu
git add -- "$1"
git diff --cached --quiet -- "$1" || git commit --quiet --message "occluder: $(basename "$1")" -- "$1"
