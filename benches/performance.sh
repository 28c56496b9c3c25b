#!/usr/bin/env bash
# What docs/performance.md says of glimt itself, measured again: medians, and in parentheses the least and the most.
#
#   benches/performance.sh [threads] [latency] [frame] [memory] [sizes] [first-ray]      default: all of them
#
#   threads    s2's ray sets on two threads against one, in seven turns, and two processes of one thread each: what the machine itself allows
#   latency    s0 at 512², one sample, from the start of the process to the file: caches warm, empty, and none allowed
#   frame      a whole picture of s1 and s4 at 1024 × 768, one light, depth 8, one thread: what each pass takes
#   memory     the most that the process and the device hold for pictures of s1
#   sizes      bumpy balls of 10³ to 10⁷ triangles, fast trees, one thread: build, bytes, rays, what rays ask of the tree
#   first-ray  a million triangles, two threads: from the file to the first ray, in turns with reading it and Embree's medium tree
#
# Needs python3, for the balls numpy, for the first ray g++ and libembree-dev (3 or 4), and the benchmark programs and scenes in $BENCH (default ../shared/bench).
# The program is $GLIMT (default: it is built).
set -euo pipefail
cd "$(dirname "$0")/.."
export BENCH=${BENCH:-../shared/bench}
if [ ! -d "$BENCH/scenes" ]; then
    echo "performance: no benchmark scenes at $BENCH: set BENCH to their folder" >&2
    exit 2
fi
source benches/built.sh
exec python3 - "$@" <<'PYTHON'
import json, math, os, re, struct, subprocess, sys, tempfile, time
from concurrent.futures import ThreadPoolExecutor
from statistics import median

GLIMT, BENCH = os.environ["GLIMT"], os.path.abspath(os.environ["BENCH"])
SCENES = f"{BENCH}/scenes"
SETS = ["primary", "shadow", "mirror", "diffuse"]
TURNS = 7


def run(*arguments, cores=None, **environment):
    """Its JSON, and seconds from its start to its end."""
    command = (["taskset", "-c", cores] if cores else []) + [GLIMT, *map(str, arguments), "--json"]
    start = time.monotonic()
    done = subprocess.run(command, capture_output=True, text=True, env=os.environ | environment, check=True)
    return json.loads(done.stdout), time.monotonic() - start


def bench(scene, view, threads, *arguments, cores=None):
    """Mrays/s of each set, and all of the answer."""
    answer, _ = run("bench", scene, "--view", view, "--threads", threads, *arguments, cores=cores or f"0-{threads - 1}")
    return [one["mrays_per_s"]["median"] for one in answer["sets"]], answer


def spread(values, digits=0):
    return f"{median(values):.{digits}f} ({min(values):.{digits}f} to {max(values):.{digits}f})"


def scene(name):
    return f"{SCENES}/{name}.glb", f"{SCENES}/{name}.json"


def threads(_):
    def side_by_side():
        """Two processes of one thread each, a core each: their sum."""
        with ThreadPoolExecutor() as pool:
            both = list(pool.map(lambda core: bench(*scene("s2"), 1, "--runs", 3, cores=str(core))[0], [0, 1]))
        return [sum(speeds) for speeds in zip(*both)]
    turns = [(bench(*scene("s2"), 1, "--runs", 3)[0], bench(*scene("s2"), 2, "--runs", 3)[0], side_by_side()) for _ in range(TURNS)]
    for place, name in enumerate(SETS):
        one, two, processes = ([turn[side][place] for turn in turns] for side in range(3))
        times = [[b / a for a, b in zip(one, others)] for others in (two, processes)]
        print(f"  {name:8} {median(one):6.2f} -> {median(two):6.2f} Mrays/s, {median(two) / median(one):.2f} times; "
              f"turn by turn {spread(times[0], 2)}, two processes {spread(times[1], 2)}")


