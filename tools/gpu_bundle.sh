#!/usr/bin/env bash
# Gathers what travels to a machine with a GPU and without a network (docs/training.md).
#
#     make gpu-bundle METHODS="pan humot" [CMU=DIR] [EARLIER=DIR]
#     tools/gpu_bundle.sh FOLDER METHOD...
#
# The folder gets the code at HEAD, the shipped weights that the methods begin with, the folder WHEELS as
# wheels/, CMU's files (CMU=DIR or RETARGET_BENCH_CMU) as cmu.tar.xz, and of an earlier run (EARLIER=DIR, its
# folder OUT) METHOD.tar, which takes the place of shipped weights.
set -euo pipefail

refuse() { echo "gpu_bundle: $*" >&2 && exit 2; }
[ $# -gt 1 ] || refuse "say a folder and at least one method: tools/gpu_bundle.sh build/gpu pan"
folder=$(realpath -m "$1") && shift
cd "$(dirname "$0")/.."
limit=40000000
cmu=${CMU:-${RETARGET_BENCH_CMU:-}}

for method; do [ -d "methods/${method%%[*}" ] || refuse "there is no method $method"; done
[ -z "$cmu" ] || [ -d "$cmu" ] || refuse "CMU=$cmu is no folder"
if [ -e "$folder" ] && [ ! -e "$folder/METHODS" ]; then refuse "$folder exists and is no bundle; give another folder"; fi
rm -rf "$folder" && mkdir -p "$folder/earlier"
weights=()
for method; do
    if [ -e "${EARLIER:-}/$method.tar" ]; then
        cp "$EARLIER/$method.tar" "$folder/earlier"
    else
        name=puppets
        if [ "$method" != "${method%%[*}" ]; then name='puppets_*'; fi # those of other parameters
        weights+=(":(glob)methods/${method%%[*}/weights/$name.*")
    fi
done
echo "$@" >"$folder/METHODS"
code=(retarget_bench methods metrics datasets tools benchmarks pyproject.toml constraints.txt LICENSE)
# training validates on another part of the embedded motions than results are of
unneeded=(":(exclude,glob)**/*.safetensors" ":(exclude,glob)methods/*/weights/*" ":(exclude)datasets/puppets/tiny/test.npz")
git archive HEAD "${code[@]}" "${unneeded[@]}" |
    tar x -C "$folder"
if [ ${#weights[@]} -gt 0 ]; then git archive HEAD "${weights[@]}" | tar x -C "$folder"; fi
if [ -n "${WHEELS:-}" ]; then cp -r "$WHEELS" "$folder/wheels"; fi
if [ -n "$cmu" ]; then (cd "$cmu" && find . -name '*.bvh' -print0 | tar c --null -T - | xz -9) >"$folder/cmu.tar.xz"; fi

size=$(du -sb --apparent-size "$folder" | cut -f1)
echo "$folder: $((size / 1000000)) MB; on the machine, in that folder:"
echo "    OUT=DIR tools/gpu_run.sh"
if [ "$size" -gt $limit ]; then
    echo "It is larger than $((limit / 1000000)) MB: name fewer METHODS, or leave CMU out." >&2
    exit 1
fi
