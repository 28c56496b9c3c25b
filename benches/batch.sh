#!/usr/bin/env bash
# Many pictures in one process against one process each, and whether the memory of the one grows.
#
#   benches/batch.sh [--jobs N] [--files N] [--single N] [FLAGS OF glimt batch]
#
# FILES (50) files of the corpus of at most 10 MB, evenly chosen from its list, are rendered at 256×256 in turn until JOBS (200)
# are done: in a batch, each job written when the answer to the one before is read, then the first N (all) of them as single `glimt render`s. Prints jobs a
# second of both and the batch's resident memory: since the files come again, that of the same files can be compared. Needs python3;
# the corpus is at $CORPUS (default ../shared/corpus), the program $GLIMT (default: it is built).
set -euo pipefail
cd "$(dirname "$0")/.."
export CORPUS=${CORPUS:-../shared/corpus}
if [ ! -f "$CORPUS/MANIFEST.tsv" ]; then
    echo "batch: no corpus at $CORPUS: set CORPUS to its folder" >&2
    exit 2
fi
source benches/built.sh
exec python3 - "$@" <<'PYTHON'
import csv, json, os, subprocess, sys, tempfile, time
from statistics import mean

flags = sys.argv[1:]


def number_of(name, default):
    if name not in flags:
        return default
    at = flags.index(name)
    value = int(flags[at + 1])
    del flags[at:at + 2]
    return value


jobs, files = number_of("--jobs", 200), number_of("--files", 50)
single = min(number_of("--single", jobs), jobs)

corpus = os.path.abspath(os.environ["CORPUS"])
with open(f"{corpus}/MANIFEST.tsv") as manifest:
    rows = [row for row in csv.DictReader(manifest, delimiter="\t") if row["path"].startswith("models/")]
rows = [row for row in rows if int(row["bytes_total"]) <= 10_000_000 and row["path"].endswith((".glb", ".gltf"))]
files = min(files, len(rows))
chosen = [rows[index * len(rows) // files] for index in range(files)]
large = sum(int(row["bytes_total"]) > 1_000_000 for row in chosen)
print(f"{files} of {len(rows)} files, {large} of them above 1 MB; {jobs} jobs")
paths = [f"{corpus}/{chosen[index % files]['path']}" for index in range(jobs)]


def memory(process):
    with open(f"/proc/{process.pid}/status") as status:
        kib = {line.split()[0]: int(line.split()[1]) for line in status if line.startswith(("VmRSS", "VmHWM"))}
    return kib["VmRSS:"] / 1024, kib["VmHWM:"] / 1024


with tempfile.TemporaryDirectory() as folder:
    start = time.monotonic()
    batch = subprocess.Popen([os.environ["GLIMT"], "batch", *flags], cwd=folder, text=True,
                             stdin=subprocess.PIPE, stdout=subprocess.PIPE)
    resident, done, parts = [], [], {"load": 0, "bvh": 0, "upload": 0, "render": 0, "save": 0, "total": 0}
    failed = {}
    for number, path in enumerate(paths):
        job = {"id": number, "scene": path, "output": f"{number}.png", "size": "256x256"}
        batch.stdin.write(json.dumps(job) + "\n")
        batch.stdin.flush()
        answer = json.loads(batch.stdout.readline())
        assert answer["id"] == number, answer
        resident.append(memory(batch))
        done.append(answer["ok"])
        if answer["ok"]:
            for part in parts:
                parts[part] += answer["report"]["times_ms"][part]
        else:
            failed[os.path.basename(path)] = answer["error"]
    batch.stdin.close()
    code = batch.wait()
    seconds = time.monotonic() - start
    print(f"batch: {jobs / seconds:.2f} jobs/s, {sum(done)} of {jobs} made, exit code {code}")
    print("       seconds: " + ", ".join(f"{part} {ms / 1e3:.1f}" for part, ms in parts.items()))
    for name, error in sorted(failed.items()):
        print(f"       not made: {name}: {error[:150]}")
    quarter = max(jobs // 4, 1)
    for first in range(0, jobs, quarter):
        some = resident[first:first + quarter]
        print(f"       jobs {first:3} to {first + len(some) - 1:3}: resident mean {mean(now for now, _ in some):7.1f} MiB, "
              f"last {some[-1][0]:7.1f}, highest so far {some[-1][1]:7.1f}")
    second, last = (mean(now for now, _ in resident[k * quarter:(k + 1) * quarter]) for k in (1, 3))
    print(f"       the last {quarter} against the second {quarter}: {100 * (last / second - 1):+.1f} %")
    if single:
        start = time.monotonic()
        alike = 0
        for number, path in enumerate(paths[:single]):
            one = subprocess.run([os.environ["GLIMT"], "render", path, "-o", "one.png", "--size", "256x256", "--json"],
                                 cwd=folder, capture_output=True)
            same = one.returncode == 0 and open(f"{folder}/one.png", "rb").read() == open(f"{folder}/{number}.png", "rb").read()
            alike += same or (one.returncode != 0 and not done[number])
        took = time.monotonic() - start
        print(f"single: {single / took:.2f} jobs/s; {alike} of {single} the same as in the batch")
        print(f"        the batch is {took / single / (seconds / jobs):.2f} times as fast")
PYTHON
