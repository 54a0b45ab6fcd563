//! Work in chunks: with the feature `parallel` on the threads of Rapier's pool, else one after the other.
//!
//! The division into chunks depends on the amount of work only, so every number of threads gives the same bits.

#[cfg(feature = "parallel")]
use std::sync::Arc;

use crate::rapier::pipeline::PhysicsWorld;

/// True if work may be spread over threads.
pub(crate) const ARE_MANY: bool = cfg!(feature = "parallel");

/// Calls `work` for each chunk of `size` consecutive items, with the index of the chunk's first item.
pub(crate) fn each_chunk<T: Send>(
    items: &mut [T],
    size: usize,
    work: impl Fn(usize, &mut [T]) + Send + Sync,
) {
    #[cfg(feature = "parallel")]
    if items.len() > size {
        use rayon::prelude::*;
        let chunks = items.par_chunks_mut(size).enumerate();
        return chunks.for_each(|(number, items)| work(number * size, items));
    }
    for (number, items) in items.chunks_mut(size).enumerate() {
        work(number * size, items);
    }
}

/// The thread pool of a world, if it has one.
pub(crate) struct Pool(#[cfg(feature = "parallel")] Option<Arc<rayon::ThreadPool>>);

impl Pool {
    /// The pool that was configured for a world, if there is one.
    #[cfg(feature = "parallel")]
    pub(crate) fn of(world: &PhysicsWorld) -> Self {
        /// Used under Rapier's `unsync-callbacks`, which another crate may turn on: worlds then have no such method.
        #[allow(dead_code)]
        trait WithoutPool {
            fn thread_pool(&self) -> Option<Arc<rayon::ThreadPool>> {
                None
            }
        }
        impl WithoutPool for PhysicsWorld {}
        Pool(world.thread_pool())
    }

    #[cfg(not(feature = "parallel"))]
    pub(crate) fn of(_world: &PhysicsWorld) -> Self {
        Pool()
    }

    /// Runs `work` on the pool's threads; without a pool, on the caller's.
    pub(crate) fn run<T: Send>(&self, work: impl FnOnce() -> T + Send) -> T {
        #[cfg(feature = "parallel")]
        if let Some(pool) = &self.0 {
            return pool.install(work);
        }
        work()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_item_is_worked_on_once() {
        for count in [0, 1, 9, 10, 11, 1000] {
            let mut items = vec![usize::MAX; count];
            each_chunk(&mut items, 10, |first, items| {
                assert!(items.len() <= 10 && first % 10 == 0);
                let places = items.iter_mut().enumerate();
                places.for_each(|(place, item)| *item = item.wrapping_add(1 + first + place));
            });
            assert!(items.into_iter().eq(0..count));
        }
    }
}
