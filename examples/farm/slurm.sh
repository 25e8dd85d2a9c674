#!/bin/sh
# occluder build by Slurm: an array of shards, and their join once all of them have succeeded.
#
#   examples/farm/slurm.sh MANIFEST SHARDS [OPTIONS OF SBATCH]
#
# The manifest is in a folder that all nodes share; the logs go there. Prints the numbers of both jobs.
# A shard that failed is sent again by itself, with --array=7 in place of 1-16, and then the join.
set -eu

MANIFEST=$(realpath "$1") SHARDS=$2
shift 2
cd "$(dirname "$MANIFEST")"
export MANIFEST SHARDS

array=$(sbatch --parsable --job-name=occluders --array="1-$SHARDS" --requeue \
    --cpus-per-task=2 --mem=4G --export=ALL "$@" <<'JOB'
#!/bin/sh
exec occluder build "$MANIFEST" --shard "$SLURM_ARRAY_TASK_ID/$SHARDS"
JOB
)
join=$(sbatch --parsable --job-name=occluders-join --dependency="afterok:${array%%;*}" \
    --kill-on-invalid-dep=yes --export=ALL "$@" <<'JOB'
#!/bin/sh
exec occluder build "$MANIFEST" --join
JOB
)
echo "shards: ${array%%;*}, join: ${join%%;*}"