def latency(folder):
    def start_to_file(environment):
        report, seconds = run("render", scene("s0")[0], "--size", "512x512", "--spp", 1, "-o", f"{folder}/s0.png", **environment)
        return report["times_ms"], 1000 * seconds
    for name, environment in [
        ("caches warm", lambda _: {}),
        ("caches empty", lambda turn: {"MESA_SHADER_CACHE_DIR": f"{folder}/mesa{turn}", "XDG_CACHE_HOME": f"{folder}/own{turn}"}),
        ("none allowed", lambda _: {"MESA_SHADER_CACHE_DISABLE": "true"}),
    ]:
        start_to_file(environment(0))
        runs = [start_to_file(environment(turn)) for turn in range(1, TURNS + 1)]
        part = {key: median(times[key] for times, _ in runs) for key in runs[0][0]}
        in_turn = ["device", "upload", "render", "save"]
        rest = median(all_of_it - sum(times[key] for key in in_turn) for times, all_of_it in runs)
        print(f"  {name}: {spread([all_of_it for _, all_of_it in runs])} ms: "
              + " + ".join(f"{key} {part[key]:.1f}" for key in in_turn)
              + f" + starting, ending and waiting {rest:.1f}; beside the device, load {part['load']:.1f} and tree {part['bvh']:.1f}")


def frame(folder):
    for name in ["s1", "s4"]:
        reports = [run("render", scene(name)[0], "--size", "1024x768", "--max-depth", 8, "--threads", 1, "-o", f"{folder}/frame.png",
                       cores="0")[0] for _ in range(TURNS + 1)][1:]
        passes = {one["name"]: median(report["passes"][place]["ms"] for report in reports) for place, one in enumerate(reports[0]["passes"])}
        outside = sum(ms for pass_name, ms in passes.items() if pass_name in ("prepare", "shade", "resolve"))
        print(f"  {name}: " + ", ".join(f"{pass_name} {ms:.1f}" for pass_name, ms in passes.items())
              + f" ms; outside traversal {100 * outside / sum(passes.values()):.1f} %")


def memory(folder):
    for side in [512, 4096, 16384]:
        command = [GLIMT, "render", scene("s1")[0], "--size", f"{side}x{side}", "-o", f"{folder}/large.png", "--json"]
        start = time.monotonic()
        process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)
        report = json.loads(process.stdout.read())
        _, status, usage = os.wait4(process.pid, 0)
        assert status == 0, status
        seconds = time.monotonic() - start
        print(f"  {side} x {side}: process {usage.ru_maxrss / 1024:.0f} MiB, device {report['memory_bytes']['device_peak'] / 2**20:.0f} MiB, {seconds:.1f} s")


def ball(path, triangles):
    """A ball with bumps in two sizes, of about so many triangles: x, y and z of points and three indices a triangle."""
    import numpy
    rings = max(round(math.sqrt(triangles / 2)), 4)
    latitude, longitude = numpy.meshgrid(numpy.linspace(0, numpy.pi, rings + 1), numpy.linspace(0, 2 * numpy.pi, rings + 1), indexing="ij")
    normal = numpy.stack([numpy.sin(latitude) * numpy.cos(longitude), numpy.cos(latitude), numpy.sin(latitude) * numpy.sin(longitude)], -1)
    bumps = 0.08 * numpy.sin(9 * normal[..., 0]) * numpy.cos(7 * normal[..., 1]) + 0.01 * numpy.sin(61 * normal[..., 2]) * numpy.cos(53 * normal[..., 0])
    points = (normal * (1 + bumps[..., None])).reshape(-1, 3).astype("<f4")
    corner = (numpy.arange(rings)[:, None] * (rings + 1) + numpy.arange(rings)).reshape(-1)
    right, below = corner + 1, corner + rings + 1
    indices = numpy.concatenate([numpy.stack([corner, right, below], -1), numpy.stack([right, below + 1, below], -1)], 1).astype("<u4")
    data = points.tobytes() + indices.tobytes()
    document = json.dumps({
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}], "buffers": [{"byteLength": len(data)}],
        "bufferViews": [{"buffer": 0, "byteLength": points.nbytes}, {"buffer": 0, "byteOffset": points.nbytes, "byteLength": indices.nbytes}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": len(points), "type": "VEC3",
             "min": points.min(0).tolist(), "max": points.max(0).tolist()},
            {"bufferView": 1, "componentType": 5125, "count": indices.size, "type": "SCALAR"},
        ],
    }).encode()
    document += b" " * (-len(document) % 4)
    with open(path, "wb") as file:
        file.write(struct.pack("<4sIIII", b"glTF", 2, 28 + len(document) + len(data), len(document), 0x4E4F534A))
        file.write(document + struct.pack("<II", len(data), 0x004E4942) + data)
    view = {"eye": [0.4, 1.2, 2.6], "target": [0, 0, 0], "up": [0, 1, 0], "vfov_deg": 45, "width": 1024, "height": 768, "light_pos": [3, 5, 3],
            "bbox_min": points.min(0).tolist(), "bbox_max": points.max(0).tolist()}
    with open(path.replace(".glb", ".json"), "w") as file:
        json.dump(view, file)
    return path, path.replace(".glb", ".json")


