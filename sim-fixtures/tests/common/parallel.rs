//! Many experiments on every processor.

use std::sync::atomic::{AtomicUsize, Ordering};

/// `work` of 0 to `count` − 1 on every processor; the results are in order, whichever thread was
/// the faster.
pub(crate) fn in_parallel<T: Send>(count: usize, work: impl Fn(usize) -> T + Sync) -> Vec<T> {
    let threads = std::thread::available_parallelism().unwrap().get();
    let next = AtomicUsize::new(0);
    let mut results: Vec<(usize, T)> = std::thread::scope(|scope| {
        let workers: Vec<_> = (0..threads)
            .map(|_| {
                scope.spawn(|| {
                    let mut done = Vec::new();
                    loop {
                        let index = next.fetch_add(1, Ordering::Relaxed);
                        if index >= count {
                            return done;
                        }
                        done.push((index, work(index)));
                    }
                })
            })
            .collect();
        workers.into_iter().flat_map(|worker| worker.join().unwrap()).collect()
    });
    results.sort_by_key(|(index, _)| *index);
    results.into_iter().map(|(_, result)| result).collect()
}

#[test]
fn results_are_in_order_whichever_program_is_first() {
    assert_eq!(
        in_parallel(200, |index: usize| {
            // The first ones take longest.
            std::thread::sleep(std::time::Duration::from_micros(
                200_u64.saturating_sub(index as u64),
            ));
            index
        }),
        (0..200).collect::<Vec<_>>()
    );
}
