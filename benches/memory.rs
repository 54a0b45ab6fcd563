//! The memory for a molecule of ammonia: Rapier's world, the tree, and all that fields keep beside it once they step.
//!
//! `cargo bench --bench memory`

use std::alloc::System;

use rapier3d_fields::prelude::*;
use rapier3d_fields_lab::single::scenes::ammonia::{AmmoniaSettings, interaction};
use stats_alloc::{INSTRUMENTED_SYSTEM, StatsAlloc};

#[global_allocator]
static ALLOCATOR: &StatsAlloc<System> = &INSTRUMENTED_SYSTEM;

const CUTOFF: Real = 10.0;

/// Bytes in use.
fn used() -> usize {
    let all = ALLOCATOR.stats();
    all.bytes_allocated - all.bytes_deallocated
}

/// The bytes per molecule that are in use after `work`, and its result.
fn kept<T>(count: usize, work: impl FnOnce() -> T) -> (usize, T) {
    let before = used();
    let made = work();
    (used().saturating_sub(before) / count, made)
}

fn print(name: &str, count: usize, spacing: Real) {
    let settings = AmmoniaSettings {
        count,
        spacing,
        ..AmmoniaSettings::default()
    };
    let (world, mut scene) = kept(count, || {
        let mut scene = settings.build().expect("the settings are in range");
        (0..5).for_each(|_| scene.world.step());
        scene
    });
    let sites: Vec<_> = scene.molecules.iter().map(|it| it.sites).collect();
    let (tree, built) = kept(count, || interaction(sites, Some(CUTOFF)));
    let (beside, _fields) = kept(count, || {
        let fields = scene.fields(Fields::builder(built));
        let mut fields = fields.expect("the tree fits the scene");
        for _ in 0..20 {
            fields.step(&mut scene.world).expect("finite fields");
        }
        fields
    });
    println!("| {name} | {world} | {tree} | {beside} |");
}

fn main() {
    println!("`cargo bench --bench memory`: bytes a molecule.\n");
    println!("| scene | Rapier's world | the tree | what fields keep beside it |");
    println!("|---|---|---|---|");
    print("liquid, 1,000 molecules", 1_000, 3.6);
    print("liquid, 10,000 molecules", 10_000, 3.6);
    print("gas, 1,000 molecules", 1_000, 20.0);
    print("gas, 10,000 molecules", 10_000, 20.0);
}
