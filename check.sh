#!/usr/bin/env bash
# What CI runs. Each step says which failure it is there for.
set -euo pipefail
cd "$(dirname "$0")"

step() { printf '\n== %s\n' "$1"; }

step "formatting"
cargo fmt --all --check

step "the library alone, as users build it, in both precisions"
cargo build --release --workspace --lib

step "lints, on every target"
cargo clippy --release --workspace --all-targets -- -D warnings

step "tests of both precisions, and every program in the documentation"
cargo test --release --workspace

step "documentation without broken links, private items included"
RUSTDOCFLAGS="-D warnings" cargo doc --workspace --no-deps --document-private-items

step "the main job, briefly"
cargo run --release --example ammonia -- --steps 500
