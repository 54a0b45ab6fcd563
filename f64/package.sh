#!/usr/bin/env bash
# Makes `rapier3d-fields-f64` a package by itself, which it is not here: its sources are those of
# the package above. Copies them beside its manifest into a folder, and packages there.
#
# Usage: f64/package.sh [FOLDER] [-- OPTIONS OF cargo package]
# To publish: cargo publish --manifest-path FOLDER/Cargo.toml
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
root=$(dirname "$here")
folder=$root/target/package-f64
if [ $# -gt 0 ] && [ "$1" != -- ]; then
    folder=$1
    shift
fi
[ "${1-}" != -- ] || shift

rm -rf "$folder"
mkdir -p "$folder"
cp -R "$root"/{src,docs,README.md,ARCHITECTURE.md,CHANGELOG.md,LICENSE-APACHE,LICENSE-MIT,Cargo.lock} "$folder"
# A workspace of its own, with the same fields for its package; its own paths instead of those above it;
# without the tests, and what they need.
{
    printf '[workspace]\n\n'
    sed -n '/^\[workspace.package\]/,/^$/p' "$root/Cargo.toml"
    awk '
        /^\[/ { skip = ($0 == "[[test]]" || $0 == "[dev-dependencies]") }
        skip || /^#/ { next }
        { gsub(/"\.\.\//, "\"") }
        { print }
    ' "$here/Cargo.toml"
} > "$folder/Cargo.toml"
if grep -n '\.\./' "$folder/Cargo.toml"; then
    echo "f64/Cargo.toml: these paths lead out of the package" >&2
    exit 1
fi
cd "$folder"
# Prepared here, so nothing in it is under version control.
cargo package --allow-dirty "$@"
