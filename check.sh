#!/usr/bin/env bash
# All that CI runs. The name of each step says what it checks.
set -euo pipefail
cd "$(dirname "$0")"

# The same random cases each time, so that a new failure comes from a change of the code.
export PROPTEST_RNG_SEED=20250
export CARGO_TARGET_DIR="${CARGO_TARGET_DIR:-$PWD/target}"
# Builds of this script are not debugged.
export CARGO_PROFILE_DEV_DEBUG=0 CARGO_INCREMENTAL=0

step() { printf '\n== %s (%d s)\n' "$1" "$SECONDS"; }

# Some steps need more than a Rust toolchain. They end with code 77 where that is not installed, and are then reported
# as skipped; but if CHECK_HAS (a list of names) contains their name, they fail.
skipped=()
optional() { # NAME, COMMAND
    local code=0
    "${@:2}" || code=$?
    if [[ $code == 77 && " ${CHECK_HAS-} " != *" $1 "* ]]; then
        skipped+=("$1")
        echo "SKIPPED: $1"
    elif [[ $code != 0 ]]; then
        echo "failed: $1"
        exit 1
    fi
}

step "formatting"
cargo fmt --all --check

step "lints, on every target"
cargo clippy --workspace --all-targets -- -D warnings

step "each combination of features that Rapier allows"
# Without a precision the build must fail, and the first error must say why.
missing=$(cargo check --quiet --package rapier3d-fields --lib --no-default-features 2>&1 || true)
grep -q 'the precision is missing' <<< "$missing"
features() { # PACKAGE, FEATURES
    echo "$1: $2"
    cargo clippy --quiet --package "$1" --lib --no-default-features --features "$2" -- -D warnings
}
# Rapier's own features, which are only passed through, appear once each, beside those that they go with. The lints
# above cover `schemars`.
for each in "" expression,tracing serde-serialize \
    parallel,enhanced-determinism,debug-render,serde-serialize,expression \
    simd8,parallel,debug-render,serde-serialize,expression; do
    features rapier3d-fields "f32,$each"
done
# The other precision has the same sources.
features rapier3d-fields-f64 f64,parallel,enhanced-determinism,debug-render,serde-serialize,expression

step "documentation without broken links, private items included"
RUSTDOCFLAGS="-D warnings" cargo doc --workspace --no-deps --document-private-items

step "the oldest Rust that Cargo.toml names"
oldest() {
    local version
    version=$(sed -n 's/^rust-version = "\(.*\)"$/\1/p' Cargo.toml)
    command -v rustup > /dev/null || return 77
    rustup toolchain install "$version" --profile minimal --no-self-update > /dev/null 2>&1 || return 77
    # In a folder of its own: artifacts of one compiler are of no use to another.
    CARGO_TARGET_DIR=$CARGO_TARGET_DIR/oldest cargo "+$version" check --quiet \
        --package rapier3d-fields --package rapier3d-fields-scene
}
optional oldest oldest

step "licences and origin of all dependencies"
licences() {
    command -v cargo-deny > /dev/null || return 77
    cargo deny --all-features check licenses sources bans
}
optional licences licences

step "public names that a release had, and this one lacks"
# Tests compare them with `tests/public-api.txt`; this compares types with those of the last release.
semver() {
    command -v cargo-semver-checks > /dev/null || return 77
    local released
    if released=$(git describe --tags --abbrev=0 2> /dev/null); then
        cargo semver-checks --package rapier3d-fields --baseline-rev "$released"
    else
        echo "nothing is released yet"
    fi
}
optional semver semver

step "tests of both precisions, and every program in the documentation"
cargo test --release --workspace

step "packages, from a clean checkout, each alone as users get it"
clean=$(mktemp -d)
trap 'rm -rf "$clean"' EXIT
now=$(git stash create)
git archive "${now:-HEAD}" | tar -x -C "$clean"
(
    cd "$clean"
    # By itself, then in place of the folder f64/, which is no package by itself, so that dependents find it.
    f64/package.sh "$clean/alone" -- --quiet --no-verify
    rm -r f64
    mv alone f64
    sed -i '/^\[workspace/,/^$/d' f64/Cargo.toml
    packages=(rapier3d-fields rapier3d-fields-f64 rapier3d-fields-scene)
    cargo package --quiet --allow-dirty --no-verify --target-dir packed "${packages[@]/#/--package=}"
    # Unpacked, and used in place of those in the registry.
    cd packed/package
    {
        printf '[workspace]\nmembers = ["rapier3d-fields*"]\nresolver = "3"\n[patch.crates-io]\n'
        for each in "${packages[@]}"; do
            tar -xzf "$each"-[0-9]*.crate
            printf '%s.path = "%s"\n' "$each" "$each"-[0-9]*/
        done
    } > Cargo.toml
    cp "$OLDPWD/Cargo.lock" .
    cargo check --quiet --workspace --offline
)

step "the plugin for Bevy"
# Bevy declares a newer Rust version than it needs.
(cd bevy && cargo fmt --check && cargo test --quiet --ignore-rust-version)

step "the example ammonia, briefly"
cargo run --release --example ammonia -- --steps 500

step "a study in parts, of which one is made again"
cargo build --release --quiet --example error_vs_runtime
optional parallel tests/shards.sh "$CARGO_TARGET_DIR/release/examples/error_vs_runtime"
optional slurm tests/slurm.sh "$CARGO_TARGET_DIR/release/examples/error_vs_runtime"

step "the page of a study, in a browser"
"$CARGO_TARGET_DIR/release/examples/error_vs_runtime" --quick --scene spring --precision f32 \
    --out "$clean/study" > "$clean/study.txt"
optional browser tests/page.sh "$clean/study/report.html"

step "pages that replay scene files, in a browser"
simulate() { cargo run --release --quiet --example simulate -- "$@"; }
simulate examples/scenes/planet.json --html "$clean/planet.html"
optional browser tests/page.sh "$clean/planet.html" replays inked turned zoomed scrubbed arrows
simulate examples/scenes/spheres.json --precision f64 --html "$clean/spheres.html"
optional browser tests/page.sh "$clean/spheres.html" replays inked turned zoomed scrubbed

step "a scene file, and the columns of its tables"
tables=$clean/tables
mkdir "$tables"
simulate examples/scenes/spheres.json --steps 200 --every 100 \
    --trajectory "$tables/trajectory.csv" --wrenches "$tables/wrenches.csv" \
    --contacts "$tables/contacts.csv"
# Columns may be added at the end.
columns() { # TABLE, FIRST COLUMNS
    local found
    found=$(head -n 1 "$tables/$1.csv")
    if [[ "$found," != "$2,"* ]]; then
        echo "$1.csv begins with the columns $found, not with $2"
        exit 1
    fi
}
columns trajectory step,time,body,x,y,z,qw,qx,qy,qz,vx,vy,vz,wx,wy,wz
columns wrenches step,time,body,fx,fy,fz,tx,ty,tz
columns contacts step,time,body1,part1,body2,part2,nx,ny,nz,px,py,pz,depth,source,approach_speed,jx1,jy1,jz1,jx2,jy2,jz2,answered_by
grep -Eq '^([^,]*,){13}field(,|$)' "$tables/contacts.csv"
if simulate nowhere.json; then
    echo "a scene that is not there was simulated"
    exit 1
fi
step "all is well${skipped[*]:+, but not looked at: ${skipped[*]}}"
