#!/usr/bin/env bash
# Makes `rapier3d-fields-f64` a package by itself. In this folder it is none, since its sources are those of the package
# above. Copies them and the manifest into another folder, and packages there.
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
# A workspace of its own, with the same [workspace.package]; paths within the folder instead of those above it.
{
    printf '[workspace]\n\n'
    sed -n '/^\[workspace.package\]/,/^$/p' "$root/Cargo.toml"
    sed -e '/^#/d' -e 's|"\.\./|"|g' "$here/Cargo.toml"
} > "$folder/Cargo.toml"
if grep -n '\.\./' "$folder/Cargo.toml"; then
    echo "f64/Cargo.toml: these paths lead out of the package" >&2
    exit 1
fi
cd "$folder"
# The folder was made by this script, so it is not under version control.
cargo package --allow-dirty "$@"
