#!/usr/bin/env bash
# The same rays through glimt and through Embree (default and ROBUST scenes): how many are wrong.
#
#   benches/robust_against_embree.sh [--quick]
#
# Leaks: rays from inside closed meshes, half of them at vertices and edges; one that meets nothing is wrong. Self-hits: rays that leave the
# faces of a cube; outward one that meets something is wrong, inward one that meets nothing. Needs g++ and libembree-dev (3 or 4).
set -euo pipefail
cd "$(dirname "$0")/.."
source benches/built.sh
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
embree=4 flags=()
if [ -f /usr/include/embree3/rtcore.h ]; then embree=3 flags=(-DE3); fi
g++ -O3 -march=native -std=c++17 "${flags[@]}" benches/embree_robust.cpp -o "$work/embree_robust" "-lembree$embree"
"$GLIMT" stress "$@" --case leaks --case self-hit --case needles --export "$work/rays" > "$work/own.txt"
cd "$work/rays"
names=$(ls ./*.rays | sed 's/\.rays$//')
# shellcheck disable=SC2086
"$work/embree_robust" $names | awk -v embree="$embree" '
    {
        wrong_default = $1 ~ /outward/ ? $3 : $2 - $3
        wrong_robust = $1 ~ /outward/ ? $4 : $2 - $4
        sub("./", "", $1)
        printf "%-32s %9d rays   Embree %d: %8d wrong (%7.4f %%)   ROBUST: %7d (%7.4f %%)\n", $1, $2, embree, wrong_default, 100 * wrong_default / $2, wrong_robust, 100 * wrong_robust / $2
        rays += $2; all_default += wrong_default; all_robust += wrong_robust
    }
    END { printf "%-32s %9d rays   Embree %d: %8d wrong (%7.4f %%)   ROBUST: %7d (%7.4f %%)\n", "all", rays, embree, all_default, 100 * all_default / rays, all_robust, 100 * all_robust / rays }'
echo "glimt, the same rays and the pictures of self-hit:"
cat "$work/own.txt"