def sizes(folder):
    first = before = None
    for decade in range(3, 8):
        files = ball(f"{folder}/ball{decade}.glb", 10**decade)
        runs = [bench(*files, 1, "--runs", 3, "--bvh", "fast") for _ in range(3)]
        answer = runs[0][1]
        tree, triangles = answer["bvh"], answer["triangles"]
        build = median(one["bvh"]["build_ms"] for _, one in runs)
        rays = [median(speeds[place] for speeds, _ in runs) for place in range(4)]
        size = tree["bytes"] + tree["triangle_bytes"]
        growth = ""
        if before:
            n_log_n = triangles * math.log(triangles) / before[0] / math.log(before[0])
            growth = f", {build / before[1]:.1f} times the last (n log n {n_log_n:.1f})"
        print(f"  {triangles:8} triangles: build {build:.1f} ms{growth}; {size} bytes, {size / triangles:.0f} a triangle; depth {tree['depth']}; "
              "Mrays/s " + ", ".join(f"{name} {speed:.2f}" for name, speed in zip(SETS, rays)), flush=True)
        first, before = first or (triangles, build, rays), (triangles, build, rays)
        counted = subprocess.run([GLIMT, "bench", files[0], "--view", files[1], "--bvh", "fast", "--runs", "1", "--work"],
                                 capture_output=True, text=True, check=True).stdout
        print("".join(f"           {line}\n" for line in counted.splitlines() if " visits " in line), end="")
    print("  from the first to the last: " + ", ".join(f"{name} {a / b:.1f}" for name, a, b in zip(SETS, first[2], before[2]))
          + f" times slower; log n {math.log(before[0]) / math.log(first[0]):.2f}")


def first_ray(folder):
    """Reading and Embree's medium tree against glimt's way to the first ray: the picture is of one pixel, kernels are made beside."""
    model, view = ball(f"{folder}/million.glb", 10**6)
    embree, flags = ("3", ["-DE3"]) if os.path.exists("/usr/include/embree3/rtcore.h") else ("4", [])
    program = f"{folder}/embree_bench"
    subprocess.run(["g++", "-O3", "-march=native", "-std=c++17", *flags, f"{BENCH}/embree_bench.cpp", "-o", program, f"-lembree{embree}"], check=True)
    run("bench", model, "--view", view, "--runs", 1, "--export", folder)
    run("render", model, "--size", "1x1", "--bvh", "fast", "-o", f"{folder}/pixel.png")
    ours, theirs = [], []
    for _ in range(TURNS):
        start = time.monotonic()
        with open(model, "rb") as file:
            file.read()
        read = 1000 * (time.monotonic() - start)
        builds = subprocess.run([program, f"{folder}/million.bin", view], capture_output=True, text=True, check=True,
                                env=os.environ | {"EMBREE_CFG": "threads=2", "RUNS": "1", "BUILDS": "2"}).stdout
        medium = float(re.search(r"-medium \S+ build ([\d.]+)", builds).group(1))
        report, _ = run("render", model, "--size", "1x1", "--bvh", "fast", "-o", f"{folder}/pixel.png")
        times = report["times_ms"]
        ours.append(times["total"] - times["render"] - times["save"])
        theirs.append(2 * (read + medium))
    print(f"  glimt {spread(ours)} ms, twice reading and Embree {embree} medium {spread(theirs)} ms: {median(ours) / median(theirs):.2f} times")


ALL = {"threads": threads, "latency": latency, "frame": frame, "memory": memory, "sizes": sizes, "first-ray": first_ray}
chosen = sys.argv[1:] or list(ALL)
if unknown := [name for name in chosen if name not in ALL]:
    print(f"performance: {', '.join(unknown)}: there are {', '.join(ALL)}", file=sys.stderr)
    sys.exit(2)
print("on " + run("devices")[0][0]["driver"])
for name in chosen:
    print(f"{name}:", flush=True)
    with tempfile.TemporaryDirectory() as folder:
        ALL[name](folder)
PYTHON
