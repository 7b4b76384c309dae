#!/bin/sh
# Builds a release of what is committed: dist/*.whl and dist/*.tar.gz, and dist/weights for the release's page.
# README's links are made absolute in it, as package indexes need them. PYTHON: with the extra "release".
set -eu
PYTHON=${PYTHON:-python}
root=$(cd "$(dirname "$0")/.." && pwd)
place=$(mktemp -d)
trap 'rm -rf "$place"' EXIT
address=$(sed -n 's/^Repository = "\(.*\)"$/\1/p' "$root/pyproject.toml")

git -C "$root" archive HEAD | tar -x -C "$place"
sed -i.old -E "s#(\]\()(docs/pictures/)#\1$address/raw/main/\2#; s#(\]\()(docs|results|[A-Z])#\1$address/blob/main/\2#g" \
	"$place/README.md"
rm -rf "$root/dist"
"$PYTHON" -m build --no-isolation --outdir "$root/dist" "$place"
"$PYTHON" -m twine check --strict "$root"/dist/*.whl "$root"/dist/*.tar.gz
cd "$place"
"$PYTHON" -m tools.release_assets "$root/dist/weights"
