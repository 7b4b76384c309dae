#!/usr/bin/env bash
# Measures and trains methods on a machine with a GPU and without a network, inside a bundle (docs/training.md).
#
#     OUT=DIR tools/gpu_run.sh [METHOD...]       all whose weights travelled, unless some are named
#
# OUT     gets run.txt (all that is printed), steps.txt (how fast steps are) and METHOD.tar (weights with their
#         card, and the log), each as soon as there is something. Default: out.
# LIMIT   seconds for everything; methods share what is left of it. Default: 570.
# BUDGET  how long each method is trained instead, as 20s.
# DATA    what all methods are trained on. Default: what tools.train_release trains each on.
# JOBS    processes that make data and draw batches. Default: one a core, fewer where /dev/shm is small.
set -uf -o pipefail

mkdir -p "${OUT:=out}" && OUT=$(realpath "$OUT")
cd "$(dirname "$0")/.." || exit 1
[ $# -gt 0 ] || set -- $(cat METHODS)
python=${PYTHON:-python3}
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
export PYTHONPATH=$PWD${PYTHONPATH:+:$PYTHONPATH} PYTHONUNBUFFERED=1
export RETARGET_BENCH_CACHE=$scratch/cache

left() { echo $((${LIMIT:-570} - SECONDS)); }
say() { echo "--- $SECONDS s: $*"; }

# Carries out a command for so many seconds at most, and not beyond LIMIT. What fails is told, and others go on.
within() {
    local seconds=$(($1 < $(left) ? $1 : $(left)))
    shift
    say "$*"
    if [ $seconds -le 0 ]; then say "no time is left for it"; return; fi
    timeout --signal INT --kill-after 10 $seconds "$@" || say "it ended with status $?"
}

# What training has left in a folder, as one file that is replaced as a whole.
keep() {
    local files
    files=$(cd "$scratch" && ls "$1"/weights.safetensors "$1"/weights.json "$1"/log.csv 2>/dev/null)
    if [ -n "$files" ]; then tar cf "$OUT/.$1" -C "$scratch" $files && mv "$OUT/.$1" "$OUT/$1.tar"; fi
}

# Prints the device, if Python has all that it needs.
look() {
    "$python" -c '
import click, filelock, matplotlib, numpy, pandas, platformdirs, psutil, pydantic, safetensors, scipy, torch, tqdm
print("cuda" if torch.cuda.is_available() else "cpu")'
}

main() {
    if ! device=$(look 2>/dev/null); then
        find wheels -name '*.whl' \
            -exec "$python" -m pip install -q --no-index --no-deps --target "$scratch/site" {} +
        PYTHONPATH=$scratch/site:$PYTHONPATH
        device=$(look) || exit 1
    fi
    find earlier -name '*.tar' -exec tar xf {} -C earlier \;
    if [ -e cmu.tar.xz ]; then
        "$python" -m tarfile -e cmu.tar.xz "$scratch/cmu" && export RETARGET_BENCH_CMU=$scratch/cmu
    fi

    local memory cores jobs preset=quick rows='2 4'
    memory=$(df -m --output=avail /dev/shm | tail -1)
    cores=$(env -u OMP_NUM_THREADS nproc)
    jobs=$cores
    if [ "$memory" -lt 4096 ]; then jobs=$((jobs < 6 ? jobs : 6)); fi
    if [ "$memory" -lt 512 ]; then jobs=1; fi
    jobs=${JOBS:-$jobs}
    if [ "$device" = cuda ]; then preset=gpu rows='128 512'; fi
    nvidia-smi --query-gpu=name,memory.total,driver_version --format=csv,noheader
    say "$device, preset $preset, $jobs processes on $cores cores, $memory MB in /dev/shm"
    plan=$("$python" -m tools.gpu_plan "$@") || exit 1

    if [ -z "$(find earlier -name '*.tar')" ]; then # else it was measured before
        within 60 "$python" -m retarget_bench train -d puppets --prepare --jobs "$jobs"
        within 60 "$python" benchmarks/training_steps.py humot paired pan nkn \
            --device "$device" --preset "$preset" --rows $rows | tee "$OUT/steps.txt"
    fi

    for data in $(grep -o -- '-d [^ ]*' <<<"$plan" | cut -c4- | sort -u); do
        within 180 "$python" -m retarget_bench train -d "$data" --prepare --jobs "$jobs"
    done

    local waiting budget keeper
    waiting=$(wc -l <<<"$plan")
    while read -r name method options <&3; do
        budget=$(($(left) / waiting - 60))
        budget=${BUDGET:-$((budget > 20 ? budget : 20))s}
        while sleep 10; do keep "$name"; done >/dev/null 2>&1 &
        keeper=$!
        within $((${budget%s} + 180)) "$python" -m retarget_bench train "$method" $options \
            --preset "$preset" --budget "$budget" --device "$device" --jobs "$jobs" --out "$scratch/$name"
        kill $keeper
        keep "$name"
        waiting=$((waiting - 1))
    done 3<<<"$plan"
    say "done"
    ls -l "$OUT"
}

main "$@" 2>&1 | tee "$OUT/run.txt"
