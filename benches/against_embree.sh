#!/usr/bin/env bash
# The same rays through Embree and through glimt, in turns, on the same threads; prints medians, ratios and builds.
#
#   benches/against_embree.sh [--threads N] [--rounds N] [SCENE.glb VIEW.json]...   default: all benchmark scenes
#
# Needs g++ and libembree-dev (3 or 4), and the benchmark programs and scenes in $BENCH (default ../shared/bench). The program is $GLIMT (default: it is built).
set -euo pipefail
cd "$(dirname "$0")/.."
BENCH=${BENCH:-../shared/bench}
threads=1 rounds=3 scenes=()
while [ $# -gt 0 ]; do
    case $1 in
        --threads) threads=$2; shift 2 ;;
        --rounds) rounds=$2; shift 2 ;;
        *) scenes+=("$1" "$2"); shift 2 ;;
    esac
done
if [ ! -d "$BENCH" ]; then
    echo "against_embree: no benchmark programs at $BENCH: set BENCH to their folder" >&2
    exit 2
fi
if [ ${#scenes[@]} = 0 ]; then
    for name in s1 s2 s4; do scenes+=("$BENCH/scenes/$name.glb" "$BENCH/scenes/$name.json"); done
fi
source benches/built.sh

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
embree=4 flags=()
if [ -f /usr/include/embree3/rtcore.h ]; then embree=3 flags=(-DE3); fi
for program in gen_rays embree_bench; do
    g++ -O3 -march=native -std=c++17 "${flags[@]}" "$BENCH/$program.cpp" -o "$work/$program" "-lembree$embree"
done
cores="0-$((threads - 1))"

for ((i = 0; i < ${#scenes[@]}; i += 2)); do
    scene=${scenes[i]} view=${scenes[i + 1]}
    name=$(basename "$scene" .glb)
    "$GLIMT" bench "$scene" --view "$view" --runs 1 --export "$work" > /dev/null
    # Embree's own rays and answers from here on, which glimt compares itself with.
    (cd "$work" && ./gen_rays "$name.bin" "$name.json" > /dev/null)
    for ((round = 0; round < rounds; round++)); do
        (cd "$work" && EMBREE_CFG="threads=$threads" RUNS=3 BUILDS=2 taskset -c "$cores" ./embree_bench "$name.bin" "$name.json" 2> /dev/null)
        for quality in fast best; do
            taskset -c "$cores" "$GLIMT" bench "$scene" --view "$view" --threads "$threads" --runs 3 --compare "$work" --bvh $quality |
                sed "s/^/glimt-$quality /"
        done
    done > "$work/$name.txt"
    echo "$name: Mrays/s, one ray at a time; Embree $embree traces on one thread, glimt on $threads"
    awk -v rounds="$rounds" '
        function median(list,   n, a, i, j, t) {
            n = split(list, a, " ")
            for (i = 1; i <= n; i++) for (j = i + 1; j <= n; j++) if (a[j] + 0 < a[i] + 0) { t = a[i]; a[i] = a[j]; a[j] = t }
            return a[int((n + 1) / 2)]
        }
        $1 ~ /^embree.-(medium|high)-1$/ { split($1, part, "-"); speed[part[2] " " $3] = speed[part[2] " " $3] " " $4 }
        $1 ~ /^embree.-(medium|high)$/ && $3 == "build" { split($1, part, "-"); build[part[2]] = build[part[2]] " " $4; bytes[part[2]] = $NF }
        $1 ~ /^glimt/ && $2 == "tree:" { build[$1] = build[$1] " " $6; bytes[$1] = ($10 + $12) / 1e6 }
        $1 ~ /^glimt/ && $2 ~ /^(primary|shadow|mirror|diffuse)$/ {
            speed[$1 " " $2] = speed[$1 " " $2] " " $5
            rays[$2] = $3; told[$2] = $11 " " $12 $13 " " $14 $15 $16 " " $17
        }
        END {
            printf "%-9s %9s %9s %11s %10s %7s %7s   %s\n", "set", "medium", "high", "glimt-fast", "glimt-best", "ratio", "rays", "mismatches"
            n = split("primary shadow mirror diffuse", sets, " ")
            for (i = 1; i <= n; i++) {
                s = sets[i]; high = median(speed["high " s]); own = median(speed["glimt-best " s])
                printf "%-9s %9.2f %9.2f %11.2f %10.2f %7.2f %7d   %s\n", s, median(speed["medium " s]), high, median(speed["glimt-fast " s]), own, own / high, rays[s], told[s]
            }
            printf "build ms  %9.1f %9.1f %11.1f %10.1f   fast/medium %.2f, best/high %.2f\n", median(build["medium"]), median(build["high"]), median(build["glimt-fast"]), median(build["glimt-best"]), median(build["glimt-fast"]) / median(build["medium"]), median(build["glimt-best"]) / median(build["high"])
            printf "MB        %9.1f %9.1f %11.1f %10.1f   nodes and triangles\n\n", bytes["medium"], bytes["high"], bytes["glimt-fast"], bytes["glimt-best"]
        }' "$work/$name.txt"
done
