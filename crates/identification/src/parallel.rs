//! Independent pieces of work, for the threads of the caller.

use std::sync::OnceLock;

/// Runs independent pieces of work.
///
/// This package starts no threads. A caller that has processors to spare implements this trait; the
/// results do not depend on it.
pub trait Parallel: Sync {
    /// Calls `work` once with each of 0 to `count` − 1, in any order and from any threads. Returns
    /// when all calls have returned.
    fn run(&self, count: usize, work: &(dyn Fn(usize) + Sync));
}

/// Runs one piece after the other, on the thread of the caller.
#[derive(Clone, Copy, Debug)]
pub struct Serial;

impl Parallel for Serial {
    fn run(&self, count: usize, work: &(dyn Fn(usize) + Sync)) {
        (0..count).for_each(work);
    }
}

/// Returns the results of `work` for 0 to `count` − 1, in order. A piece that was not run is left
/// out.
pub fn map<T: Send + Sync>(
    parallel: &dyn Parallel,
    count: usize,
    work: impl Fn(usize) -> T + Sync,
) -> Vec<T> {
    let results: Vec<OnceLock<T>> = (0..count).map(|_| OnceLock::new()).collect();
    parallel.run(count, &|index| {
        if let Some(result) = results.get(index) {
            result.get_or_init(|| work(index));
        }
    });
    results.into_iter().filter_map(OnceLock::into_inner).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Backwards;

    impl Parallel for Backwards {
        fn run(&self, count: usize, work: &(dyn Fn(usize) + Sync)) {
            (0..count).rev().for_each(work);
        }
    }

    #[test]
    fn results_are_in_order_whatever_ran_first() {
        let squares: Vec<usize> = (0..10).map(|index| index * index).collect();
        assert_eq!(map(&Serial, 10, |index| index * index), squares);
        assert_eq!(map(&Backwards, 10, |index| index * index), squares);
        assert!(map(&Serial, 0, |index| index).is_empty());
    }
}
