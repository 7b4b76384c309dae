#!/bin/sh
# Installs the wheel of dist/ where nothing else is, for each Python, and runs the main job without a network:
# it prints the table of README.md.    tools/try_release.sh python3.11 [python3.12 ...]
set -eu
root=$(cd "$(dirname "$0")/.." && pwd)
offline=
unshare -rn true 2>/dev/null && offline="unshare -rn"
table() { awk '/^puppets-/ { on = 1 } /^- Not shown/ { on = 0 } on'; }

for python in "$@"; do
	place=$(mktemp -d)
	"$python" -m venv "$place/venv"
	# shellcheck disable=SC2086
	"$place/venv/bin/pip" install --quiet --disable-pip-version-check ${PIP_OPTIONS:-} -c "$root/constraints.txt" \
		"$root"/dist/*.whl
	cd "$place"
	begun=$(date +%s)
	export RETARGET_BENCH_CACHE="$place/cache"
	$offline venv/bin/bench run >table.txt 2>log.txt || { cat log.txt; exit 1; }
	echo "$("$python" --version): the main job took $(($(date +%s) - begun)) s${offline:+ without a network}"
	table <table.txt >now
	table <"$root/README.md" | diff - now || { echo "the table is not README's"; exit 1; }
	$offline venv/bin/bench check --methods ik
	cd "$root"
	rm -rf "$place"
done
