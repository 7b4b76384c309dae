#!/bin/sh
# Installs dist/ where nothing else is, for each Python: the wheel runs the main job without a network and prints
# the table of README.md; the source archive passes the gate.    tools/try_release.sh python3.11 [python3.12 ...]
set -eu
root=$(cd "$(dirname "$0")/.." && pwd)
place=
trap 'rm -rf "$place"' EXIT
offline="env http_proxy=http://127.0.0.1:9 https_proxy=http://127.0.0.1:9" # where namespaces are not allowed
unshare -rn true 2>/dev/null && offline="unshare -rn"
table() { awk '/^puppets-/ { on = 1 } /^- Not shown/ { on = 0 } on'; }

for python in "$@"; do
	place=$(mktemp -d)
	"$python" -m venv "$place/venv"
	pip="$place/venv/bin/pip --quiet --disable-pip-version-check install ${PIP_OPTIONS:-} -c $root/constraints.txt"
	$pip "$root"/dist/*.whl
	cd "$place"
	begun=$(date +%s)
	export RETARGET_BENCH_CACHE="$place/cache"
	$offline venv/bin/bench run >table.txt 2>log.txt || { cat log.txt; exit 1; }
	echo "$("$python" --version): the main job took $(($(date +%s) - begun)) s, by: $offline"
	table <table.txt >now
	table <"$root/README.md" >expected
	test -s expected && diff now expected || { echo "the table is not README's"; exit 1; }
	$pip --force-reinstall --no-deps "$root"/dist/*.tar.gz
	$offline venv/bin/bench check --methods ik
	cd "$root"
	rm -rf "$place"
done
