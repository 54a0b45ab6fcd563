//! Functions that are compiled for the widest registers of the machine.

use fearless_simd::{Level, Simd};

#[cfg(test)]
thread_local! {
    /// The instruction set that a test uses in place of the best one.
    pub(crate) static FORCED: std::cell::Cell<Option<Level>> = const { std::cell::Cell::new(None) };
}

/// Calls `function`, compiled for the widest registers of the machine. If it is not inlined, it is compiled for the
/// narrowest ones.
///
/// The large parts of such functions are inlined unless there are debug assertions: without optimisations each inlined
/// call has its own place on the stack, which together exceed the stack of a thread.
#[inline(always)]
pub(crate) fn in_registers<R>(function: impl FnOnce() -> R) -> R {
    match level() {
        #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
        Level::Avx512(simd) => simd.vectorize(function),
        #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
        Level::Avx2(simd) => simd.vectorize(function),
        // The baseline instruction set of the target. The registers of SSE4.2 are no wider than those of SSE2.
        _ => in_any(function),
    }
}

/// Calls `function`. Not inlined in builds for debugging, so that only one copy of `function` takes stack.
#[cfg_attr(not(debug_assertions), inline(always))]
fn in_any<R>(function: impl FnOnce() -> R) -> R {
    function()
}

/// The best instruction set of the machine.
pub(crate) fn level() -> Level {
    #[cfg(test)]
    if let Some(level) = FORCED.get() {
        return level;
    }
    Level::new()
}
