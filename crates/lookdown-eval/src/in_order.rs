//! Processes several images concurrently, with results in the order of the images. Not by rayon: a
//! thread of its pool that waits for the engine's pool would begin a further image meanwhile.

use std::{
    num::NonZeroUsize,
    panic::resume_unwind,
    sync::atomic::{AtomicBool, AtomicUsize, Ordering},
    thread,
};

/// Runs `work` for each item, on at most `at_once` threads. The results equal those of one thread,
/// regardless of the order in which items finish: the error is that of the first item with an
/// error, and no item is started after an error.
pub(super) fn in_order<T: Sync, R: Send, E: Send>(
    items: &[T],
    at_once: NonZeroUsize,
    work: impl Fn(&T) -> Result<R, E> + Sync,
) -> Result<Vec<R>, E> {
    let next = AtomicUsize::new(0);
    let failed = AtomicBool::new(false);
    let take_turns = || {
        let mut results = Vec::new();
        while !failed.load(Ordering::Relaxed) {
            // Items are started in their order, so everything before a failed one is finished.
            let index = next.fetch_add(1, Ordering::Relaxed);
            let Some(item) = items.get(index) else { break };
            let result = work(item);
            failed.fetch_or(result.is_err(), Ordering::Relaxed);
            results.push((index, result));
        }
        results
    };
    let mut results = thread::scope(|scope| {
        let helpers: Vec<_> = (1..at_once.get().min(items.len()))
            .map(|number| {
                let thread = thread::Builder::new().name(format!("evaluation-{number}"));
                thread.spawn_scoped(scope, take_turns)
            })
            .collect();
        let mut results = take_turns();
        // If the operating system refuses a helper thread, the other threads do its work.
        for helper in helpers.into_iter().flatten() {
            results.extend(helper.join().unwrap_or_else(|panic| resume_unwind(panic)));
        }
        results
    });
    results.sort_unstable_by_key(|(index, _)| *index);
    results.into_iter().map(|(_, result)| result).collect()
}

#[cfg(test)]
mod tests {
    use std::sync::Barrier;

    use super::*;

    const TWO: NonZeroUsize = NonZeroUsize::new(2).unwrap();

    #[test]
    fn two_items_run_concurrently_and_results_keep_their_order() {
        let both_begun = Barrier::new(2);
        let result: Result<Vec<u32>, ()> = in_order(&[1, 2, 3, 4], TWO, |item| {
            both_begun.wait();
            Ok(item * 10)
        });
        assert_eq!(result, Ok(vec![10, 20, 30, 40]));
    }

    #[test]
    fn the_error_is_that_of_the_first_failed_item() {
        let both_begun = Barrier::new(2);
        let result: Result<Vec<()>, u32> = in_order(&[1, 2], TWO, |item| {
            both_begun.wait();
            Err(*item)
        });
        assert_eq!(result, Err(1));
    }

    #[test]
    fn no_item_is_started_after_an_error() {
        let begun = AtomicUsize::new(0);
        let result: Result<Vec<()>, &str> = in_order(&[0; 100], NonZeroUsize::MIN, |_| {
            begun.fetch_add(1, Ordering::Relaxed);
            Err("broken")
        });
        assert_eq!((result, begun.into_inner()), (Err("broken"), 1));
    }
}
